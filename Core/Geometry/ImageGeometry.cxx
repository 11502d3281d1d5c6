// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/CoarseGrid.h"
#include <cmath>

namespace echorama {

std::size_t ImageGeometry::VoxelCount() const
{
  return static_cast<std::size_t>(dimensions[0]) * static_cast<std::size_t>(dimensions[1]) *
         static_cast<std::size_t>(dimensions[2]);
}

Eigen::Affine3d ImageGeometry::IndexToWorld() const
{
  return Eigen::Translation3d(origin) * Eigen::Affine3d(direction * spacing.asDiagonal());
}

Eigen::Affine3d ImageGeometry::WorldToIndex() const
{
  const Eigen::Matrix3d linear = spacing.cwiseInverse().asDiagonal() * direction.inverse();
  return Eigen::Translation3d(-(linear * origin)) * Eigen::Affine3d(linear);
}

ImageGeometry ImageGeometry::Moved(const Pose& pose) const
{
  return {dimensions, pose * origin, spacing, pose.linear() * direction};
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
  if (product > 0x1p59) // 16 bytes a voxel are enough for all we do
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

ImageGeometry CoarseGrid(ImageGeometry whole, int stride)
{
  for (int& n : whole.dimensions)
    n = (n - 1) / stride + 1;
  whole.spacing *= stride;
  return whole;
}

bool AreGridsOfOneVolume(const ImageGeometry& a, const ImageGeometry& b)
{
  if (a.spacing[0] > b.spacing[0])
    return AreGridsOfOneVolume(b, a);
  const double stride = std::round(b.spacing[0] / a.spacing[0]);
  return stride <= 1000.0 && CoarseGrid(a, static_cast<int>(stride)).AgreesWith(b);
}

} // namespace echorama
