// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Base/Error.h"
#include <limits>

namespace echorama {

std::size_t ImageGeometry::VoxelCount() const
{
  return static_cast<std::size_t>(dimensions[0]) * static_cast<std::size_t>(dimensions[1]) *
         static_cast<std::size_t>(dimensions[2]);
}

Eigen::Affine3d ImageGeometry::IndexToWorld() const
{
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() = direction * spacing.asDiagonal();
  map.translation() = origin;
  return map;
}

Eigen::Affine3d ImageGeometry::WorldToIndex() const
{
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() = spacing.cwiseInverse().asDiagonal() * direction.inverse();
  map.translation() = -(map.linear() * origin);
  return map;
}

ImageGeometry ImageGeometry::Moved(const Pose& pose) const
{
  ImageGeometry moved = *this;
  moved.origin = pose * origin;
  moved.direction = pose.linear() * direction;
  return moved;
}

Eigen::Vector3d ImageGeometry::Centre() const
{
  return IndexToWorld() * (0.5 * Eigen::Vector3d(dimensions[0] - 1, dimensions[1] - 1, dimensions[2] - 1));
}

void ImageGeometry::Check(const std::string& name) const
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadInput, name + ": " + reason); };
  double product = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (dimensions[axis] < 1)
      fail("dimension " + std::to_string(axis) + " is " + std::to_string(dimensions[axis]) + "; it must be at least 1");
    product *= dimensions[axis];
  }
  constexpr std::ptrdiff_t most = std::numeric_limits<std::ptrdiff_t>::max() / 16; // 16 bytes a voxel are enough for all we do
  if (product > static_cast<double>(most))
    fail("the product of the dimensions overflows");
  if (!origin.allFinite() || !spacing.allFinite() || !direction.allFinite())
    fail("origin, spacing or direction holds a number that is not finite");
  for (int axis = 0; axis < 3; ++axis)
    if (!(spacing[axis] > 0.0))
      fail("spacing " + std::to_string(axis) + " is " + std::to_string(spacing[axis]) + "; it must be positive");
  if (!IsRotation(direction, 1e-3))
    fail("the direction matrix is not a rotation (it is singular, sheared, scaled or a mirror)");
}

bool ImageGeometry::AgreesWith(const ImageGeometry& other, double tolerance) const
{
  if (dimensions != other.dimensions)
    return false;
  // Corners suffice: the difference of two affine maps is affine, so it is largest at a corner.
  const Eigen::Affine3d here = IndexToWorld(), there = other.IndexToWorld();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d index(corner & 1 ? dimensions[0] - 1 : 0, corner & 2 ? dimensions[1] - 1 : 0,
                                corner & 4 ? dimensions[2] - 1 : 0);
    if (!((here * index - there * index).norm() <= tolerance * spacing.minCoeff()))
      return false;
  }
  // A single voxel has no corners that tell its spacing.
  return (spacing - other.spacing).cwiseAbs().maxCoeff() <= tolerance * spacing.minCoeff();
}

} // namespace echorama
