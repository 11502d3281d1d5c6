// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Live/NeedlePath.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double longestAdvanceMm = 1000.0, finestMm = 0.01;

double DegreesBetween(const Vector3d& a, const Vector3d& b)
{
  return std::atan2(a.cross(b).norm(), a.dot(b)) * DegreesPerRadian;
}

} // namespace

NeedleAdvance AdvanceTip(const Vector3d& from, const Vector3d& to, const NeedleObstacle& obstacle, double stepMm)
{
  if (!from.allFinite() || !to.allFinite())
    throw Error(Error::Kind::BadInput, "the way of the needle's tip is not finite");
  CheckRange("the step of the needle, in mm,", stepMm, finestMm, 10.0);
  const double length = (to - from).norm();
  CheckRange("the way of the needle's tip, in mm,", length, 0.0, longestAdvanceMm);
  if (!obstacle || length == 0.0)
    return {length, false};
  const Vector3d direction = (to - from) / length;
  const int steps = std::max(1, static_cast<int>(std::ceil(length / stepMm)));
  bool out = !obstacle(from);
  for (int n = 1; n <= steps; ++n) {
    double free = length * (n - 1) / steps, blocked = length * n / steps;
    if (!obstacle(from + blocked * direction)) {
      out = true;
      continue;
    }
    if (!out)
      continue;
    while (blocked - free > finestMm) {
      const double middle = 0.5 * (free + blocked);
      (obstacle(from + middle * direction) ? blocked : free) = middle;
    }
    return {free, true};
  }
  return out ? NeedleAdvance{length, false} : NeedleAdvance{0.0, true}; // all of the way lies in the obstacle
}

NeedleObstacle BrighterThan(const BeamVolumes& volumes, double grey, const VolumeMix& mix, double overMm)
{
  CheckRange("the size of what stops a needle, in mm,", overMm, 0.1, 20.0);
  // Beams of a small plane, as thick as it is wide.
  constexpr int across = 5;
  const ProbeGeometry cube = ProbeGeometry::Linear(overMm, 0.0, -0.5 * overMm, 0.5 * overMm);
  const BeamThickness thickness{overMm, 1.0, 0.0, across};
  return [&volumes, grey, mix, cube, thickness](const Vector3d& point) {
    Volume<float> value({across, across, 1});
    Volume<unsigned char> content({across, across, 1});
    Pose place = Pose::Identity();
    place.translation() = point;
    volumes.Read({cube, place}, thickness, value.View(), content.View(), mix);
    double sum = 0.0;
    int count = 0;
    for (std::ptrdiff_t n = 0; n < value.View().Size(); ++n)
      if (content.View()[n] != ContentNothing) {
        sum += value.View()[n];
        ++count;
      }
    return count > 0 && sum > grey * count;
  };
}

ParameterList Describe(NeedleScoreRules& r)
{
  return {
      Parameter("RedirectionDegrees", r.redirectionDegrees, {0.1, 90}, "degrees",
                "A turn of the needle by more than this within the body counts as a redirection."),
      Parameter("SettleSeconds", r.settleSeconds, {0, 10}, "s", "A turn goes on until the direction has stayed for this long.")
          .Advanced(),
      Parameter("LongestGapSeconds", r.longestGapSeconds, {0.01, 60}, "s", "Longer pauses are not counted.").Advanced(),
  };
}

NeedleTrack::NeedleTrack(const Vector3d& target, const NeedleScoreRules& rules) : target_(target), rules_(rules)
{
  CheckRanges(rules);
  if (!target.allFinite())
    throw Error(Error::Kind::BadInput, "the target of the needle is not finite");
}

void NeedleTrack::Add(const Moment& moment)
{
  moment.needle.Check();
  if (!std::isfinite(moment.seconds) || (last_ && moment.seconds < last_->seconds))
    throw Error(Error::Kind::BadInput, "the time of the needle is not finite, or goes back");
  const Vector3d& direction = moment.needle.direction;
  const bool wasInside = last_ && last_->inside;
  if (last_ && wasInside) { // what the last moment began
    const double seconds = moment.seconds - last_->seconds;
    if (seconds <= rules_.longestGapSeconds) {
      score_.insideSeconds += seconds;
      score_.offPlaneSeconds += last_->inPlane ? 0.0 : seconds;
    }
  }
  if (moment.inside && !wasInside) {
    ++score_.passes;
    settled_ = direction;
    turning_ = false;
  } else if (moment.inside && !turning_ && DegreesBetween(settled_, direction) > rules_.redirectionDegrees) {
    ++score_.redirections;
    turning_ = true;
    settled_ = direction;
    turnedAt_ = moment.seconds;
  } else if (moment.inside && turning_) {
    // It follows in parts of what counts, so that a tremor does not keep it going.
    if (DegreesBetween(settled_, direction) > 0.25 * rules_.redirectionDegrees) {
      settled_ = direction;
      turnedAt_ = moment.seconds;
    } else if (moment.seconds - turnedAt_ >= rules_.settleSeconds)
      turning_ = false;
  }
  if (moment.stopped && !(last_ && last_->stopped))
    ++score_.stops;
  score_.targetMm = (moment.needle.tip - target_).norm();
  if (moment.inside)
    score_.nearestMm = std::min(score_.nearestMm, score_.targetMm);
  last_ = moment;
}

} // namespace echorama
