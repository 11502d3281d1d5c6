// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>

namespace echorama {

/// How a probe that is pressed into soft tissue moves it, in the probe frame (origin on the face, +z into the tissue, mm).
///
/// Below the middle of the face the tissue goes along +z by \a mm, less with depth (a Gaussian of standard deviation
/// depthSigmaMm) and sideways (sideSigmaMm); what is pressed down bulges outwards, so that the field has no divergence: soft
/// tissue hardly changes its volume. Nothing folds up to maxMm.
struct ProbePress {
  static constexpr double maxMm = 10.0;
  static constexpr double depthSigmaMm = 35.0, sideSigmaMm = 45.0;

  double mm = 0.0; ///< at most maxMm; 0: nothing moves

  /// How far the tissue at \a point (where it lies unpressed) goes, mm.
  Eigen::Vector3d DisplacementAt(const Eigen::Vector3d& point) const;

  /// Where the tissue at \a point is seen.
  Eigen::Vector3d Seen(const Eigen::Vector3d& point) const { return point + DisplacementAt(point); }

  /// Its inverse, to 1e-9 mm: where the tissue that is seen at \a point lies unpressed.
  Eigen::Vector3d Unpressed(const Eigen::Vector3d& point) const;
};

} // namespace echorama
