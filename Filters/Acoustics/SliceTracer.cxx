// SPDX-License-Identifier: BSD-3-Clause
// 1. Rays. Each beam is cut into pieces of one medium by the surfaces that it crosses. Over a piece the level falls evenly, so a
//    sample costs an addition; only near the lines of surfaces powers are added. Noise is read along the same beam, at rest
//    depths.
// 2. Speckle. Numbers of neighbouring beams are summed, weighted by the lateral profile of the beam, and scaled to a mean power
// of 1
//    (they are correlated, by the grain of the noise); the logarithm of their size is added to the levels, then all is grey.
//    Some beams beyond both ends of the fan are read as well, so that its edges look like the rest.
//
// Cost: two questions to the scene's tree for each surface, and three rays per element to find what its face lies in; eight
// voxels of noise and a logarithm per sample.
#include "SliceTracer.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Interface.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr float silentDb = -1000.0f;         // of what gives no echo
constexpr double mostLossDb = 500.0;         // nothing is seen behind more
constexpr double meanSpeckleDb = -2.5068155; // mean of 10 log10 of the power of speckle whose mean power is 1
constexpr std::ptrdiff_t beamsAtOnce = 4;
constexpr double reachOfLine = 3.0;     // standard deviations
constexpr double reachAcross = 2.5;     // standard deviations of the beam's width
constexpr int mostReach = 16;           // beams
constexpr double reverberationMm = 1.6; // between the echoes of the face, and how much each is weaker than the one before
constexpr double reverberationFallDb = 6.0;

double LevelOf(double amplitude)
{
  return amplitude > 0.0 ? 20.0 * std::log10(amplitude) : -mostLossDb;
}

struct PictureLine {
  double depth, db;
};

// Draws one beam after the other: what all of them share.
class BeamPainter {
public:
  BeamPainter(const AcousticScene& scene, const SynthesisParameters& p, const SliceLook& look, const std::vector<double>& depths)
    : scene_(scene), p_(p), look_(look), depths_(depths), step_(depths[1] - depths[0]),
      lineSigma_(std::max(p.transducer.PulseSigmaMm(), step_)) // or lines would come and go between samples
  {
    for (const Material& material : scene.Materials()) {
      Medium medium;
      medium.fluid = {material.Impedance(), material.soundSpeed};
      if (material.scattererDensity > 0.0 && material.backscatterDb > Material::clearDb)
        medium.db = static_cast<float>(material.backscatterDb);
      medium.lossDbPerMm = look.attenuation ? 2.0 * material.AttenuationDbPerMm(p.transducer.frequencyMHz) : 0.0;
      medium.roughness = material.roughness;
      medium.isGas = material.IsGas();
      media_.push_back(medium);
    }
  }

