// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/LiveTransforms.h"
#include <limits>
#include <string>
#include <vector>

namespace echorama {

/// A tool, as a moment shows it.
struct ShownTool {
  std::string name;  ///< of its transform, "ProbeToTracker"
  std::string frame; ///< of coordinates, "Probe"
  TransformStatus status = TransformStatus::Missing;
  double time = std::numeric_limits<double>::quiet_NaN();
  Eigen::Affine3d toWorld = Eigen::Affine3d::Identity(); ///< identity when it is missing
};

/// The tools of a stream at a time, as LiveTransforms::Find, in their order; one for each frame of coordinates, and none for
/// names that are no transforms. A tool whose frame is the world itself lies there, with the status of its transform.
std::vector<ShownTool> ShowTools(const std::vector<std::string>& tools, const LiveTransforms& transforms,
                                 const std::string& world, double time);

} // namespace echorama
