// SPDX-License-Identifier: BSD-3-Clause
#include "ClosedBodies.h"
#include "Core/Base/Error.h"
#include "Filters/Phantoms/CalibrationRig.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

TEST(CalibrationRig, SoundInWater)
{
  // The polynomial's own values, as the paper and others tabulate them.
  EXPECT_NEAR(WaterSoundSpeed(0.0), 1402.385, 0.001);
  EXPECT_NEAR(WaterSoundSpeed(20.0), 1482.36, 0.03);
  EXPECT_NEAR(WaterSoundSpeed(25.0), 1496.70, 0.03);
  EXPECT_NEAR(WaterSoundSpeed(37.0), 1523.6, 0.2);
  EXPECT_NEAR(WaterSoundSpeed(74.0), 1555.1, 0.1);
  CalibrationRigParameters p;
  p.waterCelsius = 25.0;
  EXPECT_NEAR(MakeCalibrationRig(p).materials[0].soundSpeed, 1496.70, 0.03);
}

TEST(CalibrationRig, BallsLieWhereTheLandmarksSay)
{
  for (const double scale : {1.0, 0.5}) {
    CalibrationRigParameters p;
    p.scale = scale;
    p.detailMm = 0.4 * scale;
    const TissueSurface rig = MakeCalibrationRig(p);
    rig.Check();
    const std::vector<BodyShape> bodies = ShapesOf(rig);
    const std::vector<Landmark> landmarks = CalibrationLandmarks(p);
    ASSERT_EQ(landmarks.size(), p.balls.size());
    ASSERT_EQ(rig.bodies.size(), 2 + 2 * p.balls.size());
    for (std::size_t i = 0; i < p.balls.size(); ++i) {
      const std::size_t body = 2 + p.balls.size() + i;
      EXPECT_EQ(rig.bodies[body].name, landmarks[i].label);
      EXPECT_LT((bodies[body].box.center() - landmarks[i].position).norm(), 0.02 * p.balls[i].radius);
      const double radius = scale * p.balls[i].radius, whole = 4.18879 * radius * radius * radius;
      EXPECT_NEAR(bodies[body].volume, whole, 0.03 * whole);
      EXPECT_LT((landmarks[i].position - Vector3d(0, 0, p.plateDepthMm) - scale * p.balls[i].centre).norm(), 1e-12);
    }
    for (const BodyShape& body : bodies) {
      EXPECT_TRUE(body.closed) << body.name;
      EXPECT_GT(body.volume, 0.0) << body.name;
      EXPECT_EQ(body.euler, 2) << body.name;
    }
    EXPECT_NEAR(bodies[0].box.min().z(), p.plateDepthMm, 1e-4);
    EXPECT_NEAR(bodies[1].box.min().z(), p.plateDepthMm - 2.0, 1e-4);
    EXPECT_NEAR(bodies[1].volume, 2.0 * p.BaseOutline().volume(), 1.0);
  }
}

TEST(CalibrationRig, EachBallIsKnownByItsNeighbours)
{
  const auto balls = CalibrationRigParameters::DefaultBalls();
  std::vector<double> distances;
  for (std::size_t i = 0; i < balls.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      distances.push_back((balls[i].centre - balls[j].centre).norm());
      EXPECT_GE(std::abs(balls[i].radius - balls[j].radius), 0.5);
      EXPECT_GT((balls[i].centre - balls[j].centre).head<2>().norm(), balls[i].radius + balls[j].radius) << "one hides the other";
    }
  std::sort(distances.begin(), distances.end());
  for (std::size_t i = 1; i < distances.size(); ++i)
    EXPECT_GT(distances[i] - distances[i - 1], 1.7);
}

TEST(CalibrationRig, WithoutPlateOrStems)
{
  CalibrationRigParameters p;
  p.stemRadiusMm = 0.0;
  EXPECT_EQ(MakeCalibrationRig(p).bodies.size(), 9u);
  p.baseMm = 0.0;
  EXPECT_EQ(MakeCalibrationRig(p).bodies.size(), 8u);
  p.plateMm = 0.0;
  EXPECT_EQ(MakeCalibrationRig(p).bodies.size(), 7u);
}

TEST(CalibrationRig, RefusesWhatCannotBe)
{
  const auto refused = [](auto change, const char* word) {
    CalibrationRigParameters p;
    change(p);
    try {
      MakeCalibrationRig(p);
      ADD_FAILURE() << word << " was not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused([](auto& p) { p.scale = 0.0; }, "Scale is 0; it must be in [0.2, 5]");
  refused([](auto& p) { p.waterCelsius = 120.0; }, "WaterCelsius is 120");
  refused([](auto& p) { p.balls.clear(); }, "number of balls");
  refused([](auto& p) { p.balls[1].centre = p.balls[0].centre; }, "touches ball 1");
  refused([](auto& p) { p.balls[2].centre.z() = -1.0; }, "touches the plate");
  refused([](auto& p) { p.baseMm = 16.0; }, "or the base");
  refused([](auto& p) { p.balls[3].radius = 0.0; }, "ball 4 (D): Radius is 0 mm");
  refused([](auto& p) { p.material = "cheese"; }, "cheese");
}
