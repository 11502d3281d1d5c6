// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDeformGeometry.h"

#include "Core/Imaging/Sampling.h"

#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPointSet.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUltrasoundDisplacement.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include <cstring>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundDeformGeometry);

vtkUltrasoundParametersMacro(vtkUltrasoundDeformGeometry);

namespace {

// Arrays may lie in memory in other ways than kernels take them.
vtkSmartPointer<vtkDataArray> InOneBlock(vtkDataArray* array)
{
  if (array->HasStandardMemoryLayout()) {
    return array;
  }
  auto copy = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(array->GetDataType()));
  copy->DeepCopy(array);
  return copy;
}

vtkSmartPointer<vtkUnsignedCharArray> NewValidRegion(vtkIdType count)
{
  auto valid = vtkSmartPointer<vtkUnsignedCharArray>::New();
  valid->SetName(vtkUltrasoundVolume::ValidRegionName());
  valid->SetNumberOfTuples(count);
  return valid;
}

// An array like another of three components, with each vector multiplied by a matrix of its point.
template <class Matrix>
vtkSmartPointer<vtkDataArray> Multiplied(vtkDataArray* array, const Matrix& matrixOf, bool normalize)
{
  auto result = vtkSmartPointer<vtkDataArray>::Take(array->NewInstance());
  result->DeepCopy(array);
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i) {
    Eigen::Vector3d vector;
    array->GetTuple(i, vector.data());
    vector = matrixOf(static_cast<std::size_t>(i)) * vector;
    if (normalize && vector.norm() > 0.0) {
      vector.normalize();
    }
    result->SetTuple(i, vector.data());
  }
  return result;
}

void Replace(vtkDataSetAttributes* data, vtkDataArray* array, int attribute)
{
  data->AddArray(array); // replaces the one of the same name
  data->SetActiveAttribute(array->GetName(), attribute);
}

// The array of floating numbers or intensities is mixed, others come from the nearest voxel.
echorama::VoxelWriter WriterOf(vtkDataArray* from, vtkDataArray* to, bool isIntensity)
{
  const int components = from->GetNumberOfComponents(), type = from->GetDataType();
  echorama::VoxelWriter writer;
  if (isIntensity || type == VTK_FLOAT || type == VTK_DOUBLE) {
    switch (type) {
#define EchoramaWriterCase(T)                                                                                                    \
  case vtkTypeTraits<T>::VTK_TYPE_ID:                                                                                            \
    writer = echorama::MixedArray<T>(static_cast<const T*>(from->GetVoidPointer(0)), static_cast<T*>(to->GetVoidPointer(0)),     \
                                     components);                                                                                \
    break;
      ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaWriterCase)
#undef EchoramaWriterCase
    default:
      break;
    }
  }
  if (!writer) {
    const std::size_t bytes = static_cast<std::size_t>(from->GetDataTypeSize()) * static_cast<std::size_t>(components);
    writer = echorama::NearestArray(from->GetVoidPointer(0), to->GetVoidPointer(0), bytes);
  }
  return writer;
}

} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundDeformGeometry::vtkUltrasoundDeformGeometry()
{
  this->SetNumberOfInputPorts(3);
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundDeformGeometry::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {Describe(this->Values),
       {Parameter(
            "Result", echorama::Choice(this->ResultChosen, {"deformed", "displacement"}),
            "Deformed: what came in, deformed. Displacement: of an image only its grid counts, and a displacement image comes "
            "out there: where each voxel is read, less where it is. Forward that is the inverse displacement, backward the "
            "displacement itself."),
        Parameter("MoveVectors", this->MovesVectors,
                  "Whether the active vectors of points turn and stretch with what they lie in.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
echorama::LatticeMap vtkUltrasoundDeformGeometry::MapOf(vtkImageData* image, const std::string& name)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadInput, name + ": " + reason); };
  vtkDataArray* array = image ? image->GetPointData()->GetArray(vtkUltrasoundDisplacement::DisplacementName()) : nullptr;
  if (!array || array->GetNumberOfComponents() != 3 || array->GetNumberOfTuples() != image->GetNumberOfPoints()) {
    fail("it is no displacement image, which has a point array Displacement of three components");
  }
  const echorama::ImageGeometry lattice = vtkUltrasoundVolume::GeometryOf(image);
  lattice.Check(name);
  std::vector<Eigen::Vector3d> displacements(lattice.VoxelCount());
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    array->GetTuple(static_cast<vtkIdType>(i), displacements[i].data());
  }
  std::vector<unsigned char> exists;
  if (vtkDataArray* valid = vtkUltrasoundVolume::CheckValidRegion(image, name)) {
    const auto block = InOneBlock(valid);
    const auto* first = static_cast<const unsigned char*>(block->GetVoidPointer(0));
    exists.assign(first, first + displacements.size());
  }
  return {lattice, std::move(displacements), std::move(exists)};
}

//----------------------------------------------------------------------------
void vtkUltrasoundDeformGeometry::SetDisplacementData(vtkImageData* displacement)
{
  this->SetInputDataInternal(1, displacement);
}

