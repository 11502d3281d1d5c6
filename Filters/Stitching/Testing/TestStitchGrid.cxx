// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Stitching/StitchGrid.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

ImageGeometry Geometry(std::array<int, 3> dimensions, const Eigen::Vector3d& origin, const Eigen::Vector3d& spacing,
                       const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity())
{
  ImageGeometry g;
  g.dimensions = dimensions;
  g.origin = origin;
  g.spacing = spacing;
  g.direction = direction;
  return g;
}

// Whether every voxel centre lies within the grid (between the centres of its outer voxels).
void ExpectCovers(const ImageGeometry& grid, const ImageGeometry& volume)
{
  const Eigen::Affine3d map = grid.WorldToIndex() * volume.IndexToWorld();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d at =
        map * Eigen::Vector3d(corner & 1 ? volume.dimensions[0] - 1 : 0, corner & 2 ? volume.dimensions[1] - 1 : 0,
                              corner & 4 ? volume.dimensions[2] - 1 : 0);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(at[axis], -0.01);
      EXPECT_LE(at[axis], grid.dimensions[axis] - 1 + 0.01);
    }
  }
}

Error::Kind KindOf(const std::vector<ImageGeometry>& volumes, double spacing = 0.0)
{
  try {
    StitchGrid(volumes, spacing);
  } catch (const Error& error) {
    return error.GetKind();
  }
  ADD_FAILURE() << "no error";
  return Error::Kind::Cancelled;
}

} // namespace

TEST(StitchGrid, VolumesOfOneLatticeStayOnIt)
{
  const Eigen::Matrix3d turned = ExpRotation({0.3, -0.2, 0.5});
  const ImageGeometry a = Geometry({10, 12, 8}, {5.0, -3.0, 40.0}, {0.5, 0.4, 1.1}, turned);
  ImageGeometry b = a;
  b.dimensions = {9, 9, 9};
  b.origin = a.IndexToWorld() * Eigen::Vector3d(-4.0, 6.0, 3.0);
  const ImageGeometry grid = StitchGrid({a, b});
  EXPECT_TRUE(grid.direction.isApprox(turned));
  EXPECT_TRUE(grid.spacing.isApprox(a.spacing));
  EXPECT_EQ(grid.dimensions, (std::array<int, 3>{14, 15, 12}));
  EXPECT_TRUE((grid.IndexToWorld() * Eigen::Vector3d(4.0, 0.0, 0.0)).isApprox(a.origin));
}

TEST(StitchGrid, VolumesOfSeveralDirectionsGoAlongTheWorld)
{
  const ImageGeometry a = Geometry({30, 20, 25}, {1.0, 2.0, 3.0}, {0.5, 0.7, 0.6}, ExpRotation({0.0, 0.3, 0.1}));
  const ImageGeometry b = Geometry({22, 20, 25}, {9.0, 0.0, 3.0}, {0.4, 0.7, 0.6}, ExpRotation({0.4, 0.0, 0.0}));
  const ImageGeometry grid = StitchGrid({a, b});
  EXPECT_TRUE(grid.direction.isIdentity());
  EXPECT_TRUE(grid.spacing.isApprox(Eigen::Vector3d::Constant(0.4)));
  ExpectCovers(grid, a);
  ExpectCovers(grid, b);
  EXPECT_TRUE(StitchGrid({a, b}, 1.25).spacing.isApprox(Eigen::Vector3d::Constant(1.25)));
}

TEST(StitchGrid, ImagesOfOnePlaneMakeAnImageInThatPlane)
{
  const Eigen::Matrix3d plane = ExpRotation({0.9, 0.2, -0.4});
  const ImageGeometry a = Geometry({40, 30, 1}, {10.0, 20.0, 30.0}, {0.5, 0.5, 2.0}, plane);
  // Turned and moved within the plane.
  ImageGeometry b = a.Moved(MotionAbout(a.Centre(), 0.4 * plane.col(2), plane * Eigen::Vector3d(7.0, 3.0, 0.0)));
  const ImageGeometry grid = StitchGrid({a, b});
  EXPECT_EQ(grid.dimensions[2], 1);
  EXPECT_EQ(grid.spacing[2], 2.0);
  EXPECT_TRUE(grid.direction.isApprox(plane));
  ExpectCovers(grid, a);
  ExpectCovers(grid, b);
  b.origin += 0.5 * plane.col(2); // beside the plane: a volume
  EXPECT_GT(StitchGrid({a, b}).dimensions[2], 1);
}

TEST(StitchGrid, ImagesSquareToZGoAlongTheWorld)
{
  const ImageGeometry a = Geometry({40, 30, 1}, {0.0, 0.0, 5.0}, {1.0, 1.0, 1.0});
  const ImageGeometry b = a.Moved(MotionAbout(a.Centre(), {0.0, 0.0, 0.3}, {4.0, 0.0, 0.0}));
  const ImageGeometry grid = StitchGrid({b, a});
  EXPECT_TRUE(grid.direction.isIdentity());
  EXPECT_EQ(grid.dimensions[2], 1);
  EXPECT_EQ(grid.origin[2], 5.0);
}

TEST(StitchGrid, Refuses)
{
  const ImageGeometry good = Geometry({4, 4, 4}, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0});
  EXPECT_EQ(KindOf({}), Error::Kind::BadInput);
  EXPECT_EQ(KindOf({good}), Error::Kind::BadInput);
  EXPECT_EQ(KindOf({good, good}, -1.0), Error::Kind::InvalidParameter);
  EXPECT_EQ(KindOf({good, good}, std::numeric_limits<double>::quiet_NaN()), Error::Kind::InvalidParameter);
  EXPECT_EQ(KindOf({good, good}, 1e-12), Error::Kind::TooLarge);
  ImageGeometry bad = good;
  bad.spacing[1] = 0.0;
  EXPECT_EQ(KindOf({good, bad}), Error::Kind::BadInput);
  bad = good;
  bad.origin[0] = 1e300;
  EXPECT_EQ(KindOf({good, bad}), Error::Kind::TooLarge);
}
