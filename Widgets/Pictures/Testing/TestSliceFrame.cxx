// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Pictures/SliceFrame.h"
#include <gtest/gtest.h>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

SliceFrame Oblique()
{
  SliceFrame frame;
  frame.width = 301;
  frame.height = 200;
  frame.mmPerPixel = 0.25;
  frame.focus = {3.0, -20.0, 11.0};
  frame.cursor = {5.0, 1.0, -4.0};
  EXPECT_TRUE(frame.SetNormalAndUp({1.0, 2.0, -3.0}, {0.0, -1.0, 0.2}));
  return frame;
}

TEST(SliceFrame, PixelsAreSquaresOfThePlane)
{
  const SliceFrame frame = Oblique();
  for (const Vector2d& pixel : {Vector2d(0.0, 0.0), Vector2d(17.5, 103.25), Vector2d(300.0, 199.0)}) {
    const Vector3d world = frame.WorldOf(pixel.x(), pixel.y());
    EXPECT_LT((frame.PixelOf(world) - pixel).norm(), 1e-9);
    EXPECT_LT((frame.PixelOf(world + 7.0 * frame.Towards()) - pixel).norm(), 1e-9); // seen along the normal
    EXPECT_NEAR((world - frame.cursor).dot(frame.Towards()), 0.0, 1e-12);
  }
  EXPECT_NEAR((frame.WorldOf(1.0, 0.0) - frame.WorldOf(0.0, 0.0)).norm(), 0.25, 1e-12);
  EXPECT_LT((frame.WorldOf(150.0, 99.5) - frame.focus).norm(), 1e-12); // the middle of 301 x 200 pixels
  // The outer corners lie half a pixel beyond the outermost middles.
  const auto corners = frame.Corners();
  EXPECT_LT((frame.PixelOf(corners[0]) - Vector2d(-0.5, -0.5)).norm(), 1e-9);
  EXPECT_LT((frame.PixelOf(corners[1]) - Vector2d(300.5, -0.5)).norm(), 1e-9);
  EXPECT_LT((frame.PixelOf(corners[2]) - Vector2d(300.5, 199.5)).norm(), 1e-9);
  EXPECT_LT((frame.PixelOf(corners[3]) - Vector2d(-0.5, 199.5)).norm(), 1e-9);
}

TEST(SliceFrame, PlanesGoThroughTheCursorAndFramesAreRightHanded)
{
  SliceFrame frame = Oblique();
  const auto check = [&frame] {
    Eigen::Matrix3d axes;
    axes << frame.right, frame.up, frame.Towards();
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR((frame.cursor - frame.focus).dot(frame.Towards()), 0.0, 1e-12);
  };
  check();
  EXPECT_LT((frame.Towards() - Vector3d(1.0, 2.0, -3.0).normalized()).norm(), 1e-12);
  EXPECT_GT(frame.up.dot(Vector3d(0.0, -1.0, 0.2)), 0.0);
  const Vector2d before = frame.PixelOf(frame.cursor);
  const Vector3d up = frame.up;
  frame.Turn(0.0, 30.0); // about what is up: it stays, and so does the cursor on the screen
  check();
  EXPECT_LT((frame.up - up).norm(), 1e-12);
  EXPECT_LT((frame.PixelOf(frame.cursor) - before).norm(), 1e-9);
  EXPECT_NEAR(frame.Towards().dot(Vector3d(1.0, 2.0, -3.0).normalized()), std::cos(30.0 * 0.017453292519943295), 1e-12);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.SetAxis(axis);
    check();
    EXPECT_NEAR(frame.Position(), frame.cursor[static_cast<int>(axis)], 1e-12);
  }
  const SliceFrame kept = frame;
  EXPECT_FALSE(frame.SetNormalAndUp({1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}));
  EXPECT_FALSE(frame.SetNormalAndUp({0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}));
  EXPECT_EQ(frame.right, kept.right);
  EXPECT_EQ(frame.axis, kept.axis);
}

TEST(SliceFrame, ALineShowsWhereAnotherPlaneCuts)
{
  const SliceFrame frame = Oblique();
  SliceFrame other = frame;
  other.SetAxis(0);
  const auto line = frame.CutBy(other);
  ASSERT_TRUE(line);
  for (const Vector2d& end : *line) {
    const Vector3d world = frame.WorldOf(end.x(), end.y());
    EXPECT_NEAR(world.x(), other.Position(), 1e-9); // in both planes
    const double outside = std::max({-end.x(), -end.y(), end.x() - 300.0, end.y() - 199.0});
    EXPECT_NEAR(outside, 0.0, 1e-9); // on the border of the picture
  }
  EXPECT_GT(((*line)[1] - (*line)[0]).norm(), 100.0);
  EXPECT_FALSE(frame.CutBy(frame));
  SliceFrame away = frame; // the line goes by
  away.focus += 1000.0 * away.right + 1000.0 * away.up;
  EXPECT_FALSE(away.CutBy(other));
}

TEST(SliceFrame, ABallIsCutInACircle)
{
  const SliceFrame frame = Oblique();
  const Vector3d middle = frame.WorldOf(100.0, 80.0) + 3.0 * frame.Towards();
  const auto circle = frame.CutOf(middle, 5.0);
  ASSERT_GT(circle.size(), 16u);
  for (const Vector2d& p : circle)
    EXPECT_NEAR((p - Vector2d(100.0, 80.0)).norm(), 16.0, 1e-9); // 4 mm of 5, 3 off the plane
  EXPECT_LT((circle.front() - circle.back()).norm(), 1e-9);
  EXPECT_TRUE(frame.CutOf(middle, 3.0).empty());
  EXPECT_TRUE(frame.CutOf(middle, 0.0).empty());
}

TEST(SliceFrame, TheScaleBarIsARoundLength)
{
  SliceFrame frame;
  frame.width = 400;
  for (const auto& [mm, bar] :
       {std::pair(0.5, 50.0), {0.49, 20.0}, {0.2, 20.0}, {0.199, 10.0}, {0.1, 10.0}, {0.0999, 5.0}, {2.0, 200.0}}) {
    frame.mmPerPixel = mm;
    EXPECT_DOUBLE_EQ(frame.ScaleBarMm(), bar) << mm;
  }
}

} // namespace
} // namespace echorama
