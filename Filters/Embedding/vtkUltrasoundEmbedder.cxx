// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundEmbedder.h"

#include "BackgroundNoise.h"
#include "BeamNoise.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Memory.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Imaging/Sampling.h"
#include "Embed.h"
#include "EmbedSlabs.h"
#include "FanFilling.h"
#include "FanNoise.h"
#include "NoiseTiling.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundFeather.h"
#include "vtkUltrasoundProbeFit.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <array>
#include <cmath>

using echorama::Error;
using echorama::PlacedProbe;
using echorama::Volume;
using echorama::VolumeView;

namespace {

bool IsSame(const PlacedProbe& a, const PlacedProbe& b)
{
  const auto numbers = [](const echorama::ProbeGeometry& g) {
    return std::array<double, 7>{g.fanAngle, g.fanWidth, g.sweepAngle, g.sweepWidth, g.depthMin, g.depthMax, g.fanOffset};
  };
  return numbers(a.geometry) == numbers(b.geometry) && a.probeToWorld.matrix() == b.probeToWorld.matrix();
}

// A number for people: two digits.
std::string Rounded(double number)
{
  const int digits = number > 0.0 ? 1 - static_cast<int>(std::floor(std::log10(number))) : 0;
  const double unit = std::pow(10.0, std::abs(digits));
  return echorama::NumberText(digits > 0 ? std::round(number * unit) / unit : std::round(number / unit) * unit);
}

// Copies the tuples of an array of the data to their places on the grid; all others are 0.
vtkSmartPointer<vtkDataArray> OnGrid(vtkDataArray* array, vtkImageData* data, const echorama::EmbedGrid& grid)
{
  const auto result = vtkSmartPointer<vtkDataArray>::Take(array->NewInstance());
  result->SetName(array->GetName());
  result->SetNumberOfComponents(array->GetNumberOfComponents());
  result->SetNumberOfTuples(static_cast<vtkIdType>(grid.geometry.VoxelCount()));
  const std::size_t bytes =
      static_cast<std::size_t>(array->GetDataTypeSize()) * static_cast<std::size_t>(array->GetNumberOfComponents());
  echorama::CopyToGrid(grid, vtkUltrasoundVolume::GeometryOf(data).dimensions, bytes, array->GetVoidPointer(0),
                       result->GetVoidPointer(0));
  return result;
}

} // namespace

vtkStandardNewMacro(vtkUltrasoundEmbedder);

vtkUltrasoundParametersMacro(vtkUltrasoundEmbedder);

