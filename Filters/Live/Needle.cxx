// SPDX-License-Identifier: BSD-3-Clause
// The needle is walked in steps from its tip. Each step is a short piece; what a beam has of it is a Gaussian pulse where the
// piece is nearest to the beam, weaker by the beam's own Gaussian. Of all pulses at a sample the strongest counts, so that the
// result hardly depends on the steps. Then echoes and shadows are put into the image, as powers. Beams are worked on one by one,
// in parallel, and only those that a blob reaches: what a frame pays is steps in the plane times the samples of a blob.
#include "Filters/Live/Needle.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Live/FanTable.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double longestPieceMm = 0.3;
constexpr double ripple = 0.3; // along the beam, in standard deviations of a pulse: between two steps it dips by 0.1 dB
constexpr double halfWidths = 1.1774100225154747;    // standard deviations to half of a Gaussian's height: sqrt(2 ln 2)
constexpr double blobReach = 3.0;                    // standard deviations
constexpr double faintestDb = -90.0;                 // of white; what is weaker is not drawn
constexpr double dbPerBell = -10.0 / 2.302585092994; // dB of exp(-x^2 / 2) per x^2

double SquaredDb(double x)
{
  return dbPerBell * x * x;
}

// A step of the needle, as the plane sees it.
struct NeedleStep {
  BeamPoint at;
  double levelDb = 0.0;             // of its echo
  double coverDb = 0.0;             // by how much it lies off the plane, <= 0
  double tilt = 0.0;                // from square to the beam, in standard deviations of the mirror
  double across = 0.0, along = 0.0; // of its direction: to the next beams, down the beam
  double front = 0.0, back = 0.0;   // of the piece that it stands for, from here to its ends, mm
};

// A plane of beams and the pulses on them.
struct NeedlePlane {
  NeedlePlane(const NeedleLook& look, const ProbeGeometry& geometry, int beamCount, int sampleCount)
    : probe(geometry), beams(beamCount), samples(sampleCount), closes(ClosesCircle(geometry, beamCount)),
      sampleMm((probe.depthMax - probe.depthMin) / (samples - 1)),
      pulse(std::max(0.5 * look.pulseMm / halfWidths, 0.5 * sampleMm)), width(0.5 * look.widthMm / halfWidths)
  {
  }

  // As BeamPointAt(), and all round also between the last beam and the first.
  std::optional<BeamPoint> At(double x, double z) const
  {
    const auto at = BeamPointAt(probe, {x, 0.0, z});
    if (at || !closes)
      return at;
    const double radius = probe.fanWidth / probe.fanAngle;
    auto opposite = BeamPointAt(probe, {-x, 0.0, -2.0 * radius - z});
    if (opposite)
      opposite->fan += (opposite->fan < 0.0 ? Pi : -Pi) / probe.fanAngle;
    return opposite;
  }
  double BeamMm(double depth) const { return std::max(std::abs(probe.Fan().Span(depth)) / (beams - 1), 1e-6); }
  double WidthAt(double depth) const { return std::max(width, 0.5 * BeamMm(depth)); } // narrower would fall between the beams

  const ProbeGeometry& probe;
  int beams, samples;
  bool closes;
  double sampleMm, pulse, width; // of the blobs: standard deviations, mm
};

