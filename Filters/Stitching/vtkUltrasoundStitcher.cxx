// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundStitcher.h"

#include "Core/Base/Error.h"
#include "Filters/Stitching/StitchGrid.h"

#include "vtkDataObjectTree.h"
#include "vtkDataObjectTreeIterator.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundDisplacement.h"

#include <cstring>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundStitcher);

namespace {
const char* const METHOD_NAMES[] = {"distance", "feather", "average", "maximum"};

// The smallest of our voxel types that holds the values of both.
int CommonType(int a, int b)
{
  if (a == b || b == VTK_UNSIGNED_CHAR) {
    return a;
  }
  if (a == VTK_UNSIGNED_CHAR) {
    return b;
  }
  return a == VTK_DOUBLE || b == VTK_DOUBLE ? VTK_DOUBLE : VTK_FLOAT;
}

// The geometry that a pipeline announces, when it announces all of it. Filters that know nothing of images (calculators,
// programmable filters) announce the extent alone, and composite data announces nothing.
bool Announced(vtkInformation* information, echorama::ImageGeometry& geometry)
{
  if (!information->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()) || !information->Has(vtkDataObject::ORIGIN()) ||
      !information->Has(vtkDataObject::SPACING()) || !information->Has(vtkDataObject::DIRECTION())) {
    return false;
  }
  int extent[6];
  information->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
  information->Get(vtkDataObject::ORIGIN(), geometry.origin.data());
  information->Get(vtkDataObject::SPACING(), geometry.spacing.data());
  geometry.direction =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(information->Get(vtkDataObject::DIRECTION()));
  for (int axis = 0; axis < 3; ++axis) {
    geometry.dimensions[axis] = extent[2 * axis + 1] - extent[2 * axis] + 1;
  }
  geometry.origin = geometry.IndexToWorld() * Eigen::Vector3d(extent[0], extent[2], extent[4]);
  return true;
}
} // namespace

//----------------------------------------------------------------------------
const char* vtkUltrasoundStitcher::GetMethodName(int method)
{
  return method >= DISTANCE && method <= MAXIMUM ? METHOD_NAMES[method] : nullptr;
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::GetMethodFromName(const char* name)
{
  for (int method = DISTANCE; name && method <= MAXIMUM; ++method) {
    if (!std::strcmp(name, METHOD_NAMES[method])) {
      return method;
    }
  }
  return -1;
}

//----------------------------------------------------------------------------
vtkUltrasoundStitcher::vtkUltrasoundStitcher()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::FillInputPortInformation(int port, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  if (port == 1) {
    // The tree comes first: the pipeline looks there to see that composite data is wanted whole, not leaf by leaf.
    information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
    information->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    information->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
    return 1;
  }
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  information->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    std::vector<echorama::ImageGeometry> geometries;
    bool typeKnown = true;
    int type = VTK_UNSIGNED_CHAR;
    for (int connection = 0; connection < inputs[0]->GetNumberOfInformationObjects(); ++connection) {
      vtkInformation* in = inputs[0]->GetInformationObject(connection);
      echorama::ImageGeometry geometry;
      if (Announced(in, geometry)) {
        geometries.push_back(geometry);
        vtkInformation* scalars =
            vtkDataObject::GetActiveFieldInformation(in, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
        typeKnown = typeKnown && scalars && scalars->Has(vtkDataObject::FIELD_ARRAY_TYPE());
        type = typeKnown ? CommonType(type, scalars->Get(vtkDataObject::FIELD_ARRAY_TYPE())) : type;
        continue;
      }
      // Only the data knows. It is made now, and not again later: nothing has changed when it is asked for.
      int port = 0;
      vtkAlgorithm* producer = this->GetInputAlgorithm(0, connection, port);
      auto* pipeline = vtkStreamingDemandDrivenPipeline::SafeDownCast(producer->GetExecutive());
      if (in->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT())) {
        int whole[6];
        in->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
        in->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), whole, 6);
      }
      in->Set(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER(), 0);
      in->Set(vtkStreamingDemandDrivenPipeline::UPDATE_NUMBER_OF_PIECES(), 1);
      in->Set(vtkStreamingDemandDrivenPipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
      if (!pipeline || !pipeline->Update(port)) {
        throw Error(Error::Kind::BadInput, "input " + std::to_string(connection + 1) + " could not be made");
      }
      vtkNew<vtkInformationVector> one;
      one->Append(in);
      for (const vtkUltrasoundVolume::Input& input : vtkUltrasoundVolume::CollectInputs(this, one)) {
        geometries.push_back(vtkUltrasoundVolume::GeometryOf(input.Image));
        type = CommonType(type, input.Intensity->GetDataType());
      }
    }
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, echorama::StitchGrid(geometries, this->SpacingMm));
    if (typeKnown) {
      vtkDataObject::SetPointDataActiveScalarInfo(out, type, 1);
    }
  });
}

