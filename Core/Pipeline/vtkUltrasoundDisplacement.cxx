// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDisplacement.h"

#include "vtkCompositeDataSet.h"
#include "vtkDataObjectTree.h"
#include "vtkDataObjectTreeIterator.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundDisplacement);

namespace {
// To result what is asked of the field of an image; false, with a warning, when it has none.
template <class Ask>
bool Put(vtkImageData* displacement, double result[3], const Ask& ask)
{
  try {
    const Eigen::Vector3d found = ask(vtkUltrasoundDisplacement::FieldOf(displacement, "the displacement"));
    std::copy_n(found.data(), 3, result);
    return true;
  } catch (const Error& error) {
    vtkGenericWarningMacro(<< error.what());
    return false;
  }
}
} // namespace

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
std::vector<echorama::DisplacementField> vtkUltrasoundDisplacement::FieldsOf(vtkInformationVector* port,
                                                                             const std::vector<std::string>& volumes)
{
  std::vector<echorama::DisplacementField> fields;
  const auto add = [&fields, &volumes](vtkImageData* image, const char* name) {
    const std::size_t number = fields.size();
    const std::string of = number < volumes.size() ? volumes[number] : "a volume too many";
    if (name && *name && number < volumes.size() && !of.empty() && of != name) {
      throw Error(Error::Kind::BadInput, "displacement " + std::to_string(number + 1) + " is that of " + name +
                                             ", but the volume in its place is " + of);
    }
    fields.push_back(FieldOf(image, "the displacement of " + of));
  };
  for (int connection = 0; connection < port->GetNumberOfInformationObjects(); ++connection) {
    vtkDataObject* data = vtkDataObject::GetData(port, connection);
    if (vtkImageData* image = vtkImageData::SafeDownCast(data)) {
      add(image, nullptr);
    } else if (vtkDataObjectTree* tree = vtkDataObjectTree::SafeDownCast(data)) {
      const auto leaf = vtkSmartPointer<vtkDataObjectTreeIterator>::Take(tree->NewTreeIterator());
      leaf->VisitOnlyLeavesOn();
      for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem()) {
        vtkInformation* meta = leaf->HasCurrentMetaData() ? leaf->GetCurrentMetaData() : nullptr;
        add(vtkImageData::SafeDownCast(leaf->GetCurrentDataObject()), meta ? meta->Get(vtkCompositeDataSet::NAME()) : nullptr);
      }
    }
  }
  if (!fields.empty() && fields.size() != volumes.size()) {
    throw Error(Error::Kind::BadInput, std::to_string(fields.size()) + " displacements came in for " +
                                           std::to_string(volumes.size()) + " volumes; there must be one for each, or none");
  }
  return fields;
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
  std::copy_n(values.View().Data()->data(), 3 * values.View().Size(), array->GetPointer(0));
  image->GetPointData()->SetVectors(array);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundDisplacement::Evaluate(vtkImageData* displacement, const double point[3], double result[3])
{
  return Put(displacement, result, [point](const auto& field) { return field.At(Eigen::Vector3d(point)); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundDisplacement::Invert(vtkImageData* displacement, const double read[3], double belongs[3])
{
  return Put(displacement, belongs, [read](const auto& field) { return field.Inverse(Eigen::Vector3d(read)); });
}
