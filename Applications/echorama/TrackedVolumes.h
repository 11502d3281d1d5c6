// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/TrackerPlacement.h"
#include "Volumes.h"
#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace echorama {

/// What a subcommand is told of the recording of a tracker.
struct TrackerOptions {
  std::string log, tool;
  PoseLogOptions reading;
  TrackerPlacementParameters matching; ///< how volumes and poses belong together

  /// Adds --tracker, --tool, --at, --unit and --window.
  void AddTo(CLI::App& options, bool required);
};

/// Reads the recording and tells its notes. Throws as ToolTrackOf.
ToolTrack ReadTool(Session&, const std::string& log, const std::string& tool, const PoseLogOptions& reading);

/// The volumes as placement takes them. Throws when --at does not give a time for each.
std::vector<TrackedVolume> TrackedVolumesOf(const TrackerOptions&, const std::vector<LoadedVolume>&);

} // namespace echorama
