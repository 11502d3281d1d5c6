// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/HandlePicture.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr HandlePicture::Colour Red{255, 0, 0, 255}, Blue{0, 0, 255, 255};

double AreaOf(const HandlePicture& picture, const std::vector<int>& polygon)
{
  double area = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = picture.points[static_cast<std::size_t>(polygon[i])],
                   &b = picture.points[static_cast<std::size_t>(polygon[(i + 1) % polygon.size()])];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return std::abs(area);
}

} // namespace

TEST(HandlePicture, ALineHasItsWidthAndItsColours)
{
  HandlePicture picture;
  picture.AddLine({{10, 10}, {30, 10}, {60, 10}}, {Red, Red, Blue}, 4.0, false);
  ASSERT_EQ(picture.polygons.size(), 2u);
  EXPECT_DOUBLE_EQ(AreaOf(picture, picture.polygons[0]), 4.0 * 20.0);
  EXPECT_DOUBLE_EQ(AreaOf(picture, picture.polygons[1]), 4.0 * 30.0);
  EXPECT_EQ(picture.colours[3], Red);
  EXPECT_EQ(picture.colours[4], Blue);
  // A second one keeps to its own points, and a closed one comes back.
  picture.AddLine({{0, 0}, {10, 0}, {10, 10}, {0, 10}}, {Red, Red, Red, Red}, 1.0, true);
  ASSERT_EQ(picture.polygons.size(), 6u);
  EXPECT_EQ(*std::min_element(picture.polygons[2].begin(), picture.polygons[2].end()), 6);
  EXPECT_EQ(picture.polygons[5], (std::vector<int>{12, 6, 7, 13}));
}

TEST(HandlePicture, ARingSeenEdgeOnHasNoHoles)
{
  HandlePicture picture;
  picture.AddLine({{0, 0}, {10, 0}, {0, 0}}, {Red, Red, Red}, 2.0, false); // turns back
  for (const Vector2d& point : picture.points)
    EXPECT_TRUE(point.allFinite());
  EXPECT_NE(picture.points[2], picture.points[3]);
}

TEST(HandlePicture, TheConstraintIsSeenAsItsAxes)
{
  MouseView view; // along z
  const auto lines = [&view](MotionConstraint::Kind kind, int axis) {
    HandlePicture picture;
    DrawConstraint(view, {kind, Vector3d::Unit(axis)}, Vector3d::Zero(), picture);
    return picture.polygons.size();
  };
  EXPECT_EQ(lines(MotionConstraint::Kind::Free, 0), 0u);
  EXPECT_EQ(lines(MotionConstraint::Kind::Axis, 0), 1u);
  EXPECT_EQ(lines(MotionConstraint::Kind::Axis, 2), 0u) << "it points at the viewer";
  EXPECT_EQ(lines(MotionConstraint::Kind::Plane, 2), 2u);
  EXPECT_EQ(lines(MotionConstraint::Kind::Plane, 0), 1u);
}

TEST(HandlePicture, EachHandleIsDrawnAndTheMarkedOneStandsOut)
{
  const MouseView view;
  const HandleSizes sizes;
  const std::vector<Handle> handles = MakeHandles(view, Vector3d::Zero(), Eigen::Matrix3d::Identity(), true, sizes);
  HandlePicture plain;
  DrawHandles(handles, -1, true, sizes, plain);
  for (std::size_t i = 0; i < handles.size(); ++i) {
    HandlePicture marked;
    DrawHandles(handles, static_cast<int>(i), true, sizes, marked);
    EXPECT_NE(marked.colours, plain.colours) << i;
    EXPECT_EQ(marked.polygons.size(), plain.polygons.size());
  }
}