//----------------------------------------------------------------------------
void vtkUltrasoundDeformGeometry::SetGridData(vtkImageData* grid)
{
  this->SetInputDataInternal(2, grid);
}

//----------------------------------------------------------------------------
int vtkUltrasoundDeformGeometry::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 0) {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
    info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  } else {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), port == 2 ? 1 : 0);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundDeformGeometry::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* in = inputs[0]->GetInformationObject(0);
  if (vtkImageData::SafeDownCast(vtkDataObject::GetData(in)) && inputs[2]->GetNumberOfInformationObjects() > 0) {
    in = inputs[2]->GetInformationObject(0);
  }
  vtkInformation* out = outputs->GetInformationObject(0);
  out->CopyEntry(in, vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT());
  out->CopyEntry(in, vtkDataObject::ORIGIN());
  out->CopyEntry(in, vtkDataObject::SPACING());
  out->CopyEntry(in, vtkDataObject::DIRECTION());
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundDeformGeometry::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port) {
    vtkUltrasoundVolume::RequestWhole(inputs[port]);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundDeformGeometry::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    const echorama::LatticeMap map = MapOf(vtkImageData::GetData(inputs[1]));
    vtkDataSet* input = vtkDataSet::GetData(inputs[0]);
    vtkDataSet* output = vtkDataSet::GetData(outputs);
    vtkImageData* image = vtkImageData::SafeDownCast(input);
    vtkPointSet* points = vtkPointSet::SafeDownCast(input);
    if (!image && !points) {
      throw Error(Error::Kind::BadInput, "the input is neither an image nor a set of points");
    }
    if (points && this->ResultChosen == DISPLACEMENT) {
      throw Error(Error::Kind::InvalidParameter, "Result: a displacement comes out on the grid of an image; the input is none");
    }
    output->GetFieldData()->ShallowCopy(input->GetFieldData());
    const echorama::DeformReport report =
        image ? this->Deform(image, map, vtkImageData::GetData(inputs[2]), vtkImageData::SafeDownCast(output), progress)
              : this->Deform(points, map, vtkPointSet::SafeDownCast(output), progress);
    const double folded[2] = {static_cast<double>(report.folds.folded), static_cast<double>(report.folded)};
    const double outside = static_cast<double>(report.outside);
    vtkUltrasoundVolume::AddField(output, "DeformationJacobian", &report.folds.smallestRatio, 1);
    vtkUltrasoundVolume::AddField(output, "DeformationFolded", folded, 2);
    vtkUltrasoundVolume::AddField(output, "DeformationOutside", &outside, 1);
    if (report.folds.folded + report.folded > 0) {
      vtkWarningMacro("the displacement folds " << report.folds.folded << " of " << report.folds.tetrahedra << " tetrahedra; "
                                                << report.folded << " of " << report.count << (image ? " voxels" : " points")
                                                << " lie there and are marked as not real");
    }
    vtkInformation* out = outputs->GetInformationObject(0);
    if (image && out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT())) {
      int wanted[6];
      out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
      output->Crop(wanted); // does nothing when all was wanted
    }
  });
}

//----------------------------------------------------------------------------
echorama::DeformReport vtkUltrasoundDeformGeometry::Deform(vtkPointSet* input, const echorama::LatticeMap& map,
                                                           vtkPointSet* output, const echorama::Progress& progress)
{
  // 1. what came in
  const vtkIdType count = input->GetNumberOfPoints();
  std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(count));
  for (vtkIdType i = 0; i < count; ++i) {
    input->GetPoint(i, points[static_cast<std::size_t>(i)].data());
  }
  const auto ofThree = [count](vtkDataArray* array) {
    return array && array->GetNumberOfComponents() == 3 && array->GetNumberOfTuples() == count ? array : nullptr;
  };
  vtkDataArray* normals = ofThree(input->GetPointData()->GetNormals());
  vtkDataArray* vectors = this->MovesVectors ? ofThree(input->GetPointData()->GetVectors()) : nullptr;

  // 2. the kernel
  std::vector<unsigned char> valid;
  std::vector<Eigen::Matrix3d> gradients;
  const auto report =
      echorama::DeformPoints(this->Values, map, points, valid, normals || vectors ? &gradients : nullptr, progress);

  // 3. what goes out: the same cells over other points
  output->CopyStructure(input);
  output->GetPointData()->ShallowCopy(input->GetPointData());
  output->GetCellData()->ShallowCopy(input->GetCellData());
  if (vtkDataArray* ofCells = input->GetCellData()->GetNormals()) {
    output->GetCellData()->RemoveArray(ofCells->GetName());
  }
  vtkNew<vtkPoints> moved;
  moved->SetDataType(input->GetPoints() ? input->GetPoints()->GetDataType() : VTK_FLOAT);
  moved->SetNumberOfPoints(count);
  for (vtkIdType i = 0; i < count; ++i) {
    moved->SetPoint(i, points[static_cast<std::size_t>(i)].data());
  }
  output->SetPoints(moved);
  if (normals) {
    const auto turned = Multiplied(
        normals,
        [&gradients](std::size_t i) -> Eigen::Matrix3d {
          const Eigen::Matrix3d& gradient = gradients[i];
          return std::abs(gradient.determinant()) > echorama::latticeFoldedRatio ? Eigen::Matrix3d(gradient.inverse().transpose())
                                                                                 : Eigen::Matrix3d::Identity();
        },
        true);
    Replace(output->GetPointData(), turned, vtkDataSetAttributes::NORMALS);
  }
  if (vectors) {
    Replace(output->GetPointData(),
            Multiplied(
                vectors, [&gradients](std::size_t i) { return gradients[i]; }, false),
            vtkDataSetAttributes::VECTORS);
  }
  if (this->Values.outside == echorama::DeformGeometryParameters::Outside::Mask || this->Values.maskFolds) {
    const auto array = NewValidRegion(count);
    std::copy(valid.begin(), valid.end(), array->GetPointer(0));
    output->GetPointData()->AddArray(array);
  }
  return report;
}

