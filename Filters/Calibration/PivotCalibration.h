// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/MotionPath.h"
#include "Filters/Calibration/HandEye.h"
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

struct PivotParameters {
  PoseNoise noise; ///< of the poses, in the tool's own axes
  bool estimateNoise = true, rejectOutliers = true;
  double leastSwingDegrees = 2.0;
  std::uint64_t seed = 1;
};
ParameterList Describe(PivotParameters& p);

/// How one pose fits.
struct PivotResidual {
  double mm = 0.0; ///< from the tip, as this pose places it, to the fixed point
  bool inlier = true;
};

/// A sphere through the positions of the tool: they lie about the fixed point, as far away as the tip. It uses no rotations, and
/// so is a check of them.
struct PivotSphere {
  bool known = false; ///< false: the positions do not make one
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radiusMm = 0.0, radiusErrorMm = 0.0; ///< with its standard error
  double rmsMm = 0.0;                         ///< of the positions about it
};

struct PivotResult {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();   ///< in the tool's frame, mm
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero(); ///< the fixed point, in the tracker's frame, mm
  /// The same by least squares over all poses, for comparison.
  Eigen::Vector3d algebraicTip = Eigen::Vector3d::Zero(), algebraicPivot = Eigen::Vector3d::Zero();
  int inliers = 0;
  std::vector<PivotResidual> residuals; ///< one per pose, in their order
  /// Of tip (first three) and pivot, mm^2.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double tipRmsMm = 0.0;      ///< root of the trace of the tip's part
  double tipRadius95Mm = 0.0; ///< of the sphere that holds the true tip with 95%
  double rmsMm = 0.0;         ///< of the inliers' residuals
  double noiseScale = 1.0;    ///< what the noise was multiplied with; 1 unless estimated
  /// How far directions of the tool swung (RMS, less what the noise pretends), the largest first, and which; in its own frame.
  Eigen::Vector3d swingDegrees = Eigen::Vector3d::Zero();
  Eigen::Matrix3d swingAxes = Eigen::Matrix3d::Identity(); ///< columns
  PivotSphere sphere;
  std::vector<std::string> notes; ///< what was noticed: outliers, units, conventions; sentences for people
};

/// The place of a tool's tip in the frame of its sensor, from poses (tool to tracker) while the tip rests in a divot and the
/// tool is turned about it (dissertation 4.1.2): R_i tip + t_i = pivot.
///
/// Maximum likelihood: an error of the angle moves the tip with the whole lever, so the residuals across the lever weigh less,
/// and both tip and lever are estimated together. Errors of neighbouring poses count as independent.
/// Cost: linear in the number of poses.
///
/// \param poses times may be NaN; they are for messages alone
/// \throws Error(InvalidParameter) for what is out of its range; Error(BadInput) that names the pose when one is not finite or
/// not rigid; Error(NotPossible) with the reason: fewer than four poses; the tool turned too little, or about one axis only (its
/// tip is then known only up to a line); most poses do not agree on a fixed point. Where rotations the wrong way round explain
/// that, the message says so. Error(Cancelled).
PivotResult CalibratePivot(const std::vector<TimedPose>& poses, const PivotParameters& parameters = {},
                           const Progress& progress = {});

} // namespace echorama
