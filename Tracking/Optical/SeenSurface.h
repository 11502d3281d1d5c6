// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <optional>

namespace echorama {

/// The skin as a camera inside sees it. Questions may come from any number of threads.
class SeenSurface {
public:
  struct Hit {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< mm
    Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< of length 1, against the ray
  };

  virtual ~SeenSurface() = default;
  /// The first place that a ray meets; \a direction of length 1.
  virtual std::optional<Hit> FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const = 0;
};

/// The upper half (z >= 0) of an ellipsoid about the origin.
class DomeSurface : public SeenSurface {
public:
  /// \throws Error(InvalidParameter) for radii that are not above 0
  explicit DomeSurface(const Eigen::Vector3d& radiiMm);
  std::optional<Hit> FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const override;
  /// The place above (x, y), for what moves on it. Nothing beyond the rim.
  std::optional<Eigen::Vector3d> Above(double x, double y) const;

private:
  Eigen::Vector3d radii_;
};

} // namespace echorama
