// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/LargestCrop.h"
#include <cmath>
#include <gtest/gtest.h>

namespace echorama {

namespace {

double BruteForce(const Volume<float>& weights)
{
  const auto& n = weights.Dimensions();
  double best = 0.0;
  for (int k0 = 0; k0 < n[2]; ++k0)
    for (int j0 = 0; j0 < n[1]; ++j0)
      for (int i0 = 0; i0 < n[0]; ++i0)
        for (int k1 = k0; k1 < n[2]; ++k1)
          for (int j1 = j0; j1 < n[1]; ++j1)
            for (int i1 = i0; i1 < n[0]; ++i1) {
              double sum = 0.0;
              bool whole = true;
              for (int k = k0; k <= k1; ++k)
                for (int j = j0; j <= j1; ++j)
                  for (int i = i0; i <= i1; ++i) {
                    sum += weights.View()(i, j, k);
                    whole = whole && weights.View()(i, j, k) > 0.0f;
                  }
              if (whole)
                best = std::max(best, sum);
            }
  return best;
}

// A region: what of the fan's grid is within the fan and between two shares of the depth and the sweep.
struct FanScene {
  PlacedProbe fan;
  ImageGeometry grid;
  Volume<unsigned char> region;

  explicit FanScene(double from = 0.0, double to = 1.0, double sweepTo = 0.5)
  {
    fan.geometry = ProbeGeometry::Convex(1.0, 30.0, 0.7, 20.0, 0.0, 60.0);
    fan.probeToWorld = Pose(Eigen::Translation3d(5.0, -7.0, 3.0) * Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()));
    grid.dimensions = {100, 72, 72};
    const Eigen::Affine3d place = Eigen::Affine3d(fan.probeToWorld) * Eigen::Translation3d(-50.0, -36.0, -8.0);
    grid.origin = place.translation();
    grid.direction = place.linear();
    region = Volume<unsigned char>(grid.dimensions);
    const Eigen::Affine3d toProbe = Eigen::Affine3d(fan.probeToWorld.inverse()) * grid.IndexToWorld();
    for (int k = 0; k < 72; ++k)
      for (int j = 0; j < 72; ++j)
        for (int i = 0; i < 100; ++i) {
          const auto beam = BeamPointAt(fan.geometry, toProbe * Eigen::Vector3d(i, j, k));
          region.View()(i, j, k) = beam && beam->depth >= 60.0 * from && beam->depth <= 60.0 * to && beam->sweep <= sweepTo;
        }
  }
};

} // namespace

TEST(LargestBox, IsThatOfBruteForce)
{
  const std::array<int, 3> shapes[] = {{6, 5, 4}, {1, 7, 5}, {7, 1, 1}, {4, 6, 1}, {5, 5, 5}};
  int seed = 0;
  for (const auto& shape : shapes)
    for (const double filled : {0.3, 0.7, 0.95}) {
      Random random(17, static_cast<std::uint64_t>(++seed));
      Volume<float> weights(shape);
      for (float& weight : weights.View())
        weight = random.Uniform() < filled ? static_cast<float>(random.Uniform(0.5, 3.0)) : 0.0f;
      const CellBox box = LargestBox(weights.View());
      EXPECT_NEAR(box.weight, BruteForce(weights), 1e-5) << seed;
      double sum = 0.0;
      for (int k = box.first[2]; k < box.first[2] + box.size[2]; ++k)
        for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j)
          for (int i = box.first[0]; i < box.first[0] + box.size[0]; ++i) {
            EXPECT_GT(weights.View()(i, j, k), 0.0f);
            sum += weights.View()(i, j, k);
          }
      EXPECT_NEAR(sum, box.weight, 1e-5);
    }
}

TEST(LargestBox, NothingIsNothing)
{
  Volume<float> weights({4, 4, 4}, 0.0f);
  weights.View()[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(LargestBox(weights.View()).weight, 0.0);
  EXPECT_EQ(LargestBox(weights.View()).size, (std::array<int, 3>{0, 0, 0}));
  weights.View()[9] = 2.0f;
  EXPECT_EQ(LargestBox(weights.View()).weight, 2.0);
}

// Boxes that weigh the same: one of them is chosen, and by the weights alone.
TEST(LargestBox, TiesDoNotDependOnThreads)
{
  Volume<float> weights({9, 7, 6}, 1.0f);
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 9; ++i)
        if (i % 3 == 2 || j % 4 == 3 || k % 3 == 2)
          weights.View()(i, j, k) = 0.0f;
  const CellBox many = LargestBox(weights.View());
  const ThreadLimit limit(1);
  const CellBox one = LargestBox(weights.View());
  EXPECT_EQ(many.weight, 12.0);
  EXPECT_EQ(many.first, one.first);
  EXPECT_EQ(many.size, one.size);
  EXPECT_EQ(one.first, (std::array<int, 3>{0, 0, 0}));
  EXPECT_EQ(one.size, (std::array<int, 3>{2, 3, 2}));
}

TEST(LargestCrop, AFullFanLosesItsRimAtMost)
{
  const FanScene scene;
  const Crop crop = LargestCrop(scene.region.View(), scene.grid, scene.fan, 40);
  EXPECT_GT(crop.share, 0.9);
  EXPECT_LE(crop.share, 1.0);
}

