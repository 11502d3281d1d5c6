// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Stitching/RegionMap.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Mask = Volume<unsigned char>;

// A scene of masks over a whole grid, and the region map of it; each mask is handed over in a box around it.
struct Scene {
  std::array<int, 3> n;
  Eigen::Vector3d spacing;
  std::vector<Mask> masks;

  RegionMap Regions() const
  {
    std::vector<Boxed<unsigned char>> boxed;
    for (const Mask& mask : masks) {
      std::array<int, 3> first = n, last{-1, -1, -1};
      ForAll([&](int i, int j, int k) {
        if (mask.View()(i, j, k)) {
          first = {std::min(first[0], i), std::min(first[1], j), std::min(first[2], k)};
          last = {std::max(last[0], i), std::max(last[1], j), std::max(last[2], k)};
        }
      });
      Boxed<unsigned char> piece;
      piece.box = {first, {last[0] - first[0] + 1, last[1] - first[1] + 1, last[2] - first[2] + 1}};
      piece.values = Mask(piece.box.size);
      for (int k = 0; k < piece.box.size[2]; ++k)
        for (int j = 0; j < piece.box.size[1]; ++j)
          for (int i = 0; i < piece.box.size[0]; ++i)
            piece.values.View()(i, j, k) = mask.View()(first[0] + i, first[1] + j, first[2] + k);
      boxed.push_back(std::move(piece));
    }
    return RegionMap(std::move(boxed), n, spacing);
  }

  template <class Body>
  void ForAll(const Body& body) const
  {
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          body(i, j, k);
  }

  int Others(int v, int i, int j, int k) const
  {
    int others = 0;
    for (int w = 0; w < static_cast<int>(masks.size()); ++w)
      others += w != v && masks[w].View()(i, j, k);
    return others;
  }

  bool Is(Region region, int v, int i, int j, int k) const
  {
    const bool inside = masks[v].View()(i, j, k) != 0;
    const bool others = Others(v, i, j, k) > 0;
    return region == Region::Pure ? inside && !others : region == Region::Overlap ? inside && others : !inside && others;
  }
};

// Blobs: unions of a few balls, so that necks, islands and nested shapes occur.
Scene RandomScene(std::array<int, 3> n, const Eigen::Vector3d& spacing, int count, Random& random)
{
  Scene scene{n, spacing, {}};
  for (int v = 0; v < count; ++v) {
    Mask mask(n);
    const int balls = 1 + static_cast<int>(random.Below(3));
    for (int ball = 0; ball < balls; ++ball) {
      const Eigen::Vector3d centre(random.Uniform(0, n[0]), random.Uniform(0, n[1]), random.Uniform(0, n[2]));
      const double radius = random.Uniform(1.0, 0.4 * n[0]);
      scene.ForAll([&](int i, int j, int k) {
        if ((Eigen::Vector3d(i, j, k) - centre).norm() < radius)
          mask.View()(i, j, k) = 1;
      });
    }
    mask.View()(static_cast<int>(random.Below(n[0])), static_cast<int>(random.Below(n[1])),
                static_cast<int>(random.Below(n[2]))) = 1;
    scene.masks.push_back(std::move(mask));
  }
  return scene;
}

double BruteSquared(const Scene& scene, Region region, int v, int i, int j, int k)
{
  double nearest = std::numeric_limits<double>::infinity();
  scene.ForAll([&](int x, int y, int z) {
    if (scene.Is(region, v, x, y, z))
      nearest = std::min(nearest, Eigen::Vector3d(x - i, y - j, z - k).cwiseProduct(scene.spacing).squaredNorm());
  });
  return nearest;
}

Mask BoxMask(std::array<int, 3> n, std::array<int, 3> from, std::array<int, 3> to)
{
  Mask mask(n);
  for (int k = from[2]; k < to[2]; ++k)
    for (int j = from[1]; j < to[1]; ++j)
      for (int i = from[0]; i < to[0]; ++i)
        mask.View()(i, j, k) = 1;
  return mask;
}

int CoveredAt(const RegionMap& regions, int i, int j, int k)
{
  unsigned char count = 99;
  regions.Coverage().Copy(i, j, k, 1, &count);
  return count;
}

bool IsPure(const RegionMap& regions, int v, int i, int j, int k)
{
  unsigned char out = 9;
  regions.RegionRow(Region::Pure, v, i, j, k, 1, &out);
  return out == 1;
}

} // namespace

