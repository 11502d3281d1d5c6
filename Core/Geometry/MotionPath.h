// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/RigidTransform.h"
#include <vector>

namespace echorama {

/// Where something was at a moment.
struct TimedPose {
  double time = 0.0; ///< seconds
  Pose pose = Pose::Identity();
};

/// How a recorded motion is cleaned.
struct MotionSmoothing {
  double sigmaSeconds = 0.1, longestGapSeconds = 0.5;
};
ParameterList Describe(MotionSmoothing& p);

/// A recorded motion, made smooth, that can be asked for any moment: of a tracked probe whose planes are to be imaged where
/// they were.
///
/// Every pose is replaced by the value of a line fitted to its neighbours in time, weighted by a Gaussian (local linear
/// regression): positions in space, rotations in the tangent space at the result. So motion at constant velocity stays as it is,
/// up to its very ends. In the middle of a densely sampled path, a vibration of angular frequency w shrinks by
/// exp(-(w sigma)^2 / 2), and white noise of a sampling interval dt by a factor sqrt(dt / (2 sqrt(pi) sigma)).
/// Between poses, positions go along straight lines and rotations the shortest way. Rotations within one window must differ
/// by less than half a turn. Moments without a pose are left out of the list: where that makes a gap that is not too long, it is
/// bridged.
class MotionPath {
public:
  struct Gap {
    double from = 0.0, to = 0.0; ///< seconds: poses there are, between them none
  };

  /// \a poses in the order of time. Cost: poses times neighbours within four sigma.
  /// \throws Error(InvalidParameter) for the smoothing, Error(BadInput) when there is no pose, times do not rise or are not
  /// finite, or a pose is not rigid; it names the first one, counted from 0. Error(Cancelled).
  explicit MotionPath(std::vector<TimedPose> poses, const MotionSmoothing& smoothing = {}, const Progress& progress = {});

  /// The smoothed poses, at the times that were recorded.
  const std::vector<TimedPose>& Poses() const { return poses_; }
  double FirstTime() const { return poses_.front().time; }
  double LastTime() const { return poses_.back().time; }
  /// Those that are too long to be bridged.
  const std::vector<Gap>& Gaps() const { return gaps_; }

  /// Whether the motion is known at \a time.
  bool Covers(double time) const;

  /// The pose at a moment. \throws Error(NotPossible) that names the moment, before the first pose, after the last, and within a
  /// gap that is too long.
  Pose At(double time) const;

private:
  std::vector<TimedPose> poses_;
  std::vector<Gap> gaps_;
};

} // namespace echorama
