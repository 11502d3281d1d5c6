// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ToolPose.h"
#include <string>
#include <vector>

namespace echorama {

/// Recorded poses, whatever the file they come from.
struct PoseLog {
  std::string path;
  std::vector<std::string> tools; ///< names of transforms, "ProbeToTracker", in the order of the file
  /// In the order of time; of equal times in that of the file. Moments at which the file says that a tool was not seen are there,
  /// as Missing. Times are NaN when the file has none at all.
  std::vector<ToolPose> poses;
  std::vector<std::string> notes; ///< what was assumed or is not usable: sentences for people

  /// Those of one tool; its plain name ("Probe") will do. \throws Error(BadInput) that names the tools there are.
  std::vector<ToolPose> Of(const std::string& tool) const;
};

/// Behind the name of a transform it names the field of a frame that holds the arrival of its pose, in seconds:
/// "ProbeToTrackerArrival". Recorders write it.
inline constexpr const char* ArrivalField = "Arrival";

/// What a file does not say.
struct PoseLogOptions {
  double unitMm = 0.0, rowsPerSecond = 0.0;
};
ParameterList Describe(PoseLogOptions& p);

/// Reads a recording of a tracker:
/// * sequences (.igs.mha ...): every rigid transform of every frame that has it, in mm; with its arrival, where the field
///   ArrivalField says it;
/// * tables with a row of column names, in mm unless \a options say otherwise: a time (time, timestamp or t in seconds; or hour,
///   minutes, seconds and ms, counted from midnight on) and, for each sensor, a position (x y z or tx ty tz) and a quaternion
///   (qw, q_w, qo or q0, then qx qy qz or q1 q2 q3), whose names end alike for one sensor. So do NDI's tools for the Aurora write
///   them ("Xa", "qoa": SensorAToTracker). With a column tool (or name) each row is that of the tool it names; a column status
///   holds the words of TransformStatusOf. What precedes the names is passed over. Cells are separated by commas, semicolons,
///   tabs or blanks, and the names may follow a #;
/// * pairs of poses without names of columns: a time, then two matrices of 4 x 4 row by row; the tools are "HandToBase" and
///   "TargetToCamera". The unit is the metre unless \a options say otherwise: their only known writers use it.
///
/// A pose is Missing when all its numbers are zero or its cells are empty, and, with a note, when a number is not finite or
/// beyond 1e7 mm, the quaternion's length is further than 0.01 from 1, or the matrix is no pose (NearestPose). Rows that end
/// early give the poses that are whole, with a note. Positions of a table that all lie within 10 mm may be metres: that is noted,
/// and left to \a options. Rows without a time, and times that do not rise, are noted; the poses are sorted by time. \throws
/// Error(InvalidParameter) for the options, Error(FileSystem), Error(BadFile) that names file, line and reason: no such columns,
/// text where a number is needed, an open quotation mark, binary data, no poses.
PoseLog ReadPoseLog(const std::string& path, const PoseLogOptions& options = {});

} // namespace echorama
