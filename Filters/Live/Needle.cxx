// SPDX-License-Identifier: BSD-3-Clause
// The needle is walked in small steps from its tip. Each step is a blob of a Gaussian pulse and a Gaussian beam; of all blobs at
// a sample the strongest counts, so that the result does not depend on the steps. Then echoes and shadows are put into the image,
// as powers. Cost: steps in the plane times the samples of a blob, below a millisecond for a whole needle in the plane.
#include "Filters/Live/Needle.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double needleStepMm = 0.1;
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
  double levelDb = 0.0; // of its echo
  double coverDb = 0.0; // by how much it lies off the plane, <= 0
  double tilt = 0.0;    // from square to the beam, in standard deviations of the mirror
};

// Steps that some of the plane's thickness reaches, the tip first. \a sight is filled in.
std::vector<NeedleStep> StepsOf(const NeedleLook& look, const Needle& needle, const PlacedProbe& probe,
                                const BeamThickness& thickness, NeedleSight& sight)
{
  CheckRanges(look);
  CheckRanges(thickness);
  needle.Check();
  probe.geometry.Check();
  if (!probe.geometry.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "the probe sweeps; a needle is drawn into a single plane");
  if (!probe.probeToWorld.matrix().allFinite() || !IsRotation(probe.probeToWorld.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the probe is not rigid and finite");
  const Pose toProbe = probe.probeToWorld.inverse();
  const Vector3d tip = toProbe * needle.tip, direction = toProbe.linear() * needle.direction;
  const double mirror = look.mirrorDegrees * RadiansPerDegree;
  sight.tipOffPlaneMm = tip[1];
  std::vector<NeedleStep> steps;
  const int count = static_cast<int>(look.lengthMm / needleStepMm);
  for (int n = 0; n <= count; ++n) {
    const Vector3d point = tip - n * needleStepMm * direction;
    const auto at = BeamPointAt(probe.geometry, {point[0], 0.0, point[2]});
    if (!at)
      continue;
    // A plane as thin as a razor still cuts the needle, as thick as its pulse.
    const double sigma = std::max(thickness.SigmaMm(at->depth), 0.5 * look.pulseMm / halfWidths);
    const double coverDb = SquaredDb(point[1] / sigma);
    if (n == 0) {
      sight.tipInPlane = std::abs(point[1]) <= halfWidths * sigma;
      if (sight.tipInPlane && look.showTip)
        sight.tip = *at;
    }
    if (std::abs(point[1]) <= halfWidths * sigma)
      sight.seenMm += needleStepMm;
    if (look.echoDb + coverDb < faintestDb)
      continue;
    const double square = std::asin(std::clamp(direction.dot(DirectionOf(probe.geometry, *at)), -1.0, 1.0)) / mirror;
    const double mirrored = std::max(SquaredDb(square), look.roughDb - look.echoDb);
    double levelDb = look.echoDb + coverDb + mirrored;
    if (n == 0 && look.showTip)
      levelDb = std::max(levelDb, look.tipDb + coverDb);
    sight.strongestDb = std::max(sight.strongestDb, levelDb);
    steps.push_back({*at, levelDb, coverDb, square});
  }
  return steps;
}

// Echoes and covers of all samples, in dB; the strongest counts.
class NeedlePlane {
public:
  NeedlePlane(const NeedleLook& look, const MachineControls& controls, const ProbeGeometry& probe,
              const std::array<int, 3>& dimensions)
    : probe_(probe), samples_(dimensions[0]), beams_(dimensions[1]),
      sampleMm_((probe.depthMax - probe.depthMin) / (dimensions[0] - 1)),
      pulse_(std::max(0.5 * look.pulseMm / halfWidths, 0.5 * sampleMm_)), width_(0.5 * look.widthMm / halfWidths),
      faintestDb_(std::max(faintestDb, -controls.dynamicRangeDb - controls.gainDb -
                                           *std::max_element(controls.tgcDb.begin(), controls.tgcDb.end()) - 6.0)),
      echo_(dimensions, static_cast<float>(faintestDb)), cover_(dimensions, static_cast<float>(faintestDb))
  {
  }

  void Add(const NeedleLook& look, const NeedleStep& step)
  {
    const double beam = (step.at.fan + 0.5) * (beams_ - 1);
    const double beamMm = std::max(std::abs(probe_.Fan().Span(step.at.depth)) / (beams_ - 1), 1e-6);
    const double width = std::max(width_, 0.5 * beamMm); // narrower blobs would fall between the beams
    const double reach = blobReach * width / beamMm;
    const int first = static_cast<int>(std::ceil(std::max(beam - reach, 0.0)));
    const int last = static_cast<int>(std::floor(std::min(beam + reach, beams_ - 1.0)));
    for (int b = first; b <= last; ++b) {
      const double asideDb = SquaredDb((b - beam) * beamMm / width);
      float& cover = cover_.View()(SampleAt(step.at.depth), b, 0);
      cover = std::max(cover, static_cast<float>(step.coverDb + asideDb));
      // Each round trip within the needle adds its own tilt.
      for (int ring = 0; ring < 100; ++ring) {
        const double ringDb = step.levelDb + asideDb + ring * look.reverberationDb + SquaredDb(ring * step.tilt);
        const double depth = step.at.depth + ring * look.reverberationMm;
        if (ringDb < faintestDb_ || depth > probe_.depthMax + blobReach * pulse_)
          break;
        AddPulse(echo_.View().Row(b, 0), depth, ringDb);
        if (look.reverberationMm == 0.0)
          break;
      }
    }
  }

  // Into greys.
  void PutInto(const NeedleLook& look, const MachineControls& controls, VolumeView<float> value,
               VolumeView<const unsigned char> content) const
  {
    const double range = controls.dynamicRangeDb;
    for (int b = 0; b < beams_; ++b) {
      float coverDb = static_cast<float>(faintestDb);
      double shadowDb = 0.0; // of what lies above
      for (int s = 0; s < samples_; ++s) {
        const double echo = echo_.View()(s, b, 0);
        if (content.Empty() || content(s, b, 0) != 0) {
          float& grey = value(s, b, 0);
          const double tissue = std::max(grey - 255.0 * shadowDb / range, 0.0);
          if (echo <= faintestDb_) {
            grey = static_cast<float>(tissue);
          } else {
            // Black is no level: nothing is known of what is darker.
            const double power = (tissue > 0.0 ? std::pow(10.0, 0.1 * (tissue / 255.0 - 1.0) * range) : 0.0) +
                                 std::pow(10.0, 0.1 * (echo + GainDbAt(controls, s / (samples_ - 1.0))));
            grey = static_cast<float>(255.0 * std::clamp(1.0 + 10.0 * std::log10(power) / range, 0.0, 1.0));
          }
        }
        if (const float cover = cover_.View()(s, b, 0); cover > coverDb) {
          coverDb = cover;
          shadowDb = look.shadowDb * std::pow(10.0, 0.05 * cover);
        }
      }
    }
  }

private:
  int SampleAt(double depth) const
  {
    return std::clamp(static_cast<int>(std::lround((depth - probe_.depthMin) / sampleMm_)), 0, samples_ - 1);
  }

  void AddPulse(float* beam, double depth, double levelDb)
  {
    const double place = (depth - probe_.depthMin) / sampleMm_, reach = blobReach * pulse_ / sampleMm_;
    const int first = static_cast<int>(std::max(std::ceil(place - reach), 0.0));
    const int last = static_cast<int>(std::min(std::floor(place + reach), samples_ - 1.0));
    const auto level = static_cast<float>(levelDb), middle = static_cast<float>(place);
    const auto curve = static_cast<float>(dbPerBell * sampleMm_ * sampleMm_ / (pulse_ * pulse_));
    for (int s = first; s <= last; ++s) {
      const float aside = static_cast<float>(s) - middle;
      beam[s] = std::max(beam[s], level + curve * aside * aside);
    }
  }

  const ProbeGeometry& probe_;
  int samples_, beams_;
  double sampleMm_, pulse_, width_; // of the blobs: standard deviations, mm
  double faintestDb_;               // what stays black, whatever the gain at its depth
  Volume<float> echo_, cover_;
};

} // namespace

Needle Needle::Of(const Pose& toolToWorld)
{
  if (!toolToWorld.matrix().allFinite() || !IsRotation(toolToWorld.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the needle is not rigid and finite");
  return {toolToWorld.translation(), toolToWorld.linear().col(2).normalized()};
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

NeedleSight SeeNeedle(const NeedleLook& look, const Needle& needle, const PlacedProbe& probe, const BeamThickness& thickness)
{
  NeedleSight sight;
  StepsOf(look, needle, probe, thickness, sight);
  return sight;
}

NeedleSight DrawNeedle(const NeedleLook& look, const Needle& needle, const PlacedProbe& probe, const BeamThickness& thickness,
                       const MachineControls& controls, VolumeView<float> value, VolumeView<const unsigned char> content)
{
  NeedleSight sight;
  const std::vector<NeedleStep> steps = StepsOf(look, needle, probe, thickness, sight);
  CheckRanges(controls);
  const std::array<int, 3>& size = value.Dimensions();
  if (size[0] < 2 || size[1] < 2 || size[2] != 1 || (!content.Empty() && content.Dimensions() != size))
    throw Error(Error::Kind::InvalidParameter,
                "a needle is drawn into samples x beams x 1, at least 2 x 2, with as much content");
  if (steps.empty())
    return sight;
  NeedlePlane plane(look, controls, probe.geometry, size);
  for (const NeedleStep& step : steps)
    plane.Add(look, step);
  plane.PutInto(look, controls, value, content);
  return sight;
}

} // namespace echorama
