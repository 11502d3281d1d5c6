// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundStitcher.h"

#include "Core/Base/Error.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Filters/Stitching/StitchJson.h"

#include "vtkDataObjectTree.h"
#include "vtkDataObjectTreeIterator.h"
#include "vtkExecutive.h"
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

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundStitcher);

vtkUltrasoundParametersMacro(vtkUltrasoundStitcher);

namespace {
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
// programmable filters) announce the extent alone; composite data nothing of its own, but VTK 9.3 passes on what its maker's
// first input announced.
bool Announced(vtkInformation* information, echorama::ImageGeometry& geometry)
{
  if (!vtkImageData::SafeDownCast(information->Get(vtkDataObject::DATA_OBJECT())) ||
      !information->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()) || !information->Has(vtkDataObject::ORIGIN()) ||
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
struct vtkUltrasoundStitcher::Scene {
  // All that the plan is made of, which lives as long as it does, and when each was changed last; null: the parameters.
  std::vector<std::pair<vtkSmartPointer<vtkObject>, vtkMTimeType>> MadeOf;
  std::vector<vtkUltrasoundVolume::Input> Volumes;
  std::vector<echorama::DisplacementField> Fields;
  std::vector<echorama::StitchInput> Stitched;
  std::vector<echorama::ImageGeometry> Geometries, Reaches;
  int Type = VTK_UNSIGNED_CHAR;
  echorama::StitchOutputs Outputs;
  echorama::ImageGeometry Grid;
  std::unique_ptr<echorama::StitchPlan> Plan;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundStitcher::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {echorama::Without(Describe(this->Values), {"MembraneTolerance"}),
       {Parameter(
            "SpacingMm", this->SpacingMm, {0, echorama::Unlimited}, "mm",
            "Edge of the cubic voxels of the output. 0: the smallest spacing of the volumes, axis by axis where they all share "
            "their directions."),
        Parameter(
            "UseReliability", this->UseReliability,
            "Weigh volumes that have the array Reliability by it, so that a shadow in one is filled by another. Not for the "
            "method maximum."),
        Parameter("OutputWeights", this->Wanted.weights, "Also put out the share of each volume, as arrays Weight0, Weight1 ...")
            .Advanced(),
        Parameter(
            "OutputSpread", this->Wanted.spread,
            "Also put out how far the volumes are apart at each voxel, as the array Spread: the largest minus the smallest of "
            "their values, 0 where one is alone.")}});
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitcher::GetGain(int volume) const
{
  return volume >= 0 && volume < static_cast<int>(this->Gains.size()) ? this->Gains[volume] : 1.0;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitcher::GetOffset(int volume) const
{
  return volume >= 0 && volume < static_cast<int>(this->Offsets.size()) ? this->Offsets[volume] : 0.0;
}

//----------------------------------------------------------------------------
vtkUltrasoundStitcher::vtkUltrasoundStitcher()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundStitcher::~vtkUltrasoundStitcher() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::FillInputPortInformation(int port, vtkInformation* information)
{
  vtkUltrasoundVolume::AcceptVolumes(information);
  if (port == 1) {
    information->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
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
      // Only the data knows.
      if (!vtkUltrasoundVolume::MakeInput(this, 0, connection)) {
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
    out->Set(CAN_PRODUCE_SUB_EXTENT(), 1); // else the first of several ranks is asked for all
    if (typeKnown) {
      vtkDataObject::SetPointDataActiveScalarInfo(out, type, 1);
    }
  });
}

//----------------------------------------------------------------------------
echorama::VolumeView<const float> vtkUltrasoundStitcher::ReliabilityOf(const vtkUltrasoundVolume::Input& volume)
{
  vtkDataArray* array = volume.Image->GetPointData()->GetArray(vtkUltrasoundVolume::ReliabilityName());
  if (array && (array->GetDataType() != VTK_FLOAT || array->GetNumberOfComponents() != 1 ||
                array->GetNumberOfTuples() != volume.Image->GetNumberOfPoints())) {
    throw Error(Error::Kind::BadInput, volume.Name + ": its Reliability is not one float per voxel");
  }
  return vtkUltrasoundVolume::ViewOf<const float>(array, volume.Image);
}

//----------------------------------------------------------------------------
std::unique_ptr<vtkUltrasoundStitcher::Scene> vtkUltrasoundStitcher::Collect(vtkInformationVector** inputs)
{
  auto scene = std::make_unique<Scene>();
  scene->Volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  std::vector<std::string> names;
  for (const vtkUltrasoundVolume::Input& volume : scene->Volumes) {
    names.push_back(volume.Name);
  }
  scene->Fields = vtkUltrasoundDisplacement::FieldsOf(inputs[1], names);
  const auto keep = [&scene](vtkObject* part) { scene->MadeOf.emplace_back(part, part->GetMTime()); };
  scene->MadeOf.emplace_back(nullptr, this->GetMTime());
  for (int port = 0; port < 2; ++port) {
    for (int connection = 0; connection < inputs[port]->GetNumberOfInformationObjects(); ++connection) {
      keep(vtkDataObject::GetData(inputs[port], connection));
    }
  }
  for (const vtkUltrasoundVolume::Input& volume : scene->Volumes) {
    vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto voxel) {
      scene->Stitched.push_back({vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(volume), volume.Name});
    });
    echorama::StitchInput& stitched = scene->Stitched.back();
    if (this->UseReliability) {
      stitched.reliability = ReliabilityOf(volume);
    }
    stitched.displacement = scene->Fields.empty() ? nullptr : &scene->Fields[scene->Stitched.size() - 1];
    scene->Geometries.push_back(vtkUltrasoundVolume::GeometryOf(volume.Image));
    scene->Reaches.push_back(echorama::ReachOf(stitched));
    scene->Type = CommonType(scene->Type, volume.Intensity->GetDataType());
    keep(volume.Image);
    keep(volume.Intensity);
  }
  scene->Grid = echorama::StitchGrid(scene->Geometries, this->SpacingMm);
  scene->Outputs = this->Wanted;
  scene->Outputs.voxelBytes = static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(scene->Type));
  return scene;
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitcher::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  // 1. what came in, and what is wanted of the output
  std::unique_ptr<Scene> scene = this->Collect(inputs);
  const echorama::ImageGeometry& grid = scene->Grid;
  vtkInformation* out = this->GetOutputInformation(0);
  int announced[6], wanted[6];
  out->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), announced);
  if (announced[1] + 1 != grid.dimensions[0] || announced[3] + 1 != grid.dimensions[1] ||
      announced[5] + 1 != grid.dimensions[2]) {
    throw Error(Error::Kind::BadInput, "a volume came in with another geometry than its pipeline had announced");
  }
  out->Get(out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT()) ? vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT()
                                                                       : vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(),
           wanted);
  echorama::GridBox box;
  bool whole = true;
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = wanted[2 * axis];
    box.size[axis] = wanted[2 * axis + 1] - wanted[2 * axis] + 1;
    whole = whole && box.size[axis] == grid.dimensions[axis];
  }
  echorama::CheckStitch(this->Values, scene->Reaches, grid, scene->Outputs, box);

  // 2. the plan, new or that of the piece before
  double planned = 0.0;
  if (this->Kept && this->Kept->MadeOf == scene->MadeOf) {
    scene = std::move(this->Kept);
  } else {
    this->Kept.reset();
    planned = 0.6;
    scene->Plan = std::make_unique<echorama::StitchPlan>(this->Values, scene->Stitched, scene->Grid, scene->Outputs,
                                                         progress.Part(0.0, planned));
  }
  this->PlanFactor = scene->Plan->Factor();
  this->MembraneBound = scene->Plan->MembraneBound();
  this->Gains = scene->Plan->Gain();
  this->Offsets = scene->Plan->Offset();

  // 3. what goes out
  vtkNew<vtkStringArray> names;
  names->SetName(StitchedVolumesName());
  for (const vtkUltrasoundVolume::Input& volume : scene->Volumes) {
    names->InsertNextValue(volume.Name);
  }
  output->Initialize();
  vtkUltrasoundVolume::SetGeometry(output, scene->Grid);
  output->SetExtent(wanted);
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), scene->Type);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* coverage = AddArray(output, CoverageName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  output->GetFieldData()->AddArray(names);
  echorama::VolumeView<float> spread;
  if (this->Wanted.spread) {
    spread = vtkUltrasoundVolume::ViewOf<float>(AddArray(output, SpreadName(), VTK_FLOAT), output);
  }
  std::vector<echorama::VolumeView<float>> weights;
  for (std::size_t volume = 0; this->Wanted.weights && volume < scene->Volumes.size(); ++volume) {
    vtkDataArray* weight = AddArray(output, ("Weight" + std::to_string(volume)).c_str(), VTK_FLOAT);
    weights.push_back(vtkUltrasoundVolume::ViewOf<float>(weight, output));
  }

  // 4. the kernel
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto voxel) {
    using T = decltype(voxel);
    scene->Plan->Render<T>(box,
                           {vtkUltrasoundVolume::ViewOf<T>(intensity, output),
                            vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output),
                            vtkUltrasoundVolume::ViewOf<unsigned char>(coverage, output), weights, spread},
                           progress.Part(planned, 1.0));
  });
  if (!whole) {
    this->Kept = std::move(scene); // the other pieces will be asked for
  }
}

//----------------------------------------------------------------------------
std::optional<echorama::StitchCost> vtkUltrasoundStitcher::Cost()
{
  std::optional<echorama::StitchCost> cost;
  this->UpdateInformation();
  vtkInformationVector* inputs[2] = {this->GetExecutive()->GetInputInformation(0), this->GetExecutive()->GetInputInformation(1)};
  vtkUltrasoundVolume::MakeInput(this, 0);
  vtkUltrasoundVolume::MakeInput(this, 1);
  vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
    const std::unique_ptr<Scene> scene = this->Collect(inputs);
    cost = echorama::CostOfStitch(this->Values, scene->Reaches, scene->Grid, scene->Outputs);
  });
  return cost;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundStitcher::EstimateCost()
{
  const std::optional<echorama::StitchCost> cost = this->Cost();
  return cost ? echorama::Report(*cost) : std::string();
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitcher::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
