// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Tracking/Optical/LightRest.h"
#include <cmath>
#include <Eigen/LU>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Status = TrackedLight::Status;

TrackedLight Seen(const Vector2d& place, double size = 2.0, double peak = 100.0, double noise = 0.02)
{
  TrackedLight light;
  light.light = 0;
  light.status = Status::Seen;
  light.spot.position = light.position = place;
  light.spot.covariance = noise * noise * Matrix2d::Identity();
  light.spot.size = size;
  light.spot.peak = peak;
  return light;
}

TrackedLight Without(Status status)
{
  TrackedLight light;
  light.status = status;
  return light;
}

int Rests(LightRest& rest, int frames, const std::function<TrackedLight(int)>& light, Touch touch = Touch::Unknown)
{
  int count = 0;
  for (int n = 0; n < frames; ++n)
    count += rest.Update(light(n), touch).has_value();
  return count;
}

TEST(LightRest, IsSaidOnceUntilTheLightIsMovedOrLifted)
{
  LightRest rest;
  const auto at = [](double x) { return [=](int) { return Seen({x, 100.0}); }; };
  EXPECT_EQ(Rests(rest, 24, at(50.0)), 0);
  EXPECT_EQ(Rests(rest, 1, at(50.0)), 1);
  EXPECT_EQ(Rests(rest, 500, at(50.0)), 0) << "it has not moved";
  EXPECT_EQ(Rests(rest, 500, at(54.0)), 0) << "not far enough to be another place";
  EXPECT_EQ(Rests(rest, 500, at(60.0)), 1);
  EXPECT_EQ(Rests(rest, 10, [](int) { return Without(Status::Lost); }), 0);
  EXPECT_EQ(Rests(rest, 100, at(60.0)), 0) << "lost for a moment: the same rest";
  EXPECT_EQ(Rests(rest, 30, [](int) { return Without(Status::Lost); }), 0);
  EXPECT_EQ(Rests(rest, 100, at(60.0)), 1) << "lifted, and put there again";
}

TEST(LightRest, FramesInWhichTheLightIsOffDoNotCount)
{
  LightRest rest;
  const auto blinking = [](int n) { return n % 2 ? Without(Status::Predicted) : Seen({50.0, 50.0}); };
  EXPECT_EQ(Rests(rest, 48, blinking), 0);
  EXPECT_EQ(Rests(rest, 2, blinking), 1);
}

TEST(LightRest, WhatMovesComesDownOrHoversDoesNotRest)
{
  for (const double speed : {0.1, 0.5, 3.0}) { // px per frame
    LightRest rest;
    EXPECT_EQ(Rests(rest, 300, [=](int n) { return Seen({50.0 + speed * n, 100.0}); }), 0) << speed;
  }
  LightRest down, hovering, lamp;
  EXPECT_EQ(Rests(down, 60, [](int n) { return Seen({50.0, 100.0}, 8.0 - 0.1 * n); }), 0);
  EXPECT_EQ(Rests(
                hovering, 300,
                [](int) {
                  return Seen({50.0, 100.0});
                },
                Touch::Hover),
            0);
  EXPECT_EQ(Rests(
                hovering, 25,
                [](int) {
                  return Seen({50.0, 100.0});
                },
                Touch::Contact),
            1);
  EXPECT_EQ(Rests(lamp, 300, [](int) { return Without(Status::Lost); }), 0);
}

// Against many trials: a mean that ignored tremor, or the noise of the spots, would be off by a factor of several.
TEST(LightRest, TheCovarianceIsThatOfTheMean)
{
  for (const double tremor : {0.0, 0.15}) {
    Matrix2d truth = Matrix2d::Zero(), said = Matrix2d::Zero();
    const int trials = 2000;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(5, static_cast<std::uint64_t>(trial));
      double sway = tremor * random.Normal(); // remembers some four frames
      LightRest rest;
      std::optional<RestingLight> found;
      for (int n = 0; n < 25; ++n) {
        sway = 0.78 * sway + std::sqrt(1.0 - 0.78 * 0.78) * tremor * random.Normal();
        const Vector2d noise = 0.02 * Vector2d(random.Normal(), random.Normal());
        found = rest.Update(Seen(Vector2d(100.0, 100.0) + noise + Vector2d(sway, 0.0)), Touch::Unknown);
      }
      ASSERT_TRUE(found);
      const Vector2d error = found->position - Vector2d(100.0, 100.0);
      truth += error * error.transpose() / trials;
      said += found->covariance / trials;
    }
    for (int axis = 0; axis < 2; ++axis) {
      const double ratio = std::sqrt(said(axis, axis) / truth(axis, axis));
      EXPECT_GT(ratio, 0.6) << tremor << " " << axis;
      EXPECT_LT(ratio, 1.5) << tremor << " " << axis;
    }
  }
}

TEST(LightRest, BrightnessIsThatOfFramesThatSeeAllOfASlot)
{
  LightRest rest;
  std::optional<RestingLight> found;
  for (int n = 0; n < 25; ++n)
    found = rest.Update(Seen({50.0, 50.0}, 2.0, n % 3 ? 50.0 : 100.0), Touch::Unknown);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->peak, 100.0);
  EXPECT_NEAR(found->size, 2.0, 1e-12);
}

TEST(LightRest, ParametersAreChecked)
{
  LightRestParameters p;
  p.frames = 3;
  EXPECT_THROW(LightRest{p}, Error);
  p = {};
  p.stillPx = 0.0;
  EXPECT_THROW(LightRest{p}, Error);
}

} // namespace
