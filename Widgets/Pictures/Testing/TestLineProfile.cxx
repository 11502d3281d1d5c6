// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Widgets/Pictures/LineProfile.h"
#include "Widgets/Pictures/ShiftColours.h"
#include "Widgets/Pictures/SliceFrame.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// Grey = 3 x + 5 y - 2 z of the world, on an oblique grid; the first column is not real.
struct Ramp {
  ImageGeometry geometry;
  Volume<float> voxels{{20, 16, 12}};
  Volume<unsigned char> valid{{20, 16, 12}, 1};

  Ramp()
  {
    geometry.dimensions = {20, 16, 12};
    geometry.origin = {4, -3, 7};
    geometry.spacing = {0.5, 0.8, 1.1};
    geometry.direction = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    for (int k = 0; k < 12; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 20; ++i) {
          voxels.View()(i, j, k) = static_cast<float>(Grey(geometry.IndexToWorld() * Eigen::Vector3d(i, j, k)));
          valid.View()(i, j, k) = i > 0;
        }
  }
  static double Grey(const Eigen::Vector3d& world) { return world.dot(Eigen::Vector3d(3, 5, -2)); }
  Eigen::Vector3d At(double i, double j, double k) const { return geometry.IndexToWorld() * Eigen::Vector3d(i, j, k); }
  PosedVolume<float> Posed() const { return {voxels.View(), valid.View(), geometry}; }
};

} // namespace

TEST(LineProfile, ReadsGreyLevelsFromEndToEnd)
{
  const Ramp ramp;
  const Eigen::Vector3d from = ramp.At(3.3, 2.1, 1.2), to = ramp.At(17.5, 13.2, 9.9);
  const auto values = LineProfile(ramp.Posed(), from, to, 41);
  ASSERT_EQ(values.size(), 41u);
  for (int i = 0; i < 41; ++i)
    EXPECT_NEAR(values[static_cast<std::size_t>(i)], Ramp::Grey(from + (to - from) * i / 40.0), 2e-4);
}

TEST(LineProfile, WhereThereAreNoDataThereIsNothing)
{
  const Ramp ramp;
  // From outside, through the column that is not real, to the inside.
  const auto values = LineProfile(ramp.Posed(), ramp.At(-3.0, 5.0, 5.0), ramp.At(7.0, 5.0, 5.0), 101);
  for (int i = 0; i <= 100; ++i)
    EXPECT_EQ(std::isnan(values[static_cast<std::size_t>(i)]), -3.0 + 0.1 * i < 0.5 - 1e-9) << i;
  const double nan = std::nan("");
  EXPECT_THROW(LineProfile(ramp.Posed(), {0, 0, nan}, {1, 1, 1}, 5), Error);
  EXPECT_THROW(LineProfile(ramp.Posed(), {0, 0, 0}, {1, 1, 1}, 1), Error);
}

TEST(SliceFrame, TheNearPartOfALineIsToldInPixels)
{
  SliceFrame frame;
  frame.SetAxis(2);
  frame.width = frame.height = 100;
  frame.mmPerPixel = 0.5;
  frame.focus = {1, 2, 3};
  const auto pixel = [&](double x, double y, double z) { return frame.PixelOf({x, y, z}); };
  // From 10 mm below the plane to 10 mm above: the fifth part around the middle is within 2 mm.
  const auto part = frame.PartNear({-9, 2, -7}, {11, 2, 13}, 2.0);
  ASSERT_TRUE(part);
  EXPECT_LT(((*part)[0] - pixel(-1, 2, 3)).norm(), 1e-9);
  EXPECT_LT(((*part)[1] - pixel(3, 2, 3)).norm(), 1e-9);
  // In the plane: all of it, and of one parallel to it all or nothing.
  const auto flat = frame.PartNear({-9, 2, 4}, {11, 5, 4}, 1.0);
  ASSERT_TRUE(flat);
  EXPECT_LT(((*flat)[1] - pixel(11, 5, 4)).norm(), 1e-9);
  EXPECT_FALSE(frame.PartNear({-9, 2, 4.1}, {11, 5, 4.1}, 1.0));
  // Both ends on one side.
  EXPECT_FALSE(frame.PartNear({0, 0, 6}, {0, 0, 16}, 2.0));
  const auto end = frame.PartNear({0, 0, 4}, {0, 0, 24}, 2.0);
  ASSERT_TRUE(end);
  EXPECT_LT(((*end)[0] - pixel(0, 0, 4)).norm(), 1e-9);
}

TEST(ShiftColours, GrowBrighterWithTheShift)
{
  double before = -1.0;
  for (int i = 0; i <= 100; ++i) {
    const auto rgb = ShiftColour(i / 100.0);
    const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    EXPECT_GT(luminance, before - 1e-9) << i;
    before = luminance;
    for (const double c : rgb)
      EXPECT_TRUE(c >= 0.0 && c <= 1.0);
  }
  EXPECT_EQ(ShiftColour(-1.0), ShiftColour(0.0));
  EXPECT_EQ(ShiftColour(7.0), ShiftColour(1.0));
}

TEST(ShiftColours, LieOverWhatIsKnownAlone)
{
  // Two cells of 10 mm along x, the second not known; a plane of 30 x 9 pixels of 1 mm through their middle, on a grey picture
  // whose lowest row is empty.
  ImageGeometry geometry;
  geometry.dimensions = {2, 1, 1};
  geometry.spacing.setConstant(10.0);
  geometry.origin = {5, 5, 5};
  Volume<float> cells(geometry.dimensions);
  cells.View()[0] = 2.0f;
  cells.View()[1] = std::nanf("");
  SlicePlane plane;
  plane.origin = {0.5, 0.5, 5};
  plane.width = 30;
  plane.height = 9;
  std::vector<std::uint8_t> rgba(4 * 30 * 9, 100);
  for (std::size_t x = 0; x < 30; ++x)
    rgba[4 * x + 3] = 0;
  const auto before = rgba;
  LayShifts({cells.View(), {}, geometry}, 4.0, 0.5, plane, rgba.data());
  const auto colour = ShiftColour(0.5);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 30; ++x)
      for (int c = 0; c < 4; ++c) {
        const std::size_t at = static_cast<std::size_t>(4 * (y * 30 + x) + c);
        // The square from pixel 9 has its middle in the second cell.
        const bool known = y > 0 && x < 9 && c < 3;
        const double expected = known ? 0.5 * 100 + 0.5 * 255.0 * colour[static_cast<std::size_t>(c)] : before[at];
        EXPECT_NEAR(rgba[at], expected, known ? 1.5 : 0.0) << x << ", " << y << ", " << c;
      }
}
