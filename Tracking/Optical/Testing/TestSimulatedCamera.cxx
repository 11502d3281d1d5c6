// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Tracking/Optical/SimulatedCamera.h"
#include "Tracking/Optical/SpotDetector.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>

namespace {

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

const DomeSurface& Dome()
{
  static const DomeSurface dome({110.0, 95.0, 90.0});
  return dome;
}

SimulatedCameraParameters Quiet()
{
  SimulatedCameraParameters p;
  p.lens.width = 320;
  p.lens.height = 240;
  p.lens.centreX = 159.5;
  p.lens.centreY = 119.5;
  p.lens.focal = 95.0;
  p.readNoise = p.greyPerElectron = 0.0;
  p.hotPixels = 0;
  p.halo = 0.0;
  return p;
}

SimulatedLight Still(const Vector3d& point, double hoverMm = 0.0, double peak = 150.0)
{
  return {[=](double) { return LightOnSkin{point, hoverMm, peak}; }, {}};
}

TEST(FisheyeLens, UnprojectsWhatItProjects)
{
  FisheyeLens lens;
  lens.k1 = -0.03;
  lens.k2 = 0.004;
  lens.Check();
  for (std::uint64_t trial = 0; trial < 500; ++trial) {
    Random random(2, trial);
    const Vector3d direction = random.Direction();
    const auto pixel = lens.Project(direction * random.Uniform(0.1, 300.0));
    const double angle = std::acos(direction.z());
    ASSERT_EQ(pixel.has_value(), angle <= 100.0 / 57.29577951308232);
    if (!pixel)
      continue;
    const double t = angle * angle; // the definition
    EXPECT_NEAR((*pixel - Vector2d(319.5, 239.5)).norm(), 190.0 * angle * (1.0 - 0.03 * t + 0.004 * t * t), 1e-8);
    const auto back = lens.Unproject(*pixel);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - direction).norm(), 1e-9);
  }
  EXPECT_LT((*lens.Unproject({319.5, 239.5}) - Vector3d(0, 0, 1)).norm(), 1e-15);
  EXPECT_FALSE(lens.Unproject({1e5, 0}));
  EXPECT_FALSE(lens.Project({0, 0, -1}));
  lens.k1 = -0.5;
  EXPECT_THROW(lens.Check(), Error);
}

TEST(SeenSurface, DomeIsMetWhereItsEquationSays)
{
  const Vector3d radii(110.0, 95.0, 90.0), origin(5.0, -8.0, 10.0);
  int met = 0;
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    Random random(6, trial);
    const Vector3d direction = random.Direction();
    const auto hit = Dome().FirstHit(origin, direction);
    if (direction.z() < -0.3) { // it leaves through the opening
      EXPECT_FALSE(hit);
    }
    if (direction.z() >= 0.0) { // from within there is no other way out
      EXPECT_TRUE(hit);
    }
    if (!hit)
      continue;
    ++met;
    EXPECT_NEAR(hit->point.cwiseQuotient(radii).norm(), 1.0, 1e-9);
    EXPECT_GE(hit->point.z(), 0.0);
    EXPECT_LT((hit->point - origin).normalized().cross(direction).norm(), 1e-9);
    EXPECT_GT((hit->point - origin).dot(direction), 0.0);
    const Vector3d outwards = hit->point.cwiseQuotient(radii.cwiseProduct(radii)).normalized();
    EXPECT_LT((hit->normal + outwards).norm(), 1e-9); // against a ray from within
  }
  EXPECT_GT(met, 140);
  // From outside the near side is met first.
  const auto top = Dome().FirstHit({0.0, 0.0, 300.0}, {0.0, 0.0, -1.0});
  ASSERT_TRUE(top);
  EXPECT_LT((top->point - Vector3d(0.0, 0.0, 90.0)).norm(), 1e-9);
  EXPECT_LT((top->normal - Vector3d(0.0, 0.0, 1.0)).norm(), 1e-9);
  EXPECT_THROW(DomeSurface({1, 0, 1}), Error);
}

TEST(SimulatedCamera, SpotsAreWhereTheTruthSays)
{
  const SimulatedCamera camera(Quiet(), Dome(), Pose::Identity());
  SpotDetectorParameters parameters;
  parameters.minimumSize = 0.3;
  SpotDetector detector(parameters);
  SimulatedFrame frame;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {30.0, 10.0}, {-50.0, 30.0}, {20.0, -60.0}, {85.0, 5.0}}) {
    const Vector3d point = *Dome().Above(x, y);
    camera.Render(3, {Still(point)}, frame);
    ASSERT_TRUE(frame.truth.at(0).isVisible);
    EXPECT_DOUBLE_EQ(frame.truth[0].onShare, 1.0);
    // The truth follows from lens and pose alone.
    EXPECT_LT((frame.truth[0].pixel - *Quiet().lens.Project(point)).norm(), 1e-9);
    const SpotFrame spots = detector.Detect(frame.Grey());
    ASSERT_EQ(spots.spots.size(), 1u) << x << " " << y;
    // A bell on curved skin, seen aslant, is not quite symmetric.
    EXPECT_LT((spots.spots[0].position - frame.truth[0].pixel).norm(), 0.1) << x << " " << y;
    const auto skin = camera.SkinAt(Dome(), frame.truth[0].pixel);
    ASSERT_TRUE(skin);
    EXPECT_LT((skin->point - point).norm(), 1e-6);
  }
}

