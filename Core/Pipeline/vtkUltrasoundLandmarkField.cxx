// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundLandmarkField.h"

#include "Core/Base/Error.h"
#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkNew.h"
#include "vtkStringArray.h"

#include <string>

using echorama::Error;

//----------------------------------------------------------------------------
std::vector<echorama::Landmark> vtkUltrasoundLandmarkField::Of(vtkDataObject* data)
{
  std::vector<echorama::Landmark> landmarks;
  vtkFieldData* fields = data->GetFieldData();
  if (!fields->GetAbstractArray(PlacesName())) {
    return landmarks;
  }
  vtkDataArray* places = fields->GetArray(PlacesName());
  auto* labels = vtkStringArray::SafeDownCast(fields->GetAbstractArray(LabelsName()));
  if (!places || places->GetNumberOfComponents() != 3 || !labels || labels->GetNumberOfValues() != places->GetNumberOfTuples()) {
    throw Error(Error::Kind::BadInput, std::string("the field ") + PlacesName() + " has not three numbers, and a text in " +
                                           LabelsName() + ", for each landmark");
  }
  for (vtkIdType i = 0; i < places->GetNumberOfTuples(); ++i) {
    landmarks.push_back({labels->GetValue(i), Eigen::Vector3d(places->GetTuple(i))});
    if (!landmarks.back().position.allFinite()) {
      throw Error(Error::Kind::BadInput, "the landmark " + landmarks.back().label + " has a coordinate that is not finite");
    }
  }
  return landmarks;
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkField::Set(vtkDataObject* data, const std::vector<echorama::Landmark>& landmarks)
{
  vtkNew<vtkDoubleArray> places;
  places->SetName(PlacesName());
  places->SetNumberOfComponents(3);
  vtkNew<vtkStringArray> labels;
  labels->SetName(LabelsName());
  for (const echorama::Landmark& landmark : landmarks) {
    places->InsertNextTuple(landmark.position.data());
    labels->InsertNextValue(landmark.label);
  }
  data->GetFieldData()->AddArray(places);
  data->GetFieldData()->AddArray(labels);
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkField::Move(vtkDataObject* data, const echorama::Pose& pose)
{
  if (data->GetFieldData()->GetAbstractArray(PlacesName())) {
    try {
      std::vector<echorama::Landmark> landmarks = Of(data);
      for (echorama::Landmark& landmark : landmarks) {
        landmark.position = pose * landmark.position;
      }
      Set(data, landmarks);  // new arrays: others share the old ones
    } catch (const Error&) { // somebody else's, of the same name
    }
  }
}
