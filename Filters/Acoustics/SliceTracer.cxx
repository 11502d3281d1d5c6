// SPDX-License-Identifier: BSD-3-Clause
// 1. Rays. Each beam is cut into pieces of one medium by the surfaces that it crosses. Over a piece the level falls evenly, so a
//    sample costs an addition; only near the lines of surfaces powers are added. Noise is read along the same beam, at rest
//    depths. Several rays of an element, skew to each other as those of a hyperboloid are, make its thickness: their powers are
//    averaged. Where tissue was pressed a ray is a chain of straight pieces in the scene at rest.
// 2. Speckle. Numbers of neighbouring beams are summed, weighted by the lateral profile of the beam, and scaled to a mean power
// of 1
//    (they are correlated, by the grain of the noise); the logarithm of their size is added to the levels, then all is grey.
//    Some beams beyond both ends of the fan are read as well, so that its edges look like the rest.
//
// Cost: two questions to the scene's tree for each surface, and three rays per ray of an element to find what its face lies in;
// a power per sample and ray where there are several; eight voxels of noise and a logarithm per sample.
#include "SliceTracer.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Interface.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {

using Eigen::Vector3d;

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
constexpr double straightMm = 0.03; // what leaves a straight line by less lies on it

double LevelOf(double amplitude)
{
  return amplitude > 0.0 ? 20.0 * std::log10(amplitude) : -mostLossDb;
}

struct PictureLine {
  double depth, db;
};

// 10^(db / 10) of levels, two to the power of their whole and of their broken part: less than 1e-5 of it off.
void AddPowers(const float* __restrict level, const float* __restrict share, int count, float* __restrict power,
               float* __restrict scattered)
{
  for (int i = 0; i < count; ++i) {
    float x = level[i] * 0.33219281f; // log2(10) / 10
    x = x > -120.0f ? x : -120.0f;
    x = x < 120.0f ? x : 120.0f;
    const int below = static_cast<int>(x + 128.0f) - 128;
    const float t = x - static_cast<float>(below);
    const float part =
        1.0f + t * (0.69314718f + t * (0.24022651f + t * (0.05550411f + t * (0.0096181f + t * (0.0013333f + t * 0.000171f)))));
    std::int32_t bits = (below + 127) << 23;
    float whole;
    std::memcpy(&whole, &bits, sizeof whole);
    power[i] += whole * part;
    scattered[i] += whole * part * share[i];
  }
}

// What a ray of an element goes along: in a scene at rest, a straight line on which depths are warped, or straight pieces.
struct SlicePath {
  struct Knot {
    double depth;  // now
    Vector3d rest; // in the world
  };
  std::vector<Knot> knots;    // two or more; none: a straight line
  Vector3d origin, direction; // now
  BeamPoint beam;
  SkewRay skew;
  double perDepth = 1.0; // mm of way for a mm of depth
  PressWarp warp;
};

const Pose& PlanePose(const SynthesisParameters& p)
{
  return p.stepPoses.empty() ? p.probeToWorld : p.stepPoses.front();
}

// Follows a path from surface to surface.
class SliceWalk {
public:
  SliceWalk(const AcousticScene& scene, const SynthesisParameters& p, const SlicePath& path, const BeamBend* bend,
            double lastDepth)
    : scene_(scene), p_(p), path_(path), bend_(bend)
  {
    if (path.knots.empty()) {
      ray_.origin = path.origin - path.warp.pressMm * path.perDepth * path.direction;
      ray_.direction = path.direction;
      limit_ = (lastDepth + path.warp.pressMm) * path.perDepth;
    } else
      SetPiece();
    ray_.inside = scene.BodiesAt(ray_.origin);
  }

  const BodySet& Inside() const { return ray_.inside; }

