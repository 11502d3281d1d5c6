// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Reconstruction/HoleFilling.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace echorama;

namespace {

struct Scene {
  explicit Scene(std::array<int, 3> n, unsigned short seen = 0) : intensity(n), valid(n), coverage(n, seen) {}
  void See(int i, int j, int k, unsigned char value)
  {
    intensity.View()(i, j, k) = value;
    valid.View()(i, j, k) = 1;
    coverage.View()(i, j, k) = 1;
  }
  std::size_t Fill(HoleFilling method, int reach)
  {
    return FillHoles<unsigned char>({method, reach}, intensity.View(), valid.View(), coverage.View());
  }
  Volume<unsigned char> intensity, valid;
  Volume<unsigned short> coverage;
};

} // namespace

TEST(HoleFilling, ASingleVoxelGetsTheMeanOfItsNeighbours)
{
  Scene scene({5, 5, 5}, 0);
  Random random(3);
  double sum = 0.0;
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i)
        if (i != 2 || j != 2 || k != 2) {
          scene.See(i, j, k, static_cast<unsigned char>(random.Below(256)));
          if (std::max({std::abs(i - 2), std::abs(j - 2), std::abs(k - 2)}) == 1)
            sum += scene.intensity.View()(i, j, k);
        }
  EXPECT_EQ(scene.Fill(HoleFilling::Mean, 1), 1u);
  EXPECT_EQ(scene.intensity.View()(2, 2, 2), std::floor(sum / 26.0 + 0.5));
  EXPECT_EQ(scene.valid.View()(2, 2, 2), 1);
  EXPECT_EQ(scene.coverage.View()(2, 2, 2), 0);
}

TEST(HoleFilling, GapsUpToTheReachAreBridged)
{
  for (const HoleFilling method : {HoleFilling::Mean, HoleFilling::Stick})
    for (int gap = 1; gap < 6; ++gap)
      for (int reach = 1; reach < 6; ++reach) {
        Scene scene({3, 20, 3});
        scene.See(1, 2, 1, 60);
        scene.See(1, 3 + gap, 1, 120);
        const std::size_t filled = scene.Fill(method, reach);
        EXPECT_EQ(filled, gap <= reach ? static_cast<std::size_t>(gap) : 0u);
        for (int j = 3; method == HoleFilling::Stick && gap <= reach && j < 3 + gap; ++j) {
          // As in Plus: a hole at steps a and b from the ends weighs them by (b + 1) / (a + b + 1) and the rest.
          const double a = (3 + gap) - j, b = j - 2, share = (b + 1.0) / (a + b + 1.0);
          EXPECT_EQ(scene.intensity.View()(1, j, 1), std::floor(share * 120.0 + (1.0 - share) * 60.0 + 0.5));
        }
      }
}

TEST(HoleFilling, NothingBeyondTheRim)
{
  // A slab of data: what lies outside has data on one side only.
  Scene scene({12, 12, 12});
  for (int k = 4; k < 8; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i)
        scene.See(i, j, k, 50);
  EXPECT_EQ(scene.Fill(HoleFilling::Mean, 5), 0u);
}

TEST(HoleFilling, EarlierFillsAreForgotten)
{
  Scene scene({5, 5, 5});
  scene.See(1, 2, 2, 60);
  scene.See(3, 2, 2, 80);
  EXPECT_EQ(scene.Fill(HoleFilling::Mean, 1), 1u);
  EXPECT_EQ(scene.intensity.View()(2, 2, 2), 70);
  EXPECT_EQ(scene.Fill(HoleFilling::Mean, 1), 1u) << "what was filled must not count as seen";
  EXPECT_EQ(scene.Fill(HoleFilling::Nothing, 1), 0u);
  EXPECT_EQ(scene.intensity.View()(2, 2, 2), 0);
  EXPECT_EQ(scene.valid.View()(2, 2, 2), 0);
}

TEST(HoleFilling, ConstantsStayAndThreadsDoNotMatter)
{
  Scene scene({40, 30, 20});
  Random random(11);
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 40; ++i)
        if (random.Uniform() < 0.1)
          scene.See(i, j, k, 77);
  Scene other = scene;
  const std::size_t filled = scene.Fill(HoleFilling::Stick, 3);
  EXPECT_GT(filled, 5000u);
  for (std::ptrdiff_t at = 0; at < scene.valid.View().Size(); ++at)
    ASSERT_EQ(scene.intensity.View()[at], scene.valid.View()[at] ? 77 : 0);
  const ThreadLimit limit(1);
  EXPECT_EQ(other.Fill(HoleFilling::Stick, 3), filled);
  EXPECT_TRUE(std::equal(scene.valid.View().begin(), scene.valid.View().end(), other.valid.View().begin()));
}

TEST(HoleFilling, RefusesABadReachAndStops)
{
  Scene scene({4, 4, 4});
  EXPECT_THROW(scene.Fill(HoleFilling::Mean, 0), Error);
  EXPECT_THROW(scene.Fill(HoleFilling::Mean, 101), Error);
  EXPECT_THROW(FillHoles<unsigned char>({}, scene.intensity.View(), scene.valid.View(), scene.coverage.View(),
                                        Progress([](double) { return false; })),
               Error);
}
