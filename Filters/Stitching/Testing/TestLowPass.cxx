// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Stitching/LowPass.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

ImageGeometry Grid(const std::array<int, 3>& dimensions)
{
  ImageGeometry grid;
  grid.dimensions = dimensions;
  return grid;
}

StitchSampler SamplerOf(const Volume<float>& values, const ImageGeometry& geometry, const ImageGeometry& grid)
{
  return StitchSampler({PosedVolume<float>{values.View(), {}, geometry}, "volume"}, grid, 0.01);
}

CoverageMap MapOf(const Volume<unsigned char>& counts)
{
  CoverageMap map(counts.Dimensions(), {{{0, 0, 0}, counts.Dimensions()}});
  for (int k = 0; k < counts.Dimensions()[2]; ++k)
    for (int j = 0; j < counts.Dimensions()[1]; ++j)
      std::copy_n(counts.View().Row(j, k), counts.Dimensions()[0], map.At(0, j, k));
  return map;
}

} // namespace

TEST(LowPass, BlocksAreCubesAndCoverTheGrid)
{
  ImageGeometry grid = Grid({17, 8, 5});
  grid.spacing = {1.0, 1.0, 4.0};
  const BlockLattice blocks = BlocksOf(grid, 4.0);
  EXPECT_EQ(blocks.size, (std::array<int, 3>{4, 4, 1}));
  EXPECT_EQ(blocks.geometry.dimensions, (std::array<int, 3>{5, 2, 5}));
  EXPECT_TRUE(blocks.geometry.origin.isApprox(Eigen::Vector3d(1.5, 1.5, 0.0)));
  EXPECT_EQ(BlocksOf(Grid({9, 9, 1}), 4.0).size, (std::array<int, 3>{4, 4, 1}));
}

TEST(LowPass, KeepsConstantsAndLosesTexture)
{
  const ImageGeometry grid = Grid({40, 36, 32});
  const Volume<unsigned char> shared(grid.dimensions, 2);
  const BlockLattice blocks = BlocksOf(grid, 2.0);
  const Volume<float> constant(grid.dimensions, 0.1f);
  for (const double scale : {2.0, 5.0, 16.0}) {
    const SmoothPart flat = LowPass(SamplerOf(constant, grid, grid), BlocksOf(grid, scale), MapOf(shared), 1);
    for (const float value : flat.low.values.View())
      EXPECT_EQ(value, 0.1f);
    for (const float value : flat.deviation.values.View())
      EXPECT_EQ(value, 0.0f);
  }

  Volume<float> noise(grid.dimensions);
  Random random(1);
  for (float& value : noise.View())
    value = static_cast<float>(100.0 + 20.0 * random.Normal());
  const SmoothPart rough = LowPass(SamplerOf(noise, grid, grid), blocks, MapOf(shared), 1);
  // A block of 8 voxels keeps 1/8 of the variance, and (1 2 1)/4 3/8 of that along each axis.
  double variance = 0.0, deviation = 0.0, count = 0.0;
  for (int k = 2; k < 14; ++k)
    for (int j = 2; j < 16; ++j)
      for (int i = 2; i < 18; ++i) {
        variance += std::pow(rough.low.values.View()(i, j, k) - 100.0, 2);
        deviation += rough.deviation.values.View()(i, j, k);
        ++count;
      }
  EXPECT_NEAR(variance / count, 400.0 / 8.0 * std::pow(0.375, 3), 0.5);
  EXPECT_NEAR(deviation / count, 20.0, 0.5);
}

TEST(LowPass, IsOfTheOverlapAlone)
{
  const ImageGeometry grid = Grid({40, 12, 12});
  Volume<unsigned char> coverage(grid.dimensions, 1);
  Volume<float> values(grid.dimensions, 1000.0f);
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 11; i < 27; ++i) {
        coverage.View()(i, j, k) = 2;
        values.View()(i, j, k) = 5.0f;
      }
  const SmoothPart part = LowPass(SamplerOf(values, grid, grid), BlocksOf(grid, 4.0), MapOf(coverage), 1);
  const auto low = part.low.values.View();
  for (int block = 0; block < 10; ++block) {
    const bool near = block >= 1 && block <= 7; // blocks 2 to 6 hold overlap, and one more on either side
    EXPECT_EQ(std::isnan(low(block, 1, 1)), !near) << block;
    if (near) {
      EXPECT_EQ(low(block, 1, 1), 5.0f) << block;
    }
  }
}

TEST(LowPass, VolumesThatAgreeHaveTheSameSmoothPart)
{
  // Two windows of one world, of which only the overlap counts.
  const ImageGeometry grid = Grid({48, 20, 20});
  Volume<float> world(grid.dimensions);
  Random random(2);
  for (float& value : world.View())
    value = static_cast<float>(random.Uniform(0.0, 255.0));
  Volume<unsigned char> coverage(grid.dimensions, 1);
  ImageGeometry a = Grid({30, 20, 20}), b = Grid({31, 20, 20});
  b.origin[0] = 17.0;
  Volume<float> first(a.dimensions), second(b.dimensions);
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 30; ++i)
        first.View()(i, j, k) = world.View()(i, j, k);
      for (int i = 0; i < 31; ++i)
        second.View()(i, j, k) = world.View()(i + 17, j, k);
      for (int i = 17; i < 30; ++i)
        coverage.View()(i, j, k) = 2;
    }
  const BlockLattice blocks = BlocksOf(grid, 3.0);
  const SmoothPart p = LowPass(SamplerOf(first, a, grid), blocks, MapOf(coverage), 1);
  const SmoothPart q = LowPass(SamplerOf(second, b, grid), blocks, MapOf(coverage), 1);
  int compared = 0;
  for (int k = 0; k < p.low.box.size[2]; ++k)
    for (int j = 0; j < p.low.box.size[1]; ++j)
      for (int i = 17 / 3; i <= 29 / 3; ++i) {
        EXPECT_EQ(p.low.Row(j, k)[i - p.low.box.first[0]], q.low.Row(j, k)[i - q.low.box.first[0]]);
        ++compared;
      }
  EXPECT_GT(compared, 100);
}

TEST(LowPass, RefusesNothingAndWorksInTheFlat)
{
  const ImageGeometry grid = Grid({13, 11, 1});
  const Volume<unsigned char> shared(grid.dimensions, 2);
  const Volume<float> values(grid.dimensions, 3.0f);
  const SmoothPart part = LowPass(SamplerOf(values, grid, grid), BlocksOf(grid, 2.0), MapOf(shared), 1);
  for (const float value : part.low.values.View())
    EXPECT_EQ(value, 3.0f);
}