  // Between the ray and a surface that it crosses at a depth, as they are now. A normal turns with the transposed derivative of
  // where tissue lay.
  double Cosine(const Crossing& crossing, double depth) const
  {
    if (path_.knots.empty())
      return -ray_.direction.dot(crossing.normal);
    constexpr double step = 0.25; // mm
    const double beside = path_.skew.shiftMm + path_.skew.slope * depth, fan = path_.beam.fan;
    const double span = std::max(std::abs(p_.probe.Fan().Span(depth)), 1e-3);
    const Vector3d deeper = DirectionOf(p_.probe, path_.beam), lateral(deeper.z(), 0.0, -deeper.x());
    const Vector3d normal = PlanePose(p_).linear().transpose() * crossing.normal;
    // What a step along each axis comes to at rest, along the normal.
    const auto along = [&](const Vector3d& axis, double toDepth, double toFan, double toBeside) {
      const auto moveAt = [&](double sign) {
        return bend_->At(depth + sign * toDepth * step, fan + sign * toFan * step / span, beside + sign * toBeside * step);
      };
      return normal.dot(axis + (moveAt(0.5) - moveAt(-0.5)) / step);
    };
    const Vector3d now(along(lateral, 0, 1, 0), along(Vector3d::UnitY(), 0, 0, 1), along(deeper, 1, 0, 0));
    return -(path_.skew.slope * now.y() + now.z()) / (path_.perDepth * std::max(now.norm(), 1e-12));
  }

  // \param depth where on the beam it lies now, not before the face \param wayMm how far it is from the face, at rest
  bool Next(Crossing& crossing, double& depth, double& wayMm)
  {
    for (;;) {
      if (scene_.NextCrossing(ray_, limit_, crossing)) {
        wayMm = wayMm_ + crossing.distance;
        depth = path_.knots.empty() ? path_.warp.PressedDepth(crossing.distance / path_.perDepth - path_.warp.pressMm)
                                    : path_.knots[piece_].depth + crossing.distance / limit_ *
                                                                      (path_.knots[piece_ + 1].depth - path_.knots[piece_].depth);
        depth = std::max(0.0, depth);
        return true;
      }
      if (path_.knots.empty() || piece_ + 2 >= path_.knots.size())
        return false;
      wayMm_ += limit_;
      ++piece_;
      SceneRay next;
      next.inside = ray_.inside;
      ray_ = next;
      SetPiece();
    }
  }

private:
  void SetPiece()
  {
    const Vector3d way = path_.knots[piece_ + 1].rest - path_.knots[piece_].rest;
    ray_.origin = path_.knots[piece_].rest;
    limit_ = way.norm();
    ray_.direction = way / limit_;
  }

  const AcousticScene& scene_;
  const SynthesisParameters& p_;
  const SlicePath& path_;
  const BeamBend* bend_;
  SceneRay ray_;
  std::size_t piece_ = 0;
  double limit_ = 0.0, wayMm_ = 0.0;
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

  // The way of a ray. Of pressed tissue, of which \a line is what \a bend says of the element, also where each sample lay, and
  // nothing else when \a isRestAlone.
  SlicePath PathOf(int element, const SkewRay& skew, const BeamBend* bend, const BeamBend::Line& line,
                   std::vector<Vector3d>* rest = nullptr, bool isRestAlone = false) const
  {
    const RayStart axis = AxisOf(p_, element, 0);
    const Pose& pose = PlanePose(p_);
    const BeamPoint beam = BeamOf(p_, element, 0);
    SlicePath path;
    path.beam = beam;
    path.skew = skew;
    path.perDepth = std::hypot(1.0, skew.slope);
    path.origin = axis.origin + skew.shiftMm * pose.linear().col(1);
    path.direction = (axis.direction + skew.slope * pose.linear().col(1)) / path.perDepth;
    path.warp = {look_.pressMm * std::max(0.0, DirectionOf(p_.probe, beam).z()), look_.pressReachMm};
    if (!bend)
      return path;
    const auto restAt = [&](double depth) -> Vector3d {
      const double beside = skew.shiftMm + skew.slope * depth;
      const Eigen::Vector3f move = line.At(static_cast<float>(depth), static_cast<float>(beside));
      return path.origin + depth * path.perDepth * path.direction + pose.linear() * move.cast<double>();
    };
    if (rest)
      std::transform(depths_.begin(), depths_.end(), rest->begin(), restAt);
    if (isRestAlone)
      return path;
    // From one knot as far as the nodes between lie on the straight line.
    const double first = std::max(0.0, depths_.front()), last = depths_.back();
    std::vector<SlicePath::Knot> nodes;
    for (int i = 0; i < bend->Depths(); ++i) {
      const double depth = first + (last - first) * i / (bend->Depths() - 1);
      nodes.push_back({depth, restAt(depth)});
    }
    path.knots.push_back(nodes.front());
    for (std::size_t from = 0, to = 2; to <= nodes.size(); ++to) {
      const auto isStraight = [&] {
        for (std::size_t i = from + 1; i < to; ++i) {
          const double part = (nodes[i].depth - nodes[from].depth) / (nodes[to].depth - nodes[from].depth);
          if ((nodes[from].rest + part * (nodes[to].rest - nodes[from].rest) - nodes[i].rest).norm() > straightMm)
            return false;
        }
        return true;
      };
      if (to == nodes.size() || !isStraight()) {
        path.knots.push_back(nodes[to - 1]);
        from = to - 1;
      }
    }
    // What has no length has no direction.
    path.knots.erase(std::unique(path.knots.begin(), path.knots.end(),
                                 [](const auto& a, const auto& b) { return (a.rest - b.rest).norm() < 1e-6; }),
                     path.knots.end());
    if (path.knots.size() < 2)
      path.knots.clear();
    path.warp.pressMm = 0.0;
    return path;
  }

