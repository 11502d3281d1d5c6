// SPDX-License-Identifier: BSD-3-Clause
#include "SpotPictures.h"
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using namespace echorama::pictures;
using Eigen::Vector2d;

double Flat(int, int)
{
  return 10.0;
}

struct Errors {
  double rms = 0.0;        // px, per axis
  Vector2d bias{0, 0};     // px
  double normalised = 0.0; // mean of e^T C^-1 e / 2, 1 when the covariance is right
  int found = 0;
};

// Of one spot near the middle, at places between the pixels that differ from trial to trial.
Errors Measure(SpotDetector& detector, PaintedSpot spot, const std::function<double(int, int)>& ground, int trials,
               const LightsOffBackground* background, const std::vector<PaintedSpot>& others = {}, int size = 96)
{
  Errors errors;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(77, static_cast<std::uint64_t>(trial));
    PaintedSpot here = spot;
    here.x += random.Uniform(-0.5, 0.5);
    here.y += random.Uniform(-0.5, 0.5);
    std::vector<PaintedSpot> all = others;
    all.push_back(here);
    const Picture picture = Paint(size, size, ground, all, 1000 + static_cast<std::uint64_t>(trial));
    const SpotFrame frame = detector.Detect(picture.Frame(), background);
    for (const Spot& s : frame.spots) {
      const Vector2d error = s.position - Vector2d(here.x, here.y);
      if (error.norm() > 3.0)
        continue;
      ++errors.found;
      errors.rms += 0.5 * error.squaredNorm();
      errors.bias += error;
      errors.normalised += 0.5 * error.dot(s.covariance.inverse() * error);
    }
  }
  errors.rms = std::sqrt(errors.rms / errors.found);
  errors.bias /= errors.found;
  errors.normalised /= errors.found;
  return errors;
}

TEST(SpotDetector, ComesNearTheCramerRaoBoundFromFaintToBright)
{
  SpotDetector detector;
  const LightsOffBackground background = Background(96, 96, Flat, 8, 1);
  for (const double peak : {20.0, 60.0, 150.0, 230.0}) {
    const PaintedSpot spot{48, 48, peak, 2.0};
    const Errors errors = Measure(detector, spot, Flat, 400, &background);
    EXPECT_EQ(errors.found, 400) << peak;
    const double bound = CramerRao(spot, 10.0, {});
    EXPECT_LT(errors.rms, 1.15 * bound) << peak;
    EXPECT_GT(errors.rms, 0.9 * bound) << peak; // nobody is better: the bound or the noise would be wrong
    EXPECT_NEAR(errors.normalised, 1.0, 0.2) << peak;
  }
}

TEST(SpotDetector, ASlopeDoesNotMoveTheFitButTheCentreOfMass)
{
  const auto slope = [](int x, int) { return 20.0 + 1.5 * x; };
  SpotDetector fit;
  SpotDetectorParameters parameters;
  parameters.method = SpotMethod::Centroid;
  parameters.threshold = 110.0; // above the slope's brightest pixel near the spot
  SpotDetector centroid(parameters);
  const PaintedSpot spot{40, 40, 90.0, 2.5};
  const Errors fitted = Measure(fit, spot, slope, 600, nullptr, {}, 80);
  EXPECT_EQ(fitted.found, 600);
  EXPECT_LT(fitted.bias.norm(), 0.02);
  // The centre of mass is drawn uphill. All of the background is above 0, so that it needs a threshold that high.
  Errors massed;
  for (int trial = 0; trial < 100; ++trial) {
    const Picture picture = Paint(
        80, 80, [](int x, int) { return 20.0 + 1.5 * std::min(x, 55); }, {spot}, 5000 + static_cast<std::uint64_t>(trial));
    for (const Spot& s : centroid.Detect(picture.Frame()).spots) {
      massed.bias += s.position - Vector2d(spot.x, spot.y);
      ++massed.found;
    }
  }
  ASSERT_EQ(massed.found, 100);
  massed.bias /= massed.found;
  EXPECT_GT(massed.bias.x(), 0.1);
  EXPECT_LT(std::abs(massed.bias.y()), 0.05);
}

