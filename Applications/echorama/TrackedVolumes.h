// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ToolPose.h"
#include "Volumes.h"
#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace echorama {

/// What a subcommand is told of the recording of a tracker.
struct TrackerOptions {
  std::string log, tool;
  std::vector<double> times; ///< when each volume was made, on the recording's clock
  double unitMm = 0.0;       ///< 0: as the file says
  double windowSeconds = 0.2;

  /// Adds --tracker, --tool, --at, --unit and --window.
  void AddTo(CLI::App& options, bool required);
};

/// The recorded poses of the tool, without those that are not valid.
struct TrackedTool {
  std::string name;     ///< "ProbeToTracker"
  std::string from, to; ///< its frames
  std::vector<ToolPose> poses;
};

/// Reads the recording. Without \a tool it must know just one tool. One that it does not hold itself is composed, at each moment,
/// from those it holds: StylusToReference from StylusToTracker and ReferenceToTracker. Throws Error that names file and tools.
TrackedTool ReadTool(Session&, const std::string& log, const std::string& tool, double unitMm);

/// Where the sensor was when each volume was made: at the times that were given, else at the volumes' time stamps, else the
/// recording's poses one by one, when it has as many. Poses are means over the window. Throws Error that says what is missing.
std::vector<Pose> SensorPoses(Session&, const TrackerOptions&, const TrackedTool&, const std::vector<LoadedVolume>&);

/// The frame that is fixed to the probe, in the space of each volume's file: the probe's own when all volumes know it
/// (ProbeToWorld), else that of the files as they stand.
struct VolumeFrames {
  bool ofProbe = false;
  std::vector<Pose> toFile; ///< one per volume

  const char* Name() const { return ofProbe ? "probe" : "file"; }
  /// \param frame "probe", "file", or empty: probe where all volumes know it. Throws Error when a volume does not.
  static VolumeFrames Of(Session&, const std::vector<LoadedVolume>&, const std::string& frame = "");
};

} // namespace echorama