  // Levels in dB, and which share of the power of each sample is that of speckle.
  void Paint(int element, float* level, float* share, SliceBeam& about) const
  {
    const RayStart axis = AxisOf(p_, element, 0);
    const double cosine = DirectionOf(p_.probe, BeamOf(p_, element, 0)).z();
    const PressWarp warp{look_.pressMm * std::max(0.0, cosine), look_.pressReachMm};
    SceneRay ray;
    ray.origin = axis.origin - warp.pressMm * axis.direction;
    ray.direction = axis.direction;
    ray.inside = scene_.BodiesAt(ray.origin);
    if (ray.inside.Count() > 0)
      about.toBodyMm = 0.0;

    std::fill_n(share, depths_.size(), 1.0f);
    std::fill_n(level, depths_.size(), silentDb);
    thread_local std::vector<PictureLine> lines;
    lines.clear();
    int medium = scene_.MediumOf(ray.inside);
    std::size_t sample = static_cast<std::size_t>(std::lower_bound(depths_.begin(), depths_.end(), -1e-9) -
                                                  depths_.begin()); // nothing is seen before the face
    double loss = 0.0, from = 0.0;
    const double limit = depths_.back() + warp.pressMm;
    Crossing crossing;
    bool meets = scene_.NextCrossing(ray, limit, crossing);
    const auto note = [&] {
      if (meets && about.toBodyMm > 0.0)
        about.toBodyMm = std::min(about.toBodyMm, Depth(warp, crossing.distance));
    };
    note();
    if (Of(medium).isGas) {
      if (meets && crossing.distance <= look_.gelMm && !Of(crossing.after).isGas && crossing.sheet < 0) {
        medium = crossing.after; // filled with gel
        meets = scene_.NextCrossing(ray, limit, crossing);
      } else {
        about.contact = false;
        loss = mostLossDb;
        for (int i = 0; look_.reverberationDb > 0.0 && i < 40; ++i)
          lines.push_back({i * reverberationMm, look_.reverberationDb - i * reverberationFallDb});
      }
    }

    for (;;) {
      const double to = meets ? Depth(warp, crossing.distance) : depths_.back() + step_;
      const Medium& here = Of(medium);
      for (; sample < depths_.size() && depths_[sample] < to; ++sample)
        if (here.db > silentDb)
          level[sample] = here.db - static_cast<float>(loss + here.lossDbPerMm * (depths_[sample] - from));
      loss += here.lossDbPerMm * (to - from);
      from = to;
      if (!meets || loss >= mostLossDb)
        break;
      ++about.surfaces;
      const Medium& behind = Of(crossing.sheet >= 0 ? crossing.sheet : crossing.after);
      // As sound meets it that is not bent.
      const double cosIncidence = -ray.direction.dot(crossing.normal);
      const InterfaceResponse response = MeetInterface(here.fluid, {behind.fluid.impedance, here.fluid.soundSpeed}, cosIncidence);
      if (look_.surfaceLines && response.reflected != 0.0) {
        const double turned = TurnedBack(cosIncidence, std::max(here.roughness, behind.roughness),
                                         p_.transport.acceptanceDegrees * RadiansPerDegree);
        lines.push_back({to, p_.mirrorDb + LevelOf(std::abs(response.reflected) * turned) - loss});
      }
      if (look_.surfaceLosses)
        loss -= LevelOf(response.transmittedEnergy);
      loss += look_.darkeningDb;
      if (crossing.sheet < 0)
        medium = crossing.after;
      meets = loss < mostLossDb && scene_.NextCrossing(ray, limit, crossing);
      note();
    }
    for (const PictureLine& line : lines)
      Draw(line, level, share);
  }

private:
  struct Medium {
    Fluid fluid;
    float db = silentDb;
    double lossDbPerMm = 0.0; // there and back
    double roughness = 0.0;
    bool isGas = false;
  };
  const Medium& Of(int material) const { return media_[static_cast<std::size_t>(material)]; }

  // Where on the beam it lies now, not before the face.
  static double Depth(const PressWarp& warp, double distance)
  {
    return std::max(0.0, warp.PressedDepth(distance - warp.pressMm));
  }

  void Draw(const PictureLine& line, float* level, float* share) const
  {
    const double place = (line.depth - depths_[0]) / step_, reach = reachOfLine * lineSigma_ / step_;
    const double last = static_cast<double>(depths_.size()) - 1.0;
    for (auto i = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil(place - reach)));
         static_cast<double>(i) <= std::min(last, place + reach); ++i) {
      const double away = (static_cast<double>(i) - place) * step_ / lineSigma_;
      const double added = std::pow(10.0, 0.1 * (line.db - 4.342944819032518 * away * away)), // of powers
          scattered = std::pow(10.0, 0.1 * static_cast<double>(level[i])), all = scattered + added;
      if (!(all > 0.0))
        continue;
      share[i] *= static_cast<float>(scattered / all);
      level[i] = static_cast<float>(10.0 * std::log10(all));
    }
  }

  const AcousticScene& scene_;
  const SynthesisParameters& p_;
  const SliceLook& look_;
  const std::vector<double>& depths_;
  double step_, lineSigma_;
  std::vector<Medium> media_;
};

} // namespace