//----------------------------------------------------------------------------
echorama::VolumeView<const float> vtkUltrasoundStitcher::ReliabilityOf(const vtkUltrasoundVolume::Input& volume) const
{
  vtkDataArray* array =
      this->UseReliability ? volume.Image->GetPointData()->GetArray(vtkUltrasoundVolume::ReliabilityName()) : nullptr;
  if (array && (array->GetDataType() != VTK_FLOAT || array->GetNumberOfComponents() != 1 ||
                array->GetNumberOfTuples() != volume.Image->GetNumberOfPoints())) {
    throw Error(Error::Kind::BadInput, volume.Name + ": its Reliability is not one float per voxel");
  }
  return vtkUltrasoundVolume::ViewOf<const float>(array, volume.Image);
}

//----------------------------------------------------------------------------
std::vector<echorama::DisplacementField>
vtkUltrasoundStitcher::DisplacementsOf(vtkInformationVector* port, const std::vector<vtkUltrasoundVolume::Input>& volumes) const
{
  std::vector<echorama::DisplacementField> fields;
  const auto add = [&fields, &volumes](vtkImageData* image, const char* name) {
    const std::size_t number = fields.size();
    const std::string of = number < volumes.size() ? volumes[number].Name : "a volume too many";
    if (name && *name && number < volumes.size() && of != name) {
      throw Error(Error::Kind::BadInput, "displacement " + std::to_string(number + 1) + " is that of " + name +
                                             ", but the volume in its place is " + of);
    }
    fields.push_back(vtkUltrasoundDisplacement::FieldOf(image, "the displacement of " + of));
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
void vtkUltrasoundStitcher::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  // 1. what came in
  const std::vector<vtkUltrasoundVolume::Input> volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  const std::vector<echorama::DisplacementField> fields = this->DisplacementsOf(inputs[1], volumes);
  std::vector<echorama::StitchInput> stitched;
  std::vector<echorama::ImageGeometry> geometries, reaches;
  int type = VTK_UNSIGNED_CHAR;
  vtkNew<vtkStringArray> names;
  names->SetName(StitchedVolumesName());
  for (const vtkUltrasoundVolume::Input& volume : volumes) {
    vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto voxel) {
      stitched.push_back({vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(volume), volume.Name, this->ReliabilityOf(volume)});
    });
    stitched.back().displacement = fields.empty() ? nullptr : &fields[stitched.size() - 1];
    geometries.push_back(vtkUltrasoundVolume::GeometryOf(volume.Image));
    reaches.push_back(echorama::ReachOf(stitched.back()));
    type = CommonType(type, volume.Intensity->GetDataType());
    names->InsertNextValue(volume.Name);
  }
  echorama::StitchParameters parameters;
  parameters.method = static_cast<echorama::StitchMethod>(this->Method);
  parameters.sharpness = this->Sharpness;
  parameters.reliabilityFloor = this->ReliabilityFloor;
  parameters.allowDisjoint = this->AllowDisjoint;
  parameters.maximumMemoryGb = this->MaximumMemoryGb;

  // 2. what goes out
  const echorama::ImageGeometry grid = echorama::StitchGrid(geometries, this->SpacingMm);
  int announced[6];
  this->GetOutputInformation(0)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), announced);
  if (announced[1] + 1 != grid.dimensions[0] || announced[3] + 1 != grid.dimensions[1] ||
      announced[5] + 1 != grid.dimensions[2]) {
    throw Error(Error::Kind::BadInput, "a volume came in with another geometry than its pipeline had announced");
  }
  echorama::CheckStitch(parameters, reaches, grid, static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(type)),
                        this->OutputWeights);
  output->Initialize();
  vtkUltrasoundVolume::SetGeometry(output, grid);
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), type);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* coverage = AddArray(output, CoverageName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  output->GetFieldData()->AddArray(names);
  std::vector<echorama::VolumeView<float>> weights;
  for (std::size_t volume = 0; this->OutputWeights && volume < volumes.size(); ++volume) {
    vtkDataArray* weight = AddArray(output, ("Weight" + std::to_string(volume)).c_str(), VTK_FLOAT);
    weights.push_back(vtkUltrasoundVolume::ViewOf<float>(weight, output));
  }

  // 3. the kernel
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto voxel) {
    using T = decltype(voxel);
    echorama::Stitch<T>(parameters, stitched, grid,
                        {vtkUltrasoundVolume::ViewOf<T>(intensity, output),
                         vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output),
                         vtkUltrasoundVolume::ViewOf<unsigned char>(coverage, output), weights},
                        progress);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitcher::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Method: " << this->GetMethodAsString() << "\n";
  os << indent << "Sharpness: " << this->Sharpness << "\n";
  os << indent << "SpacingMm: " << this->SpacingMm << "\n";
  os << indent << "AllowDisjoint: " << this->AllowDisjoint << "\n";
  os << indent << "UseReliability: " << this->UseReliability << "\n";
  os << indent << "ReliabilityFloor: " << this->ReliabilityFloor << "\n";
  os << indent << "OutputWeights: " << this->OutputWeights << "\n";
  os << indent << "MaximumMemoryGb: " << this->MaximumMemoryGb << "\n";
}
