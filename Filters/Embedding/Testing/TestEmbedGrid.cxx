// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Embedding/EmbedGrid.h"
#include <gtest/gtest.h>

namespace echorama {

namespace {

ImageGeometry Oblique()
{
  ImageGeometry data;
  data.dimensions = {50, 40, 30};
  data.spacing = {0.8, 0.9, 1.1};
  data.origin = {-20.0, 5.0, 30.0};
  data.direction =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitZ())).toRotationMatrix();
  return data;
}

PlacedProbe Fan()
{
  PlacedProbe fan;
  fan.geometry = ProbeGeometry::Convex(1.2, 50.0, 0.8, 30.0, 0.0, 90.0);
  fan.probeToWorld = Eigen::Translation3d(1.0, 2.0, 3.0) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY());
  return fan;
}

} // namespace

TEST(EmbedGrid, VoxelsOfTheDataKeepTheirPlaces)
{
  for (const int factor : {1, 2, 3}) {
    const ImageGeometry data = Oblique();
    const EmbedGrid grid = EmbedGridOf(data, {0, 0, 0}, {49, 39, 29}, Fan(), factor);
    for (const auto& at : {std::array<int, 3>{0, 0, 0}, {5, 7, 2}, {11, 3, 9}}) {
      const Eigen::Vector3d world = grid.geometry.IndexToWorld() * Eigen::Vector3d(at[0], at[1], at[2]);
      const Eigen::Vector3d same =
          data.IndexToWorld() * Eigen::Vector3d(grid.DataIndex(at[0], 0), grid.DataIndex(at[1], 1), grid.DataIndex(at[2], 2));
      EXPECT_LT((world - same).norm(), 1e-9);
    }
    EXPECT_TRUE(grid.geometry.spacing.isApprox(factor * data.spacing));
  }
}

TEST(EmbedGrid, HoldsTheFanAndTheDataAndLittleElse)
{
  const EmbedGrid grid = EmbedGridOf(Oblique(), {10, 10, 10}, {20, 30, 29}, Fan());
  const Eigen::Affine3d worldToIndex = grid.geometry.IndexToWorld().inverse();
  Eigen::Vector3d least = Eigen::Vector3d::Constant(1e9), most = -least;
  for (int f = 0; f <= 301; ++f)
    for (int s = 0; s <= 301; ++s)
      for (const double depth : {0.0, 45.0, 90.0}) {
        const Eigen::Vector3d at =
            worldToIndex * (Fan().probeToWorld * PointOf(Fan().geometry, {depth, f / 301.0 - 0.5, s / 301.0 - 0.5}));
        least = least.cwiseMin(at);
        most = most.cwiseMax(at);
      }
  for (const auto& voxel : {std::array<int, 3>{10, 10, 10}, {20, 30, 29}})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = voxel[axis] + grid.offset[axis];
      least[static_cast<Eigen::Index>(axis)] = std::min(least[static_cast<Eigen::Index>(axis)], at);
      most[static_cast<Eigen::Index>(axis)] = std::max(most[static_cast<Eigen::Index>(axis)], at);
    }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Index a = static_cast<Eigen::Index>(axis);
    EXPECT_GT(least[a], -0.5);
    EXPECT_LT(least[a], 1.0);
    EXPECT_LT(most[a], grid.geometry.dimensions[axis] - 0.5);
    EXPECT_GT(most[a], grid.geometry.dimensions[axis] - 2.0);
  }
}

TEST(EmbedGrid, TakesTheEndsOfARegionFromItsVoxels)
{
  const ImageGeometry data = Oblique();
  Volume<unsigned char> region(data.dimensions);
  region.View()(10, 30, 12) = 1; // each end along another axis lies at another voxel
  region.View()(20, 10, 29) = 255;
  region.View()(15, 12, 10) = 1;
  for (const int factor : {1, 2}) {
    const EmbedGrid wanted = EmbedGridOf(data, {10, 10, 10}, {20, 30, 29}, Fan(), factor);
    const EmbedGrid found = EmbedGridOf(data, region.View(), Fan(), factor);
    EXPECT_EQ(found.offset, wanted.offset);
    EXPECT_EQ(found.geometry.dimensions, wanted.geometry.dimensions);
  }
  // Voxels beyond the fan make the grid larger: an end that is missed shows.
  PlacedProbe small = Fan();
  small.geometry = ProbeGeometry::Convex(0.2, 5.0, 0.1, 3.0, 0.0, 5.0);
  small.probeToWorld = Pose(Eigen::Translation3d(data.IndexToWorld() * Eigen::Vector3d(15.0, 20.0, 20.0)));
  const EmbedGrid found = EmbedGridOf(data, region.View(), small);
  EXPECT_EQ(found.offset, (std::array<int, 3>{-10, -10, -10}));
  EXPECT_EQ(found.geometry.dimensions, (std::array<int, 3>{11, 21, 20}));
}

TEST(EmbedGrid, CopiesEveryVoxelToItsPlaceAndZerosElsewhere)
{
  const std::array<int, 3> size{7, 5, 4};
  Volume<std::array<short, 2>> data(size);
  short value = 0;
  for (auto& voxel : data.View()) {
    ++value;
    voxel = {value, static_cast<short>(-value)};
  }
  for (const int factor : {1, 2, 3}) {
    EmbedGrid grid;
    grid.factor = factor;
    grid.offset = {2, 0, -1}; // empty before, flush, and cut
    grid.start = {factor / 2, 1, 0};
    grid.geometry.dimensions = {12, 6, 5};
    Volume<std::array<short, 2>> out(grid.geometry.dimensions, {9, 9});
    CopyToGrid(grid, size, sizeof(std::array<short, 2>), data.View().Data(), out.View().Data());
    int copied = 0;
    for (int k = 0; k < 5; ++k)
      for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 12; ++i) {
          const int x = factor * (i - 2) + factor / 2, y = factor * j + 1, z = factor * (k + 1);
          const bool there = x >= 0 && x < 7 && y < 5 && z < 4;
          copied += there;
          EXPECT_EQ(out.View()(i, j, k), there ? data.View()(x, y, z) : (std::array<short, 2>{0, 0}))
              << i << " " << j << " " << k;
        }
    EXPECT_GT(copied, 0);
  }
}

TEST(EmbedGrid, ASliceStaysOne)
{
  ImageGeometry data = Oblique();
  data.dimensions[2] = 1;
  PlacedProbe plane = Fan();
  plane.geometry.sweepAngle = plane.geometry.sweepWidth = 0.0;
  EXPECT_EQ(EmbedGridOf(data, {0, 0, 0}, {49, 39, 0}, plane).geometry.dimensions[2], 1);
}

TEST(EmbedGrid, RefusesBadParameters)
{
  EXPECT_THROW(EmbedGridOf(Oblique(), {0, 0, 0}, {49, 39, 29}, Fan(), 0), Error);
  ImageGeometry fine = Oblique();
  fine.spacing *= 1e-6;
  EXPECT_THROW(EmbedGridOf(fine, {0, 0, 0}, {49, 39, 29}, Fan()), Error);
}

} // namespace echorama