ParameterList Describe(SliceLook& l)
{
  return {
      Parameter("DarkeningDb", l.darkeningDb, {0, 100}, "dB",
                "How much darker everything behind a surface is: shadows by the number of surfaces that were crossed."),
      Parameter("TissueAttenuation", l.attenuation, "Whether tissue attenuates by its material and the frequency.").Advanced(),
      Parameter("SurfaceLosses", l.surfaceLosses,
                "Whether a surface takes from what is behind it by its step of impedance, too: shadows of bone and air.")
          .Advanced(),
      Parameter("SurfaceLines", l.surfaceLines, "Whether surfaces are lines, by their step of impedance and the angle.")
          .Advanced(),
      Parameter("Speckle", l.speckle, {0, 2}, "",
                "How much of the noise is blended in: 0 shows the bare materials, 1 speckle as strong as it is really."),
      Parameter("PressMm", l.pressMm, {0, 100}, "mm",
                "How deep the probe is pressed into the body: the picture is warped along the beams."),
      Parameter("PressReachMm", l.pressReachMm, {1, 1000}, "mm",
                "Over which depth tissue gives way to 1/e as far as at the face.")
          .Advanced(),
      Parameter(
          "GelMm", l.gelMm, {0, 100}, "mm",
          "Gaps of air between face and body up to this are taken as filled with gel. Beams with wider ones have no contact.")
          .Advanced(),
      Parameter("ReverberationDb", l.reverberationDb, {0, 100}, "dB",
                "Level of the echo of the face itself where it has no contact, beside the reference tissue; 0: none.")
          .Advanced(),
  };
}

double PressWarp::RestDepth(double depth) const
{
  return pressMm > 0.0 ? depth - pressMm * std::exp(-std::max(0.0, depth) / reachMm) : depth;
}

double PressWarp::PressedDepth(double restDepth) const
{
  if (!(pressMm > 0.0))
    return restDepth;
  if (!(restDepth > -pressMm))
    return restDepth + pressMm;
  // RestDepth rises and is bent downwards from the face on, so that Newton's method comes from below and cannot miss.
  double depth = std::max(0.0, restDepth);
  for (int i = 0; i < 200; ++i) {
    const double given = pressMm * std::exp(-depth / reachMm);
    const double change = (restDepth - depth + given) / (1.0 + given / reachMm);
    depth += change;
    if (std::abs(change) < 1e-9)
      break;
  }
  return depth;
}

// How the beams beside one count, sample by sample.
void SliceTracer::MakeLateral(const SynthesisParameters& p, const std::vector<double>& depths)
{
  std::vector<double> sigmas, pitches;
  reach_ = 0;
  for (const double depth : depths) {
    sigmas.push_back(WidthAt(p.transducer, depth).lateralSigma);
    pitches.push_back(std::max(std::abs(p.probe.Fan().Span(depth)) / (p.elements - 1), 1e-3));
    const double beams = std::ceil(reachAcross * sigmas.back() / pitches.back());
    reach_ = std::max(reach_, static_cast<int>(std::min(beams, static_cast<double>(mostReach))));
  }
  const auto taps = static_cast<std::size_t>(2 * reach_ + 1), n = depths.size();
  weights_.assign(taps * n, 0.0f);
  std::vector<double> weights(taps);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < taps; ++k) {
      const double away = (static_cast<double>(k) - reach_) * pitches[i] / sigmas[i];
      weights[k] = std::abs(away) <= reachAcross ? std::exp(-0.5 * away * away) : 0.0;
    }
    double power = 0.0;
    for (std::size_t apart = 0; apart < taps; ++apart) {
      const double away = static_cast<double>(apart) * pitches[i] / texture_->GrainMm();
      const double correlation = std::exp(-0.25 * away * away);
      if (correlation < 1e-6)
        break;
      for (std::size_t k = 0; k + apart < taps; ++k)
        power += (apart == 0 ? 1.0 : 2.0) * correlation * weights[k] * weights[k + apart];
    }
    for (std::size_t k = 0; k < taps; ++k)
      weights_[k * n + i] = static_cast<float>(weights[k] / std::sqrt(power));
  }
}

