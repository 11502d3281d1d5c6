// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Tracking/Optical/FisheyeLens.h"
#include "Tracking/Optical/SurfaceDrift.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Verdict = SurfaceDrift::Verdict;

const double Noise = 0.3; // px per axis

// Five marks on a dome of 110 mm, one on top and four at 35 degrees above the horizon, seen by a camera that has moved and
// turned.
std::vector<DriftPoint> Seen(std::uint64_t seed, const Vector3d& movedMm = Vector3d::Zero(),
                             const Vector3d& turned = Vector3d::Zero())
{
  const FisheyeLens lens;
  const auto pixel = [&](const Vector3d& point, const Vector3d& moved, const Vector3d& rotation) {
    return *lens.Project(ExpRotation(rotation).transpose() * (point - moved));
  };
  std::vector<DriftPoint> points;
  for (int i = 0; i < 5; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const double up = i == 0 ? 90.0 : 35.0 + 5.0 * i, around = 80.0 * i;
    const Vector3d point =
        110.0 * Vector3d(std::cos(up * RadiansPerDegree) * std::cos(around * RadiansPerDegree),
                         std::cos(up * RadiansPerDegree) * std::sin(around * RadiansPerDegree), std::sin(up * RadiansPerDegree));
    DriftPoint p;
    p.mark = 10 * i + 7;
    const Vector2d expected = pixel(point, Vector3d::Zero(), Vector3d::Zero());
    p.difference = pixel(point, movedMm, turned) - expected + Noise * Vector2d(random.Normal(), random.Normal());
    p.covariance = Noise * Noise * Matrix2d::Identity();
    for (int axis = 0; axis < 3; ++axis) {
      p.motion.col(axis) = (pixel(point, 1e-4 * Vector3d::Unit(axis), Vector3d::Zero()) - expected) / 1e-4;
      p.motion.col(axis + 3) = (pixel(point, Vector3d::Zero(), 1e-6 * Vector3d::Unit(axis)) - expected) / 1e-6;
    }
    points.push_back(p);
  }
  return points;
}

TEST(ChiSquared, AgreesWithTables)
{
  EXPECT_NEAR(ChiSquaredChance(18.307, 10), 0.05, 1e-5);
  EXPECT_NEAR(ChiSquaredChance(29.588, 10), 0.001, 1e-6);
  EXPECT_NEAR(ChiSquaredChance(5.991, 2), 0.05, 1e-4);
  EXPECT_NEAR(ChiSquaredChance(13.277, 4), 0.01, 1e-5);
  EXPECT_EQ(ChiSquaredChance(0.0, 10), 1.0);
}

// A test that never alarmed, or looked at the largest difference alone, would not keep both rates.
TEST(SurfaceDrift, AlarmsAsOftenAsItSaysWhenNothingHasChanged)
{
  int alarms = 0, rare = 0;
  const int checks = 4000;
  for (int trial = 0; trial < checks; ++trial) {
    const auto points = Seen(static_cast<std::uint64_t>(trial));
    alarms += JudgeDrift(points, 0.05).verdict != Verdict::Holds;
    rare += JudgeDrift(points).verdict != Verdict::Holds;
  }
  EXPECT_NEAR(alarms, 200, 55); // four standard deviations
  EXPECT_LE(rare, 12);
}

TEST(SurfaceDrift, SaysHowFarTheCameraHasMoved)
{
  const Vector3d moved(1.5, -1.0, 0.8), turned = Vector3d(0.5, 1.0, -0.7) * RadiansPerDegree;
  int told = 0, within = 0;
  for (std::uint64_t trial = 0; trial < 200; ++trial) {
    const SurfaceDrift drift = JudgeDrift(Seen(trial, moved, turned));
    told += drift.verdict == Verdict::Moved;
    within += std::abs(drift.movedMm.norm() - moved.norm()) < 2.0 * drift.movedErrorMm &&
              std::abs(drift.turned.norm() - turned.norm()) * DegreesPerRadian < 2.0 * drift.turnedErrorDegrees;
    EXPECT_LT((drift.movedMm - moved).norm(), 2.5);
  }
  EXPECT_GE(told, 198);
  EXPECT_GT(within, 160); // both within two standard errors: 91%
  EXPECT_NE(JudgeDrift(Seen(1, moved, turned)).message.find("calibrate again"), std::string::npos);
}

TEST(SurfaceDrift, ATurnOfHalfADegreeIsNoticed)
{
  for (std::uint64_t trial = 0; trial < 100; ++trial)
    EXPECT_EQ(JudgeDrift(Seen(trial, Vector3d::Zero(), {0.0, 0.5 * RadiansPerDegree, 0.0})).verdict, Verdict::Moved) << trial;
}

TEST(SurfaceDrift, OneWrongMarkIsNamedAndIsNoMotion)
{
  int named = 0, moved = 0;
  for (std::uint64_t trial = 0; trial < 100; ++trial)
    for (std::size_t wrong = 0; wrong < 5; ++wrong) {
      auto points = Seen(trial);
      points[wrong].difference += Vector2d(3.0, -2.0);
      const SurfaceDrift drift = JudgeDrift(points);
      named += drift.verdict == Verdict::WrongMark && drift.mark == points[wrong].mark;
      moved += drift.verdict == Verdict::Moved;
    }
  EXPECT_GE(named, 490);
  EXPECT_LE(moved, 5);
}

TEST(SurfaceDrift, WhatNoMotionExplainsIsNoMotion)
{
  auto points = Seen(3);
  points[0].difference += Vector2d(30.0, 10.0);
  points[2].difference += Vector2d(-20.0, 25.0);
  points[4].difference += Vector2d(15.0, -25.0);
  EXPECT_EQ(JudgeDrift(points).verdict, Verdict::Changed);
}

TEST(SurfaceDrift, BadInputIsRefused)
{
  auto points = Seen(1);
  EXPECT_THROW(JudgeDrift({points.begin(), points.begin() + 3}), Error);
  EXPECT_THROW(JudgeDrift(points, 0.0), Error);
  points[1].difference.x() = std::nan("");
  EXPECT_THROW(JudgeDrift(points), Error);
  points = Seen(1);
  points[1].covariance.setZero();
  EXPECT_THROW(JudgeDrift(points), Error);
}

} // namespace
