// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundNoiseSource.h"

#include "Core/Base/Angles.h"
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

//----------------------------------------------------------------------------
vtkUltrasoundNoiseSource::vtkUltrasoundNoiseSource()
{
  this->SetNumberOfInputPorts(2);
  const echorama::BeamNoiseParameters beams;
  this->Mean = beams.mean;
  this->DynamicRangeDb = beams.dynamicRangeDb;
  this->Seed = static_cast<vtkTypeInt64>(beams.seed);
  this->DepthCorrelationMm = beams.depthCorrelationMm;
  this->FanCorrelation = beams.fanCorrelation;
  this->SweepCorrelation = beams.sweepCorrelation;
  this->WindowMm = echorama::NoiseMatchParameters().windowMm;
  const echorama::LatticeNoiseParameters lattice;
  this->Deviation = lattice.deviation;
  this->CellMm = lattice.cellMm;
  this->Octaves = lattice.octaves;
}

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
  echorama::PlacedProbe fan;
  fan.geometry.fanAngle = this->FanAngle / echorama::DegreesPerRadian;
  fan.geometry.fanWidth = this->FanWidth;
  fan.geometry.sweepAngle = this->SweepAngle / echorama::DegreesPerRadian;
  fan.geometry.sweepWidth = this->SweepWidth;
  fan.geometry.depthMin = this->DepthMin;
  fan.geometry.depthMax = this->DepthMax;
  fan.probeToWorld.linear() =
      echorama::ExpRotation(Eigen::Map<const Eigen::Vector3d>(this->Orientation) / echorama::DegreesPerRadian);
  fan.probeToWorld.translation() = Eigen::Map<const Eigen::Vector3d>(this->Position);
  return fan;
}

//----------------------------------------------------------------------------
echorama::ImageGeometry vtkUltrasoundNoiseSource::GridFor(vtkInformationVector** inputs, const echorama::PlacedProbe& fan)
{
  if (this->OnInputGrid) {
    for (const int port : {0, 1}) {
      if (const auto input = this->InputAt(inputs, port)) {
        return vtkUltrasoundVolume::GeometryOf(input->Image);
      }
    }
    throw Error(Error::Kind::InvalidParameter, "OnInputGrid is on, but there is no input whose grid could be taken");
  }
  return echorama::ScanConversionGrid(fan.geometry, fan.probeToWorld, this->SpacingMm,
                                      static_cast<std::size_t>(this->MaximumVoxels));
}

//----------------------------------------------------------------------------
echorama::BeamNoiseParameters vtkUltrasoundNoiseSource::BeamParameters(const echorama::ProbeGeometry& geometry) const
{
  echorama::BeamNoiseParameters parameters;
  parameters.intensity =
      this->IntensityModel == RAYLEIGH ? echorama::NoiseIntensity::Rayleigh : echorama::NoiseIntensity::LogCompressed;
  parameters.mean = this->Mean;
  parameters.dynamicRangeDb = this->DynamicRangeDb;
  parameters.depthCorrelationMm = this->DepthCorrelationMm;
  parameters.fanCorrelation = this->FanCorrelation;
  parameters.sweepCorrelation = this->SweepCorrelation;
  return echorama::ResolvingCounts(parameters, geometry);
}

