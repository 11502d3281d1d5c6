// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Reconstruction/FrameSector.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace echorama;

namespace {

constexpr int width = 240, height = 200;

bool InFan(int x, int y)
{
  const double across = x - 120.0, down = y + 40.0, radius = std::hypot(across, down);
  return radius >= 55.0 && radius <= 220.0 && std::abs(std::atan2(across, down)) <= 0.5;
}

// A fan with speckle and a black vessel; beside it text, a bar that changes now and then, a clock, and noise of compression.
Volume<unsigned char> Screen(int frame)
{
  Volume<unsigned char> image({width, height, 1});
  Random random(5, static_cast<std::uint64_t>(frame));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      unsigned char& pixel = image.View()(x, y, 0);
      const double noise = random.Uniform();
      if (InFan(x, y))
        pixel = std::hypot(x - 118.0, y - 110.0) < 22.0 ? 0 : static_cast<unsigned char>(20 + 200 * noise);
      else if (x < 30 && y < 20)
        pixel = (x * 7 + y * 3) % 5 == 0 ? 255 : 0; // text
      else if (x > 228 && y > 30 && y < 170)
        pixel = static_cast<unsigned char>(y); // bar of grey levels
      else if (x > 205 && y > 185)
        pixel = static_cast<unsigned char>(255 * noise); // a clock
      else if (noise < 0.01)
        pixel = 3;
    }
  return image;
}

} // namespace

TEST(FrameSector, FindsTheFanAmongWhatScannersPrint)
{
  FrameSector sector;
  for (int frame = 0; frame < 30; ++frame)
    sector.Add<unsigned char>(Screen(frame).View());
  EXPECT_EQ(sector.Frames(), 30);
  const Volume<unsigned char> mask = sector.Detect();
  int both = 0, fan = 0, found = 0, elsewhere = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      both += InFan(x, y) && mask.View()(x, y, 0);
      fan += InFan(x, y);
      found += mask.View()(x, y, 0);
      elsewhere += mask.View()(x, y, 0) && (y < 10 || x < 15 || x > 225);
    }
  EXPECT_GT(both, 0.99 * fan);
  EXPECT_EQ(elsewhere, 0);
  EXPECT_LT(found - both, 0.007 * fan);
  EXPECT_EQ(mask.View()(120, 12, 0), 0) << "the hollow under the face is not data";
  EXPECT_EQ(mask.View()(118, 110, 0), 1) << "fluid is real data";
}

TEST(FrameSector, ASingleFrameAndOtherTypes)
{
  Volume<float> image({60, 50, 1});
  for (int y = 10; y < 40; ++y)
    for (int x = 5; x < 45; ++x)
      image.View()(x, y, 0) = 2.5f;
  FrameSector sector;
  sector.Add<float>(image.View());
  const auto mask = sector.Detect();
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 60; ++x)
      ASSERT_EQ(mask.View()(x, y, 0), y >= 10 && y < 40 && x >= 5 && x < 45);
}

TEST(FrameSector, RefusesWhatHasNone)
{
  FrameSector none;
  EXPECT_THROW(none.Detect(), Error);
  FrameSector still;
  const Volume<unsigned char> image({20, 20, 1}, 80);
  still.Add<unsigned char>(image.View());
  still.Add<unsigned char>(image.View());
  EXPECT_THROW(still.Detect(), Error);
  EXPECT_THROW(still.Add<unsigned char>(Volume<unsigned char>({20, 21, 1}).View()), Error);
  EXPECT_THROW(FrameSector().Add<unsigned char>(Volume<unsigned char>({20, 20, 2}).View()), Error);
}

TEST(FrameSector, AFanIsFittedToWhatWasFound)
{
  FrameSector sector;
  for (int frame = 0; frame < 30; ++frame)
    sector.Add<unsigned char>(Screen(frame).View());
  const FittedSector fitted = FitSector(sector.Detect(), 0.4, 0.4);
  EXPECT_GT(fitted.overlap, 0.95);
  int both = 0, either = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      both += InFan(x, y) && fitted.mask.View()(x, y, 0);
      either += InFan(x, y) || fitted.mask.View()(x, y, 0);
    }
  EXPECT_GT(both, 0.97 * either);
}