struct vtkUltrasoundEmbedder::Settings {
  Settings() { embed.featherMm = enclosing.marginMm = -1.0; } // as the data ask
  echorama::EmbedParameters embed;
  echorama::EnclosingFanParameters enclosing;
  echorama::NoiseTilingParameters tiling;
  bool matchGrain = true;
  std::uint64_t seed = 1;
  int previewFactor = 1;
  double maximumMemoryGb = 0.0;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundEmbedder::Parameters()
{
  using echorama::Parameter, echorama::Unlimited;
  Settings& v = *this->Values;
  echorama::ParameterList embed = echorama::Without(Describe(v.embed), {"Exact", "Accuracy", "DiffusionVoxels"});
  Parameter& feather = echorama::Named(embed, "FeatherMm");
  feather.range.low = -1.0;
  feather.help += " Below 0: twice the length of the grain of the data (where it is not known, four voxels), at most 3 mm.";
  return echorama::Join(
      {Describe(v.enclosing),
       embed,
       {Parameter(
           "MatchGrain", v.matchGrain,
           "Give noise that is made the grain of the data: its size along depth, fan and sweep, and its distribution. Where "
           "the data have too little speckle to tell, grains are two voxels long and three wide.")},
       echorama::Without(Describe(v.tiling), {"Columns", "Rows", "OverlapMm", "SpacingMm"}),
       {Parameter("Seed", v.seed, {0, 9223372036854775807.0}, "", "The same seed makes the same noise."),
        Parameter("PreviewFactor", v.previewFactor, {1, 64}, "", "For a quick look: only every so many voxels along each axis."),
        Parameter(
            "MaximumMemoryGb", v.maximumMemoryGb, {0, Unlimited}, "GB",
            "What may be used, in 10^9 bytes. A volume that needs more is embedded slab by slab, as its output is asked for. 0: "
            "the memory that is free.")}});
}

//----------------------------------------------------------------------------
vtkUltrasoundEmbedder::vtkUltrasoundEmbedder() : Values(new Settings)
{
  this->SetNumberOfInputPorts(3);
}

//----------------------------------------------------------------------------
vtkUltrasoundEmbedder::~vtkUltrasoundEmbedder() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundEmbedder::FillInputPortInformation(int port, vtkInformation* info)
{
  this->Superclass::FillInputPortInformation(port, info);
  if (port == 1) {
    info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
    info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  }
  if (port > 0) {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundEmbedder::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // The fan, and with it the grid, depends on the data.
  vtkUltrasoundVolume::MakeInput(this, 2);
  if (this->IsLarge()) {
    return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
      echorama::CheckRanges(this->Parameters());
      vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0), this->PrepareSlabs(inputs, progress).Grid());
    });
  }
  this->Slabs.reset();
  vtkUltrasoundVolume::MakeInput(this, 0);
  if (!vtkImageData::GetData(inputs[0])) {
    return 1; // a composite data set, whose blocks come one by one later
  }
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    // It takes well below a second: a stop is left to the data, whose request takes it back.
    const echorama::ImageGeometry& grid = this->Prepare(inputs, {}).Grid.geometry;
    const bool isLarge = this->BytesOn(grid, vtkImageData::GetData(inputs[0])) > this->AllowedBytes() && this->CanBeCut();
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0), isLarge ? this->PrepareSlabs(inputs, {}).Grid() : grid);
  });
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedder::AllowedBytes() const
{
  const double allowed = 1e9 * this->Values->maximumMemoryGb;
  return allowed > 0.0 ? allowed : echorama::FreeMemory();
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedder::BytesOn(const echorama::ImageGeometry& grid, vtkImageData* image) const
{
  double bytes = echorama::EmbedMemory(this->Values->embed, grid);
  for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i) {
    if (vtkDataArray* array = image->GetPointData()->GetArray(i)) {
      bytes += static_cast<double>(grid.VoxelCount()) * array->GetDataTypeSize() * array->GetNumberOfComponents();
    }
  }
  return bytes;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundEmbedder::CanBeCut()
{
  return this->GetNumberOfInputConnections(0) == 1 && this->GetNumberOfInputConnections(1) == 0 &&
         this->Values->previewFactor == 1;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundEmbedder::IsLargerThanMemory()
{
  int port = 0;
  return this->CanBeCut() && this->GetInputAlgorithm(0, 0, port)->GetExecutive()->UpdateInformation() && this->IsLarge();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundEmbedder::IsLarge()
{
  if (!this->CanBeCut()) {
    return false;
  }
  int port = 0, whole[6];
  vtkInformation* input = this->GetInputAlgorithm(0, 0, port)->GetOutputInformation(port);
  if (!input->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()) || !input->Has(vtkDataObject::SPACING())) {
    return false;
  }
  input->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  echorama::ImageGeometry grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.dimensions[axis] = whole[2 * axis + 1] - whole[2 * axis] + 1;
    if (grid.dimensions[axis] < 2) {
      return false;
    }
  }
  input->Get(vtkDataObject::SPACING(), grid.spacing.data());
  // The input, and the result at least: a voxel and its valid region each.
  return echorama::EmbedMemory(this->Values->embed, grid) + 4.0 * static_cast<double>(grid.VoxelCount()) > this->AllowedBytes();
}

//----------------------------------------------------------------------------
vtkSmartPointer<vtkImageData> vtkUltrasoundEmbedder::InputSlices(int first, int count)
{
  int port = 0;
  vtkAlgorithm* producer = this->GetInputAlgorithm(0, 0, port);
  int extent[6];
  producer->GetOutputInformation(port)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
  extent[4] += first;
  extent[5] = extent[4] + count - 1;
  const vtkNew<vtkInformationVector> requests;
  requests->SetNumberOfInformationObjects(producer->GetNumberOfOutputPorts());
  requests->GetInformationObject(port)->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent, 6);
  const bool made = producer->Update(port, requests) != 0;
  vtkSmartPointer<vtkImageData> slices = made ? vtkImageData::SafeDownCast(producer->GetOutputDataObject(port)) : nullptr;
  if (!slices || slices->GetNumberOfPoints() == 0) {
    throw Error(Error::Kind::BadInput,
                "the input failed at slices " + std::to_string(first) + " to " + std::to_string(first + count - 1));
  }
  if (int there[6]; slices->GetExtent(there), !std::equal(there, there + 6, extent)) { // some make all, whatever is asked for
    const vtkNew<vtkImageData> some;
    some->ShallowCopy(slices);
    some->Crop(extent);
    slices = some.GetPointer();
  }
  return slices;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedder::ShowSlices(vtkImageData* slices, const SlicesUse& use)
{
  const auto input = vtkUltrasoundVolume::CheckInput(this, slices, "the input");
  vtkUltrasoundFeather::RefuseEmbedded(slices);
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    using T = decltype(type);
    const Volume<unsigned char> region = echorama::RealRegionOf(vtkUltrasoundVolume::PosedVolumeOf<T>(input));
    use(vtkUltrasoundVolume::ViewOf<const T>(input.Intensity, slices).Data(), region.View().Data());
  });
}

