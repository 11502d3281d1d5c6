// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Live/SkinShape.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// A tissue of tetrahedra of these sizes, about these places along x.
TissueSurface Tetrahedra(const std::vector<std::pair<float, float>>& sizesAndPlaces)
{
  TissueSurface tissue;
  tissue.materials.resize(1);
  for (const auto& [size, x] : sizesAndPlaces) {
    const auto first = static_cast<std::uint32_t>(tissue.points.size());
    for (const Eigen::Vector3f& corner : {Eigen::Vector3f(0, 0, 0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1}})
      tissue.points.push_back(size * corner + Eigen::Vector3f(x, 0, 0));
    for (const std::array<std::uint32_t, 3>& t : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      tissue.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      tissue.bodyOfTriangle.push_back(static_cast<std::int32_t>(tissue.bodies.size()));
    }
    tissue.bodies.emplace_back();
  }
  return tissue;
}

} // namespace

TEST(SkinShape, TheBodyThatHoldsTheOthersIsFoundWhereverItIsListed)
{
  EXPECT_EQ(OutermostBody(Tetrahedra({{3, 0}, {10, -1}, {2, 1}})), 1);
  EXPECT_EQ(OutermostBody(Tetrahedra({{3, 0}, {2, 1}, {10, -1}})), 2);
  EXPECT_EQ(OutermostBody(Tetrahedra({{10, -1}, {10, -1}})), 0);  // a layer over itself
  EXPECT_EQ(OutermostBody(Tetrahedra({{2, 1000}, {10, -1}})), 1); // size counts, not where it lies
  TissueSurface tissue = Tetrahedra({{3, 0}, {10, 0}});
  for (auto& body : tissue.bodyOfTriangle)
    body = 0; // the second is but a name
  EXPECT_EQ(OutermostBody(tissue), 0);
  EXPECT_EQ(OutermostBody({}), -1);
}

TEST(SkinShape, ParametersAreChecked)
{
  SkinParameters p;
  CheckRanges(p);
  p.mostCells = 999;
  EXPECT_THROW(CheckRanges(p), Error);
  p = {};
  p.passBand = 0.0;
  EXPECT_THROW(CheckRanges(p), Error);
}