// A black bath in which a wire or two move: what changes is not the sector.
TEST(FrameSector, WhatIsTooSmallForASectorIsNotBelieved)
{
  for (const int edge : {20, 40, 120}) { // 1, 4 and 36% of the image
    FrameSector frames;
    for (int frame = 0; frame < 10; ++frame) {
      Volume<unsigned char> image({200, 200, 1});
      Random random(9, static_cast<std::uint64_t>(frame));
      for (int y = 30; y < 30 + edge; ++y)
        for (int x = 50; x < 50 + edge; ++x)
          image.View()(x, y, 0) = static_cast<unsigned char>(random.Below(256));
      frames.Add<unsigned char>(image.View());
    }
    const DetectedSector sector = DetectSector(frames, 0.5, 0.5);
    const auto box = BoxOf(sector.mask.View());
    EXPECT_EQ(sector.found, edge == 120) << sector.text;
    if (edge == 120) {
      const std::array<int, 4> expected{50, 169, 30, 149};
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(box[i], expected[i], 1);
    } else {
      EXPECT_EQ(box, (std::array<int, 4>{0, 199, 0, 199}));
      EXPECT_EQ(std::count(sector.mask.View().begin(), sector.mask.View().end(), 1), 200 * 200);
      EXPECT_NE(sector.text.find("all pixels were taken"), std::string::npos);
      EXPECT_NE(sector.text.find(edge == 20 ? "1.0%" : "4.0%"), std::string::npos) << sector.text;
    }
  }
  EXPECT_EQ(BoxOf(Volume<unsigned char>({5, 4, 1}).View())[1], -1);
}

TEST(FrameSector, WhatNoFanExplainsStaysAsItIs)
{
  Volume<unsigned char> cross({60, 60, 1});
  for (int i = 0; i < 60; ++i)
    for (int j = 28; j < 32; ++j)
      cross.View()(i, j, 0) = cross.View()(j, i, 0) = 1;
  const FittedSector fitted = FitSector(cross, 1.0, 1.0);
  EXPECT_EQ(fitted.overlap, 0.0);
  EXPECT_TRUE(std::equal(cross.View().begin(), cross.View().end(), fitted.mask.View().begin()));
}

TEST(FrameSector, FanAndRectangleByNumbers)
{
  const ImageFan fan{120.0, -40.0, -0.5 * 57.29577951308232, 0.5 * 57.29577951308232, 55.0, 220.0};
  const auto mask = FanMask(fan, width, height, 1.0, 1.0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      ASSERT_EQ(mask.View()(x, y, 0), InFan(x, y)) << x << " " << y;
  EXPECT_THROW(FanMask({0.0, 0.0, 20.0, 10.0, 0.0, 10.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({0.0, 0.0, 0.0, 10.0, 5.0, 5.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({std::nan(""), 0.0, 0.0, 10.0, 0.0, 5.0}, 9, 9, 1.0, 1.0), Error);

  const auto part = RectangleMask(2, 20, -3, 4, 10, 10);
  int count = 0;
  for (const unsigned char pixel : part.View())
    count += pixel;
  EXPECT_EQ(count, 8 * 5);
  EXPECT_EQ(part.View()(2, 0, 0), 1);
  EXPECT_EQ(part.View()(1, 0, 0), 0);
  EXPECT_THROW(RectangleMask(10, 20, 0, 4, 10, 10), Error);
  EXPECT_THROW(RectangleMask(5, 2, 0, 4, 10, 10), Error);

  // Leaning, and with pixels that are not square.
  const ImageFan leaning{120.0, -40.0, -10.0, 40.0, 41.3, 133.7};
  const auto oblique = FanMask(leaning, width, height, 0.5, 0.8);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double across = 0.5 * (x - 120.0), down = 0.8 * (y + 40.0), mm = std::hypot(across, down);
      const double angle = std::atan2(across, down) * 57.29577951308232;
      ASSERT_EQ(oblique.View()(x, y, 0), mm >= 41.3 && mm <= 133.7 && angle >= -10.0 && angle <= 40.0) << x << " " << y;
    }
}