// Steps that some of the plane's thickness reaches, the tip first. \a sight is filled in.
std::vector<NeedleStep> StepsOf(const NeedleLook& look, const Needle& needle, const Pose& probeToWorld, const NeedlePlane& plane,
                                const BeamThickness& thickness, NeedleSight& sight)
{
  const Pose toProbe = probeToWorld.inverse();
  const Vector3d tip = toProbe * needle.tip, direction = toProbe.linear() * needle.direction;
  const double mirror = look.mirrorDegrees * RadiansPerDegree;
  sight.tipOffPlaneMm = tip[1];
  std::vector<NeedleStep> steps;
  bool wasSeen = false, wasInFan = false;
  for (double passed = 0.0, step = 0.0; passed <= look.lengthMm; passed += step) {
    // The piece begins in the middle between two steps; at an end of the fan it goes on a little beyond.
    const double front = wasInFan ? 0.5 * step : step;
    step = longestPieceMm;
    const Vector3d point = tip - passed * direction;
    const auto at = plane.At(point[0], point[2]);
    if (!at) {
      if (wasInFan && !steps.empty())
        steps.back().back *= 2.0;
      wasSeen = wasInFan = false;
      continue;
    }
    wasInFan = true;
    const Vector3d beam = DirectionOf(plane.probe, *at);
    const double along = std::clamp(direction.dot(beam), -1.0, 1.0);
    step = std::min(step, ripple * plane.pulse / std::max(std::abs(along), 1e-6));
    // A plane as thin as a razor still cuts the needle, as thick as its pulse.
    const double sigma = std::max(thickness.SigmaMm(at->depth), 0.5 * look.pulseMm / halfWidths);
    step = std::min(step, std::max(0.1, 0.12 * sigma / std::max(std::abs(direction[1]), 1e-6))); // which it may cross
    const double coverDb = SquaredDb(point[1] / sigma);
    const bool isSeen = std::abs(point[1]) <= halfWidths * sigma, isTip = passed == 0.0;
    if (isTip) {
      sight.tipInPlane = isSeen;
      if (isSeen && look.showTip)
        sight.tip = *at;
    }
    if (isSeen && wasSeen)
      sight.seenMm += 2.0 * front; // as it was in the fan before
    wasSeen = isSeen;
    if (look.echoDb + coverDb < faintestDb)
      continue;
    const double square = std::asin(along) / mirror;
    const double mirrored = std::max(SquaredDb(square), look.roughDb - look.echoDb);
    double levelDb = look.echoDb + coverDb + mirrored;
    if (isTip && look.showTip)
      levelDb = std::max(levelDb, look.tipDb + coverDb);
    sight.strongestDb = std::max(sight.strongestDb, levelDb);
    const double across = direction[0] * beam[2] - direction[2] * beam[0];
    steps.push_back({*at, levelDb, coverDb, square, across, along, front, isTip ? 0.0 : 0.5 * step}); // the tip is a point
  }
  return steps;
}

// A step on one of the beams that it reaches.
struct NeedleBlob {
  const NeedleStep* step;
  double depth, asideDb;
};

std::vector<std::vector<NeedleBlob>> BlobsOfBeams(const std::vector<NeedleStep>& steps, const NeedlePlane& plane)
{
  std::vector<std::vector<NeedleBlob>> blobs(static_cast<std::size_t>(plane.beams));
  for (const NeedleStep& step : steps) {
    const double beam = (step.at.fan + 0.5) * (plane.beams - 1), beamMm = plane.BeamMm(step.at.depth);
    const double width = plane.WidthAt(step.at.depth);
    const double reach = std::min(blobReach * width / beamMm, plane.closes ? 0.5 * plane.beams - 1.0 : Unlimited);
    const double last = plane.closes ? beam + reach : std::min(beam + reach, plane.beams - 1.0);
    for (int b = static_cast<int>(std::ceil(plane.closes ? beam - reach : std::max(beam - reach, 0.0))); b <= last; ++b) {
      const int place = plane.closes ? (b + 2 * plane.beams) % plane.beams : b;
      // The place of the piece that is nearest to this beam, up the shaft.
      const double aside = (b - beam) * beamMm;
      const double up = std::abs(step.across) > 1e-6 ? std::clamp(-aside / step.across, -step.front, step.back) : 0.0;
      const double offDb = SquaredDb((aside + up * step.across) / width);
      blobs[static_cast<std::size_t>(place)].push_back({&step, step.at.depth - up * step.along, offDb});
    }
  }
  return blobs;
}