//----------------------------------------------------------------------------
echorama::EmbedSlabs& vtkUltrasoundEmbedder::PrepareSlabs(vtkInformationVector** inputs, const echorama::Progress& progress)
{
  int port = 0;
  vtkAlgorithm* producer = this->GetInputAlgorithm(0, 0, port);
  vtkImageData* shape = inputs[2]->GetNumberOfInformationObjects() > 0 ? vtkImageData::GetData(inputs[2]) : nullptr;
  auto* pipeline = vtkDemandDrivenPipeline::SafeDownCast(producer->GetExecutive());
  const PlanKey key{{{this, this->GetMTime()},
                     {producer, pipeline ? pipeline->GetPipelineMTime() : 0},
                     {shape, shape ? shape->GetMTime() : 0}}};
  if (this->Slabs && this->PlannedFor == key) {
    return *this->Slabs;
  }
  this->Slabs.reset();
  this->Planned.reset();
  this->Warned = false;
  int whole[6];
  producer->GetOutputInformation(port)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  const int slices = whole[5] - whole[4] + 1;
  echorama::EmbedSlabs::Settings settings{this->Values->embed, this->Values->enclosing, this->Values->matchGrain,
                                          this->Values->seed, this->AllowedBytes()};
  if (shape) {
    settings.enclosing.shape =
        vtkUltrasoundProbeFit::ProbeOf(vtkUltrasoundVolume::CheckInput(this, shape, "the form"), nullptr, {});
  }
  std::unique_ptr<echorama::EmbedSlabs> planned;
  for (int first = 0, count = 1; first < slices; first += count, count = planned->SlicesAtATime()) {
    count = std::min(count, slices - first);
    const vtkSmartPointer<vtkImageData> image = this->InputSlices(first, count);
    if (!planned) {
      const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
      echorama::ImageGeometry data = vtkUltrasoundVolume::GeometryOf(image); // of its first slice
      data.dimensions[2] = slices;
      vtkUltrasoundVolume::Dispatch(input.Intensity,
                                    [&](auto type) { planned = echorama::EmbedSlabs::Make<decltype(type)>(settings, data); });
      this->SlabType = input.Intensity->GetDataType();
      this->SlabName = input.Intensity->GetName() ? input.Intensity->GetName() : vtkUltrasoundVolume::IntensityName();
    }
    this->ShowSlices(image,
                     [&](const void* intensity, const unsigned char* region) { planned->Look(first, count, intensity, region); });
    progress(0.8 * (first + count) / slices);
  }
  planned->Plan(progress.Part(0.8, 1.0));
  this->Slabs = std::move(planned);
  this->PlannedFor = key;
  return *this->Slabs;
}