TEST(RegionMap, ThicknessIsTwiceTheVoxelsOverTheFaces)
{
  Random random(7);
  const int sides[3][3] = {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  for (int trial = 0; trial < 8; ++trial) {
    const Scene scene =
        RandomScene(trial % 4 == 0 ? std::array<int, 3>{30, 24, 1} : std::array<int, 3>{24, 20, 17}, {1.0, 1.0, 1.0}, 3, random);
    const RegionMap regions = scene.Regions();
    for (int v = 0; v < 3; ++v) {
      std::ptrdiff_t voxels = 0, faces = 0;
      scene.ForAll([&](int i, int j, int k) {
        const bool shared = scene.Is(Region::Overlap, v, i, j, k);
        voxels += shared;
        for (const auto& [x, y, z] : sides) {
          if (i + x < 0 || j + y < 0 || k + z < 0)
            continue;
          const bool beside = scene.Is(Region::Overlap, v, i + x, j + y, k + z);
          const auto known = [&](int a, int b, int c) {
            return scene.Is(Region::Pure, v, a, b, c) || scene.Is(Region::Empty, v, a, b, c);
          };
          faces += (shared && known(i + x, j + y, k + z)) || (beside && known(i, j, k));
        }
      });
      EXPECT_EQ(regions.OverlapThickness(v), voxels == 0 ? 0.0 : 2.0 * static_cast<double>(voxels) / static_cast<double>(faces));
    }
  }
}

TEST(RegionMap, RegionsAreTheBooleanOnes)
{
  Random random(11);
  for (int trial = 0; trial < 10; ++trial) {
    Scene scene = RandomScene({13, 11, trial % 2 ? 1 : 9}, {1.0, 1.0, 1.0}, 2 + trial % 4, random);
    const RegionMap regions = scene.Regions();
    std::ptrdiff_t number = 0;
    std::vector<unsigned char> row(13);
    scene.ForAll([&](int i, int j, int k) {
      const int covered = scene.Others(-1, i, j, k);
      ASSERT_EQ(CoveredAt(regions, i, j, k), covered);
      ASSERT_EQ(regions.OverlapBefore(i, j, k), number);
      number += covered > 1;
      for (int v = 0; v < regions.Count(); ++v)
        for (const Region region : {Region::Pure, Region::Overlap, Region::Empty}) {
          regions.RegionRow(region, v, i / 2, j, k, 13 - i / 2, row.data()); // rows may begin anywhere
          ASSERT_EQ(row[i - i / 2], scene.Is(region, v, i, j, k));
        }
    });
    EXPECT_EQ(regions.OverlapCount(), number);
    for (int v = 0; v < regions.Count(); ++v) {
      std::ptrdiff_t pure = 0, overlap = 0;
      scene.ForAll([&](int i, int j, int k) {
        pure += scene.Is(Region::Pure, v, i, j, k);
        overlap += scene.Is(Region::Overlap, v, i, j, k);
      });
      EXPECT_EQ(regions.PureCount(v), pure);
      EXPECT_EQ(regions.OverlapCount(v), overlap);
      EXPECT_EQ(regions.InsideCount(v), pure + overlap);
    }
  }
}

TEST(RegionMap, DistancesAreExactInTheOverlap)
{
  Random random(12);
  for (int trial = 0; trial < 24; ++trial) {
    const bool image = trial % 3 == 0;
    Scene scene = RandomScene(image ? std::array<int, 3>{37, 31, 1} : std::array<int, 3>{17, 15, 13},
                              trial % 2 ? Eigen::Vector3d(1.0, 1.0, 1.0) : Eigen::Vector3d(0.5, 0.8, 1.3), 2 + trial % 3, random);
    const RegionMap regions = scene.Regions();
    for (int v = 0; v < regions.Count(); ++v)
      for (const Region region : {Region::Pure, Region::Empty}) {
        const Boxed<float> distance = regions.SquaredDistanceTo(region, v);
        scene.ForAll([&](int i, int j, int k) {
          if (!scene.Is(Region::Overlap, v, i, j, k))
            return;
          const double truth = BruteSquared(scene, region, v, i, j, k);
          if (distance.box.Empty()) {
            ASSERT_TRUE(std::isinf(truth));
            return;
          }
          ASSERT_TRUE(distance.box.HasRow(j, k));
          ASSERT_GE(i, distance.box.first[0]);
          ASSERT_LT(i, distance.box.first[0] + distance.box.size[0]);
          ASSERT_NEAR(distance.Row(j, k)[i - distance.box.first[0]], truth, 1e-5 * truth) << "trial " << trial;
        });
      }
  }
}

TEST(RegionMap, DistancesAreMadeNearTheOverlapOnly)
{
  // Two long rods side by side that touch over a short piece: the box must not be the grid.
  const std::array<int, 3> n{400, 24, 24};
  Scene scene{n, {1.0, 1.0, 1.0}, {BoxMask(n, {0, 0, 0}, {210, 24, 24}), BoxMask(n, {190, 0, 0}, {400, 24, 24})}};
  const RegionMap regions = scene.Regions();
  EXPECT_LE(regions.SquaredDistanceTo(Region::Pure, 0).box.size[0], 90);
  EXPECT_LE(regions.SquaredDistanceTo(Region::Empty, 0).box.size[0], 90);
}

TEST(RegionMap, WhatIsFarAwayIsFoundAndTheVoidBetweenTakesNoMemory)
{
  // The second lies in the first, whose empty region is the far third and, nearer but beside a corner, the fourth.
  const std::array<int, 3> n{240, 40, 30};
  const Scene scene{n,
                    {1.0, 1.0, 1.5},
                    {BoxMask(n, {0, 0, 0}, {20, 20, 10}), BoxMask(n, {5, 5, 2}, {9, 9, 6}), BoxMask(n, {200, 3, 2}, {240, 13, 8}),
                     BoxMask(n, {150, 36, 25}, {154, 39, 29})}};
  const RegionMap regions = scene.Regions();
  EXPECT_EQ(regions.Coverage().Bytes(), 20u * 20 * 10 + 40 * 10 * 6 + 4 * 3 * 4);
  const Boxed<float> distance = regions.SquaredDistanceTo(Region::Empty, 0);
  for (int k = 2; k < 6; ++k)
    for (int j = 5; j < 9; ++j)
      for (int i = 5; i < 9; ++i)
        ASSERT_FLOAT_EQ(distance.Row(j, k)[i - distance.box.first[0]],
                        static_cast<float>(BruteSquared(scene, Region::Empty, 0, i, j, k)));
}

TEST(RegionMap, DepthIsTheDistanceToTheOutside)
{
  const std::array<int, 3> n{20, 20, 20};
  Scene scene{n, {1.0, 2.0, 0.5}, {BoxMask(n, {0, 5, 6}, {10, 20, 14}), BoxMask(n, {0, 0, 0}, {20, 20, 20})}};
  const RegionMap regions = scene.Regions();
  const Boxed<float> depth = regions.SquaredDepth(0);
  for (int k = 6; k < 14; ++k)
    for (int j = 5; j < 20; ++j)
      for (int i = 0; i < 10; ++i) {
        // Beyond the grid is outside too.
        const double d = std::min({1.0 * (i + 1), 1.0 * (10 - i), 2.0 * (j - 4), 2.0 * (20 - j), 0.5 * (k - 5), 0.5 * (14 - k)});
        ASSERT_FLOAT_EQ(depth.Row(j, k)[i - depth.box.first[0]], static_cast<float>(d * d));
      }
}

TEST(RegionMap, AMiddleVolumeGetsTheCoreWhereItIsDeepest)
{
  // [0, 10), [4, 14), [8, 18): the middle one is covered, and deeper than both neighbours around its middle.
  const std::array<int, 3> n{18, 30, 1};
  Scene scene{n,
              {1.0, 1.0, 1.0},
              {BoxMask(n, {0, 0, 0}, {10, 30, 1}), BoxMask(n, {4, 0, 0}, {14, 30, 1}), BoxMask(n, {8, 0, 0}, {18, 30, 1})}};
  RegionMap regions = scene.Regions();
  EXPECT_EQ(regions.PureCount(1), 0);
  regions.GiveCores();
  EXPECT_FALSE(regions.HasCore(0));
  EXPECT_TRUE(regions.HasCore(1));
  EXPECT_FALSE(regions.HasCore(2));
  for (int i = 0; i < 18; ++i)
    for (const int j : {0, 15, 29})                                   // also at the border to the void
      EXPECT_EQ(IsPure(regions, 1, i, j, 0), i >= 7 && i <= 10) << i; // 7 lies 4 deep in it and 3 deep in the first volume
  for (int i = 0; i < 18; ++i)
    EXPECT_EQ(IsPure(regions, 0, i, 15, 0), i < 4) << i;
}

TEST(RegionMap, IdenticalAndNestedVolumesHaveCores)
{
  const std::array<int, 3> n{16, 16, 16};
  const Mask large = BoxMask(n, {0, 0, 0}, {16, 16, 16}), small = BoxMask(n, {5, 5, 5}, {10, 10, 10});
  Scene same{n, {1.0, 1.0, 1.0}, {large, large}};
  RegionMap regions = same.Regions();
  regions.GiveCores();
  same.ForAll([&](int i, int j, int k) { ASSERT_TRUE(IsPure(regions, 0, i, j, k) && IsPure(regions, 1, i, j, k)); });

  Scene nested{n, {1.0, 1.0, 1.0}, {large, small}};
  regions = nested.Regions();
  regions.GiveCores();
  EXPECT_FALSE(regions.HasCore(0));
  EXPECT_TRUE(regions.HasCore(1));
  nested.ForAll([&](int i, int j, int k) { ASSERT_EQ(IsPure(regions, 1, i, j, k), i == 7 && j == 7 && k == 7); });
}

TEST(RegionMap, CoverageSaturates)
{
  const std::array<int, 3> n{3, 2, 1};
  Scene scene{n, {1.0, 1.0, 1.0}, std::vector<Mask>(300, BoxMask(n, {0, 0, 0}, {2, 2, 1}))};
  const RegionMap regions = scene.Regions();
  EXPECT_EQ(CoveredAt(regions, 0, 0, 0), 255);
  EXPECT_EQ(CoveredAt(regions, 2, 0, 0), 0);
  EXPECT_EQ(regions.OverlapCount(), 4);
}
