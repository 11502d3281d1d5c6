// SPDX-License-Identifier: BSD-3-Clause
// Volumes are drawn: caps of balls as a probe sees them, a plate, and echoes that are none of both.
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/RigFit.h"
#include "Testing/Sanitized.h"
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

const std::vector<RigBall> Rig = {{"A", {-27, -22, -19}, 4.0}, {"B", {-30, 23, -45}, 5.0}, {"C", {-5, -20, -49}, 3.0},
                                  {"D", {-2, 18, -28}, 6.0},   {"E", {27, 21, -20}, 7.0},  {"F", {12, -14, -58}, 3.5},
                                  {"G", {30, -1, -47}, 4.5}};

struct Drawn {
  Volume<float> intensity;
  ImageGeometry geometry;
  PlacedProbe probe;
  Pose rigToProbe = Pose::Identity();
};

struct Drawing {
  double scale = 1.0;
  std::vector<RigBall> balls = Rig;
  Pose rigToProbe = Pose(Eigen::Translation3d(2, -3, 105) * Eigen::AngleAxisd(0.7, Vector3d(0.1, 0.15, 1).normalized()));
  int strays = 12; // echoes of dust
  std::uint64_t seed = 1;
};

Drawn Draw(const Drawing& drawing)
{
  Drawn drawn;
  drawn.probe.geometry = ProbeGeometry::Convex(1.3, 40.0, 1.1, 30.0, 0.0, 125.0);
  drawn.probe.probeToWorld = Pose(Eigen::Translation3d(10, 20, -5) * Eigen::AngleAxisd(0.3, Vector3d(1, 2, 0.5).normalized()));
  drawn.rigToProbe = drawing.rigToProbe;
  drawn.geometry.dimensions = {106, 97, 80};
  drawn.geometry.spacing.setConstant(1.4);
  drawn.geometry.direction = drawn.probe.probeToWorld.linear();
  drawn.geometry.origin = drawn.probe.probeToWorld * Vector3d(-74, -68, 10);
  Random random(drawing.seed);
  std::vector<Vector3d> strays;
  for (int i = 0; i < drawing.strays; ++i)
    strays.push_back({random.Uniform(-40, 40), random.Uniform(-40, 40), random.Uniform(30, 95)});
  drawn.intensity = Volume<float>(drawn.geometry.dimensions);
  const Eigen::Affine3d indexToProbe = drawn.probe.probeToWorld.inverse() * drawn.geometry.IndexToWorld();
  const Vector3d plateNormal = drawing.rigToProbe.linear().col(2), plate = drawing.rigToProbe.translation();
  ParallelFor(drawn.geometry.dimensions[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    Random noise(drawing.seed + 1000, static_cast<std::uint64_t>(k));
    for (int j = 0; j < drawn.geometry.dimensions[1]; ++j)
      for (int i = 0; i < drawn.geometry.dimensions[0]; ++i) {
        const auto shown = BeamPointAt(drawn.probe.geometry, indexToProbe * Vector3d(i, j, k));
        if (!shown)
          continue;
        BeamPoint real = *shown;
        real.depth /= drawing.scale;
        const Vector3d place = PointOf(drawn.probe.geometry, real), beam = DirectionOf(drawn.probe.geometry, real);
        double value = 3.0 * noise.Uniform();
        for (const RigBall& ball : drawing.balls) {
          const Vector3d away = place - drawing.rigToProbe * ball.centre;
          const double off = (away.norm() - ball.radius) / 0.8, facing = std::max(0.0, -away.normalized().dot(beam));
          value += 120.0 * std::exp(-0.5 * off * off) * std::pow(facing, 6.0);
        }
        for (const Vector3d& stray : strays)
          value += 90.0 * std::exp(-0.5 * (place - stray).squaredNorm());
        const double height = plateNormal.dot(place - plate);
        value += 200.0 * std::exp(-0.5 * height * height) * std::pow(std::abs(plateNormal.dot(beam)), 4.0);
        drawn.intensity.View()(i, j, k) = static_cast<float>(value);
      }
  });
  return drawn;
}

double ErrorOf(const Drawn& drawn, const RigFit& fit)
{
  double largest = 0.0;
  for (const RigBall& ball : Rig)
    largest = std::max(largest, (fit.rigToProbe * ball.centre - drawn.rigToProbe * ball.centre).norm());
  return largest;
}

RigFit Fit(Drawn& drawn, const RigFitParameters& parameters = {}, const std::vector<RigBall>& rig = Rig)
{
  return FitRig(drawn.intensity.View(), {}, drawn.geometry, drawn.probe, rig, parameters);
}

