// SPDX-License-Identifier: BSD-3-Clause
// A frame is chosen first (a direction matrix and an origin), then every corner of every volume is expressed in voxels of
// that frame, and the grid is the range of whole indices around them. Choosing the first volume's own lattice as the frame
// is what keeps volumes of one lattice free of interpolation.
#include "StitchGrid.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

constexpr double sameDirection = 1e-4; // largest difference of two entries of direction matrices that count as the same
constexpr double planeSlack = 0.01;    // of the smallest pixel: how far apart the planes of 2D images may lie

bool AllShareOneDirection(const std::vector<ImageGeometry>& volumes)
{
  return std::all_of(volumes.begin(), volumes.end(), [&volumes](const ImageGeometry& v) {
    return (v.direction - volumes.front().direction).cwiseAbs().maxCoeff() <= sameDirection;
  });
}

bool AllLieInOnePlane(const std::vector<ImageGeometry>& volumes)
{
  const Eigen::Vector3d normal = volumes.front().direction.col(2);
  return std::all_of(volumes.begin(), volumes.end(), [&](const ImageGeometry& v) {
    return v.dimensions[2] == 1 && v.direction.col(2).cross(normal).norm() <= sameDirection &&
           std::abs(normal.dot(v.Centre() - volumes.front().Centre())) <= planeSlack * v.spacing.head<2>().minCoeff();
  });
}

// The smallest spacing per axis. Axes with a single voxel tell nothing about resolution unless there is nothing else.
Eigen::Vector3d SmallestSpacing(const std::vector<ImageGeometry>& volumes, bool perAxis)
{
  Eigen::Vector3d smallest = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (const bool singleVoxelsCount : {false, true}) {
    for (const ImageGeometry& v : volumes)
      for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(smallest[axis]) || !singleVoxelsCount)
          if (v.dimensions[axis] > 1 || singleVoxelsCount)
            smallest[axis] = std::min(smallest[axis], v.spacing[axis]);
    if (!perAxis && std::isfinite(smallest.minCoeff()))
      return Eigen::Vector3d::Constant(smallest.minCoeff());
  }
  return smallest;
}

} // namespace

ImageGeometry StitchGrid(const std::vector<ImageGeometry>& volumes, double spacingMm)
{
  if (volumes.size() < 2)
    throw Error(Error::Kind::BadInput, "stitching needs at least two volumes, got " + std::to_string(volumes.size()));
  if (!(spacingMm >= 0.0) || !std::isfinite(spacingMm))
    throw Error(Error::Kind::InvalidParameter, "SpacingMm is " + std::to_string(spacingMm) +
                                                   "; it must be positive, or 0 for the smallest spacing of the volumes");
  for (std::size_t v = 0; v < volumes.size(); ++v)
    volumes[v].Check("volume " + std::to_string(v + 1));

  const ImageGeometry& first = volumes.front();
  const bool shared = AllShareOneDirection(volumes), flat = AllLieInOnePlane(volumes);
  ImageGeometry grid;
  const bool alongFirst = shared || (flat && std::abs(first.direction(2, 2)) < 1.0 - sameDirection);
  if (alongFirst)
    grid.direction = first.direction;
  grid.origin = first.origin;
  grid.spacing = spacingMm > 0.0 ? Eigen::Vector3d::Constant(spacingMm) : SmallestSpacing(volumes, shared);
  if (flat)
    grid.spacing[2] = first.spacing[2];

  const Eigen::Affine3d worldToGrid = grid.WorldToIndex();
  Eigen::AlignedBox3d box;
  for (const ImageGeometry& v : volumes) {
    const Eigen::Affine3d map = worldToGrid * v.IndexToWorld();
    for (int corner = 0; corner < 8; ++corner)
      box.extend(map * Eigen::Vector3d(corner & 1 ? v.dimensions[0] - 1 : 0, corner & 2 ? v.dimensions[1] - 1 : 0,
                                       corner & 4 ? v.dimensions[2] - 1 : 0));
  }
  // Voxels turned against the grid have no phase to keep: begin at the rim. A thousandth of a voxel of slack, so that
  // rounding adds no empty layer.
  const Eigen::Vector3d lower = alongFirst ? Eigen::Vector3d((box.min().array() + 1e-3).floor()) : box.min();
  Eigen::Vector3d size = (box.max() - lower).array() - 1e-3;
  size = size.array().ceil() + 1.0;
  if (flat)
    size[2] = 1.0;
  if (!(size.maxCoeff() <= std::numeric_limits<int>::max()) || !(size.prod() <= 1e15))
    throw Error(Error::Kind::TooLarge, "the output grid would have " + SizeText(size[0], size[1], size[2]) +
                                           " voxels; choose a larger SpacingMm, or poses that lie nearer to each other");
  for (int axis = 0; axis < 3; ++axis)
    grid.dimensions[axis] = static_cast<int>(size[axis]);
  grid.origin = grid.IndexToWorld() * (flat ? Eigen::Vector3d(lower[0], lower[1], 0.0) : lower);
  return grid;
}

} // namespace echorama
