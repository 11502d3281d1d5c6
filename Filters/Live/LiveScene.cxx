// SPDX-License-Identifier: BSD-3-Clause
// Both models tell the same of contact: the drawn one, without its speckle, costs little beside the acoustic one.
#include "Filters/Live/LiveScene.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double hardKPa = 1e5; // cartilage and calcified walls are softer, bone and plastic stiffer

} // namespace

ParameterList Describe(LiveSceneParameters& p)
{
  ParameterList look = Describe(p.look);
  for (Parameter& parameter : look)
    parameter.When("Source", "scene");
  Find(look, "PressMm")->When("Source", "volumes"); // by states
  return Join({{Parameter("Source", Choice(p.source, {"volumes", "scene", "acoustic"}),
                          "What the image is made of. Volumes: input 0. Scene: tissue of input 1, drawn fast. Acoustic: the same "
                          "by the acoustic model.")},
               look,
               {Parameter("Refinement", p.refinement, {0, ProgressiveSlice::levels - 1}, "",
                          "How good the acoustic image is: 0 a quarter of the beams, 1 half of them, 2 all, 3 reflected sound as "
                          "well. For a probe that moves, take a low one, and raise it while it rests.")
                    .When("Source", "acoustic")}});
}

SynthesisParameters SceneSettings(const LiveImageParameters& p, const Pose& probeToWorld, std::int64_t frame)
{
  SynthesisParameters s;
  s.probe = GeometryOf(p.probe, p.beams);
  s.probeToWorld = probeToWorld;
  s.elements = p.beams;
  s.samples = p.samples;
  s.transducer = TransducerOf(p.probe);
  const MachineControls& c = p.controls;
  s.transducer.frequencyMHz = FrequencyOf(c, s.transducer.frequencyMHz);
  if (p.thickness.focusMm > 0.0)
    s.transducer.lateralFocusMm = s.transducer.elevationFocusMm = std::max(1.0, p.thickness.focusMm);

  Receiver& receiver = s.receiver = GainOf(c, s.probe.depthMin, s.probe.depthMax);
  receiver.tgcDbPerCm = std::min(2.0 * c.attenuation * s.transducer.frequencyMHz, 100.0);
  receiver.dynamicRangeDb = c.dynamicRangeDb;
  // Of the image it is told beside white.
  const double whiteDb = (255.0 - receiver.referenceGrey) * c.dynamicRangeDb / 255.0;
  receiver.noiseDb = c.noiseDb > -200.0 ? std::min(c.noiseDb + whiteDb, 100.0) : Receiver::noNoiseDb;
  receiver.noiseSeed = static_cast<std::uint64_t>(c.seed) + (c.noiseMoves ? static_cast<std::uint64_t>(frame) : 0);
  receiver.noiseSeed &= 0x7FFFFFFFFFFFFFFFu;
  s.seed = static_cast<std::uint64_t>(c.seed);
  return s;
}

SliceThickness SceneThickness(const LiveImageParameters& p)
{
  const BeamThickness thickness = ThicknessOf(p);
  const double waist = thickness.SigmaMm(thickness.focusMm);
  return {waist, waist > 0.0 ? thickness.divergence * waist / thickness.thicknessMm : 0.0, thickness.focusMm};
}

const Material* LiveScene::HardMaterialAt(const Eigen::Vector3d& point) const
{
  const Eigen::Vector3f place = point.cast<float>();
  std::int32_t index = 0;
  scene_.MediumAt(&place, 1, &index);
  const Material& material = scene_.Materials()[static_cast<std::size_t>(index)];
  return material.youngsModulusKPa > hardKPa ? &material : nullptr;
}

NeedleObstacle LiveScene::Hard() const
{
  return [this](const Eigen::Vector3d& point) { return HardMaterialAt(point) != nullptr; };
}

Volume<float> LiveScene::MakeBeams(const SynthesisParameters& settings, const LiveSceneParameters& p, const Progress& progress,
                                   const SliceThickness& thickness, const BeamBend* bend)
{
  CheckRanges(p);
  const bool isAcoustic = p.source == LiveSource::Acoustic;
  SliceLook look = p.look;
  if (isAcoustic)
    look.speckle = look.pressMm = look.gelMm = 0.0; // which it knows nothing of
  std::vector<SliceBeam> beams;
  Volume<float> picture =
      isAcoustic ? tracer_.Trace(settings, look, &beams) : tracer_.Trace(settings, look, &beams, thickness, bend);
  if (isAcoustic) {
    const Volume<unsigned char> greys = slice_.Make(settings, p.refinement, progress);
    std::copy(greys.View().begin(), greys.View().end(), picture.View().begin());
  }
  const auto share = [&beams](auto holds) {
    return static_cast<double>(std::count_if(beams.begin(), beams.end(), holds)) / static_cast<double>(beams.size());
  };
  contactShare_ = share([](const SliceBeam& beam) { return beam.contact; });
  seenShare_ = share([](const SliceBeam& beam) { return std::isfinite(beam.toBodyMm); });
  return picture;
}

} // namespace echorama