TEST(SimulatedCamera, ALightThatLiftsOffFadesAndSpreads)
{
  const SimulatedCamera camera(Quiet(), Dome(), Pose::Identity());
  const Vector3d point = *Dome().Above(10.0, 5.0);
  SpotDetectorParameters parameters;
  parameters.minimumSize = 0.3;
  SpotDetector detector(parameters);
  SimulatedFrame frame;
  double peak = 1e9, size = 0.0;
  for (const double hover : {0.0, 1.0, 2.0, 3.0}) {
    camera.Render(0, {Still(point, hover, 240.0)}, frame);
    const SpotFrame spots = detector.Detect(frame.Grey());
    ASSERT_EQ(spots.spots.size(), 1u) << hover;
    EXPECT_LT(spots.spots[0].peak, peak);
    EXPECT_GT(spots.spots[0].size, size);
    peak = spots.spots[0].peak;
    size = spots.spots[0].size;
  }
  camera.Render(0, {Still(point, 20.0, 240.0)}, frame);
  EXPECT_TRUE(detector.Detect(frame.Grey()).spots.empty());
}

TEST(SimulatedCamera, NoiseIsThatOfItsModelAndOfItsSeed)
{
  SimulatedCameraParameters p = Quiet();
  p.readNoise = 2.0;
  p.greyPerElectron = 0.1;
  p.ambient = 60.0;
  p.vignetting = 0.0;
  const SimulatedCamera camera(p, Dome(), Pose::Identity());
  SimulatedFrame frame, again;
  double sum = 0.0, squares = 0.0, beside = 0.0, before = 0.0;
  int count = 0;
  std::vector<std::uint8_t> last;
  for (int n = 0; n < 20; ++n) {
    camera.Render(n, {}, frame);
    for (int y = 100; y < 140; ++y)
      for (int x = 130; x < 190; ++x) {
        const double off = frame.Grey()(x, y) - 64.0;
        sum += off;
        squares += off * off;
        beside += off * (frame.Grey()(x + 1, y) - 64.0);
        if (!last.empty())
          before += off * (last[static_cast<std::size_t>(y * 320 + x)] - 64.0);
        ++count;
      }
    last = frame.pixels;
  }
  const double variance = 4.0 + 0.1 * 64.0 + 1.0 / 12.0;
  EXPECT_NEAR(sum / count, 0.0, 0.06);
  EXPECT_NEAR(squares / count, variance, 0.03 * variance);
  EXPECT_NEAR(beside / count, 0.0, 0.02 * variance);
  EXPECT_NEAR(before / count, 0.0, 0.02 * variance);

  camera.Render(7, {Still(*Dome().Above(0, 0))}, frame);
  {
    const ThreadLimit one(1);
    camera.Render(7, {Still(*Dome().Above(0, 0))}, again);
  }
  EXPECT_EQ(frame.pixels, again.pixels);
  p.seed = 2;
  SimulatedCamera(p, Dome(), Pose::Identity()).Render(7, {Still(*Dome().Above(0, 0))}, again);
  EXPECT_NE(frame.pixels, again.pixels);
}

TEST(SimulatedCamera, TailsOfTheNoiseAreThoseOfANormalDistribution)
{
  SimulatedCameraParameters p = Quiet();
  p.readNoise = 10.0;
  p.ambient = 124.0;
  p.vignetting = 0.0;
  p.lens.focal = 130.0; // sees skin everywhere
  const SimulatedCamera camera(p, DomeSurface({1000.0, 1000.0, 1000.0}), Pose::Identity());
  SimulatedFrame frame;
  std::map<int, int> beyond;
  std::int64_t pixels = 0;
  for (int n = 0; n < 60; ++n) {
    camera.Render(n, {}, frame);
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      if (std::abs(camera.Ambient(static_cast<int>(i % 320), static_cast<int>(i / 320)) - 128.0f) > 0.01f)
        continue;
      ++pixels;
      for (const int sigmas : {2, 3, 4, 5})
        beyond[sigmas] += std::abs(frame.pixels[i] - 128.0) >= 10.0 * sigmas + 0.5; // a level is half a level wide at each side
    }
  }
  ASSERT_GT(pixels, 2000000);
  for (const int sigmas : {2, 3, 4, 5}) {
    // P(|x| rounds to more than 10 sigmas) = erfc((sigmas + 0.05) / sqrt 2)
    const double expected = std::erfc((sigmas + 0.05) / std::sqrt(2.0)) * static_cast<double>(pixels);
    EXPECT_NEAR(beyond[sigmas], expected, 5.0 * std::sqrt(expected) + 1.0) << sigmas;
  }
}