TEST(LargestCrop, ABoxInBeamSpaceIsFound)
{
  const FanScene scene(0.25, 0.75, 0.1);
  const Crop crop = LargestCrop(scene.region.View(), scene.grid, scene.fan, 40);
  EXPECT_NEAR(crop.first.depth, 15.0, 1.6);
  EXPECT_NEAR(crop.last.depth, 45.0, 1.6);
  EXPECT_NEAR(crop.first.fan, -0.5, 0.03);
  EXPECT_NEAR(crop.last.fan, 0.5, 0.03);
  EXPECT_NEAR(crop.first.sweep, -0.5, 0.03);
  EXPECT_NEAR(crop.last.sweep, 0.1, 0.03);
  EXPECT_GT(crop.share, 0.85);
  // The share is that of the region's voxels within the corners.
  const Eigen::Affine3d toProbe = Eigen::Affine3d(scene.fan.probeToWorld.inverse()) * scene.grid.IndexToWorld();
  int all = 0, inside = 0;
  for (int k = 0; k < 72; ++k)
    for (int j = 0; j < 72; ++j)
      for (int i = 0; i < 100; ++i)
        if (scene.region.View()(i, j, k)) {
          const auto beam = BeamPointAt(scene.fan.geometry, toProbe * Eigen::Vector3d(i, j, k));
          ++all;
          inside += beam && beam->depth >= crop.first.depth && beam->depth <= crop.last.depth && beam->fan >= crop.first.fan &&
                    beam->fan <= crop.last.fan && beam->sweep >= crop.first.sweep && beam->sweep <= crop.last.sweep;
        }
  EXPECT_DOUBLE_EQ(crop.share, static_cast<double>(inside) / all);
}

// Above 55% of the depth lie more cells, below it more mm^3: a fan grows wide.
TEST(LargestCrop, LargestIsByVolume)
{
  FanScene scene;
  const Eigen::Affine3d toProbe = Eigen::Affine3d(scene.fan.probeToWorld.inverse()) * scene.grid.IndexToWorld();
  for (int k = 0; k < 72; ++k)
    for (int j = 0; j < 72; ++j)
      for (int i = 0; i < 100; ++i)
        if (const auto beam = BeamPointAt(scene.fan.geometry, toProbe * Eigen::Vector3d(i, j, k));
            beam && beam->depth > 33.0 && beam->depth < 37.0)
          scene.region.View()(i, j, k) = 0;
  const Crop crop = LargestCrop(scene.region.View(), scene.grid, scene.fan, 40);
  EXPECT_GT(crop.first.depth, 33.0);
  EXPECT_GT(crop.last.depth, 57.0);
}

TEST(LargestCrop, AHoleCostsThePartBehindIt)
{
  FanScene scene;
  const double whole = LargestCrop(scene.region.View(), scene.grid, scene.fan, 40).share;
  for (int k = 30; k < 40; ++k)
    for (int j = 31; j < 41; ++j)
      for (int i = 45; i < 55; ++i)
        scene.region.View()(i, j, k) = 0;
  const double holed = LargestCrop(scene.region.View(), scene.grid, scene.fan, 40).share;
  EXPECT_LT(holed, 0.8 * whole);
  EXPECT_GT(holed, 0.3);
}

TEST(LargestCrop, APlaneHasOneLayer)
{
  PlacedProbe fan;
  fan.geometry = ProbeGeometry::Phased(1.2, 0.0, 5.0, 50.0);
  ImageGeometry grid;
  grid.dimensions = {81, 1, 56};
  grid.origin = {-40.0, 0.0, 0.0};
  Volume<unsigned char> region(grid.dimensions);
  for (int k = 0; k < 56; ++k)
    for (int i = 0; i < 81; ++i) {
      const auto beam = BeamPointAt(fan.geometry, {i - 40.0, 0.0, static_cast<double>(k)});
      region.View()(i, 0, k) = beam && beam->fan < 0.0;
    }
  const Crop crop = LargestCrop(region.View(), grid, fan);
  EXPECT_GT(crop.share, 0.8); // near the apex a voxel is several beams wide
  EXPECT_NEAR(crop.last.fan, 0.0, 0.05);
}

TEST(LargestCrop, EmptyRegionsAndBadInput)
{
  FanScene scene(0.6, 0.5);
  const Crop crop = LargestCrop(scene.region.View(), scene.grid, scene.fan, 20);
  EXPECT_TRUE(std::isnan(crop.share));
  EXPECT_THROW(LargestCrop(scene.region.View(), scene.grid, scene.fan, 1), Error);
  EXPECT_THROW(LargestCrop({}, scene.grid, scene.fan), Error);
  scene.fan.geometry.depthMax = -1.0;
  EXPECT_THROW(LargestCrop(scene.region.View(), scene.grid, scene.fan), Error);
}

TEST(LargestCrop, ThreadsDoNotMatter)
{
  const FanScene scene(0.1, 0.8, 0.3);
  const Crop many = LargestCrop(scene.region.View(), scene.grid, scene.fan, 30);
  const ThreadLimit limit(1);
  const Crop one = LargestCrop(scene.region.View(), scene.grid, scene.fan, 30);
  EXPECT_EQ(many.share, one.share);
  EXPECT_EQ(many.first.fan, one.first.fan);
}

} // namespace echorama
