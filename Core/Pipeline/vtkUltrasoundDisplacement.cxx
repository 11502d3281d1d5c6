// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDisplacement.h"

#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundDisplacement);

//----------------------------------------------------------------------------
echorama::DisplacementField vtkUltrasoundDisplacement::FieldOf(vtkImageData* displacement, const std::string& name)
{
  vtkDataArray* array = displacement ? displacement->GetPointData()->GetArray(DisplacementName()) : nullptr;
  if (!array || array->GetNumberOfComponents() != 3 || array->GetNumberOfTuples() != displacement->GetNumberOfPoints()) {
    throw Error(Error::Kind::BadInput,
                name + ": it is no displacement image, which has a point array Displacement of three components");
  }
  const echorama::ImageGeometry lattice = vtkUltrasoundVolume::GeometryOf(displacement);
  lattice.Check(name);
  std::vector<Eigen::Vector3d> values(lattice.VoxelCount());
  for (std::size_t i = 0; i < values.size(); ++i) {
    array->GetTuple(static_cast<vtkIdType>(i), values[i].data());
  }
  try {
    return echorama::DisplacementField::Interpolating(lattice, values);
  } catch (const Error& error) {
    throw Error(error.GetKind(), name + ": " + error.what());
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundDisplacement::ImageOf(const echorama::DisplacementField& field, vtkImageData* image)
{
  image->Initialize();
  vtkUltrasoundVolume::SetGeometry(image, field.Lattice());
  const auto values = field.SampledOn(field.Lattice());
  vtkNew<vtkDoubleArray> array;
  array->SetName(DisplacementName());
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(values.View().Size());
  for (vtkIdType i = 0; i < values.View().Size(); ++i) {
    array->SetTuple(i, values.View()[i].data());
  }
  image->GetPointData()->AddArray(array);
  image->GetPointData()->SetActiveVectors(DisplacementName());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundDisplacement::Evaluate(vtkImageData* displacement, const double point[3], double result[3])
{
  try {
    const Eigen::Vector3d u = FieldOf(displacement, "the displacement").At(Eigen::Vector3d(point));
    std::copy_n(u.data(), 3, result);
    return true;
  } catch (const Error& error) {
    vtkGenericWarningMacro(<< error.what());
    return false;
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundDisplacement::Invert(vtkImageData* displacement, const double read[3], double belongs[3])
{
  try {
    const Eigen::Vector3d x = FieldOf(displacement, "the displacement").Inverse(Eigen::Vector3d(read));
    std::copy_n(x.data(), 3, belongs);
    return true;
  } catch (const Error& error) {
    vtkGenericWarningMacro(<< error.what());
    return false;
  }
}
