// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ToolPose.h"
#include <string>
#include <vector>

namespace echorama {

/// Recorded poses, whatever the file they come from.
struct PoseLog {
  std::string path;
  std::vector<std::string> tools; ///< names of transforms, "ProbeToTracker", in the order of the file
  std::vector<ToolPose> poses;    ///< in the order of time; moments at which a tool was not seen are there, as Missing
  std::vector<std::string> notes; ///< what was assumed or is not usable: sentences for people

  /// Those of one tool. \throws Error(BadInput) that names the tools there are.
  std::vector<ToolPose> Of(const std::string& tool) const;
};

/// What a file does not say.
struct PoseLogOptions {
  double unitMm = 0.0; ///< of lengths, in mm (1000: metres); 0: what the format says, else mm
};

/// Reads a recording of a tracker:
/// * sequences (.igs.mha ...): every transform of every frame;
/// * CSV logs: NDI's as the Aurora tools write them (Hour, Minutes, Seconds, ms, then X Y Z qo qx qy qz per sensor; rows of zeros
/// are
///   Missing), and plain ones with a header "time,tool,tx,ty,tz,qw,qx,qy,qz[,status]" or "t, x, y, z, q_x, q_y, q_z, q_w";
/// * pairs of poses (t, A 4x4, B 4x4 row by row): the tools are "HandToBase" and "TargetToCamera".
/// \throws Error(FileSystem), Error(BadFile) that names file, line and reason.
PoseLog ReadPoseLog(const std::string& path, const PoseLogOptions& options = {});

/// Whether the text of a file looks like one that ReadPoseLog reads, other than a sequence.
bool LooksLikePoseLog(std::string_view bytes);

} // namespace echorama
