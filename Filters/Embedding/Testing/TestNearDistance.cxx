// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/DistanceMap.h"
#include "Filters/Embedding/NearDistance.h"
#include <gtest/gtest.h>

namespace echorama {

namespace {

// Single voxels far apart, so that most distances are more than a few voxels, and a solid corner.
Volume<unsigned char> Mask(const std::array<int, 3>& size)
{
  Volume<unsigned char> mask(size);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        mask.View()(i, j, k) = Random(6, static_cast<std::uint64_t>((k * size[1] + j) * size[0] + i)).Uniform() < 0.002 ||
                               (i < size[0] / 3 && j < size[1] / 3);
  return mask;
}

} // namespace

// Equal spacings, of whole and of broken voxels, different ones, planes and lines, radii below a voxel and of many.
TEST(NearDistance, IsTheDistanceMapAsFarAsTheRadius)
{
  const Eigen::Vector3d equal(0.8, 0.8, 0.8), unequal(0.5, 0.7, 1.3);
  for (const std::array<int, 3>& size :
       {std::array<int, 3>{150, 40, 30}, {37, 1, 41}, {50, 60, 1}, {1, 33, 20}, {70, 1, 1}, {3, 2, 2}, {1, 1, 1}}) {
    const Volume<unsigned char> mask = Mask(size);
    for (const Eigen::Vector3d& spacing : {equal, unequal})
      for (const double radius : {0.3, 1.6, 3.0, 5.0, 40.0}) {
        Volume<float> all(size), near(size);
        SquaredDistanceMap(mask.View(), spacing, all.View());
        NearSquaredDistances(mask.View(), spacing, radius, near.View());
        std::ptrdiff_t within = 0;
        for (std::ptrdiff_t at = 0; at < all.View().Size(); ++at) {
          const float wanted = all.View()[at], got = near.View()[at];
          if (static_cast<double>(wanted) <= radius * radius) {
            ASSERT_EQ(got, wanted) << size[0] << " " << spacing[0] << " " << radius;
            ++within;
          } else {
            ASSERT_GE(got, wanted);
          }
        }
        if (size[0] == 150) {
          EXPECT_GT(within, 1000);
        }
      }
  }
}

TEST(NearDistance, OfNothingItIsFarEverywhere)
{
  const Volume<unsigned char> mask({20, 9, 8});
  Volume<float> near(mask.Dimensions());
  NearSquaredDistances(mask.View(), Eigen::Vector3d::Ones(), 3.0, near.View());
  for (const float value : near.View())
    ASSERT_GT(value, 9.0f);
}

TEST(NearDistance, RefusesBadInput)
{
  const Volume<unsigned char> mask({20, 9, 8});
  Volume<float> near({20, 9, 7}), same({20, 9, 8});
  EXPECT_THROW(NearSquaredDistances(mask.View(), Eigen::Vector3d::Ones(), 3.0, near.View()), Error);
  EXPECT_THROW(NearSquaredDistances(mask.View(), Eigen::Vector3d(1.0, 0.0, 1.0), 3.0, same.View()), Error);
  EXPECT_THROW(
      NearSquaredDistances(mask.View(), Eigen::Vector3d::Ones(), 3.0, same.View(), Progress([](double) { return false; })),
      Error);
}

} // namespace echorama
