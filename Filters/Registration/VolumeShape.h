// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "LocalAlign.h"
#include "PlacedVolume.h"

namespace echorama {

/// The shape of a volume: some of its real voxels, and how far it goes. Where its geometry has them, mm.
struct VolumeShape {
  explicit VolumeShape(const PlacedVolume& volume);

  /// How far two poses put the volume apart: the mean over its points, mm.
  double Distance(const Pose& a, const Pose& b) const;

  /// The root mean square displacement of the points, placed by \a pose, under a twist of this covariance about \a centre
  /// (world), mm.
  double Error(const Information& covariance, const Eigen::Vector3d& centre, const Pose& pose) const;

  std::vector<Eigen::Vector3d> points; ///< some 1000, evenly
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double radius = 0.0; ///< root mean square distance from the centroid
  double reach = 0.0;  ///< the largest distance from it
  double extent = 0.0; ///< the longest side of the box around them
};

} // namespace echorama
