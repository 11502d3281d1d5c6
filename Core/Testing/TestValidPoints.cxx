// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Percentile.h"
#include "Core/Imaging/ValidPoints.h"
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

namespace echorama {
namespace {

TEST(ValidPoints, LieInRealVoxelsOfAnyVolume)
{
  const std::array<int, 3> n{7, 5, 3};
  Volume<float> intensity(n, std::numeric_limits<float>::quiet_NaN());
  Volume<unsigned char> valid(n, 1);
  for (const int i : {0, 11, 36, 104})
    intensity.View()[i] = 1.0f;
  valid.View()[11] = 0;
  const auto points = ValidPoints<float>(intensity.View(), valid.View(), 3000, 9);
  ASSERT_EQ(points.size(), 3000u);
  std::array<int, 105> hits{};
  for (const Eigen::Vector3d& p : points) {
    const auto cell = (p.array() + 0.5).floor().cast<int>();
    ++hits[static_cast<std::size_t>(cell[0] + 7 * (cell[1] + 5 * cell[2]))];
  }
  for (const std::size_t i : {std::size_t{0}, std::size_t{36}, std::size_t{104}})
    EXPECT_NEAR(hits[i], 1000, 130);
  EXPECT_EQ(hits[0] + hits[36] + hits[104], 3000);

  std::ptrdiff_t count = 0;
  const Eigen::Vector3d centroid = ValidCentroid<float>(intensity.View(), valid.View(), count);
  EXPECT_EQ(count, 3);
  // Voxels 0, 36 and 104 are (0,0,0), (1,0,1) and (6,4,2).
  EXPECT_LT((centroid - Eigen::Vector3d(7.0 / 3.0, 4.0 / 3.0, 1.0)).norm(), 1e-12);

  const Volume<unsigned char> none(n, 0);
  EXPECT_TRUE(ValidPoints<float>(intensity.View(), none.View(), 10, 9).empty());
  ValidCentroid<float>(intensity.View(), none.View(), count);
  EXPECT_EQ(count, 0);
}

TEST(ValidPoints, AreTheSameForTheSameSeed)
{
  const std::array<int, 3> flat{20, 30, 1};
  const Volume<short> image(flat, 4);
  const auto points = ValidPoints<short>(image.View(), {}, 50, 1);
  EXPECT_EQ(points, ValidPoints<short>(image.View(), {}, 50, 1));
  EXPECT_NE(points, ValidPoints<short>(image.View(), {}, 50, 2));
  for (const Eigen::Vector3d& p : points)
    EXPECT_EQ(p.z(), 0.0);
}

// The nearest rank: between two numbers the lower one, and never a number that is not there.
TEST(Percentile, IsTheNearestRank)
{
  std::vector<double> numbers(20);
  std::iota(numbers.rbegin(), numbers.rend(), 1.0);
  EXPECT_EQ(Percentile(numbers, 0.95), 19.0);
  EXPECT_EQ(Percentile(numbers, 0.951), 20.0);
  EXPECT_EQ(Percentile(numbers, 0.5), 10.0);
  EXPECT_EQ(Percentile(numbers, 0.0), 1.0);
  EXPECT_EQ(Percentile(numbers, 1.0), 20.0);
  EXPECT_EQ(Percentile({7.0}, 0.3), 7.0);
}

} // namespace
} // namespace echorama
