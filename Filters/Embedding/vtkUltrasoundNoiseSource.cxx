// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundNoiseSource.h"

#include "BeamNoise.h"
#include "Core/Geometry/ProbeSettings.h"
#include "Core/Imaging/ScanConversion.h"
#include "LatticeNoise.h"
#include "NoiseMatch.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundProbeFit.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <algorithm>
#include <utility>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundNoiseSource);

vtkUltrasoundParametersMacro(vtkUltrasoundNoiseSource);

struct vtkUltrasoundNoiseSource::Settings {
  enum class NoiseKind { Beams, White, Perlin } kind = NoiseKind::Beams;
  int samples = 0, elements = 0, steps = 0;
  echorama::BeamNoiseParameters beams;
  echorama::NoiseMatchParameters match;
  echorama::LatticeNoiseParameters lattice;
  double spacingMm = 0.5;
  bool onInputGrid = false, floatOutput = false;
  std::int64_t maximumVoxels = std::int64_t{1} << 30;
  echorama::ProbeSettings fan;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundNoiseSource::Parameters()
{
  using echorama::Parameter;
  Settings& v = *this->Values;
  const std::string automatic =
      " 0: three to each length of the grain, or 400 samples, 240 elements and 120 steps where that is 0.";
  return echorama::Join(
      {{Parameter("Kind", echorama::Choice(v.kind, {"beams", "white", "perlin"}),
                  "Noise along beams looks like ultrasound; white and Perlin noise are there to compare with.")},
       echorama::Without(Describe(v.beams), {"Samples", "Elements", "Steps"}),
       {Parameter("Samples", v.samples, {0, 100000}, "", "Samples along a beam." + automatic),
        Parameter("Elements", v.elements, {0, 100000}, "", "Beams across the fan." + automatic),
        Parameter("Steps", v.steps, {0, 100000}, "", "Planes of the sweep." + automatic)},
       echorama::Without(Describe(v.match), {"DepthBands", "Quantiles"}),
       Describe(v.lattice),
       {Parameter("SpacingMm", v.spacingMm, {0, 1000, true}, "mm", "Edge of the cubic voxels.").When("OnInputGrid", "off"),
        Parameter("OnInputGrid", v.onInputGrid, "Whether the output lies on the grid of the volume that gives the fan."),
        Parameter("FloatOutput", v.floatOutput, "Whether intensities are float, neither rounded nor cut; else unsigned char."),
        Parameter("MaximumVoxels", v.maximumVoxels, {1, echorama::Unlimited}, "",
                  "The output is refused when it would have more voxels.")
            .Advanced()},
       Describe(v.fan)});
}

//----------------------------------------------------------------------------
vtkUltrasoundNoiseSource::vtkUltrasoundNoiseSource() : Values(new Settings)
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundNoiseSource::~vtkUltrasoundNoiseSource() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundNoiseSource::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return this->Superclass::FillInputPortInformation(port, info);
}

//----------------------------------------------------------------------------
std::optional<vtkUltrasoundVolume::Input> vtkUltrasoundNoiseSource::InputAt(vtkInformationVector** inputs, int port)
{
  vtkImageData* image = vtkImageData::GetData(inputs[port]);
  if (!image) {
    return {};
  }
  return vtkUltrasoundVolume::CheckInput(this, image, port == 0 ? "the volume with the fan" : "the volume to match");
}

//----------------------------------------------------------------------------
echorama::PlacedProbe vtkUltrasoundNoiseSource::FanFor(vtkInformationVector** inputs)
{
  for (const int port : {0, 1}) {
    if (const auto input = this->InputAt(inputs, port)) {
      return vtkUltrasoundProbeFit::ProbeOf(*input);
    }
  }
  return this->Values->fan.Place();
}

//----------------------------------------------------------------------------
echorama::ImageGeometry vtkUltrasoundNoiseSource::GridFor(vtkInformationVector** inputs, const echorama::PlacedProbe& fan)
{
  if (this->Values->onInputGrid) {
    for (const int port : {0, 1}) {
      if (const auto input = this->InputAt(inputs, port)) {
        return vtkUltrasoundVolume::GeometryOf(input->Image);
      }
    }
    throw Error(Error::Kind::InvalidParameter, "OnInputGrid is on, but there is no input whose grid could be taken");
  }
  return echorama::ScanConversionGrid(fan.geometry, fan.probeToWorld, this->Values->spacingMm,
                                      static_cast<std::size_t>(this->Values->maximumVoxels));
}