// Draws the needle into beams, one after the other.
class NeedleBrush {
public:
  NeedleBrush(const NeedleLook& look, const MachineControls& controls, const NeedlePlane& plane)
    : look_(look), plane_(plane), range_(static_cast<float>(controls.dynamicRangeDb)),
      faintestDb_(std::max(faintestDb, -controls.dynamicRangeDb - controls.gainDb -
                                           *std::max_element(controls.tgcDb.begin(), controls.tgcDb.end()) - 6.0)),
      gain_(static_cast<std::size_t>(plane.samples))
  {
    const Receiver curve = GainOf(controls, 0.0, plane.samples - 1.0);
    for (int s = 0; s < plane.samples; ++s)
      gain_[static_cast<std::size_t>(s)] = static_cast<float>(curve.GainDbAt(s));
  }

  void Draw(const std::vector<NeedleBlob>& blobs, float* value, const unsigned char* content)
  {
    if (blobs.empty())
      return;
    echo_.assign(gain_.size(), nothingDb);
    cover_.assign(gain_.size(), nothingDb);
    for (const NeedleBlob& blob : blobs)
      Add(blob);
    constexpr float log2PerDb = 0.33219280948873623f; // of a power: log2(10) / 10
    const float dbPerGrey = range_ / 255.0f;
    float coverDb = nothingDb, shadow = 0.0f; // in greys, of what lies above
    for (std::size_t s = 0; s < gain_.size(); ++s) {
      if (!content || content[s] != 0) {
        value[s] = std::max(value[s] - shadow, 0.0f);
        if (echo_[s] > nothingDb) {
          // Black is no level: nothing is known of what is darker.
          const float power = (value[s] > 0.0f ? std::exp2(log2PerDb * (value[s] * dbPerGrey - range_)) : 0.0f) +
                              std::exp2(log2PerDb * (echo_[s] + gain_[s]));
          value[s] = std::clamp(255.0f + std::log2(power) / (log2PerDb * dbPerGrey), 0.0f, 255.0f);
        }
      }
      if (cover_[s] > coverDb) {
        coverDb = cover_[s];
        shadow = static_cast<float>(look_.shadowDb) * std::exp2(0.5f * log2PerDb * coverDb) / dbPerGrey;
      }
    }
  }

private:
  static constexpr float nothingDb = -1000.0f;

  void Add(const NeedleBlob& blob)
  {
    const NeedleStep& step = *blob.step;
    const auto at = static_cast<std::size_t>(std::clamp(std::lround((blob.depth - plane_.probe.depthMin) / plane_.sampleMm), 0L,
                                                        static_cast<long>(plane_.samples) - 1));
    cover_[at] = std::max(cover_[at], static_cast<float>(step.coverDb + blob.asideDb));
    // Each round trip within the needle adds its own tilt.
    for (int ring = 0; ring < 100; ++ring) {
      const double ringDb = step.levelDb + blob.asideDb + ring * look_.reverberationDb + SquaredDb(ring * step.tilt);
      const double depth = blob.depth + ring * look_.reverberationMm;
      if (ringDb < faintestDb_ || depth > plane_.probe.depthMax + blobReach * plane_.pulse)
        break;
      AddPulse(depth, ringDb);
      if (look_.reverberationMm == 0.0)
        break;
    }
  }

  void AddPulse(double depth, double levelDb)
  {
    const double place = (depth - plane_.probe.depthMin) / plane_.sampleMm, reach = blobReach * plane_.pulse / plane_.sampleMm;
    const int first = static_cast<int>(std::max(std::ceil(place - reach), 0.0));
    const int last = static_cast<int>(std::min(std::floor(place + reach), plane_.samples - 1.0));
    const auto level = static_cast<float>(levelDb), middle = static_cast<float>(place);
    const auto curve = static_cast<float>(dbPerBell * plane_.sampleMm * plane_.sampleMm / (plane_.pulse * plane_.pulse));
    float* echo = echo_.data();
    for (int s = first; s <= last; ++s) {
      const float aside = static_cast<float>(s) - middle;
      echo[s] = std::max(echo[s], level + curve * aside * aside);
    }
  }

  const NeedleLook& look_;
  const NeedlePlane& plane_;
  float range_;
  double faintestDb_;                      // what stays black, whatever the gain at its depth
  std::vector<float> gain_, echo_, cover_; // of the samples of a beam, dB
};

} // namespace

