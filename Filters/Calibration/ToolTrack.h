// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/MotionPath.h"
#include "Readers/PoseLog.h"
#include <string>
#include <vector>

namespace echorama {

/// The recorded poses of one tool, without those that are not valid.
struct ToolTrack {
  std::string source;           ///< the recording, for messages: its file, or "the track"
  std::string name;             ///< "ProbeToTracker"
  std::string from, to;         ///< its frames of coordinates
  std::vector<TimedPose> poses; ///< in the order of the recording; times are NaN when it has none
  std::vector<std::string> notes;

  bool IsTimed() const;
  /// The motion for any moment; poses that repeat a time are left out. \throws as MotionPath, with the source before it
  MotionPath Path(const MotionSmoothing& smoothing, const Progress& progress = {}) const;
  /// How many poses Path() leaves out.
  std::size_t Repeats() const;
};

/// The poses of \a tool out of a recording. One that the recording does not hold itself is composed, at each moment, from those
/// it holds: StylusToReference from StylusToTracker and ReferenceToTracker. Empty: the only one there is.
/// \throws Error(InvalidParameter) when none is named and there are several, Error(BadInput) when there is no such tool, or it
/// was never seen; both name the file and the tools
ToolTrack ToolTrackOf(const PoseLog& recording, const std::string& tool);

} // namespace echorama