  // Levels in dB, and which share of the power of each sample is that of speckle.
  void Paint(const SlicePath& path, const BeamBend* bend, float* level, float* share, SliceBeam& about) const
  {
    SliceWalk walk(scene_, p_, path, bend, depths_.back());
    if (walk.Inside().Count() > 0)
      about.toBodyMm = 0.0;

    std::fill_n(share, depths_.size(), 1.0f);
    std::fill_n(level, depths_.size(), silentDb);
    thread_local std::vector<PictureLine> lines;
    lines.clear();
    int medium = scene_.MediumOf(walk.Inside());
    std::size_t sample = static_cast<std::size_t>(std::lower_bound(depths_.begin(), depths_.end(), -1e-9) -
                                                  depths_.begin()); // nothing is seen before the face
    double loss = 0.0, from = 0.0;
    Crossing crossing;
    double at = 0.0, wayMm = 0.0; // of the crossing: its depth, and how far it is at rest
    bool meets = walk.Next(crossing, at, wayMm);
    const auto note = [&] {
      if (meets && about.toBodyMm > 0.0)
        about.toBodyMm = std::min(about.toBodyMm, at);
    };
    note();
    if (Of(medium).isGas) {
      if (meets && wayMm <= look_.gelMm && !Of(crossing.after).isGas && crossing.sheet < 0) {
        medium = crossing.after; // filled with gel
        meets = walk.Next(crossing, at, wayMm);
      } else {
        about.contact = false;
        loss = mostLossDb;
        for (int i = 0; look_.reverberationDb > 0.0 && i < 40; ++i)
          lines.push_back({i * reverberationMm, look_.reverberationDb - i * reverberationFallDb});
      }
    }

    for (;;) {
      const double to = meets ? at : depths_.back() + step_;
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
      const double cosIncidence = walk.Cosine(crossing, at);
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
      meets = loss < mostLossDb && walk.Next(crossing, at, wayMm);
      note();
    }
    for (const PictureLine& line : lines)
      Draw(line, level, share);
  }