TEST(SpotDetector, SunlightThatSaturatesAQuarterDoesNotBiasSpotsBesideIt)
{
  // Full sun on the right quarter, which fades within 25 pixels: up to 6 levels per pixel.
  const auto sun = [](int x, int) { return 15.0 + 330.0 / (1.0 + std::exp(-(x - 110.0) / 9.0)); };
  SpotDetector detector;
  const LightsOffBackground background = Background(160, 96, sun, 8, 1);
  for (const double x : {84.0, 96.0, 104.0}) {
    const PaintedSpot spot{x, 48, 150.0, 2.5};
    double sum = 0.0;
    int found = 0, refused = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const Picture picture = Paint(160, 96, sun, {spot}, 9000 + static_cast<std::uint64_t>(trial));
      const SpotFrame frame = detector.Detect(picture.Frame(), &background);
      EXPECT_EQ(frame.state, FrameState::Good) << frame.message;
      EXPECT_GT(frame.saturatedShare, 0.25);
      ASSERT_LE(frame.spots.size(), 1u);
      refused += frame.refused;
      for (const Spot& s : frame.spots) {
        ++found;
        sum += s.position.x() - x;
      }
    }
    EXPECT_GT(found, 195) << x << " refused " << refused;
    EXPECT_LT(std::abs(sum / found), 0.02) << x;
  }
}

TEST(SpotDetector, SaturatedSpotsAreFittedByTheirFlanks)
{
  SpotDetector detector;
  const LightsOffBackground background = Background(96, 96, Flat, 8, 1);
  const PaintedSpot spot{48, 48, 900.0, 3.0};
  const Errors errors = Measure(detector, spot, Flat, 200, &background);
  EXPECT_EQ(errors.found, 200);
  EXPECT_LT(errors.rms, 1.2 * CramerRao(spot, 10.0, {}));
  EXPECT_LT(errors.bias.norm(), 0.005);
  const Picture picture = Paint(96, 96, Flat, {spot}, 4);
  const SpotFrame frame = detector.Detect(picture.Frame(), &background);
  ASSERT_EQ(frame.spots.size(), 1u);
  EXPECT_NEAR(frame.spots[0].peak, 900.0, 90.0);
  EXPECT_NEAR(frame.spots[0].size, 3.0, 0.1);
  EXPECT_GT(frame.spots[0].saturatedPixels, 50);
}

TEST(SpotDetector, TwoThatTouchAreTwo)
{
  SpotDetector detector;
  const LightsOffBackground background = Background(96, 96, Flat, 8, 1);
  for (const double distance : {5.0, 6.0, 8.0, 12.0, 20.0}) { // of a standard deviation of 2
    const PaintedSpot other{48 + distance, 49, 90.0, 2.0};
    const Errors errors = Measure(detector, {48, 48, 140.0, 2.0}, Flat, 150, &background, {other});
    EXPECT_GE(errors.found, 149) << distance;
    EXPECT_LT(errors.rms, 0.06) << distance;
    EXPECT_LT(errors.bias.norm(), 0.02) << distance;
  }
  // At less than two standard deviations there is no dip: it is found by the shape, unless that could be one spot.
  const Picture close = Paint(96, 96, Flat, {{46, 48, 150, 2.0}, {49.8, 48, 150, 2.0}}, 8);
  const SpotFrame frame = detector.Detect(close.Frame(), &background);
  ASSERT_EQ(frame.spots.size(), 2u);
  for (const Spot& s : frame.spots)
    EXPECT_LT(std::min(std::abs(s.position.x() - 46.0), std::abs(s.position.x() - 49.8)), 0.2);
  // One long spot is one.
  const Picture one = Paint(96, 96, Flat, {{48, 48, 150, 4.0, 2.0}}, 9);
  EXPECT_EQ(detector.Detect(one.Frame(), &background).spots.size(), 1u);
}

TEST(SpotDetector, WhatCannotBeToldApartIsLeftOutAndNothingIsPutBetween)
{
  // Three lights so near each other that fits of all hardly converge. Without the weakest, the others' places would be wrong.
  SpotDetector detector;
  const LightsOffBackground background = Background(96, 96, Flat, 8, 1);
  const std::vector<PaintedSpot> first{{45.3, 47.8, 435, 2.6}, {52.0, 50.3, 254, 2.6}, {59.3, 54.4, 123, 2.4}},
      second{{39.4, 44.4, 103, 3.7}, {58.1, 58.6, 379, 3.7}, {50.8, 51.0, 142, 3.6}};
  int between = 0;
  for (const auto& lights : {first, second})
    for (std::uint64_t trial = 0; trial < 50; ++trial)
      for (const Spot& s : detector.Detect(Paint(96, 96, Flat, lights, 500 + trial).Frame(), &background).spots)
        between += std::none_of(lights.begin(), lights.end(), [&s](const PaintedSpot& light) {
          return (s.position - Vector2d(light.x, light.y)).norm() < 0.4;
        });
  EXPECT_LT(between, 20); // in 100 pictures
}

