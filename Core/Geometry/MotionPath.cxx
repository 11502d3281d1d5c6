// SPDX-License-Identifier: BSD-3-Clause
// A weighted mean of neighbours would pull the ends of a path inwards, and bend paths whose sampling is uneven; a line that is
// fitted does neither. Rotations have no mean by sums: they are taken to the tangent space at a guess (which also settles the
// sign of their quaternions), the line is fitted there, the guess is moved to its value, and so on until it stays. Pieces
// between gaps are smoothed each for itself, so that nothing reaches across a gap that cannot be bridged. Every pose is computed
// from the recorded ones alone: the number of threads does not matter.
#include "Core/Geometry/MotionPath.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

/// The value at 0 of a line fitted to weighted values at offsets in time.
class LocalLine {
public:
  void Add(double weight, double offset, const Vector3d& value)
  {
    s0_ += weight;
    s1_ += weight * offset;
    s2_ += weight * offset * offset;
    b0_ += weight * value;
    b1_ += weight * offset * value;
  }

  Vector3d Value() const
  {
    const double spread = s0_ * s2_ - s1_ * s1_;
    if (!(spread > 1e-12 * s0_ * s2_)) // a single moment
      return b0_ / s0_;
    return (s2_ * b0_ - s1_ * b1_) / spread;
  }

private:
  double s0_ = 0.0, s1_ = 0.0, s2_ = 0.0;
  Vector3d b0_ = Vector3d::Zero(), b1_ = Vector3d::Zero();
};

// The smoothed pose \a index from those in [first, last).
Pose Smoothed(const std::vector<TimedPose>& poses, std::size_t index, std::size_t first, std::size_t last, double sigma)
{
  const double time = poses[index].time;
  const auto weight = [time, sigma](const TimedPose& pose) {
    const double z = (pose.time - time) / sigma;
    return std::exp(-0.5 * z * z);
  };
  Pose result = poses[index].pose;
  LocalLine position;
  for (std::size_t j = first; j < last; ++j)
    position.Add(weight(poses[j]), poses[j].time - time, poses[j].pose.translation());
  result.translation() = position.Value();
  for (int iteration = 0; iteration < 20; ++iteration) {
    LocalLine turn;
    const Eigen::Matrix3d back = result.linear().transpose();
    for (std::size_t j = first; j < last; ++j)
      turn.Add(weight(poses[j]), poses[j].time - time, LogRotation(back * poses[j].pose.linear()));
    const Vector3d step = turn.Value();
    result.linear() = result.linear() * ExpRotation(step);
    if (step.norm() < 1e-12)
      break;
  }
  return result;
}

void CheckPoses(const std::vector<TimedPose>& poses)
{
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::BadInput, "motion path: " + reason); };
  if (poses.empty())
    fail("there is no pose");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = "pose " + std::to_string(i);
    if (!std::isfinite(poses[i].time))
      fail("the time of " + name + " is not finite");
    if (i > 0 && !(poses[i].time > poses[i - 1].time))
      fail(name + " is of " + NumberText(poses[i].time) + " s, and the one before it of " + NumberText(poses[i - 1].time) +
           " s; times must rise");
    const Pose& pose = poses[i].pose;
    if (!pose.matrix().allFinite() || !IsRotation(pose.linear()))
      fail(name + " (at " + NumberText(poses[i].time) + " s) is not a rotation and a translation");
  }
}

} // namespace

ParameterList Describe(MotionSmoothing& p)
{
  return {Parameter("WindowSeconds", p.sigmaSeconds, {0, 60}, "s",
                    "Standard deviation of the window over which poses are averaged. 0: they stay as they are."),
          Parameter("LongestGapSeconds", p.longestGapSeconds, {0, 600, true}, "s",
                    "Poses that lie further apart are not connected: no pose is known between them.")
              .Advanced()};
}

MotionPath::MotionPath(std::vector<TimedPose> poses, const MotionSmoothing& smoothing, const Progress& progress)
  : poses_(std::move(poses))
{
  CheckRanges(smoothing);
  CheckPoses(poses_);
  const std::size_t count = poses_.size();
  std::vector<std::size_t> pieceBegin(count, 0), pieceEnd(count, count);
  for (std::size_t i = 1; i < count; ++i) {
    pieceBegin[i] = pieceBegin[i - 1];
    if (poses_[i].time - poses_[i - 1].time > smoothing.longestGapSeconds) {
      gaps_.push_back({poses_[i - 1].time, poses_[i].time});
      pieceBegin[i] = i;
    }
  }
  for (std::size_t i = count - 1; i-- > 0;)
    pieceEnd[i] = pieceBegin[i + 1] == i + 1 ? i + 1 : pieceEnd[i + 1];
  if (smoothing.sigmaSeconds == 0.0)
    return;
  const std::vector<TimedPose> recorded = poses_;
  const double reach = 4.0 * smoothing.sigmaSeconds;
  const auto before = [](const TimedPose& pose, double time) { return pose.time < time; };
  ParallelRanges(static_cast<std::ptrdiff_t>(count), 256, progress, [&](std::ptrdiff_t from, std::ptrdiff_t to) {
    for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i) {
      const auto begin = recorded.begin() + static_cast<std::ptrdiff_t>(pieceBegin[i]),
                 end = recorded.begin() + static_cast<std::ptrdiff_t>(pieceEnd[i]);
      const auto first = std::lower_bound(begin, end, recorded[i].time - reach, before);
      const auto last = std::lower_bound(begin, end, recorded[i].time + reach, before);
      poses_[i].pose = Smoothed(recorded, i, static_cast<std::size_t>(first - recorded.begin()),
                                static_cast<std::size_t>(last - recorded.begin()), smoothing.sigmaSeconds);
    }
  });
}

bool MotionPath::Covers(double time) const
{
  return time >= FirstTime() && time <= LastTime() &&
         std::none_of(gaps_.begin(), gaps_.end(), [time](const Gap& gap) { return time > gap.from && time < gap.to; });
}

Pose MotionPath::At(double time) const
{
  if (!Covers(time)) {
    std::string reason = "motion path: at " + NumberText(time) + " s nothing is known: ";
    for (const Gap& gap : gaps_)
      if (time > gap.from && time < gap.to)
        throw Error(Error::Kind::NotPossible, reason + "poses are missing from " + NumberText(gap.from) + " to " +
                                                  NumberText(gap.to) + " s, which is too long to be bridged");
    throw Error(Error::Kind::NotPossible,
                reason + "it goes from " + NumberText(FirstTime()) + " to " + NumberText(LastTime()) + " s");
  }
  const auto after = std::upper_bound(poses_.begin(), poses_.end(), time,
                                      [](double moment, const TimedPose& pose) { return moment < pose.time; });
  const TimedPose& from = *std::prev(after);
  if (after == poses_.end() || from.time == time)
    return from.pose;
  return Interpolate(from.pose, after->pose, (time - from.time) / (after->time - from.time));
}

} // namespace echorama
