// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Reconstruction/FrameSector.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <string>
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
  try {
    still.Add<unsigned char>(Volume<unsigned char>({18, 21, 1}).View());
    ADD_FAILURE() << "frames of two sizes";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("20 x 20 and 18 x 21"), std::string::npos) << error.what();
  }
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
  const ImageFan fan{120.0, -40.0, -0.5 * DegreesPerRadian, 0.5 * DegreesPerRadian, 55.0, 220.0};
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
      const double angle = std::atan2(across, down) * DegreesPerRadian;
      ASSERT_EQ(oblique.View()(x, y, 0), mm >= 41.3 && mm <= 133.7 && angle >= -10.0 && angle <= 40.0) << x << " " << y;
    }
}

namespace {

// Boxes (first and last column, first and last row) of one frame.
Volume<unsigned char> Boxes(int across, int down, const std::vector<std::array<int, 4>>& boxes, unsigned char value = 1)
{
  Volume<unsigned char> image({across, down, 1});
  for (const auto& box : boxes)
    for (int y = box[2]; y <= box[3]; ++y)
      for (int x = box[0]; x <= box[1]; ++x)
        image.View()(x, y, 0) = value;
  return image;
}

Volume<unsigned char> SectorOf(const Volume<unsigned char>& frame)
{
  FrameSector sector;
  sector.Add<unsigned char>(frame.View());
  return sector.Detect();
}

void ExpectSame(const Volume<unsigned char>& found, const Volume<unsigned char>& expected, const char* what)
{
  ASSERT_EQ(found.Dimensions(), expected.Dimensions());
  EXPECT_TRUE(std::equal(found.View().begin(), found.View().end(), expected.View().begin())) << what;
}

// Whether a box is a sector that shows these values, frame after frame.
bool IsAlive(const std::vector<float>& values)
{
  FrameSector sector;
  for (const float value : values) {
    Volume<float> image({40, 40, 1});
    for (int y = 10; y < 30; ++y)
      for (int x = 10; x < 30; ++x)
        image.View()(x, y, 0) = value;
    sector.Add<float>(image.View());
  }
  try {
    sector.Detect();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
    return false;
  }
  return true;
}

std::vector<float> Frames(std::size_t count, const std::vector<std::size_t>& lit, float value = 80.0f)
{
  std::vector<float> values(count, 0.0f);
  for (const std::size_t frame : lit)
    values[frame] = value;
  return values;
}

} // namespace

TEST(FrameSector, APixelIsAliveByHowOftenItChanges)
{
  // Lit in one frame, it changes twice: a tenth of 20 steps, less than that of 21.
  EXPECT_TRUE(IsAlive(Frames(21, {10})));
  EXPECT_FALSE(IsAlive(Frames(22, {10})));
  EXPECT_TRUE(IsAlive(Frames(22, {10, 15})));
  EXPECT_FALSE(IsAlive(Frames(21, {20}))); // one change
  // Lit in one piece, it changes once: alive when that is half of the frames.
  const auto litFrom = [](std::size_t first) {
    std::vector<std::size_t> frames;
    for (std::size_t i = first; i < 20; ++i)
      frames.push_back(i);
    return Frames(20, frames);
  };
  EXPECT_TRUE(IsAlive(litFrom(10)));
  EXPECT_FALSE(IsAlive(litFrom(11)));
  EXPECT_FALSE(IsAlive(litFrom(0))) << "what never changes was printed";
  // What is no number in all frames does not change; what becomes one does.
  const float nan = std::nanf("");
  EXPECT_FALSE(IsAlive({nan, nan, nan}));
  EXPECT_TRUE(IsAlive({nan, 5.0f, nan}));
  EXPECT_TRUE(IsAlive({80.0f})) << "a single frame";
  EXPECT_FALSE(IsAlive({0.0f}));
}

TEST(FrameSector, ThinBridgesAreCutOff)
{
  const std::array<int, 4> large{2, 31, 5, 44}, small{50, 69, 10, 39};
  for (const bool turned : {false, true})
    for (const int width : {6, 7}) {
      std::vector<std::array<int, 4>> boxes{large, small, {32, 49, 20, 19 + width}}, kept{large};
      if (width == 7)
        kept = boxes;
      if (turned)
        for (auto* list : {&boxes, &kept})
          for (auto& box : *list)
            box = {box[2], box[3], box[0], box[1]};
      const int across = turned ? 50 : 72, down = turned ? 72 : 50;
      ExpectSame(SectorOf(Boxes(across, down, boxes)), Boxes(across, down, kept), turned ? "down" : "across");
    }
}

TEST(FrameSector, GapsOfTwoPixelsAreClosedAndWiderOnesPart)
{
  const std::array<int, 4> left{4, 33, 5, 44};
  ExpectSame(SectorOf(Boxes(72, 50, {left, {36, 60, 5, 44}})), Boxes(72, 50, {{4, 60, 5, 44}}), "two columns");
  ExpectSame(SectorOf(Boxes(72, 50, {left, {37, 60, 5, 44}})), Boxes(72, 50, {left}), "three columns");
  const std::array<int, 4> upper{5, 44, 4, 33};
  ExpectSame(SectorOf(Boxes(50, 72, {upper, {5, 44, 36, 60}})), Boxes(50, 72, {{5, 44, 4, 60}}), "two rows");
  ExpectSame(SectorOf(Boxes(50, 72, {upper, {5, 44, 37, 60}})), Boxes(50, 72, {upper}), "three rows");
}

