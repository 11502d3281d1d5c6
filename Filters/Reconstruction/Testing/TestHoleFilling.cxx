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

TEST(HoleFilling, TheCubeOfTheMeanIsThatOfTheGap)
{
  Scene one({12, 3, 3});
  one.See(3, 1, 1, 200);
  one.See(5, 1, 1, 60);
  one.See(7, 1, 1, 80);
  one.Fill(HoleFilling::Mean, 5);
  EXPECT_EQ(one.intensity.View()(6, 1, 1), 70);
  EXPECT_EQ(one.intensity.View()(4, 1, 1), 130);
  Scene three({12, 3, 3});
  three.See(4, 1, 1, 255);
  three.See(5, 1, 1, 60);
  three.See(9, 1, 1, 80);
  EXPECT_EQ(three.Fill(HoleFilling::Mean, 5), 3u);
  EXPECT_EQ(three.intensity.View()(6, 1, 1), 158); // half edge 2: 255 and 60
  EXPECT_EQ(three.intensity.View()(7, 1, 1), 70);
  EXPECT_EQ(three.intensity.View()(8, 1, 1), 80);
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

TEST(HoleFilling, SticksAreThoseOfBruteForce)
{
  const std::array<int, 3> n{14, 12, 10};
  constexpr int reach = 3;
  Scene scene(n);
  Random random(5);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (random.Uniform() < 0.15)
          scene.See(i, j, k, static_cast<unsigned char>(random.Below(256)));
  const Scene before = scene;
  // As in Plus the end ahead counts more than the one behind, so that it matters which way a line runs.
  const std::array<std::array<int, 3>, 13> lines{{{1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, 0, 1},
                                                  {1, 1, 0},
                                                  {1, -1, 0},
                                                  {1, 0, 1},
                                                  {1, 0, -1},
                                                  {0, 1, 1},
                                                  {0, 1, -1},
                                                  {1, 1, 1},
                                                  {-1, 1, 1},
                                                  {1, -1, 1},
                                                  {1, 1, -1}}};
  const auto seen = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2] && before.coverage.View()(i, j, k) > 0;
  };
  scene.Fill(HoleFilling::Stick, reach);
  int filled = 0, oblique = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (seen(i, j, k))
          continue;
        double shortest = 1e9, sum = 0.0;
        int count = 0, steps = 0;
        for (const auto& [x, y, z] : lines) {
          int ahead = 1, back = 1;
          while (ahead <= reach && !seen(i + ahead * x, j + ahead * y, k + ahead * z))
            ++ahead;
          while (back <= reach && !seen(i - back * x, j - back * y, k - back * z))
            ++back;
          if (ahead + back - 1 > reach)
            continue;
          const double length = (ahead + back + 1) * std::sqrt(static_cast<double>(x * x + y * y + z * z));
          if (length < shortest) {
            shortest = length;
            sum = count = 0;
            steps = x * x + y * y + z * z;
          }
          if (length == shortest) {
            const double share = (back + 1.0) / (ahead + back + 1.0);
            sum += share * before.intensity.View()(i + ahead * x, j + ahead * y, k + ahead * z) +
                   (1.0 - share) * before.intensity.View()(i - back * x, j - back * y, k - back * z);
            ++count;
          }
        }
        ASSERT_EQ(scene.valid.View()(i, j, k), count > 0) << i << " " << j << " " << k;
        ASSERT_EQ(scene.intensity.View()(i, j, k), count > 0 ? std::floor(sum / count + 0.5) : 0.0) << i << " " << j << " " << k;
        filled += count > 0;
        oblique += steps > 1;
      }
  EXPECT_GT(filled, 500);
  EXPECT_GT(oblique, 100);
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

// Which voxels are holes, against the definition tried at every voxel.
TEST(HoleFilling, HolesAreThoseOfTheDefinition)
{
  const std::array<int, 3> n{23, 19, 21};
  Random random(17);
  Scene scene(n);
  for (int seen = 0; seen < 60; ++seen)
    scene.See(static_cast<int>(random.Below(23)), static_cast<int>(random.Below(19)), static_cast<int>(random.Below(21)), 9);
  const auto seen = scene.coverage.View();
  const auto ahead = [&](int i, int j, int k, int x, int y, int z) {
    for (int step = 1;; ++step) {
      const int a = i + step * x, b = j + step * y, c = k + step * z;
      if (a < 0 || b < 0 || c < 0 || a >= n[0] || b >= n[1] || c >= n[2])
        return 1000;
      if (seen(a, b, c))
        return step;
    }
  };
  for (const int reach : {1, 4, 9, 40, 100}) {
    scene.Fill(HoleFilling::Stick, reach);
    std::ptrdiff_t different = 0, holes = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          bool hole = false;
          for (int line = 14; line < 27 && !seen(i, j, k); ++line) { // one of each pair of opposite directions
            const int x = line % 3 - 1, y = line / 3 % 3 - 1, z = line / 9 - 1;
            hole = hole || ahead(i, j, k, x, y, z) + ahead(i, j, k, -x, -y, -z) - 1 <= reach;
          }
          holes += hole;
          different += (scene.valid.View()(i, j, k) == 1) != (hole || seen(i, j, k));
        }
    EXPECT_EQ(different, 0) << reach;
    EXPECT_GT(holes, 0) << reach;
  }
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