Needle Needle::Of(const Pose& toolToWorld)
{
  if (!toolToWorld.matrix().allFinite() || !IsRotation(toolToWorld.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the needle is not rigid and finite");
  return {toolToWorld.translation(), toolToWorld.linear().col(2).normalized()};
}

Pose Needle::ToWorld() const
{
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction).toRotationMatrix();
  pose.translation() = tip;
  return pose;
}

void Needle::Check() const
{
  if (!tip.allFinite() || !direction.allFinite() || std::abs(direction.norm() - 1.0) > 1e-6)
    throw Error(Error::Kind::BadInput, "the needle's tip is not finite, or its direction is no unit vector");
}

ParameterList Describe(NeedleLook& l)
{
  return {
      Parameter("NeedleLengthMm", l.lengthMm, {1, 1000}, "mm", "Length of the needle's shaft."),
      Parameter("NeedleEchoDb", l.echoDb, {-60, 60}, "dB", "Echo of the needle, square to the beam, relative to white."),
      Parameter("NeedleMirrorDegrees", l.mirrorDegrees, {0.1, 90}, "degrees",
                "How far from square to the beam the needle may be until its echo has faded to 61%.")
          .Advanced(),
      Parameter("NeedleRoughDb", l.roughDb, {-90, 60}, "dB", "Echo of the needle at any angle, relative to white.").Advanced(),
      Parameter("NeedleWidthMm", l.widthMm, {0.1, 20}, "mm", "Width of the needle's echo across the beams.").Advanced(),
      Parameter("NeedlePulseMm", l.pulseMm, {0.05, 20}, "mm", "Length of the needle's echo along the beams.").Advanced(),
      Parameter("NeedleReverberationMm", l.reverberationMm, {0, 20}, "mm",
                "Distance between the echoes within the needle that ring below it; 0: it does not ring.")
          .Advanced(),
      Parameter("NeedleReverberationDb", l.reverberationDb, {-60, -1}, "dB", "From one echo within the needle to the next.")
          .Advanced(),
      Parameter("NeedleShadowDb", l.shadowDb, {0, 60}, "dB", "How much darker it is below the needle."),
      Parameter("NeedleShowTip", l.showTip, "Whether the tip echoes at any angle, and is marked."),
      Parameter("NeedleTipDb", l.tipDb, {-60, 60}, "dB", "Echo of the tip, relative to white.").When("NeedleShowTip", "on"),
  };
}

NeedleSight DrawNeedle(const NeedleLook& look, const Needle& needle, const PlacedProbe& probe, const BeamThickness& thickness,
                       const MachineControls& controls, VolumeView<float> value, VolumeView<const unsigned char> content)
{
  CheckRanges(look);
  CheckRanges(thickness);
  CheckRanges(controls);
  needle.Check();
  probe.geometry.Check();
  if (!probe.geometry.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "the probe sweeps; a needle is drawn into a single plane");
  if (!probe.probeToWorld.matrix().allFinite() || !IsRotation(probe.probeToWorld.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the probe is not rigid and finite");
  const std::array<int, 3>& size = value.Dimensions();
  if (size[0] < 2 || size[1] < 2 || size[2] != 1 || (!content.Empty() && content.Dimensions() != size))
    throw Error(Error::Kind::InvalidParameter,
                "a needle is drawn into samples x beams x 1, at least 2 x 2, with as much content");
  const NeedlePlane plane(look, probe.geometry, size[1], size[0]);
  NeedleSight sight;
  const std::vector<NeedleStep> steps = StepsOf(look, needle, probe.probeToWorld, plane, thickness, sight);
  if (steps.empty())
    return sight;
  const std::vector<std::vector<NeedleBlob>> blobs = BlobsOfBeams(steps, plane);
  const NeedleBrush brush(look, controls, plane);
  ParallelRanges(size[1], 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    NeedleBrush own = brush;
    for (auto b = static_cast<int>(begin); b < end; ++b)
      own.Draw(blobs[static_cast<std::size_t>(b)], value.Row(b, 0), content.Empty() ? nullptr : content.Row(b, 0));
  });
  return sight;
}

} // namespace echorama