TEST(FrameSector, TheBordersOfTheImageAreNoPartsOfASector)
{
  const Volume<unsigned char> all({40, 30, 1}, 1);
  ExpectSame(SectorOf(all), all, "the whole image");
  // The end of a row is no neighbour of the beginning of the next.
  const std::array<int, 4> right{45, 59, 0, 29}, left{0, 13, 8, 47};
  ExpectSame(SectorOf(Boxes(60, 60, {right, left})), Boxes(60, 60, {left}), "the larger is at the left");
  const std::array<int, 4> wider{40, 59, 0, 29};
  ExpectSame(SectorOf(Boxes(60, 60, {wider, left})), Boxes(60, 60, {wider}), "the larger is at the right");
  // The last row and column are looked at as all others.
  const std::array<int, 4> corner{30, 59, 30, 59};
  ExpectSame(SectorOf(Boxes(60, 60, {corner})), Boxes(60, 60, {corner}), "the last corner");
}

TEST(FrameSector, SectorsOfAFewPixels)
{
  // Too thin for an opening. (What ends a pixel from the border of the image is taken to be cut by it.)
  for (const std::array<int, 4>& box : {std::array<int, 4>{0, 0, 0, 0}, {9, 9, 7, 7}, {2, 7, 3, 3}, {4, 4, 2, 5}, {2, 6, 2, 5}})
    ExpectSame(SectorOf(Boxes(10, 8, {box})), Boxes(10, 8, {box}), ("from column " + std::to_string(box[0])).c_str());
  EXPECT_EQ(SectorOf(Volume<unsigned char>({1, 1, 1}, 9)).View()[0], 1);
}

// What both its row and its column enclose, in a ring; not what is open to one side.
TEST(FrameSector, HolesAreFilledAndHollowsAreNot)
{
  Volume<unsigned char> ring = Boxes(80, 80, {{5, 74, 10, 69}});
  const Volume<unsigned char> hole = Boxes(80, 80, {{25, 54, 30, 49}}), hollow = Boxes(80, 80, {{25, 54, 10, 49}});
  Volume<unsigned char> open = ring;
  for (std::ptrdiff_t at = 0; at < ring.View().Size(); ++at) {
    open.View()[at] = ring.View()[at] && !hollow.View()[at];
    ring.View()[at] = ring.View()[at] && !hole.View()[at];
  }
  ExpectSame(SectorOf(ring), Boxes(80, 80, {{5, 74, 10, 69}}), "a hole");
  ExpectSame(SectorOf(open), open, "a hollow");
}

// Fans of less than 5% of an image, and pieces without a fan of less than 25%, are not believed; a little more is.
TEST(FrameSector, HowLargeASectorIs)
{
  const auto detect = [](const Volume<unsigned char>& frame) {
    FrameSector frames;
    frames.Add<unsigned char>(frame.View());
    return DetectSector(frames, 0.5, 0.5);
  };
  const auto square = [](int edge) { return Boxes(200, 200, {{60, 59 + edge, 50, 49 + edge}}, 90); };
  EXPECT_FALSE(detect(square(44)).found);           // 4.8%
  const DetectedSector sector = detect(square(47)); // 5.5%
  EXPECT_TRUE(sector.found) << sector.text;
  EXPECT_NE(sector.text.find("a fan fitted"), std::string::npos) << sector.text;
  const auto cross = [](int width) {
    const int first = 30 - width / 2, last = first + width - 1;
    return Boxes(60, 60, {{0, 59, first, last}, {first, last, 0, 59}}, 90);
  };
  const DetectedSector thin = detect(cross(7)); // 22%
  EXPECT_FALSE(thin.found);
  EXPECT_NE(thin.text.find("no fan fits"), std::string::npos) << thin.text;
  EXPECT_EQ(std::count(thin.mask.View().begin(), thin.mask.View().end(), 1), 60 * 60);
  EXPECT_TRUE(detect(Boxes(80, 60, {{0, 79, 25, 34}, {36, 43, 0, 59}}, 90)).found) << "25%";
  const DetectedSector wide = detect(cross(9)); // 28%
  EXPECT_TRUE(wide.found) << wide.text;
  EXPECT_NE(wide.text.find("as it is"), std::string::npos) << wide.text;
  EXPECT_EQ(std::count(wide.mask.View().begin(), wide.mask.View().end(), 1), 2 * 9 * 60 - 81);
}

