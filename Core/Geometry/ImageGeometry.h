// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <array>
#include <cstddef>
#include <string>

namespace echorama {

/// Where the voxels of a volume lie in the world: the geometry is the pose.
///
/// world = origin + direction * (spacing .* index), in millimetres (LPS); the index counts from the first voxel, x
/// fastest. A 2D image has dimensions[2] == 1.
struct ImageGeometry {
  std::array<int, 3> dimensions{0, 0, 0};
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();        ///< centre of the first voxel, mm
  Eigen::Vector3d spacing = Eigen::Vector3d::Ones();       ///< mm, > 0
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity(); ///< columns: unit vectors of the index axes

  std::size_t VoxelCount() const;
  Eigen::Affine3d IndexToWorld() const;
  Eigen::Affine3d WorldToIndex() const;

  /// The same voxels moved by \a pose: world becomes pose * world.
  ImageGeometry Moved(const Pose& pose) const;

  /// World position of the middle of the grid.
  Eigen::Vector3d Centre() const;

  /// Throws Error(BadInput) that begins with \a name when a dimension is not positive, the number of voxels overflows,
  /// a number is not finite, a spacing is not positive, or the direction is singular, sheared or a mirror.
  void Check(const std::string& name) const;

  /// Whether both place every voxel at the same point, to within \a tolerance voxels.
  bool AgreesWith(const ImageGeometry& other, double tolerance = 1e-3) const;
};

} // namespace echorama