TEST(SimulatedCamera, SunlightSaturatesTheShareThatItIsToldTo)
{
  SimulatedCameraParameters p = Quiet();
  p.sunShare = 0.25;
  const SimulatedCamera camera(p, Dome(), Pose::Identity());
  SimulatedFrame frame;
  camera.Render(0, {}, frame);
  const auto saturated = std::count(frame.pixels.begin(), frame.pixels.end(), 255);
  EXPECT_NEAR(static_cast<double>(saturated) / static_cast<double>(frame.pixels.size()), 0.25, 0.03);
  p.sunShare = 0.99;
  EXPECT_THROW(SimulatedCamera(p, Dome(), Pose::Identity()), Error);
}

TEST(SimulatedCamera, ARollingShutterShowsRowsAtTheirOwnTimes)
{
  SimulatedCameraParameters p = Quiet();
  p.rowUs = 40.0;
  p.exposureMs = 1.0;
  const SimulatedCamera camera(p, Dome(), Pose::Identity());
  // It moves along the picture's x at 2 m/s.
  const SimulatedLight light{[](double time) {
                               return LightOnSkin{*Dome().Above(2000.0 * (time - 0.5) - 10.0, 40.0), 0.0, 200.0};
                             },
                             {}};
  SimulatedFrame frame;
  camera.Render(45, {light}, frame);
  ASSERT_TRUE(frame.truth[0].isVisible);
  EXPECT_NEAR(frame.truth[0].time, 45 / 90.0 + frame.truth[0].pixel.y() * 40e-6 + 0.5e-3, 1e-9);
  SpotDetectorParameters parameters;
  parameters.minimumSize = 0.3;
  SpotDetector detector(parameters);
  const SpotFrame spots = detector.Detect(frame.Grey());
  ASSERT_EQ(spots.spots.size(), 1u);
  EXPECT_LT((spots.spots[0].position - frame.truth[0].pixel).norm(), 0.1);
  // A light that goes out halfway is seen in the rows before only.
  const SimulatedLight half{Still({0.0, 0.0, 90.0}).place, [](double from, double to) {
                              return std::clamp((119.5 * 40e-6 + 0.5e-3 - from) / (to - from), 0.0, 1.0);
                            }};
  SimulatedFrame whole;
  camera.Render(0, {{half.place, {}}}, whole);
  camera.Render(0, {half}, frame);
  // A row takes light for 1 ms: 25 rows later all of it is missing.
  for (const int row : {117, 119, 121}) {
    const double lit = whole.Grey()(159, row) - 16.0, share = std::clamp(0.5 + (119.5 - row) / 25.0, 0.0, 1.0);
    EXPECT_NEAR(frame.Grey()(159, row) - 16.0, lit * share, 1.0) << row;
  }
  EXPECT_NEAR(frame.truth[0].onShare, 0.5, 0.01);
}

TEST(SimulatedCamera, FramesAreLateAndSomeAreLost)
{
  SimulatedCameraParameters p = Quiet();
  p.lostFrames = 0.2;
  p.latencyMs = 15.0;
  p.lens.width = p.lens.height = 16;
  p.lens.centreX = p.lens.centreY = 7.5;
  p.lens.focal = 8;
  const SimulatedCamera camera(p, Dome(), Pose::Identity());
  SimulatedFrame frame;
  int lost = 0;
  for (int n = 0; n < 1000; ++n) {
    camera.Render(n, {}, frame);
    lost += frame.isLost;
    EXPECT_NEAR(frame.begin, n / 90.0, 1e-9);
    EXPECT_NEAR(frame.delivered - frame.begin, 0.008 + 0.015, 1e-9);
  }
  EXPECT_NEAR(lost, 200, 60);
  p.exposureMs = 12.0;
  EXPECT_THROW(SimulatedCamera(p, Dome(), Pose::Identity()), Error);
  p = Quiet();
  p.rowUs = 60.0;
  EXPECT_THROW(SimulatedCamera(p, Dome(), Pose::Identity()), Error);
  Pose away = Pose::Identity();
  away.translation() = Vector3d(0, 0, 500);
  EXPECT_THROW(SimulatedCamera(Quiet(), Dome(), away), Error);
}

TEST(SimulatedCamera, HotPixelsAreNoSpots)
{
  SimulatedCameraParameters p = Quiet();
  p.hotPixels = 200;
  p.readNoise = 1.0;
  p.greyPerElectron = 0.05;
  const SimulatedCamera camera(p, Dome(), Pose::Identity());
  SpotDetector detector;
  SimulatedFrame frame;
  for (int n = 0; n < 20; ++n) {
    camera.Render(n, {}, frame);
    EXPECT_GT(std::count_if(frame.pixels.begin(), frame.pixels.end(), [](int g) { return g > 40; }), 50);
    EXPECT_TRUE(detector.Detect(frame.Grey()).spots.empty());
  }
}

} // namespace