std::string RefusalOf(Drawn& drawn, const RigFitParameters& parameters = {}, const std::vector<RigBall>& rig = Rig)
{
  try {
    Fit(drawn, parameters, rig);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(RigFit, FindsTheRigAndTheSpeedOfSound)
{
  for (const double scale : {1.0, 1540.0 / 1482.0}) {
    Drawing drawing;
    drawing.scale = scale;
    Drawn drawn = Draw(drawing);
    const RigFit fit = Fit(drawn);
    EXPECT_EQ(fit.found, 7);
    EXPECT_LT(ErrorOf(drawn, fit), 0.4);
    EXPECT_NEAR(fit.depthScale, scale, 0.004);
    EXPECT_GT(fit.depthScaleError, 1e-5);
    EXPECT_LT(fit.depthScaleError, 0.01);
    RigFitParameters given;
    given.depthScale = scale;
    const RigFit known = Fit(drawn, given);
    EXPECT_LT(ErrorOf(drawn, known), 0.3);
    EXPECT_EQ(known.depthScale, scale);
    EXPECT_EQ(known.depthScaleError, 0.0);
  }
}

TEST(RigFit, AnywhereInTheVolume)
{
  ECHORAMA_SKIP_SANITIZED();
  for (int trial = 0; trial < 4; ++trial) {
    Random random(11, static_cast<std::uint64_t>(trial));
    Drawing drawing;
    drawing.seed = static_cast<std::uint64_t>(trial) + 5;
    drawing.rigToProbe = Pose(Eigen::Translation3d(random.Uniform(-6, 6), random.Uniform(-6, 6), random.Uniform(98, 108)) *
                              Eigen::AngleAxisd(random.Uniform(-0.2, 0.2), Vector3d::UnitX()) *
                              Eigen::AngleAxisd(random.Uniform(-3.1, 3.1), Vector3d::UnitZ()));
    Drawn drawn = Draw(drawing);
    const RigFit fit = Fit(drawn);
    EXPECT_GE(fit.found, 5);
    EXPECT_LT(ErrorOf(drawn, fit), 0.8) << trial;
  }
}

TEST(RigFit, MissingBallsAreNamed)
{
  Drawing drawing;
  drawing.balls.erase(drawing.balls.begin() + 4);
  drawing.balls.erase(drawing.balls.begin() + 1);
  Drawn drawn = Draw(drawing);
  const RigFit fit = Fit(drawn);
  EXPECT_EQ(fit.found, 5);
  for (const RigFit::Ball& ball : fit.balls)
    EXPECT_EQ(ball.found, ball.name != "B" && ball.name != "E") << ball.name;
  EXPECT_LT(ErrorOf(drawn, fit), 0.8);
}

TEST(RigFit, SaysWhenItIsNotThere)
{
  ECHORAMA_SKIP_SANITIZED();
  // Dust alone, which here and there lies as some of the balls do.
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    Drawing empty;
    empty.balls.clear();
    empty.seed = seed;
    empty.strays = 10 * static_cast<int>(seed);
    Drawn dust = Draw(empty);
    EXPECT_FALSE(RefusalOf(dust).empty()) << seed;
  }
  Drawing few; // three balls are less than a rig
  few.balls.resize(3);
  few.strays = 0;
  Drawn drawn = Draw(few);
  EXPECT_NE(RefusalOf(drawn).find("not found"), std::string::npos) << RefusalOf(drawn);
  // Nothing at all.
  std::fill(drawn.intensity.View().begin(), drawn.intensity.View().end(), 0.0f);
  EXPECT_NE(RefusalOf(drawn).find("not found"), std::string::npos) << RefusalOf(drawn);
  std::fill(drawn.intensity.View().begin(), drawn.intensity.View().end(), std::nanf(""));
  EXPECT_NE(RefusalOf(drawn).find("not found"), std::string::npos) << RefusalOf(drawn);
}

TEST(RigFit, TwoPlacesThatExplainEquallyMuchAreRefused)
{
  // A square of equal balls lies alike in four ways.
  Drawing drawing;
  drawing.balls = {
      {"A", {-20, -20, -40}, 4.0}, {"B", {20, -20, -40}, 4.0}, {"C", {20, 20, -40}, 4.0}, {"D", {-20, 20, -40}, 4.0}};
  drawing.rigToProbe = Pose(Eigen::Translation3d(0, 0, 105));
  drawing.strays = 0;
  Drawn drawn = Draw(drawing);
  EXPECT_NE(RefusalOf(drawn, {}, drawing.balls).find("equally well"), std::string::npos);
}

TEST(RigFit, BadInput)
{
  Drawing drawing;
  Drawn drawn = Draw(drawing);
  RigFitParameters p;
  p.depthScale = 2.0;
  EXPECT_NE(RefusalOf(drawn, p).find("DepthScale"), std::string::npos);
  p = {};
  p.toleranceMm = std::nan("");
  EXPECT_NE(RefusalOf(drawn, p).find("ToleranceMm"), std::string::npos);
  auto rig = Rig;
  rig[2].radius = 0.0;
  EXPECT_NE(RefusalOf(drawn, {}, rig).find("ball C"), std::string::npos);
  rig.resize(2);
  EXPECT_NE(RefusalOf(drawn, {}, rig).find("2 balls"), std::string::npos);
}
