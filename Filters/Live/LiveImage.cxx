// SPDX-License-Identifier: BSD-3-Clause
// Beams are read, developed into greys and scan-converted. Noise is made once for the geometry and lies on the beams, so that it
// stays with the probe; when it moves, each frame sees it from another beam and depth on, which a seed and the frame's number
// choose.
#include "Filters/Live/LiveImage.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/BeamNoise.h"
#include <algorithm>
#include <cmath>

namespace echorama {

ParameterList Describe(LiveImageParameters& p)
{
  return Join(
      {Describe(p.probe),
       Describe(p.controls),
       Describe(p.mix),
       {Parameter("ThicknessMm", p.thickness.thicknessMm, {-1, 100}, "mm",
                  "How thick the plane is that is seen, at the focus: full width at half of its sensitivity. 0: a slice as "
                  "thin as a razor; -1: that of the probe."),
        Parameter(
            "FocusMm", p.thickness.focusMm, {0, 1000}, "mm",
            "Depth of the focus, about which the plane is thinnest; nearer than 1 mm counts as 1 mm. 0: as usual for the probe."),
        Parameter("Divergence", p.thickness.divergence, {-1, 10}, "mm/mm",
                  "How much thicker the plane becomes with the distance from the focus. -1: as that of the probe.")
            .Advanced()},
       Without(Describe(p.thickness), {"ThicknessMm", "FocusMm", "Divergence"}),
       {Parameter("Beams", p.beams, {2, 4096}, "", "Beams of the plane.").Advanced(),
        Parameter("Samples", p.samples, {2, 16384}, "", "Samples along a beam.").Advanced(),
        Parameter("Width", p.width, {16, 8192}, "pixels", "Width of the image."),
        Parameter("Height", p.height, {16, 8192}, "pixels", "Height of the image."),
        Parameter("Flip", p.flip,
                  "Whether left and right are exchanged: the first pixel of a row then lies towards +x of the probe.")}});
}

BeamThickness ThicknessOf(const LiveImageParameters& p)
{
  const double focus = std::max(1.0, p.thickness.focusMm > 0.0 ? p.thickness.focusMm : FocusOf(p.probe));
  const BeamThickness usual = ThicknessOf(p.probe, focus);
  BeamThickness thickness = p.thickness;
  const bool isUsual = thickness.thicknessMm < 0.0;
  thickness.focusMm = isUsual ? usual.focusMm : focus;
  if (isUsual)
    thickness.thicknessMm = usual.thicknessMm;
  if (thickness.divergence < 0.0)
    thickness.divergence = usual.divergence;
  return thickness;
}

void LiveImage::Set(const LiveImageParameters& p)
{
  CheckRanges(p);
  geometry_ = GeometryOf(p.probe, p.beams);
  thickness_ = ThicknessOf(p);
  const FanImage image{geometry_, p.beams, p.samples, p.width, p.height, p.flip};
  if (!table_ || !(table_->Image() == image))
    table_.emplace(image);
  const auto key = std::make_tuple(p.controls, geometry_.depthMin, geometry_.depthMax, p.samples);
  if (!development_ || !(developmentKey_ == key)) {
    development_.emplace(p.controls, geometry_.depthMin, geometry_.depthMax, p.samples);
    developmentKey_ = key;
  }
  parameters_ = p;
  const std::array<int, 3> plane{p.samples, p.beams, 1};
  if (value_.Dimensions() != plane) {
    value_ = Volume<float>(plane);
    content_ = Volume<unsigned char>(plane);
  }
  MakeNoise();
}

void LiveImage::MakeNoise()
{
  const MachineControls& c = parameters_.controls;
  if (c.noiseDb <= -200.0)
    return;
  const auto key = std::make_tuple(geometry_, parameters_.beams, parameters_.samples, c.seed, c.noiseGrainMm);
  if (noiseKey_ == key)
    return;
  BeamNoiseParameters noise;
  noise.samples = parameters_.samples;
  noise.elements = parameters_.beams;
  noise.intensity = NoiseIntensity::Rayleigh;
  noise.mean = 1.0;
  noise.depthCorrelationMm = std::min(c.noiseGrainMm, 0.25 * (geometry_.depthMax - geometry_.depthMin));
  noise.fanCorrelation = 0.0; // each beam has its own
  noise.seed = static_cast<std::uint64_t>(c.seed);
  noise_ = MakeBeamNoise(noise, geometry_);
  const float meanPower = 1.2732395447f; // of an envelope whose mean is 1: 4 / pi
  for (float& sample : noise_.View())
    sample = 10.0f * std::log10(std::max(sample * sample / meanPower, 1e-6f));
  noiseKey_ = key;
}

void LiveImage::MakeBeams(const BeamVolumes& volumes, const Pose& probeToWorld, std::int64_t frame, const BeamBend* bend)
{
  volumes.Read({geometry_, probeToWorld}, thickness_, value_.View(), content_.View(), parameters_.mix, bend);
  const MachineControls& c = parameters_.controls;
  const bool hasNoise = c.noiseDb > -200.0;
  std::ptrdiff_t beamShift = 0, depthShift = 0;
  const std::ptrdiff_t samples = parameters_.samples;
  if (hasNoise && c.noiseMoves) {
    Random random(static_cast<std::uint64_t>(c.seed), static_cast<std::uint64_t>(frame));
    beamShift = static_cast<std::ptrdiff_t>(random.Below(static_cast<std::uint64_t>(parameters_.beams)));
    depthShift = static_cast<std::ptrdiff_t>(random.Below(static_cast<std::uint64_t>(samples)));
  }
  const auto real = ParallelSum<std::ptrdiff_t>(parameters_.beams, 8, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> shifted;
    std::ptrdiff_t count = 0;
    for (std::ptrdiff_t beam = begin; beam < end; ++beam) {
      const float* noise = nullptr;
      if (hasNoise) {
        noise = noise_.View().Row(static_cast<int>((beam + beamShift) % parameters_.beams), 0);
        if (depthShift > 0) {
          shifted.assign(noise + depthShift, noise + samples);
          shifted.insert(shifted.end(), noise, noise + depthShift);
          noise = shifted.data();
        }
      }
      const unsigned char* content = content_.View().Row(static_cast<int>(beam), 0);
      development_->Apply(noise, content, value_.View().Row(static_cast<int>(beam), 0));
      count += samples - std::count(content, content + samples, static_cast<unsigned char>(ContentNothing));
    }
    return count;
  });
  realShare_ = static_cast<double>(real) / static_cast<double>(value_.View().Size());
}

void LiveImage::SetBeams(const Volume<float>& value)
{
  if (value.Dimensions() != value_.Dimensions())
    throw Error(Error::Kind::BadInput, "live image: the beams have not as many samples and beams as the image");
  value_ = value;
  std::fill(content_.View().begin(), content_.View().end(), static_cast<unsigned char>(ContentData));
  realShare_ = 1.0;
}

NeedleSight LiveImage::DrawNeedle(const NeedleLook& look, const Needle& needle, const Pose& probeToWorld)
{
  return echorama::DrawNeedle(look, needle, {geometry_, probeToWorld}, thickness_, parameters_.controls, value_.View(),
                              content_.View());
}

void LiveImage::MakePixels(VolumeView<unsigned char> intensity, VolumeView<unsigned char> valid,
                           VolumeView<unsigned char> label) const
{
  table_->Convert(value_.View(), content_.View(), intensity, valid, label);
}

} // namespace echorama
