// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <Eigen/Core>
#include <optional>

namespace echorama {

/// A wide-angle lens by Kannala and Brandt (2006), as OpenCV's fisheye module has it: a ray at the angle t to the axis +z meets
/// the sensor at the radius focal * (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9).
struct FisheyeLens {
  int width = 640, height = 480;
  double focal = 190.0;                    ///< pixels per radian, at the axis
  double centreX = 319.5, centreY = 239.5; ///< pixels
  double k1 = -0.02, k2 = 0.0, k3 = 0.0, k4 = 0.0;
  double maximumAngle = 100.0; ///< degrees from the axis

  /// \throws Error(InvalidParameter): out of range, or a radius that does not grow with the angle
  void Check() const;
  /// Where a direction of the camera's frame meets the sensor, also beyond its border; nothing beyond the largest angle.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& direction) const;
  /// The direction, of length 1, that a pixel looks into; nothing beyond the largest angle.
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& pixel) const;

  /// As Project(), with its derivatives, for fits; goes on smoothly beyond the largest angle. Nothing for a direction of no
  /// length or straight backwards.
  struct Projection {
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> byDirection;
    Eigen::Matrix<double, 2, 7> byLens; ///< focal, centreX, centreY, k1 to k4
  };
  std::optional<Projection> Differentiate(const Eigen::Vector3d& direction) const;
  /// Degrees up to which the radius grows with the angle, MaximumAngle at most.
  double GrowsUpTo() const;

  bool Covers(const Eigen::Vector2d& pixel) const
  {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() < height - 0.5;
  }

private:
  double Radius(double angle) const; // over focal
  double Growth(double angle) const; // its derivative
};
ParameterList Describe(FisheyeLens& p);

} // namespace echorama
