// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundVolume.h"

#include "Core/Geometry/MatrixRows.h"
#include "vtkAlgorithm.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataObjectTree.h"
#include "vtkDataObjectTreeIterator.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundLandmarkField.h"

#include <cstdint>
#include <new>
#include <sys/mman.h>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundVolume);

//----------------------------------------------------------------------------
vtkDataArray* vtkUltrasoundVolume::GetIntensity(vtkImageData* volume)
{
  vtkPointData* arrays = volume ? volume->GetPointData() : nullptr;
  vtkDataArray* named = arrays ? arrays->GetArray(IntensityName()) : nullptr;
  return named || !arrays ? named : arrays->GetScalars();
}

//----------------------------------------------------------------------------
vtkSmartPointer<vtkDataArray> vtkUltrasoundVolume::NewArray(int vtkType, vtkIdType tuples, const char* name)
{
  auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(vtkType));
  array->SetName(name);
  array->SetNumberOfTuples(tuples);
  // On huge pages, before anybody writes to it (memory of our own: ZeroedMemory.h). What is advised begins with a page.
  auto* const voxels = static_cast<char*>(array->GetVoidPointer(0));
  const std::size_t bytes = static_cast<std::size_t>(tuples) * static_cast<std::size_t>(array->GetDataTypeSize());
  if (const std::size_t before = (0 - reinterpret_cast<std::uintptr_t>(voxels)) % 65536; before < bytes) {
    madvise(voxels + before, bytes - before, MADV_HUGEPAGE);
  }
  return array;
}

//----------------------------------------------------------------------------
vtkDataArray* vtkUltrasoundVolume::GetValidRegion(vtkImageData* volume)
{
  return volume ? volume->GetPointData()->GetArray(ValidRegionName()) : nullptr;
}

//----------------------------------------------------------------------------
std::array<int, 3> vtkUltrasoundVolume::DimensionsOf(vtkImageData* image)
{
  std::array<int, 3> dimensions;
  image->GetDimensions(dimensions.data());
  return dimensions;
}