//----------------------------------------------------------------------------
int vtkUltrasoundNoiseSource::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Field data and valid regions do not travel with the information of the pipeline.
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port) {
    int producerPort = 0;
    if (vtkAlgorithm* producer = this->GetInputAlgorithm(port, 0, producerPort)) {
      producer->Update(producerPort);
    }
  }
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, this->GridFor(inputs, this->FanFor(inputs)));
    vtkDataObject::SetPointDataActiveScalarInfo(out, this->FloatOutput ? VTK_FLOAT : VTK_UNSIGNED_CHAR, 1);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseSource::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const echorama::PlacedProbe fan = this->FanFor(inputs);
  const echorama::ImageGeometry grid = this->GridFor(inputs, fan);
  const auto seed = static_cast<std::uint64_t>(this->Seed);

  // What it shall be like.
  echorama::BeamNoiseParameters beams = this->BeamParameters(fan.geometry);
  echorama::LatticeNoiseParameters lattice;
  lattice.mean = this->Mean;
  lattice.deviation = this->Deviation;
  std::fill_n(this->MatchResolved, 3, 0);
  const auto matched = this->InputAt(inputs, 1);
  if (matched) {
    const echorama::PlacedProbe probe = vtkUltrasoundProbeFit::ProbeOf(*matched);
    echorama::NoiseMatchParameters how;
    how.windowMm = this->WindowMm;
    vtkUltrasoundVolume::Dispatch(matched->Intensity, [&](auto type) {
      using T = decltype(type);
      const auto match = echorama::MatchNoise<T>(vtkUltrasoundVolume::PosedVolumeOf<T>(*matched), probe.geometry,
                                                 probe.probeToWorld, how, progress.Part(0.0, 0.5));
      beams = echorama::NoiseLike(match, probe.geometry, fan.geometry);
      lattice.mean = match.mean;
      lattice.deviation = match.deviation;
      std::copy(match.lengths.resolved.begin(), match.lengths.resolved.end(), this->MatchResolved);
    });
  }
  beams.seed = lattice.seed = seed;
  for (const auto& [wanted, count] : {std::pair{this->Samples, &beams.samples}, std::pair{this->Elements, &beams.elements},
                                      std::pair{this->Steps, &beams.steps}}) {
    *count = wanted > 0 ? wanted : *count;
  }
  lattice.cellMm = this->CellMm;
  lattice.octaves = this->Octaves;

  vtkUltrasoundVolume::SetGeometry(output, grid);
  vtkDataArray* intensity =
      AddArray(output, vtkUltrasoundVolume::IntensityName(), this->FloatOutput ? VTK_FLOAT : VTK_UNSIGNED_CHAR);
  vtkDataArray* validRegion = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  const auto valid = vtkUltrasoundVolume::ViewOf<unsigned char>(validRegion, output);

  const echorama::Progress make = progress.Part(matched ? 0.5 : 0.0, 0.8), convert = progress.Part(0.8, 1.0);
  echorama::Volume<float> noise;
  if (this->Kind == BEAMS) {
    const auto samples = echorama::MakeBeamNoise(beams, fan.geometry, make);
    noise = echorama::Volume<float>(grid.dimensions);
    echorama::ScanConvert<float>(samples.View(), fan.geometry, fan.probeToWorld, grid, noise.View(), valid, convert);
    std::copy_n(samples.Dimensions().begin(), 3, this->MadeCounts);
    this->MadeCorrelation[0] = beams.depthCorrelationMm;
    this->MadeCorrelation[1] = beams.fanCorrelation;
    this->MadeCorrelation[2] = fan.geometry.IsPlane() ? 0.0 : beams.sweepCorrelation;
  } else {
    noise = this->Kind == WHITE ? echorama::MakeWhiteNoise(lattice, grid.dimensions, make)
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
  if (this->FloatOutput) {
    std::copy(noise.View().begin(), noise.View().end(), vtkUltrasoundVolume::ViewOf<float>(intensity, output).begin());
  } else {
    std::transform(noise.View().begin(), noise.View().end(),
                   vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output).begin(),
                   [](float value) { return static_cast<unsigned char>(std::min(std::max(value, 0.0f), 255.0f) + 0.5f); });
  }
  vtkUltrasoundAcquisition::SetProbeGeometry(output, fan.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, fan.probeToWorld);
  vtkUltrasoundAcquisition::SetSeed(output, seed);
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Kind: " << (this->Kind == BEAMS ? "beams" : this->Kind == WHITE ? "white" : "Perlin") << "\n";
  os << indent << "IntensityModel: " << (this->IntensityModel == RAYLEIGH ? "Rayleigh" : "log-compressed") << "\n";
  os << indent << "Mean: " << this->Mean << "\n";
  os << indent << "DynamicRangeDb: " << this->DynamicRangeDb << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "Counts: " << this->Samples << " x " << this->Elements << " x " << this->Steps << "\n";
  os << indent << "Correlation: " << this->DepthCorrelationMm << " mm, " << this->FanCorrelation << " fans, "
     << this->SweepCorrelation << " sweeps\n";
  os << indent << "WindowMm: " << this->WindowMm << "\n";
  os << indent << "Deviation: " << this->Deviation << "\n";
  os << indent << "CellMm: " << this->CellMm << "\n";
  os << indent << "Octaves: " << this->Octaves << "\n";
  os << indent << "SpacingMm: " << this->SpacingMm << "\n";
  os << indent << "OnInputGrid: " << (this->OnInputGrid ? "on" : "off") << "\n";
  os << indent << "FloatOutput: " << (this->FloatOutput ? "on" : "off") << "\n";
  os << indent << "MaximumVoxels: " << this->MaximumVoxels << "\n";
  os << indent << "Fan: " << this->FanAngle << " degrees, " << this->FanWidth << " mm\n";
  os << indent << "Sweep: " << this->SweepAngle << " degrees, " << this->SweepWidth << " mm\n";
  os << indent << "Depth: " << this->DepthMin << " to " << this->DepthMax << "\n";
  os << indent << "Position: " << this->Position[0] << " " << this->Position[1] << " " << this->Position[2] << "\n";
  os << indent << "Orientation: " << this->Orientation[0] << " " << this->Orientation[1] << " " << this->Orientation[2] << "\n";
}