//----------------------------------------------------------------------------
int vtkUltrasoundNoiseSource::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Field data and valid regions do not travel with the information of the pipeline.
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port) {
    vtkUltrasoundVolume::MakeInput(this, port);
  }
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, this->GridFor(inputs, this->FanFor(inputs)));
    vtkDataObject::SetPointDataActiveScalarInfo(out, this->Values->floatOutput ? VTK_FLOAT : VTK_UNSIGNED_CHAR, 1);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseSource::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const echorama::PlacedProbe fan = this->FanFor(inputs);
  const echorama::ImageGeometry grid = this->GridFor(inputs, fan);
  const Settings& v = *this->Values;

  // What it shall be like.
  echorama::BeamNoiseParameters beams = echorama::ResolvingCounts(v.beams, fan.geometry);
  echorama::LatticeNoiseParameters lattice = v.lattice;
  lattice.mean = v.beams.mean;
  std::fill_n(this->MatchResolved, 3, 0);
  const auto matched = this->InputAt(inputs, 1);
  if (matched) {
    const echorama::PlacedProbe probe = vtkUltrasoundProbeFit::ProbeOf(*matched);
    vtkUltrasoundVolume::Dispatch(matched->Intensity, [&](auto type) {
      using T = decltype(type);
      const auto match = echorama::MatchNoise<T>(vtkUltrasoundVolume::PosedVolumeOf<T>(*matched), probe.geometry,
                                                 probe.probeToWorld, v.match, progress.Part(0.0, 0.5));
      beams = echorama::NoiseLike(match, probe.geometry, fan.geometry);
      lattice.mean = match.mean;
      lattice.deviation = match.deviation;
      std::copy(match.lengths.resolved.begin(), match.lengths.resolved.end(), this->MatchResolved);
    });
  }
  beams.seed = lattice.seed = v.beams.seed;
  for (const auto& [wanted, count] :
       {std::pair{v.samples, &beams.samples}, std::pair{v.elements, &beams.elements}, std::pair{v.steps, &beams.steps}}) {
    *count = wanted > 0 ? wanted : *count;
  }

  vtkUltrasoundVolume::SetGeometry(output, grid);
  vtkDataArray* intensity =
      AddArray(output, vtkUltrasoundVolume::IntensityName(), this->Values->floatOutput ? VTK_FLOAT : VTK_UNSIGNED_CHAR);
  vtkDataArray* validRegion = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  const auto valid = vtkUltrasoundVolume::ViewOf<unsigned char>(validRegion, output);

  const echorama::Progress make = progress.Part(matched ? 0.5 : 0.0, 0.8), convert = progress.Part(0.8, 1.0);
  echorama::Volume<float> noise;
  if (v.kind == Settings::NoiseKind::Beams) {
    const auto samples = echorama::MakeBeamNoise(beams, fan.geometry, make);
    noise = echorama::Volume<float>(grid.dimensions);
    echorama::ScanConvert<float>(samples.View(), fan.geometry, fan.probeToWorld, grid, noise.View(), valid, convert);
    std::copy_n(samples.Dimensions().begin(), 3, this->MadeCounts);
    this->MadeCorrelation[0] = beams.depthCorrelationMm;
    this->MadeCorrelation[1] = beams.fanCorrelation;
    this->MadeCorrelation[2] = fan.geometry.IsPlane() ? 0.0 : beams.sweepCorrelation;
  } else {
    noise = v.kind == Settings::NoiseKind::White ? echorama::MakeWhiteNoise(lattice, grid.dimensions, make)
                                                 : echorama::MakePerlinNoise(lattice, grid, make);
    // For the shape of the fan alone, which reaches a thousandth of a sample beyond the last.
    const echorama::Volume<unsigned char> samples({beams.samples, beams.elements, fan.geometry.IsPlane() ? 1 : beams.steps});
    echorama::Volume<unsigned char> nothing(grid.dimensions);
    echorama::ScanConvert<unsigned char>(samples.View(), fan.geometry, fan.probeToWorld, grid, nothing.View(), valid, convert);
    for (std::ptrdiff_t i = 0; i < valid.Size(); ++i) {
      noise.View()[i] = valid[i] ? noise.View()[i] : 0.0f;
    }
    std::fill_n(this->MadeCounts, 3, 0);
    std::fill_n(this->MadeCorrelation, 3, 0.0);
  }
  if (this->Values->floatOutput) {
    std::copy(noise.View().begin(), noise.View().end(), vtkUltrasoundVolume::ViewOf<float>(intensity, output).begin());
  } else {
    std::transform(noise.View().begin(), noise.View().end(),
                   vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output).begin(),
                   [](float value) { return static_cast<unsigned char>(std::min(std::max(value, 0.0f), 255.0f) + 0.5f); });
  }
  vtkUltrasoundAcquisition::SetProbeGeometry(output, fan.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, fan.probeToWorld);
  vtkUltrasoundAcquisition::SetSeed(output, v.beams.seed);
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
