// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundStitcher.h"

#include "Core/Base/Error.h"
#include "Core/Base/Json.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Filters/Stitching/StitchMemory.h"

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
#include <cstring>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundStitcher);

namespace {
const char* const METHOD_NAMES[] = {"distance", "feather", "average", "maximum", "membrane"};
const char* const TEXTURE_NAMES[] = {"mix", "split", "seam"};

template <std::size_t count>
const char* NameOf(const char* const (&names)[count], int number)
{
  return number >= 0 && number < static_cast<int>(count) ? names[number] : nullptr;
}

template <std::size_t count>
int NumberOf(const char* const (&names)[count], const char* name)
{
  for (std::size_t number = 0; name && number < count; ++number) {
    if (!std::strcmp(name, names[number])) {
      return static_cast<int>(number);
    }
  }
  return -1;
}

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
  vtkMTimeType Made = 0; // of the parameters and of all that came in
  std::vector<vtkUltrasoundVolume::Input> Volumes;
  std::vector<echorama::DisplacementField> Fields;
  std::vector<echorama::StitchInput> Stitched;
  std::vector<echorama::ImageGeometry> Geometries, Reaches;
  int Type = VTK_UNSIGNED_CHAR;
  echorama::ImageGeometry Grid;
  std::unique_ptr<echorama::StitchPlan> Plan;
};

//----------------------------------------------------------------------------
const char* vtkUltrasoundStitcher::GetMethodName(int method)
{
  return NameOf(METHOD_NAMES, method);
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::GetMethodFromName(const char* name)
{
  return NumberOf(METHOD_NAMES, name);
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundStitcher::GetTextureName(int texture)
{
  return NameOf(TEXTURE_NAMES, texture);
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitcher::GetTextureFromName(const char* name)
{
  return NumberOf(TEXTURE_NAMES, name);
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
echorama::StitchParameters vtkUltrasoundStitcher::Parameters() const
{
  echorama::StitchParameters parameters;
  parameters.method = static_cast<echorama::StitchMethod>(this->Method);
  parameters.texture = static_cast<echorama::StitchTexture>(this->Texture);
  parameters.sharpness = this->Sharpness;
  parameters.detailSharpness = this->DetailSharpness;
  parameters.detailScale = this->DetailScale;
  parameters.equalizeGain = this->EqualizeGain;
  parameters.reliabilityFloor = this->ReliabilityFloor;
  parameters.allowDisjoint = this->AllowDisjoint;
  parameters.maximumMemoryGb = this->MaximumMemoryGb;
  return parameters;
}

//----------------------------------------------------------------------------
std::unique_ptr<vtkUltrasoundStitcher::Scene> vtkUltrasoundStitcher::Collect(vtkInformationVector** inputs)
{
  auto scene = std::make_unique<Scene>();
  scene->Volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  scene->Fields = this->DisplacementsOf(inputs[1], scene->Volumes);
  scene->Made = this->GetMTime();
  for (int port = 0; port < 2; ++port) {
    for (int connection = 0; connection < inputs[port]->GetNumberOfInformationObjects(); ++connection) {
      scene->Made = std::max(scene->Made, vtkDataObject::GetData(inputs[port], connection)->GetMTime());
    }
  }
  for (const vtkUltrasoundVolume::Input& volume : scene->Volumes) {
    vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto voxel) {
      scene->Stitched.push_back(
          {vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(volume), volume.Name, this->ReliabilityOf(volume)});
    });
    echorama::StitchInput& stitched = scene->Stitched.back();
    stitched.displacement = scene->Fields.empty() ? nullptr : &scene->Fields[scene->Stitched.size() - 1];
    scene->Geometries.push_back(vtkUltrasoundVolume::GeometryOf(volume.Image));
    scene->Reaches.push_back(echorama::ReachOf(stitched));
    scene->Type = CommonType(scene->Type, volume.Intensity->GetDataType());
    scene->Made = std::max({scene->Made, volume.Image->GetMTime(), volume.Intensity->GetMTime()});
  }
  scene->Grid = echorama::StitchGrid(scene->Geometries, this->SpacingMm);
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
  const echorama::StitchParameters parameters = this->Parameters();
  const echorama::StitchOutputs outputs{static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(scene->Type)), this->OutputWeights,
                                        this->OutputSpread};
  echorama::CheckStitch(parameters, scene->Reaches, grid, outputs, box);

  // 2. the plan, new or that of the piece before
  double planned = 0.0;
  if (this->Kept && this->Kept->Made == scene->Made) {
    scene = std::move(this->Kept);
  } else {
    this->Kept.reset();
    planned = 0.6;
    scene->Plan =
        std::make_unique<echorama::StitchPlan>(parameters, scene->Stitched, scene->Grid, outputs, progress.Part(0.0, planned));
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
  if (this->OutputSpread) {
    spread = vtkUltrasoundVolume::ViewOf<float>(AddArray(output, SpreadName(), VTK_FLOAT), output);
  }
  std::vector<echorama::VolumeView<float>> weights;
  for (std::size_t volume = 0; this->OutputWeights && volume < scene->Volumes.size(); ++volume) {
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
std::string vtkUltrasoundStitcher::EstimateCost()
{
  std::string report;
  this->UpdateInformation();
  vtkInformationVector* inputs[2] = {this->GetExecutive()->GetInputInformation(0), this->GetExecutive()->GetInputInformation(1)};
  vtkUltrasoundVolume::MakeInput(this, 0);
  vtkUltrasoundVolume::MakeInput(this, 1);
  vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
    const std::unique_ptr<Scene> scene = this->Collect(inputs);
    const echorama::StitchOutputs outputs{static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(scene->Type)),
                                          this->OutputWeights, this->OutputSpread};
    const echorama::StitchCost cost = echorama::CostOfStitch(this->Parameters(), scene->Reaches, scene->Grid, outputs);
    const auto& spacing = scene->Grid.spacing;
    report = nlohmann::ordered_json{{"volumes", scene->Volumes.size()},
                                    {"dimensions", scene->Grid.dimensions},
                                    {"spacing", {spacing[0], spacing[1], spacing[2]}},
                                    {"plan_factor", cost.planFactor},
                                    {"plan_bytes", cost.planBytes},
                                    {"output_bytes", cost.outputBytes},
                                    {"allowed_bytes", cost.allowedBytes},
                                    {"slabs", cost.slabs}}
                 .dump();
  });
  return report;
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitcher::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Method: " << this->GetMethodAsString() << "\n";
  os << indent << "Texture: " << this->GetTextureAsString() << "\n";
  os << indent << "Sharpness: " << this->Sharpness << "\n";
  os << indent << "DetailSharpness: " << this->DetailSharpness << "\n";
  os << indent << "DetailScale: " << this->DetailScale << "\n";
  os << indent << "EqualizeGain: " << this->EqualizeGain << "\n";
  os << indent << "SpacingMm: " << this->SpacingMm << "\n";
  os << indent << "AllowDisjoint: " << this->AllowDisjoint << "\n";
  os << indent << "UseReliability: " << this->UseReliability << "\n";
  os << indent << "ReliabilityFloor: " << this->ReliabilityFloor << "\n";
  os << indent << "OutputWeights: " << this->OutputWeights << "\n";
  os << indent << "OutputSpread: " << this->OutputSpread << "\n";
  os << indent << "MaximumMemoryGb: " << this->MaximumMemoryGb << "\n";
}