// The fan is one in mm: with pixels that are not square its mask in pixels is another.
TEST(FrameSector, AFanIsFittedInMillimetres)
{
  const ImageFan fan{120.0, -40.0, -25.0, 40.0, 60.0, 165.0};
  const auto mask = FanMask(fan, width, height, 0.9, 0.75);
  const FittedSector fitted = FitSector(mask, 0.9, 0.75);
  EXPECT_GT(fitted.overlap, 0.97);
  int both = 0, either = 0;
  for (std::ptrdiff_t at = 0; at < mask.View().Size(); ++at) {
    both += mask.View()[at] && fitted.mask.View()[at];
    either += mask.View()[at] || fitted.mask.View()[at];
  }
  EXPECT_GT(both, 0.98 * either);
}

// Nothing of what was found is lost, and the mask grows by half of the smaller edge of a pixel all around the fan.
TEST(FrameSector, AFittedFanReachesHalfAPixelBeyondTheCentres)
{
  struct Case {
    double across, down, from, to, nearMm, farMm;
  };
  for (const Case& c : {Case{1.0, 1.0, -28.6, 28.6, 55.0, 220.0}, Case{1.0, 1.0, -25.0, 40.0, 60.0, 165.0},
                        Case{0.9, 0.75, -25.0, 40.0, 60.0, 165.0}, Case{0.4, 0.5, -28.6, 28.6, 25.0, 85.0}}) {
    const auto mask = FanMask({120.0, -40.0, c.from, c.to, c.nearMm, c.farMm}, width, height, c.across, c.down);
    const auto fitted = FitSector(mask, c.across, c.down).mask;
    int added = 0, lost = 0;
    for (std::ptrdiff_t at = 0; at < mask.View().Size(); ++at) {
      added += fitted.View()[at] && !mask.View()[at];
      lost += mask.View()[at] && !fitted.View()[at];
    }
    EXPECT_EQ(lost, 0);
    const double perimeter = (c.nearMm + c.farMm) * (c.to - c.from) / DegreesPerRadian + 2.0 * (c.farMm - c.nearMm);
    EXPECT_NEAR(added * c.across * c.down / perimeter, 0.5 * std::min(c.across, c.down), 0.1 * std::min(c.across, c.down));
  }
}

TEST(FrameSector, TheBoxOfAMask)
{
  Volume<unsigned char> mask({9, 7, 1});
  mask.View()(6, 2, 0) = 1;
  EXPECT_EQ(BoxOf(mask.View()), (std::array<int, 4>{6, 6, 2, 2}));
  mask.View()(3, 5, 0) = 1;
  EXPECT_EQ(BoxOf(mask.View()), (std::array<int, 4>{3, 6, 2, 5}));
  mask.View()(8, 0, 0) = mask.View()(0, 6, 0) = 1;
  EXPECT_EQ(BoxOf(mask.View()), (std::array<int, 4>{0, 8, 0, 6}));
}

TEST(FrameSector, TheEndsOfFansAndRectanglesBelongToThem)
{
  const auto fan = FanMask({5.0, 0.0, 0.0, 60.0, 3.0, 6.0}, 11, 9, 1.0, 1.0);
  for (int y = 0; y < 9; ++y) // on the first beam
    EXPECT_EQ(fan.View()(5, y, 0), y >= 3 && y <= 6) << y;
  EXPECT_EQ(fan.View()(4, 5, 0), 0);
  EXPECT_EQ(fan.View()(6, 5, 0), 1);
  const auto other = FanMask({5.0, 0.0, -60.0, 0.0, 3.0, 6.0}, 11, 9, 1.0, 1.0);
  EXPECT_EQ(other.View()(5, 4, 0), 1);
  EXPECT_EQ(other.View()(4, 5, 0), 1);
  EXPECT_EQ(other.View()(6, 5, 0), 0);

  EXPECT_NO_THROW(FanMask({0.0, 0.0, -180.0, 180.0, 0.0, 10.0}, 9, 9, 1.0, 1.0));
  EXPECT_THROW(FanMask({0.0, 0.0, -180.5, 10.0, 0.0, 10.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({0.0, 0.0, -10.0, 180.5, 0.0, 10.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({0.0, 0.0, 10.0, 10.0, 0.0, 10.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({0.0, 0.0, 0.0, 10.0, -1.0, 10.0}, 9, 9, 1.0, 1.0), Error);
  EXPECT_THROW(FanMask({0.0, std::nan(""), 0.0, 10.0, 0.0, 5.0}, 9, 9, 1.0, 1.0), Error);

  ExpectSame(RectangleMask(-4, 3, 6, 30, 10, 12), Boxes(10, 12, {{0, 3, 6, 11}}), "cut at the left and below");
  ExpectSame(RectangleMask(9, 9, 11, 11, 10, 12), Boxes(10, 12, {{9, 9, 11, 11}}), "the last pixel");
  ExpectSame(RectangleMask(0, 0, 0, 0, 10, 12), Boxes(10, 12, {{0, 0, 0, 0}}), "the first pixel");
  EXPECT_THROW(RectangleMask(0, 5, 4, 2, 10, 12), Error);
  EXPECT_THROW(RectangleMask(0, 5, 12, 20, 10, 12), Error);
  EXPECT_THROW(RectangleMask(-5, -1, 0, 4, 10, 12), Error);
}