//----------------------------------------------------------------------------
echorama::DeformReport vtkUltrasoundDeformGeometry::Deform(vtkImageData* input, const echorama::LatticeMap& map,
                                                           vtkImageData* grid, vtkImageData* output,
                                                           const echorama::Progress& progress)
{
  // 1. what came in: its voxels are real where they are valid and, if they have intensities, finite
  echorama::DeformedImage image;
  image.geometry = vtkUltrasoundVolume::GeometryOf(input);
  image.geometry.Check("the input");
  const auto valid = vtkUltrasoundVolume::CheckValidRegion(input, "the input");
  const auto validBlock = valid ? InOneBlock(valid) : vtkSmartPointer<vtkDataArray>();
  image.real = vtkUltrasoundVolume::ViewOf<const unsigned char>(validBlock, input);
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(input);
  echorama::Volume<unsigned char> real;
  if (intensity && intensity->GetNumberOfComponents() == 1 && intensity->GetNumberOfTuples() == input->GetNumberOfPoints() &&
      (intensity->GetDataType() == VTK_FLOAT || intensity->GetDataType() == VTK_DOUBLE)) {
    const auto block = InOneBlock(intensity);
    vtkUltrasoundVolume::Dispatch(block, [&](auto type) {
      using T = decltype(type);
      real = echorama::RealRegionOf(
          echorama::PosedVolume<T>{vtkUltrasoundVolume::ViewOf<const T>(block, input), image.real, image.geometry});
    });
    image.real = real.View();
  }

  // 2. what goes out, on a grid that RequestInformation has promised
  vtkImageData* place = grid ? grid : input;
  image.grid = vtkUltrasoundVolume::GeometryOf(place);
  image.grid.Check("the grid");
  output->SetExtent(place->GetExtent());
  output->SetOrigin(place->GetOrigin());
  output->SetSpacing(place->GetSpacing());
  output->SetDirectionMatrix(place->GetDirectionMatrix());
  const vtkIdType count = output->GetNumberOfPoints();
  const auto outValid = NewValidRegion(count);
  image.valid = vtkUltrasoundVolume::ViewOf<unsigned char>(outValid, output);
  vtkPointData* arrays = output->GetPointData();
  std::vector<vtkSmartPointer<vtkDataArray>> blocks; // alive while they are read
  if (this->ResultChosen == DISPLACEMENT) {
    vtkNew<vtkDoubleArray> displacement;
    displacement->SetName(vtkUltrasoundDisplacement::DisplacementName());
    displacement->SetNumberOfComponents(3);
    displacement->SetNumberOfTuples(count);
    static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
    image.displacements = {reinterpret_cast<Eigen::Vector3d*>(displacement->GetPointer(0)), image.grid.dimensions};
    Replace(arrays, displacement, vtkDataSetAttributes::VECTORS);
  } else {
    for (int number = 0; number < input->GetPointData()->GetNumberOfArrays(); ++number) {
      vtkDataArray* from = input->GetPointData()->GetArray(number); // nullptr: it holds no numbers
      if (!from || from == valid || from->GetDataType() == VTK_BIT || from->GetNumberOfTuples() != input->GetNumberOfPoints()) {
        continue;
      }
      blocks.push_back(InOneBlock(from));
      auto to = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(from->GetDataType()));
      to->SetName(from->GetName());
      to->SetNumberOfComponents(from->GetNumberOfComponents());
      for (int component = 0; component < from->GetNumberOfComponents(); ++component) {
        to->SetComponentName(component, from->GetComponentName(component));
      }
      to->SetNumberOfTuples(count);
      image.writers.push_back(WriterOf(blocks.back(), to, from == intensity));
      arrays->AddArray(to);
    }
    for (int attribute = 0; attribute < vtkDataSetAttributes::NUM_ATTRIBUTES; ++attribute) {
      if (vtkAbstractArray* active = input->GetPointData()->GetAbstractAttribute(attribute)) {
        arrays->SetActiveAttribute(active->GetName(), attribute);
      }
    }
  }
  arrays->AddArray(outValid);

  // 3. the kernel
  return echorama::DeformImage(this->Values, map, image, progress);
}

//----------------------------------------------------------------------------
void vtkUltrasoundDeformGeometry::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