Volume<float> SliceTracer::Trace(const SynthesisParameters& p, const SliceLook& look, std::vector<SliceBeam>* beams)
{
  p.Check();
  CheckRanges(look);
  if (!p.probe.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "the probe sweeps; one plane is traced at a time (SliceOf makes its settings)");
  std::vector<double> depths(static_cast<std::size_t>(p.samples));
  for (int i = 0; i < p.samples; ++i)
    depths[static_cast<std::size_t>(i)] = p.probe.depthMin + (p.probe.depthMax - p.probe.depthMin) * i / (p.samples - 1);

  const bool speckled = look.speckle > 0.0;
  if (speckled) {
    // No finer than what the samples can show.
    const double grain = std::clamp(std::max(p.transducer.PulseSigmaMm(), 0.6 * (depths[1] - depths[0])), 0.001, 100.0);
    if (!texture_ || texture_->GrainMm() != grain || textureSeed_ != p.seed) {
      texture_.emplace(p.seed, grain);
      textureSeed_ = p.seed;
    }
    MakeLateral(p, depths);
  }

  const auto n = static_cast<std::size_t>(p.samples);
  const int margin = speckled ? reach_ : 0;
  std::vector<SliceBeam> about(static_cast<std::size_t>(p.elements));
  Volume<float> picture({p.samples, p.elements, 1}), share({p.samples, p.elements, 1});
  std::vector<std::complex<float>> noise(speckled ? n * static_cast<std::size_t>(p.elements + 2 * margin) : 0);
  const BeamPainter painter(scene_, p, look, depths);
  ParallelRanges(p.elements + 2 * margin, beamsAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<double> rest(n);
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const int element = static_cast<int>(row) - margin;
      if (element >= 0 && element < p.elements)
        painter.Paint(element, picture.View().Row(element, 0), share.View().Row(element, 0),
                      about[static_cast<std::size_t>(element)]);
      if (!speckled)
        continue;
      const RayStart axis = AxisOf(p, element, 0);
      const double cosine = DirectionOf(p.probe, BeamOf(p, element, 0)).z();
      const PressWarp warp{look.pressMm * std::max(0.0, cosine), look.pressReachMm};
      std::transform(depths.begin(), depths.end(), rest.begin(), [&warp](double depth) { return warp.RestDepth(depth); });
      texture_->Along(axis.origin, axis.direction, rest, noise.data() + static_cast<std::size_t>(row) * n);
    }
  });

  const double greyPerDb = 255.0 / p.receiver.dynamicRangeDb;
  std::vector<float> gain(n);
  std::transform(depths.begin(), depths.end(), gain.begin(),
                 [&](double depth) { return static_cast<float>(p.receiver.GainDbAt(depth)); });
  ParallelRanges(p.elements, beamsAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<std::complex<float>> sum(n);
    for (std::ptrdiff_t element = begin; element < end; ++element) {
      float* const level = picture.View().Row(static_cast<int>(element), 0);
      const float* const scattered = share.View().Row(static_cast<int>(element), 0);
      if (speckled) {
        std::fill(sum.begin(), sum.end(), 0.0f);
        for (std::size_t k = 0; k < static_cast<std::size_t>(2 * reach_ + 1); ++k) {
          const std::complex<float>* const from = noise.data() + (static_cast<std::size_t>(element) + k) * n;
          const float* const weight = weights_.data() + k * n;
          for (std::size_t i = 0; i < n; ++i)
            sum[i] += weight[i] * from[i];
        }
        for (std::size_t i = 0; i < n; ++i) {
          const float speckleDb = 4.3429448f * std::log(std::max(std::norm(sum[i]), 1e-12f)) - static_cast<float>(meanSpeckleDb);
          level[i] += static_cast<float>(look.speckle) * scattered[i] * speckleDb;
        }
      }
      for (std::size_t i = 0; i < n; ++i)
        level[i] = std::clamp(static_cast<float>(p.receiver.referenceGrey) + static_cast<float>(greyPerDb) * (level[i] + gain[i]),
                              0.0f, 255.0f);
    }
  });
  if (beams)
    *beams = std::move(about);
  return picture;
}

} // namespace echorama