//----------------------------------------------------------------------------
int vtkUltrasoundEmbedder::RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputs,
                                               vtkInformationVector* outputs)
{
  this->Superclass::RequestUpdateExtent(request, inputs, outputs);
  if (this->Slabs) { // the first slices of those that are missing; the others are asked for when these are taken
    vtkInformation* in = inputs[0]->GetInformationObject(0);
    int wanted[6], extent[6];
    outputs->GetInformationObject(0)->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
    in->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
    const auto [from, to] = this->Slabs->Missing(wanted[4], wanted[5] + 1);
    vtkImageData* last = vtkImageData::GetData(in);
    if (from < to) {
      extent[4] += from;
      extent[5] = extent[4] + std::min(this->Slabs->SlicesAtATime(), to - from) - 1;
    } else if (last && last->GetNumberOfPoints() > 0) {
      last->GetExtent(extent); // nothing is
    } else {
      extent[5] = extent[4];
    }
    in->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent, 6);
  }
  return 1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedder::ExecuteSlab(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  echorama::EmbedSlabs& slabs = this->PrepareSlabs(inputs, progress.Part(0.0, 0.1));
  int wanted[6];
  this->GetOutputInformation(0)->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
  const echorama::ImageGeometry& grid = slabs.Grid();
  const int first = wanted[4], count = wanted[5] - wanted[4] + 1, most = (grid.dimensions[2] + slabs.Slabs() - 1) / slabs.Slabs();
  if (count > most) {
    throw Error(Error::Kind::TooLarge, "embedding on a grid of " + echorama::SizeText(grid.dimensions) +
                                           " voxels needs more memory than is allowed (MaximumMemoryGb); it can be made in " +
                                           std::to_string(slabs.Slabs()) +
                                           " slabs (echorama embed, or NumberOfSlabs of the writer)");
  }
  for (auto [from, to] = slabs.Missing(first, first + count); from < to;) {
    const int some = std::min(slabs.SlicesAtATime(), to - from);
    this->ShowSlices(this->InputSlices(from, some), [&, at = from](const void* intensity, const unsigned char* region) {
      slabs.Take(at, some, intensity, region);
    });
    from += some;
    progress(0.1);
  }
  const echorama::BackgroundNoise& noise = slabs.Noise();
  this->SpeckleShare = this->Values->matchGrain ? noise.speckleShare : -1.0;
  this->SpeckleGrains = this->Values->matchGrain ? noise.grains : -1.0;
  this->GrainMm = noise.grainMm;
  this->UsedFeatherMm = slabs.FeatherMm();
  this->Notes =
      "It is made slab by slab: the outline and the levels come from a coarse copy of the data.\n" + this->NoteOfNoise(noise);

  output->Initialize();
  output->GetFieldData()->ShallowCopy(vtkImageData::GetData(inputs[0])->GetFieldData());
  vtkUltrasoundVolume::SetGeometry(output, grid);
  int extent[6] = {0, grid.dimensions[0] - 1, 0, grid.dimensions[1] - 1, wanted[4], wanted[5]};
  output->SetExtent(extent);
  vtkUltrasoundAcquisition::SetProbeGeometry(output, slabs.Form().geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, slabs.Form().probeToWorld);
  vtkDataArray* intensity = AddArray(output, this->SlabName.c_str(), this->SlabType);
  output->GetPointData()->SetActiveScalars(this->SlabName.c_str());
  const auto bytesOf = [&](const char* name) {
    return vtkUltrasoundVolume::ViewOf<unsigned char>(AddArray(output, name, VTK_UNSIGNED_CHAR), output).Data();
  };
  unsigned char* const seen = bytesOf(vtkUltrasoundVolume::ValidRegionName());
  slabs.Render(first, count, intensity->GetVoidPointer(0), seen, bytesOf(vtkUltrasoundVolume::EmbeddingName()),
               progress.Part(0.1, 1.0));
}

//----------------------------------------------------------------------------
int vtkUltrasoundEmbedder::GetSlabs() const
{
  return this->Slabs ? this->Slabs->Slabs() : 1;
}