//----------------------------------------------------------------------------
echorama::ImageGeometry vtkUltrasoundVolume::GeometryOf(vtkImageData* volume)
{
  echorama::ImageGeometry geometry;
  geometry.dimensions = DimensionsOf(volume);
  volume->GetSpacing(geometry.spacing.data());
  volume->GetOrigin(geometry.origin.data());
  geometry.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(volume->GetDirectionMatrix()->GetData());
  const int* extent = volume->GetExtent();
  const Eigen::Vector3d first(extent[0], extent[2], extent[4]);
  geometry.origin += geometry.direction * geometry.spacing.cwiseProduct(first);
  return geometry;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::SetGeometry(vtkImageData* volume, const echorama::ImageGeometry& geometry)
{
  volume->SetDimensions(geometry.dimensions.data());
  volume->SetOrigin(geometry.origin.data());
  volume->SetSpacing(geometry.spacing.data());
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction = geometry.direction;
  volume->SetDirectionMatrix(direction.data());
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::SetGeometry(vtkInformation* information, const echorama::ImageGeometry& geometry)
{
  const int extent[6] = {0, geometry.dimensions[0] - 1, 0, geometry.dimensions[1] - 1, 0, geometry.dimensions[2] - 1};
  information->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  information->Set(vtkDataObject::ORIGIN(), geometry.origin.data(), 3);
  information->Set(vtkDataObject::SPACING(), geometry.spacing.data(), 3);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction = geometry.direction;
  information->Set(vtkDataObject::DIRECTION(), direction.data(), 9);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::Move(vtkImageData* volume, const echorama::Pose& pose)
{
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> before(volume->GetDirectionMatrix()->GetData());
  const Eigen::Vector3d origin = pose * Eigen::Map<const Eigen::Vector3d>(volume->GetOrigin());
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction = pose.linear() * before;
  volume->SetOrigin(origin.data());
  volume->SetDirectionMatrix(direction.data());
  if (const auto probe = vtkUltrasoundAcquisition::ProbeToWorldOf(volume)) {
    vtkUltrasoundAcquisition::SetProbeToWorld(volume, pose * *probe);
  }
  if (const auto image = vtkUltrasoundAcquisition::ImageToWorldOf(volume)) {
    vtkUltrasoundAcquisition::SetImageToWorld(volume, pose * *image);
  }
  vtkUltrasoundLandmarkField::Move(volume, pose);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolume::Move(vtkImageData* volume, vtkMatrix4x4* matrix)
{
  const auto pose = RigidPoseOf(matrix);
  if (!pose) {
    vtkGenericWarningMacro("vtkUltrasoundVolume::Move: the matrix is not a rigid transform; the volume was not moved");
    return false;
  }
  Move(volume, *pose);
  return true;
}

//----------------------------------------------------------------------------
std::optional<echorama::Pose> vtkUltrasoundVolume::RigidPoseOf(vtkMatrix4x4* matrix)
{
  const auto pose = echorama::FromRows<echorama::Pose>(matrix->GetData());
  if (!echorama::IsRotation(pose.linear()) || !pose.translation().allFinite() ||
      pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return std::nullopt;
  }
  return pose;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::SetMatrix(vtkMatrix4x4* matrix, const echorama::Pose& pose)
{
  matrix->DeepCopy(echorama::MatrixRows(pose.matrix()).data());
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::RefuseType(vtkDataArray* intensity)
{
  throw Error(Error::Kind::BadInput, std::string("voxels of type ") + intensity->GetDataTypeAsString() +
                                         " are not supported; use unsigned char, short, unsigned short, float or double");
}

//----------------------------------------------------------------------------
vtkDataArray* vtkUltrasoundVolume::CheckValidRegion(vtkImageData* image, const std::string& name)
{
  vtkDataArray* valid = GetValidRegion(image);
  if (valid && (valid->GetDataType() != VTK_UNSIGNED_CHAR || valid->GetNumberOfComponents() != 1 ||
                valid->GetNumberOfTuples() != image->GetNumberOfPoints())) {
    throw Error(Error::Kind::BadInput, name + ": its ValidRegion is not one unsigned char per voxel");
  }
  return valid;
}

//----------------------------------------------------------------------------
vtkUltrasoundVolume::Input vtkUltrasoundVolume::CheckInput(vtkAlgorithm* filter, vtkImageData* image, const std::string& name)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadInput, name + ": " + reason); };
  Input input;
  input.Image = image;
  input.Name = name;
  // The filter's choice counts when somebody made one; the default choice of vtkImageAlgorithm (the active scalars) gives
  // way to the array that is named Intensity.
  vtkInformation* choice = filter ? filter->GetInputArrayInformation(0) : nullptr;
  const bool chosen = choice && choice->Has(vtkDataObject::FIELD_NAME());
  input.Intensity = chosen ? image->GetPointData()->GetArray(choice->Get(vtkDataObject::FIELD_NAME())) : GetIntensity(image);
  if (!input.Intensity) {
    fail(chosen ? std::string("it has no point array named ") + choice->Get(vtkDataObject::FIELD_NAME())
                : std::string("it has no intensities (a point array named Intensity, or active scalars)"));
  }
  if (input.Intensity->GetNumberOfComponents() != 1) {
    fail("its intensities have " + std::to_string(input.Intensity->GetNumberOfComponents()) + " components; one is needed");
  }
  try {
    Dispatch(input.Intensity, [](auto) {});
  } catch (const Error& error) {
    fail(error.what());
  }
  GeometryOf(image).Check(name);
  if (input.Intensity->GetNumberOfTuples() != image->GetNumberOfPoints()) {
    fail("its intensities are not one per voxel");
  }
  input.ValidRegion = CheckValidRegion(image, name);
  return input;
}

//----------------------------------------------------------------------------
std::vector<vtkUltrasoundVolume::Input> vtkUltrasoundVolume::CollectInputs(vtkAlgorithm* filter, vtkInformationVector* port)
{
  std::vector<Input> inputs;
  const auto add = [&inputs, filter](vtkImageData* image, const char* name) {
    inputs.push_back(CheckInput(filter, image, name && *name ? name : "volume " + std::to_string(inputs.size() + 1)));
  };
  for (int connection = 0; connection < port->GetNumberOfInformationObjects(); ++connection) {
    vtkDataObject* data = vtkDataObject::GetData(port, connection);
    if (vtkImageData* image = vtkImageData::SafeDownCast(data)) {
      add(image, nullptr);
    } else if (vtkDataObjectTree* tree = vtkDataObjectTree::SafeDownCast(data)) {
      const auto leaf = vtkSmartPointer<vtkDataObjectTreeIterator>::Take(tree->NewTreeIterator());
      leaf->VisitOnlyLeavesOn();
      for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem()) {
        if (vtkImageData* leafImage = vtkImageData::SafeDownCast(leaf->GetCurrentDataObject())) {
          vtkInformation* meta = leaf->HasCurrentMetaData() ? leaf->GetCurrentMetaData() : nullptr;
          add(leafImage, meta ? meta->Get(vtkCompositeDataSet::NAME()) : nullptr);
        }
      }
    }
  }
  return inputs;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::AcceptVolumes(vtkInformation* port)
{
  // The tree comes first: the pipeline looks there to see that composite data is wanted whole, not leaf by leaf.
  port->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
  port->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  port->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolume::MakeInput(vtkAlgorithm* filter, int port, int connection)
{
  RequestWhole(filter->GetExecutive()->GetInputInformation(port));
  bool made = true;
  for (int number = 0; number < filter->GetNumberOfInputConnections(port); ++number) {
    if (connection < 0 || number == connection) {
      int output = 0;
      vtkAlgorithm* producer = filter->GetInputAlgorithm(port, number, output);
      made = producer->GetExecutive()->Update(output) && made;
    }
  }
  return made;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::AddField(vtkDataObject* data, const char* name, const double* values, int components)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->InsertNextTuple(values);
  data->GetFieldData()->AddArray(array);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::AddField(vtkDataObject* data, const char* name, const std::string& text)
{
  vtkNew<vtkStringArray> array;
  array->SetName(name);
  array->InsertNextValue(text);
  data->GetFieldData()->AddArray(array);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolume::RequestWhole(vtkInformationVector* port)
{
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  for (int connection = 0; connection < port->GetNumberOfInformationObjects(); ++connection) {
    vtkInformation* in = port->GetInformationObject(connection);
    in->Set(Pipeline::UPDATE_PIECE_NUMBER(), 0);
    in->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), 1);
    in->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
    if (in->Has(Pipeline::WHOLE_EXTENT())) {
      int whole[6];
      in->Get(Pipeline::WHOLE_EXTENT(), whole);
      in->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
    }
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolume::Run(vtkAlgorithm* filter, vtkInformationVector* outputs,
                             const std::function<void(const echorama::Progress&)>& body)
{
  const auto failed = [outputs]() {
    for (int port = 0; outputs && port < outputs->GetNumberOfInformationObjects(); ++port) {
      if (vtkDataObject* output = vtkDataObject::GetData(outputs, port)) {
        output->Initialize();
      }
    }
    return 0;
  };
  // VTK 9.1 takes an earlier request to stop back before data are made, later ones leave that to the algorithm.
  filter->SetAbortExecute(0);
  const echorama::Progress progress([filter](double fraction) {
    filter->UpdateProgress(fraction);
    return !filter->GetAbortExecute();
  });
  try {
    body(progress);
    return 1;
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::Cancelled) {
      vtkErrorWithObjectMacro(filter, << error.what());
    }
  } catch (const std::bad_alloc&) {
    vtkErrorWithObjectMacro(filter, "there is not enough memory for the result");
  } catch (const std::exception& error) {
    vtkErrorWithObjectMacro(filter, << error.what());
  }
  return failed();
}
