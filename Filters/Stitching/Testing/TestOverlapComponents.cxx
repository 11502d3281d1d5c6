// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Stitching/OverlapComponents.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// Boxes in a grid, and the pieces of their overlap.
struct Pieces {
  RegionMap regions;
  OverlapComponents components;

  Pieces(const std::array<int, 3>& grid, const std::vector<GridBox>& boxes)
    : regions(Masks(boxes), grid, Eigen::Vector3d::Ones()), components((regions.GiveCores(), regions))
  {
  }
  static std::vector<Boxed<unsigned char>> Masks(const std::vector<GridBox>& boxes)
  {
    std::vector<Boxed<unsigned char>> masks;
    for (const GridBox& box : boxes)
      masks.push_back({box, Volume<unsigned char>(box.size, 1)});
    return masks;
  }
  int PartnerOf(int volume, int i, int j, int k) const
  {
    int partner = -2; // not in the overlap
    components.ForRuns(volume, j, k, [&](int begin, int end, int other) {
      if (i >= begin && i < end)
        partner = other;
    });
    return partner;
  }
};

} // namespace

TEST(OverlapComponents, InAChainEveryOverlapIsAPair)
{
  const Pieces chain({30, 6, 4}, {{{0, 0, 0}, {12, 6, 4}}, {{8, 0, 0}, {12, 6, 4}}, {{16, 0, 0}, {14, 6, 4}}});
  EXPECT_EQ(chain.components.Count(), 2);
  EXPECT_EQ(chain.PartnerOf(0, 9, 2, 1), 1);
  EXPECT_EQ(chain.PartnerOf(1, 9, 2, 1), 0);
  EXPECT_EQ(chain.PartnerOf(1, 17, 2, 1), 2);
  EXPECT_EQ(chain.PartnerOf(2, 17, 2, 1), 1);
}

TEST(OverlapComponents, ThreeInOnePieceAreNoPair)
{
  const Pieces triple({20, 20, 1}, {{{0, 0, 0}, {12, 12, 1}}, {{8, 0, 0}, {12, 12, 1}}, {{4, 8, 0}, {12, 12, 1}}});
  EXPECT_EQ(triple.components.Count(), 1);
  EXPECT_EQ(triple.PartnerOf(0, 9, 9, 0), -1);
}

TEST(OverlapComponents, AThirdThatTouchesThePieceIsABoundaryOfIt)
{
  // The third begins where the overlap of the others ends.
  const Pieces touched({12, 12, 1}, {{{0, 0, 0}, {8, 6, 1}}, {{4, 0, 0}, {8, 6, 1}}, {{4, 6, 0}, {4, 6, 1}}});
  EXPECT_EQ(touched.components.Count(), 1);
  EXPECT_EQ(touched.PartnerOf(0, 5, 3, 0), -1);
}

TEST(OverlapComponents, IdenticalVolumesClaimTheSameCore)
{
  const Pieces same({6, 6, 6}, {{{0, 0, 0}, {6, 6, 6}}, {{0, 0, 0}, {6, 6, 6}}});
  EXPECT_EQ(same.components.Count(), 1);
  EXPECT_EQ(same.PartnerOf(0, 3, 3, 3), -1);
}

TEST(OverlapComponents, PiecesThatMeetByAnEdgeAreTwo)
{
  const Pieces edges({8, 8, 1}, {{{0, 0, 0}, {4, 4, 1}}, {{4, 4, 0}, {4, 4, 1}}, {{0, 0, 0}, {8, 8, 1}}});
  EXPECT_EQ(edges.components.Count(), 2);
}
