// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Embedding/RegionSurface.h"
#include <algorithm>
#include <gtest/gtest.h>
#include <tuple>

namespace echorama {

namespace {

std::size_t CountOf(const Volume<unsigned char>& region)
{
  return SurfaceOf(region.View()).size();
}

} // namespace

TEST(RegionSurface, TheShellOfABox)
{
  Volume<unsigned char> region({9, 8, 7});
  for (int k = 1; k < 6; ++k)
    for (int j = 2; j < 6; ++j)
      for (int i = 3; i < 9; ++i)
        region.View()(i, j, k) = 1;
  const auto surface = SurfaceOf(region.View());
  EXPECT_EQ(surface.size(), 6u * 4 * 5 - 4u * 2 * 3); // touches the end of the first axis: that side is surface too
  EXPECT_EQ(surface.front(), (std::array<int, 3>{3, 2, 1}));
  EXPECT_TRUE(std::is_sorted(surface.begin(), surface.end(), [](const auto& a, const auto& b) {
    return std::make_tuple(a[2], a[1], a[0]) < std::make_tuple(b[2], b[1], b[0]);
  }));
}

TEST(RegionSurface, FullGridsHaveTheirRim)
{
  EXPECT_EQ(CountOf(Volume<unsigned char>({5, 5, 5}, 1)), 125u - 27u);
  EXPECT_EQ(CountOf(Volume<unsigned char>({5, 5, 1}, 1)), 25u - 9u); // a single slice has no beyond along its axis
  EXPECT_EQ(CountOf(Volume<unsigned char>({1, 1, 1}, 1)), 0u);
}

TEST(RegionSurface, HolesIslandsAndNothing)
{
  Volume<unsigned char> region({7, 7, 7}, 1);
  region.View()(3, 3, 3) = 0;
  EXPECT_EQ(CountOf(region), 343u - 125u + 26u);
  Volume<unsigned char> island({7, 7, 7});
  island.View()(3, 3, 3) = 255; // any number but 0
  EXPECT_EQ(SurfaceOf(island.View()), (std::vector<std::array<int, 3>>{{3, 3, 3}}));
  EXPECT_EQ(CountOf(Volume<unsigned char>({7, 7, 7})), 0u);
}

} // namespace echorama
