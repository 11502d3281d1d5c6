// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/MotionPath.h"
#include "SynthesisScene.h"
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// How a probe is moved through the world of a scene: recorded by a tracker, or stated by keys.
class ScenePath {
public:
  /// Reads the poses of the transform that the scene names, "ProbeToTracker", out of a sequence file, composed where the file
  /// does not have it itself; frames in which it was not tracked are left out. Scale and shear of a calibration are refused.
  /// \throws Error that names the file.
  ScenePath(const std::string& path, const SceneRecording& recording);
  /// \throws Error(BadInput)
  explicit ScenePath(const SceneMotion& motion);

  /// That of a scene's views; none when they stand side by side or are listed.
  static std::optional<ScenePath> Of(const SynthesisScene& scene);

  double FirstTime() const { return motion_.FirstTime(); }

  /// Moments of the views: those that are asked for, or evenly from the first pose to the last; each with half of
  /// \a sweepSeconds on either side. \throws Error(NotPossible) where the path does not go so far
  std::vector<double> Times(const ScenePathViews& views, double sweepSeconds) const;

  /// ProbeToWorld at a moment. \throws Error(NotPossible) that names file and moment, in a gap that is too long.
  Pose At(double time) const;

private:
  std::string name_;
  Pose pathToWorld_ = Pose::Identity();
  MotionPath motion_;
};

} // namespace echorama
