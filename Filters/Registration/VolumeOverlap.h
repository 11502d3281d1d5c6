// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "PlacedVolume.h"
#include <cstdint>

namespace echorama {

/// Points of a volume at its coarsest resolution: of \a count drawn by \a seed in its valid region, those that its own
/// interpolation holds.
struct OverlapPoints {
  OverlapPoints(const PlacedVolume& volume, int count, std::uint64_t seed = 1);

  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< of its valid region, where its geometry has it, mm
  std::vector<Eigen::Vector3f> fromCentre;
};

/// One resolution of a volume, and where it is.
struct PlacedLevel {
  const PyramidLevel* level;
  Pose volumeToWorld;
};

/// The share of \a points, their volume being where \a volumeToWorld puts it, that lie in one of \a fixed: the voxel nearest to
/// each is real. 0 without points.
double OverlapOf(const OverlapPoints& points, const Pose& volumeToWorld, const std::vector<PlacedLevel>& fixed);

/// The same of \a moving 's points and \a fixed at their coarsest resolution.
double OverlapOf(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving, int points, std::uint64_t seed = 1);

} // namespace echorama