  // Adds the rays but for the first, which has been painted, and makes levels and shares those of all.
  void PaintBeside(int element, const std::vector<SkewRay>& rays, const BeamBend* bend, const BeamBend::Line& line,
                   std::vector<float>& powers, float* level, float* share) const
  {
    const std::size_t n = depths_.size();
    const auto count = static_cast<int>(n);
    float *const power = powers.data(), *const scattered = power + n;
    std::fill(powers.begin(), powers.end(), 0.0f);
    AddPowers(level, share, count, power, scattered);
    SliceBeam unused;
    for (std::size_t ray = 1; ray < rays.size(); ++ray) {
      Paint(PathOf(element, rays[ray], bend, line), bend, level, share, unused);
      AddPowers(level, share, count, power, scattered);
    }
    const float each = 1.0f / static_cast<float>(rays.size());
    for (std::size_t i = 0; i < n; ++i) {
      level[i] = power[i] > 1e-30f ? 4.3429448f * std::log(power[i] * each) : silentDb;
      share[i] = power[i] > 1e-30f ? scattered[i] / power[i] : 1.0f;
    }
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
      Parameter(
          "PressMm", l.pressMm, {0, 100}, "mm",
          "How deep the probe is pressed into the body: a drawn scene is warped along the beams; with pressed states volumes and "
          "drawn scenes are as those say."),
      Parameter("PressReachMm", l.pressReachMm, {1, 1000}, "mm",
                "Over which depth tissue gives way to 1/e as far as at the face.")
          .Advanced(),
      Parameter(
          "GelMm", l.gelMm, {0, 100}, "mm",
          "Gaps of air between face and body up to this are taken as filled with gel. Beams with wider ones have no contact.")
          .Advanced(),
      Parameter(
          "SceneRays", l.rays, {1, 65}, "",
          "Rays of each element, spread over the thickness of the plane: the time of a frame rises with them. 1: a plane as "
          "thin as a razor; else an odd number of at least 5.")
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

std::vector<SkewRay> RaysOf(const SliceThickness& thickness, int count)
{
  if (count != 1 && (count < 5 || count % 2 == 0))
    throw Error(Error::Kind::InvalidParameter, "SceneRays is " + std::to_string(count) + "; it must be 1, or odd and at least 5");
  std::vector<SkewRay> rays(1);
  if (!(thickness.waistMm > 0.0))
    return rays;
  // distance(depth) = waist p + spread (depth - focus) q, with pairs of points (p, q) on a circle whose mean squares are 1. The
  // circle is turned so that of five rays no two are equally far away, at the focus and far from it.
  const int pairs = (count - 1) / 2;
  const double radius = pairs > 0 ? std::sqrt(static_cast<double>(count) / pairs) : 0.0;
  for (int pair = 0; pair < pairs; ++pair) {
    const double angle = (2.0 * std::atan(0.5) + pair * Pi) / pairs;
    for (const double side : {1.0, -1.0}) {
      const double p = side * radius * std::cos(angle), q = side * radius * std::sin(angle);
      rays.push_back({thickness.waistMm * p - thickness.spread * thickness.focusMm * q, thickness.spread * q});
    }
  }
  return rays;
}

// How the beams beside one count, sample by sample.
void SliceTracer::MakeLateral(const SynthesisParameters& p, const std::vector<double>& depths)
{
  const Transducer& t = p.transducer;
  const std::vector<double> key{t.frequencyMHz,
                                t.bandwidth,
                                t.lateralApertureMm,
                                t.lateralFocusMm,
                                t.elevationApertureMm,
                                t.elevationFocusMm,
                                t.assumedSoundSpeed,
                                t.smallestFNumber,
                                t.dynamicReceive ? 1.0 : 0.0,
                                p.probe.fanAngle,
                                p.probe.fanWidth,
                                depths.front(),
                                depths.back(),
                                static_cast<double>(depths.size()),
                                static_cast<double>(p.elements),
                                texture_->GrainMm()};
  if (key == weightsKey_)
    return;
  weightsKey_ = key;
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

Volume<float> SliceTracer::Trace(const SynthesisParameters& p, const SliceLook& look, std::vector<SliceBeam>* beams,
                                 const SliceThickness& thickness, const BeamBend* bend)
{
  p.Check();
  CheckRanges(look);
  const std::vector<SkewRay> rays = RaysOf(thickness, look.rays);
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
    std::vector<Vector3d> restPoints(bend ? n : 0);
    std::vector<float> powers(rays.size() > 1 ? 2 * n : 0);
    BeamBend::Line line;
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const int element = static_cast<int>(row) - margin;
      const bool isInFan = element >= 0 && element < p.elements;
      if (bend)
        line = bend->Along(BeamOf(p, element, 0).fan);
      const SlicePath path = painter.PathOf(element, rays[0], bend, line, bend ? &restPoints : nullptr, !isInFan);
      if (isInFan) {
        float* const level = picture.View().Row(element, 0);
        float* const scattered = share.View().Row(element, 0);
        SliceBeam& own = about[static_cast<std::size_t>(element)];
        painter.Paint(path, bend, level, scattered, own);
        if (rays.size() > 1)
          painter.PaintBeside(element, rays, bend, line, powers, level, scattered);
      }
      if (!speckled)
        continue;
      std::complex<float>* const numbers = noise.data() + static_cast<std::size_t>(row) * n;
      if (bend) {
        texture_->At(restPoints, numbers);
        continue;
      }
      std::transform(depths.begin(), depths.end(), rest.begin(), [&path](double depth) { return path.warp.RestDepth(depth); });
      texture_->Along(path.origin, path.direction, rest, numbers);
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
