// SPDX-License-Identifier: BSD-3-Clause
#include "SeenTissue.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "WideBeams.h"
#include <algorithm>
#include <array>
#include <limits>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr std::ptrdiff_t tracedPerRange = 8;
constexpr double toleranceMm = 1e-6;
constexpr double leastWeight = 1e-6; // a beam that counts less does not tell whether sound gets to a point
constexpr int maxIterations = 100;

} // namespace

SeenTissue::SeenTissue(const AcousticScene& scene, const SynthesisParameters& p, const Progress& progress)
  : probe_(p.probe), probeToWorld_(p.probeToWorld), transducer_(p.transducer), elements_(p.elements),
    steps_(p.BeamDimensions()[2])
{
  p.Check();
  if (p.mode != SynthesisParameters::Mode::Coherent)
    throw Error(Error::Kind::InvalidParameter, "Mode is counting; where tissue is seen is known of coherent echoes alone");
  SoundTransport direct = p.transport;
  direct.maxBounces = 0;
  const SoundTracer tracer(scene, direct, ConditionsOf(p));
  std::optional<WideBeams> wide;
  if (p.wideBeams)
    wide.emplace(TraceWideBeams(scene, p, progress.Part(0.0, 0.9)));
  const Pose worldToProbe = probeToWorld_.inverse();
  beams_.resize(static_cast<std::size_t>(elements_) * static_cast<std::size_t>(steps_));
  ParallelRanges(static_cast<std::ptrdiff_t>(beams_.size()), tracedPerRange, progress.Part(wide ? 0.9 : 0.0, 1.0),
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   SoundPath path;
                   for (std::ptrdiff_t i = begin; i < end; ++i) {
                     const int element = static_cast<int>(i % elements_), step = static_cast<int>(i / elements_);
                     if (wide) {
                       path.segments = wide->HeardWay(i);
                     } else {
                       RayStart axis = AxisOf(p, element, step);
                       axis.inside = scene.BodiesAt(axis.origin);
                       tracer.Trace(axis, path);
                     }
                     Beam& beam = beams_[static_cast<std::size_t>(i)];
                     BeamPoint shown = BeamOf(p, element, step);
                     beam.fan = shown.fan;
                     beam.sweep = shown.sweep;
                     const auto add = [&](double scanDepth, const Vector3d& place) {
                       shown.depth = scanDepth;
                       beam.nodes.push_back({scanDepth, worldToProbe * place - PointOf(probe_, shown)});
                     };
                     for (const SoundSegment& segment : path.segments)
                       add(segment.scanDepth, segment.from);
                     if (!path.segments.empty()) {
                       const SoundSegment& last = path.segments.back();
                       add(last.scanDepth + last.length * last.scanDepthPerMm, last.from + last.length * last.direction);
                     }
                   }
                 });
}

SeenTissue::Displacement SeenTissue::At(const BeamPoint& at) const
{
  const double fan = (at.fan + 0.5) * (elements_ - 1), sweep = (at.sweep + 0.5) * (steps_ - 1);
  const int left = std::clamp(static_cast<int>(fan), 0, elements_ - 2),
            before = std::clamp(static_cast<int>(sweep), 0, std::max(steps_ - 2, 0));
  struct Neighbour {
    Vector3d shown, displacement;
  };
  std::array<Neighbour, 4> reaching;
  std::size_t count = 0;
  Vector3d ofAll = Vector3d::Zero(), ofReaching = Vector3d::Zero();
  double weights = 0.0;
  for (const int step : {before, before + 1})
    for (const int element : {left, left + 1}) {
      const double weight = (1.0 - std::abs(fan - element)) * (1.0 - std::abs(sweep - step));
      if (!(weight > leastWeight))
        continue;
      const Beam& beam =
          beams_[static_cast<std::size_t>(step) * static_cast<std::size_t>(elements_) + static_cast<std::size_t>(element)];
      if (beam.nodes.empty())
        continue;
      const double depth = std::clamp(at.depth, beam.nodes.front().scanDepth, beam.nodes.back().scanDepth);
      const auto next = std::find_if(beam.nodes.begin() + 1, beam.nodes.end() - 1,
                                     [depth](const Node& node) { return node.scanDepth >= depth; });
      const Node& from = *(next - 1);
      const double length = next->scanDepth - from.scanDepth, share = length > 0.0 ? (depth - from.scanDepth) / length : 0.0;
      const Vector3d displacement = from.displacement + share * (next->displacement - from.displacement);
      ofAll += weight * displacement;
      if (std::abs(at.depth - depth) > toleranceMm)
        continue;
      ofReaching += weight * displacement;
      weights += weight;
      reaching[count++] = {PointOf(probe_, {at.depth, beam.fan, beam.sweep}), displacement};
    }
  if (count == 0)
    return {ofAll, false};
  // Between beams that are bent apart by more than they are wide, what is shown is dark, or something else.
  const BeamWidth width = WidthAt(transducer_, at.depth);
  const double blur = std::max(width.lateralSigma, width.elevationSigma);
  bool isWhole = true;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double bent = (reaching[i].displacement - reaching[j].displacement).norm();
      isWhole = isWhole && bent <= std::max(blur, (reaching[i].shown - reaching[j].shown).norm());
    }
  return {ofReaching / weights, isWhole};
}

std::optional<Vector3d> SeenTissue::Seen(const Vector3d& point) const
{
  const Vector3d tissue = probeToWorld_.inverse() * point;
  Vector3d seen = tissue;
  double part = 1.0, last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < maxIterations; ++i) {
    // On its way the iteration may leave the fan; it goes on from the edge.
    auto at = BeamPointAt(probe_, seen);
    if (!at)
      at = BeamPointAt(probe_, seen, std::numeric_limits<double>::infinity());
    if (!at)
      return {};
    const Vector3d shown = PointOf(probe_, *at);
    const Displacement displacement = At(*at);
    const Vector3d missing = tissue - shown - displacement.vector;
    const double distance = missing.norm();
    if (distance <= toleranceMm)
      return displacement.isSeen ? std::optional(probeToWorld_ * shown) : std::nullopt;
    if (!(distance < last))
      part *= 0.5;
    last = distance;
    seen = shown + part * missing;
  }
  return {};
}

} // namespace echorama