TEST(SpotDetector, FindsNothingWhereNothingIs)
{
  SpotDetector detector;
  const auto ground = [](int x, int y) { return 20.0 + 0.3 * x + 40.0 * std::sin(y / 40.0) * std::sin(x / 50.0) + 40.0; };
  const LightsOffBackground background = Background(320, 240, ground, 5, 1);
  int spots = 0;
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    Picture picture = Paint(320, 240, ground, {}, 300 + trial);
    Random random(5, trial);
    for (int hot = 0; hot < 20; ++hot) // pixels that were not hot in the background
      picture.pixels[random.Below(picture.pixels.size())] = 255;
    spots += static_cast<int>(detector.Detect(picture.Frame(), &background).spots.size());
    spots += static_cast<int>(detector.Detect(picture.Frame()).spots.size());
  }
  EXPECT_EQ(spots, 0);
  // Three hot pixels in a corner are as many as a small spot has, but smaller than any lens draws.
  Picture corner = Paint(320, 240, ground, {}, 7);
  for (const int index : {100 * 320 + 100, 100 * 320 + 101, 101 * 320 + 100})
    corner.pixels[static_cast<std::size_t>(index)] = 250;
  EXPECT_TRUE(detector.Detect(corner.Frame(), &background).spots.empty());
}

TEST(SpotDetector, SizeAndBrightnessTellContactFromHover)
{
  SpotDetector detector;
  std::vector<ContactSample> samples;
  for (int y = 0; y <= 4; ++y)
    for (int x = 0; x <= 4; ++x) // a lens that darkens by half towards the right
      samples.push_back({Vector2d(24.0 * x, 24.0 * y), 160.0 - 20.0 * x, 2.0});
  const BrightnessCalibration calibration = BrightnessCalibration::Fit(samples, 97, 97, 5, 5);
  EXPECT_NEAR(calibration.At({48, 48}).peak, 120.0, 6.0);
  const auto judge = [&](double x, double peak, double size, Touch before) {
    const Picture picture = Paint(97, 97, Flat, {{x, 48, peak, size}}, 3);
    const SpotFrame frame = detector.Detect(picture.Frame());
    EXPECT_EQ(frame.spots.size(), 1u);
    return frame.spots.empty() ? Touch::Unknown : JudgeTouch(frame.spots[0], calibration, before);
  };
  EXPECT_EQ(judge(80, 90, 2.0, Touch::Unknown), Touch::Contact); // dark, but so is the lens there
  EXPECT_EQ(judge(16, 90, 2.0, Touch::Contact), Touch::Contact); // between both limits: as before
  EXPECT_EQ(judge(16, 90, 2.0, Touch::Hover), Touch::Hover);
  EXPECT_EQ(judge(16, 60, 2.0, Touch::Contact), Touch::Hover);
  EXPECT_EQ(judge(16, 145, 3.2, Touch::Contact), Touch::Hover); // bright, but wide
  const Picture picture = Paint(97, 97, Flat, {{30, 48, 100, 2}}, 3);
  EXPECT_EQ(JudgeTouch(detector.Detect(picture.Frame()).spots.at(0), {}, Touch::Contact), Touch::Unknown);
  EXPECT_THROW(BrightnessCalibration::Fit({}, 97, 97), Error);
  EXPECT_THROW(BrightnessCalibration::Fit({{Vector2d(1, 1), 0.0, 2.0}}, 97, 97), Error);
}

TEST(SpotDetector, LargeSpotsAreFittedToMeansOfPixels)
{
  SpotDetector detector;
  const PaintedSpot spot{80, 80, 60.0, 9.0, 6.0};
  const LightsOffBackground background = Background(160, 160, Flat, 8, 1);
  const Errors errors = Measure(detector, spot, Flat, 60, &background, {}, 160);
  EXPECT_EQ(errors.found, 60);
  EXPECT_LT(errors.rms, 1.25 * CramerRao({80, 80, 60.0, std::sqrt(0.5 * (81.0 + 36.0))}, 10.0, {}));
  const SpotFrame frame = detector.Detect(Paint(160, 160, Flat, {spot}, 6).Frame(), &background);
  ASSERT_EQ(frame.spots.size(), 1u);
  EXPECT_NEAR(frame.spots[0].size, std::sqrt(54.0), 0.15);
  EXPECT_NEAR(frame.spots[0].peak, 60.0, 1.5);
  EXPECT_NEAR(frame.spots[0].elongation, 1.5, 0.05);
}

