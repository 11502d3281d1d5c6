// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include "Core/Geometry/TransformGraph.h"
#include <limits>
#include <string>

namespace echorama {

/// What a tracker said of one tool at one moment.
struct ToolPose {
  /// The transform that it is, by the rule of FramesOf: "ProbeToTracker". A sender's plain name, "Probe", is made one by
  /// ToolTransformName.
  std::string name;
  /// When it was measured: seconds on the sender's clock. NaN: the sender does not say, and the arrival stands for it.
  double time = std::numeric_limits<double>::quiet_NaN();
  /// When it came: seconds on our clock (Clock.h). NaN: the stream fills it in.
  double arrival = std::numeric_limits<double>::quiet_NaN();
  Pose pose = Pose::Identity(); ///< mm; of no meaning when the status is Missing
  TransformStatus status = TransformStatus::Valid;
};

/// "ProbeToTracker" as it stands; "Probe", which names no two frames, becomes "ProbeToTracker". Always a name that FramesOf
/// takes: blanks, signs other than "." and "-", control characters and bytes that are no UTF-8 become "_", and "AToBToC", which
/// could be cut in two places, becomes "ATOBTOCToTracker".
std::string ToolTransformName(const std::string& name);

/// The rigid pose nearest to \a matrix, when it is one to within what single precision and a device's rounding explain: finite,
/// last row 0 0 0 1, a rotation to 1e-3 per entry. Otherwise nothing.
bool NearestPose(const Eigen::Matrix4d& matrix, Pose& pose);

} // namespace echorama
