// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundLandmarkError.h"

#include "Core/Geometry/MatrixRows.h"
#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAligner.h"
#include "vtkUltrasoundDisplacement.h"
#include "vtkUltrasoundLandmarkField.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundLandmarkError);

//----------------------------------------------------------------------------
vtkUltrasoundLandmarkError::vtkUltrasoundLandmarkError()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundLandmarkError::~vtkUltrasoundLandmarkError() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::AddLandmarkFile(const char* file)
{
  this->Landmarks.files.emplace_back(file ? file : "");
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::ClearLandmarkFiles()
{
  this->Landmarks.files.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::AddLandmark(int volume, const char* label, double x, double y, double z)
{
  this->Landmarks.points[volume].push_back({label ? label : "", {x, y, z}});
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::ClearLandmarks()
{
  this->Landmarks.points.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundLandmarkError::SetPose(int volume, vtkMatrix4x4* volumeToWorld)
{
  const auto pose = vtkUltrasoundVolume::RigidPoseOf(volumeToWorld);
  if (!pose) {
    vtkErrorMacro("the pose of volume " << volume << " is not rigid");
    return false;
  }
  this->Poses[volume] = *pose;
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::ClearPoses()
{
  this->Poses.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
int vtkUltrasoundLandmarkError::FillInputPortInformation(int /*port*/, vtkInformation* info)
{
  vtkUltrasoundVolume::AcceptVolumes(info);
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundLandmarkError::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  vtkUltrasoundVolume::RequestWhole(inputs[1]);
  return 1;
}

//----------------------------------------------------------------------------
std::vector<echorama::LandmarkList> vtkUltrasoundLandmarkError::Lists(vtkInformationVector** inputs)
{
  vtkInformationVector* volumes = inputs[0];
  std::vector<vtkUltrasoundVolume::Input> aligned;
  if (volumes->GetNumberOfInformationObjects() > 0) {
    aligned = vtkUltrasoundVolume::CollectInputs(this, volumes);
  }
  const int count = aligned.empty() ? this->Landmarks.Count() : static_cast<int>(aligned.size());
  const auto landmarks = this->Landmarks.Lists(count);
  std::vector<echorama::LandmarkList> lists;
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    echorama::LandmarkList list{echorama::Pose::Identity(), landmarks[index], "volume " + std::to_string(i + 1)};
    if (!aligned.empty()) {
      list.name = aligned[index].Name;
      auto* rows =
          vtkDoubleArray::SafeDownCast(aligned[index].Image->GetFieldData()->GetArray(vtkUltrasoundAligner::VolumeToWorldName()));
      if (rows && rows->GetNumberOfValues() == 16) {
        list.volumeToWorld = echorama::FromRows<echorama::Pose>(rows->GetPointer(0));
      }
    } else if (index < this->Landmarks.files.size() && !this->Landmarks.files[index].empty()) {
      list.name = this->Landmarks.files[index];
    }
    if (!aligned.empty()) { // those that the volume carries lie where the alignment put it
      const echorama::Pose worldToVolume = list.volumeToWorld.inverse();
      for (const echorama::Landmark& carried : vtkUltrasoundLandmarkField::Of(aligned[index].Image)) {
        list.landmarks.push_back({carried.label, worldToVolume * carried.position});
      }
    }
    if (const auto pose = this->Poses.find(i); pose != this->Poses.end()) {
      list.volumeToWorld = pose->second;
    }
    lists.push_back(std::move(list));
  }
  std::vector<std::string> names(lists.size());
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    names[i] = lists[i].name;
  }
  const auto fields = vtkUltrasoundDisplacement::FieldsOf(inputs[1], names);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    lists[i].displacement = fields[i];
  }
  return lists;
}

//----------------------------------------------------------------------------
int vtkUltrasoundLandmarkError::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Found = {};
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    progress(0.0);
    this->Found = echorama::MeasureLandmarkError(this->Lists(inputs));
    this->PutOut(outputs->GetInformationObject(0));
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::PutOut(vtkInformation* out) const
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkDoubleArray> errors, distances;
  errors->SetName("Error");
  errors->SetNumberOfComponents(3);
  distances->SetName("Distance");
  vtkNew<vtkIntArray> first, second, lone;
  first->SetName("FirstVolume");
  second->SetName("SecondVolume");
  lone->SetName("UnmatchedVolume");
  vtkNew<vtkStringArray> labels, unmatched;
  labels->SetName("Label");
  unmatched->SetName("UnmatchedLabel");
  for (const echorama::LandmarkDistance& distance : this->Found.distances) {
    const vtkIdType id = points->InsertNextPoint(distance.place.data());
    vertices->InsertNextCell(1, &id);
    errors->InsertNextTuple(distance.error.data());
    distances->InsertNextValue(distance.error.norm());
    labels->InsertNextValue(distance.label);
    first->InsertNextValue(distance.first);
    second->InsertNextValue(distance.second);
  }
  for (const echorama::LoneLandmark& landmark : this->Found.unmatched) {
    unmatched->InsertNextValue(landmark.label);
    lone->InsertNextValue(landmark.list);
  }

  vtkPolyData* output = vtkPolyData::GetData(out);
  if (out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER()) <= 0) {
    output->SetPoints(points);
    output->SetVerts(vertices);
    for (vtkAbstractArray* array : {static_cast<vtkAbstractArray*>(distances), static_cast<vtkAbstractArray*>(labels),
                                    static_cast<vtkAbstractArray*>(first), static_cast<vtkAbstractArray*>(second)}) {
      output->GetPointData()->AddArray(array);
    }
    output->GetPointData()->SetVectors(errors);
  }
  using Of = echorama::LandmarkError;
  for (const auto& [name, number] : {std::pair("Mean", &Of::mean), std::pair("Rms", &Of::rms), std::pair("Median", &Of::median),
                                     std::pair("Percentile95", &Of::percentile95), std::pair("Max", &Of::max)}) {
    vtkUltrasoundVolume::AddField(output, name, &(this->Found.*number), 1);
  }
  output->GetFieldData()->AddArray(unmatched);
  output->GetFieldData()->AddArray(lone);
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarkError::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "LandmarkFiles: " << this->Landmarks.files.size() << "\n";
  os << indent << "Poses: " << this->Poses.size() << "\n";
  os << indent << "Pairs: " << this->GetNumberOfPairs() << "\n";
  os << indent << "Mean: " << this->GetMean() << "\n";
}