TEST(SpotDetector, TakesTheGreenChannelAndSaysWhatIsTooBright)
{
  SpotDetector detector;
  const Picture picture = Paint(64, 48, Flat, {{30, 20, 100, 2}}, 3);
  std::vector<std::uint8_t> colour(picture.pixels.size() * 3, 200); // red and blue say nothing
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    colour[3 * i + 1] = picture.pixels[i];
  const SpotFrame mono = detector.Detect(picture.Frame()), green = detector.Detect(GreyFrame::Green(colour.data(), 64, 48));
  ASSERT_EQ(mono.spots.size(), 1u);
  ASSERT_EQ(green.spots.size(), 1u);
  EXPECT_EQ(mono.spots[0].position, green.spots[0].position);

  const Picture bright = Paint(
      64, 48, [](int x, int) { return x < 40 ? 400.0 : 20.0; }, {}, 3);
  const SpotFrame tooBright = detector.Detect(bright.Frame());
  EXPECT_EQ(tooBright.state, FrameState::TooBright);
  EXPECT_NE(tooBright.message.find("62.5%"), std::string::npos) << tooBright.message;
  const LightsOffBackground dark = Background(64, 48, Flat, 3, 1);
  const SpotFrame changed = detector.Detect(Paint(
                                                64, 48, [](int, int) { return 60.0; }, {}, 3)
                                                .Frame(),
                                            &dark);
  EXPECT_EQ(changed.state, FrameState::Changed);
  EXPECT_TRUE(changed.spots.empty());
  EXPECT_FALSE(changed.message.empty());
}

TEST(SpotDetector, BadInputIsRefused)
{
  SpotDetector detector;
  EXPECT_THROW(detector.Detect(GreyFrame()), Error);
  const LightsOffBackground other = Background(64, 48, Flat, 1, 1);
  const Picture picture = Paint(48, 64, Flat, {}, 1);
  EXPECT_THROW(detector.Detect(picture.Frame(), &other), Error);
  LightsOffBackground half;
  half.Add(picture.Frame(), 0, 32);
  EXPECT_FALSE(half.IsComplete());
  EXPECT_THROW(detector.Detect(picture.Frame(), &half), Error);
  half.Add(picture.Frame(), 32, 64);
  EXPECT_NO_THROW(detector.Detect(picture.Frame(), &half));
  EXPECT_THROW(half.Add(picture.Frame(), 10, 65), Error);
  EXPECT_THROW(LightsOffBackground(0.0), Error);
  SpotDetectorParameters parameters;
  parameters.threshold = 255.0; // eq. 7.1 would divide by nothing
  EXPECT_THROW(SpotDetector{parameters}, Error);
}

TEST(SpotDetector, SpotsAtTheBorderAreFoundOrLeftOutButNeverElsewhere)
{
  SpotDetector detector;
  for (const double x : {-3.0, -1.0, 0.5, 2.0, 4.0}) {
    const Picture picture = Paint(64, 64, Flat, {{x, 32, 120, 2}}, 3);
    const SpotFrame frame = detector.Detect(picture.Frame());
    for (const Spot& s : frame.spots)
      EXPECT_LT((s.position - Vector2d(x, 32)).norm(), 0.3) << x;
    if (x >= 2.0) {
      EXPECT_EQ(frame.spots.size(), 1u) << x;
    }
  }
}

TEST(LightsOffBackground, IsAMeanThatForgets)
{
  LightsOffBackground mean(0.25);
  std::vector<std::uint8_t> frame(64, 0);
  for (int i = 0; i < 3; ++i) {
    frame.assign(64, static_cast<std::uint8_t>(10 * (i + 1)));
    mean.Add(GreyFrame::Mono(frame.data(), 8, 8));
  }
  EXPECT_FLOAT_EQ(mean.At(3, 3), 20.0f);
  EXPECT_NEAR(mean.NoiseShare(0), 1.0 / 3.0, 1e-12);
  for (int i = 0; i < 60; ++i) {
    frame.assign(64, 100);
    mean.Add(GreyFrame::Mono(frame.data(), 8, 8));
  }
  EXPECT_NEAR(static_cast<double>(mean.At(3, 3)), 100.0, 1e-3);
  EXPECT_NEAR(mean.NoiseShare(0), 0.25 / 1.75, 1e-6);
}

} // namespace