//----------------------------------------------------------------------------
const vtkUltrasoundEmbedder::Plan& vtkUltrasoundEmbedder::Prepare(vtkInformationVector** inputs,
                                                                  const echorama::Progress& progress)
{
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  vtkImageData* shape = inputs[2]->GetNumberOfInformationObjects() > 0 ? vtkImageData::GetData(inputs[2]) : nullptr;
  if (!shape && this->GetNumberOfInputConnections(2) > 0) {
    throw Error(Error::Kind::BadInput, "the form is not one volume");
  }
  const PlanKey key{{{this, this->GetMTime()}, {image, image->GetMTime()}, {shape, shape ? shape->GetMTime() : 0}}};
  if (this->Planned && this->PlannedFor == key) {
    return *this->Planned;
  }
  this->Planned.reset();
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  vtkUltrasoundFeather::RefuseEmbedded(image);
  const echorama::ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image);
  Volume<unsigned char> region;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    region = echorama::RealRegionOf(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input));
  });

  Plan plan;
  echorama::EnclosingFanParameters enclosing = this->Values->enclosing;
  if (shape) {
    enclosing.shape = vtkUltrasoundProbeFit::ProbeOf(vtkUltrasoundVolume::CheckInput(this, shape, "the form"), nullptr,
                                                     progress.Part(0.0, 0.3));
  }
  plan.Form = echorama::EncloseRegion(region.View(), geometry, enclosing, progress.Part(0.3, 0.9));
  const echorama::OutlineFamily family = echorama::FamilyOf(plan.Form.geometry);
  const std::string kind = family == echorama::OutlineFamily::Linear   ? "box"
                           : family == echorama::OutlineFamily::Phased ? "fan from a point"
                                                                       : "fan";
  plan.Note = !shape                                ? "The outline is a " + kind + " that was found from the data."
              : IsSame(plan.Form, *enclosing.shape) ? "The outline is the fan of the form."
                                                    : "The fan of the form does not hold all data: the outline is a larger one.";

  plan.Grid = echorama::EmbedGridOf(geometry, region.View(), plan.Form, this->Values->previewFactor);
  this->Planned = plan;
  this->PlannedFor = key;
  return *this->Planned;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundEmbedder::NoteOfNoise(const echorama::BackgroundNoise& behind)
{
  if (this->GetEnoughSpeckle() && this->SpeckleGrains >= 0.0) {
    return "The noise is made, with the grain of the data: " + Rounded(behind.grainMm) + " mm, measured on " +
           Rounded(behind.grains) + " grains in " + Rounded(100.0 * behind.speckleShare) + "% of them.";
  }
  if (this->SpeckleGrains < 0.0) {
    return "The noise is made.";
  }
  this->Warning = "the data have too little speckle to tell its grain and brightness from (" + Rounded(behind.grains) +
                  " grains; " + Rounded(echorama::NoiseMatch::leastGrains) +
                  " are needed): the background is a guess, with grains of two by three voxels. Give noise volumes of the "
                  "same scanner, or stitch views that hold more tissue";
  return "The noise is made, with a grain of its own" + (behind.reason.empty() ? "" : ": " + behind.reason) + ".";
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedder::MakeNoise(vtkInformationVector** inputs, const Plan& plan, VolumeView<float> noise,
                                      VolumeView<unsigned char> form, const echorama::Progress& progress)
{
  const echorama::ImageGeometry& grid = plan.Grid.geometry;
  const auto input = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[0]), "the input");
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[1]);

  // 1. noise that is made, everywhere in the fan
  echorama::BeamNoiseParameters parameters;
  std::string note = "The noise is made.";
  if (this->Values->matchGrain && volumes.empty()) {
    echorama::BackgroundNoise behind;
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
      behind =
          echorama::NoiseBehind(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input), plan.Form, progress.Part(0.0, 0.4));
    });
    parameters = behind.parameters;
    this->SpeckleShare = behind.speckleShare;
    this->SpeckleGrains = behind.grains;
    this->GrainMm = behind.grainMm;
    note = this->NoteOfNoise(behind);
  }
  parameters = echorama::ForGrid(parameters, plan.Form, grid, this->Values->seed);
  echorama::FillFanWithNoise(parameters, plan.Form, grid, noise, form, progress.Part(0.4, 0.8));

  // 2. real noise in its place, wherever there is any
  if (!volumes.empty()) {
    std::vector<echorama::NoiseInput> tiles;
    for (const auto& volume : volumes) {
      vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto type) {
        tiles.push_back({vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volume),
                         vtkUltrasoundProbeFit::ProbeOf(volume, nullptr, progress.Part(0.8, 0.82)), volume.Name});
      });
    }
    const echorama::TiledBeams tiled = echorama::TileNoiseBeams(this->Values->tiling, tiles, progress.Part(0.82, 0.9));
    Volume<float> real(grid.dimensions);
    Volume<unsigned char> there(grid.dimensions);
    echorama::FillFanFromBeams(tiled.samples.View(), tiled.fan.geometry, {0, 0, 0}, plan.Form, grid, real.View(), there.View(),
                               progress.Part(0.9, 1.0));
    const std::ptrdiff_t missing = echorama::PutRealNoise(real.View(), there.View(), form, noise);
    note = "The noise is that of " + std::to_string(volumes.size()) + (volumes.size() == 1 ? " volume" : " volumes") +
           (missing ? ", and made where they have none." : ".");
  }
  this->Notes += note;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedder::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Notes.clear();
  this->Warning.clear();
  this->SpeckleShare = this->SpeckleGrains = -1.0;
  this->GrainMm = 0.0;
  if (this->Slabs) {
    this->ExecuteSlab(inputs, output, progress);
    if (!this->Warning.empty() && !this->Warned) {
      vtkWarningMacro(<< this->Warning);
      this->Warned = true;
    }
    return;
  }
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  const Plan& plan = this->Prepare(inputs, progress.Part(0.0, 0.1));
  const echorama::ImageGeometry& grid = plan.Grid.geometry;
  this->Notes = plan.Note + "\n";

  if (const double bytes = this->BytesOn(grid, image); bytes > this->AllowedBytes()) {
    throw Error(Error::Kind::TooLarge, "embedding on a grid of " + echorama::SizeText(grid.dimensions) + " voxels needs " +
                                           std::to_string(bytes / 1e9).substr(0, 5) +
                                           " GB, more than there is free or allowed; a PreviewFactor of 2 needs an eighth of it");
  }

  // 1. the data on the grid
  output->Initialize();
  vtkUltrasoundVolume::SetGeometry(output, grid);
  output->GetFieldData()->ShallowCopy(image->GetFieldData());
  vtkUltrasoundAcquisition::SetProbeGeometry(output, plan.Form.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, plan.Form.probeToWorld);
  for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i) {
    if (vtkDataArray* array = image->GetPointData()->GetArray(i); array && array != input.Intensity) {
      output->GetPointData()->AddArray(OnGrid(array, image, plan.Grid));
    }
  }
  const char* name = input.Intensity->GetName() ? input.Intensity->GetName() : vtkUltrasoundVolume::IntensityName();
  const auto intensity = OnGrid(input.Intensity, image, plan.Grid);
  intensity->SetName(name);
  output->GetPointData()->AddArray(intensity);
  output->GetPointData()->SetActiveScalars(name);
  vtkDataArray* seen = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* labels = AddArray(output, vtkUltrasoundVolume::EmbeddingName(), VTK_UNSIGNED_CHAR);
  const auto region = vtkUltrasoundVolume::ViewOf<unsigned char>(seen, output);
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    const Volume<unsigned char> real = echorama::RealRegionOf(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input));
    echorama::CopyToGrid(plan.Grid, real.Dimensions(), 1, real.View().Data(), region.Data());
  });

  // 2. the background, and the data over it
  Volume<float> noise(grid.dimensions);
  Volume<unsigned char> form(grid.dimensions);
  this->MakeNoise(inputs, plan, noise.View(), form.View(), progress.Part(0.1, 0.4));
  echorama::EmbedParameters parameters = this->Values->embed;
  if (parameters.featherMm < 0.0) {
    parameters.featherMm = echorama::FeatherDepth(this->GrainMm, vtkUltrasoundVolume::GeometryOf(image).spacing);
  }
  this->UsedFeatherMm = parameters.featherMm;
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    echorama::Embed<T>(parameters, region, grid.spacing, noise.View(), form.View(),
                       vtkUltrasoundVolume::ViewOf<T>(intensity, output),
                       vtkUltrasoundVolume::ViewOf<unsigned char>(labels, output), progress.Part(0.4, 1.0));
  });
  if (!this->Warning.empty()) {
    vtkWarningMacro(<< this->Warning);
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundEmbedder::GetEnoughSpeckle() const
{
  return this->SpeckleGrains < 0.0 || this->SpeckleGrains >= echorama::NoiseMatch::leastGrains;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedder::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "SpeckleGrains: " << this->SpeckleGrains << "\n";
  os << indent << "SpeckleShare: " << this->SpeckleShare << "\n";
  os << indent << "UsedFeatherMm: " << this->UsedFeatherMm << "\n";
  os << indent << "Notes: " << this->Notes << "\n";
}
