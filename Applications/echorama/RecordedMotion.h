// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/MotionPath.h"
#include "Filters/Acoustics/SynthesisScene.h"
#include <string>
#include <vector>

namespace echorama {

/// How a tracked probe was moved, from a recording, in the world of a scene.
class RecordedMotion {
public:
  /// Reads the poses of the transform that the scene names, "ProbeToTracker", out of a sequence file, composed where the file
  /// does not have it itself; frames in which it was not tracked are left out. Scale and shear of a calibration are refused.
  /// \throws Error that names the file.
  RecordedMotion(const std::string& path, const SceneRecording& recording);

  /// Moments of \a count views, evenly from the first pose to the last, each with half of \a sweepSeconds on either side.
  std::vector<double> Times(int count, double sweepSeconds) const;

  /// ProbeToWorld at a moment. \throws Error(NotPossible) that names the file and the moment, in a gap that is too long.
  Pose At(double time) const;

  /// At each of \a steps steps of a sweep that takes \a seconds and has its middle at \a time.
  std::vector<Pose> Around(double time, double seconds, int steps) const;

private:
  std::string path_;
  Pose trackerToWorld_;
  MotionPath motion_;
};

} // namespace echorama
