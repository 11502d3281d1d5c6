// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Geometry/FanModel.h"
#include <array>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

double DistanceOf(const FanModel& model, const Eigen::Vector3d& point)
{
  return LocateInFan(model.shape, model.probeToWorld.inverse() * point).distance;
}

FanModel Moved(const FanModel& model, int unknown, double by)
{
  FanModel moved = model;
  if (unknown < FanModel::FanAngle)
    moved.probeToWorld = model.probeToWorld * Exp(by * Twist::Unit(unknown));
  else
    moved[unknown] += by;
  return moved;
}

FanModel Oblique(const ProbeGeometry& shape)
{
  FanModel model;
  model.shape = shape;
  model.probeToWorld = Eigen::Translation3d(10.0, -20.0, 5.0) * Eigen::Isometry3d(ExpRotation({0.4, -0.8, 1.1}));
  return model;
}

} // namespace

TEST(FanModel, DistancesAreThoseFromTheFaces)
{
  const FanModel flat = Oblique(ProbeGeometry::Linear(40.0, 20.0, 0.0, 60.0));
  const auto distance = [&flat](double x, double y, double z) {
    return DistanceOf(flat, flat.probeToWorld * Eigen::Vector3d(x, y, z));
  };
  EXPECT_NEAR(distance(0.0, 0.0, 30.0), -10.0, 1e-9); // halfway between the sides of the sweep
  EXPECT_NEAR(distance(23.0, 0.0, 30.0), 3.0, 1e-9);
  EXPECT_NEAR(distance(0.0, -14.0, 30.0), 4.0, 1e-9);
  EXPECT_NEAR(distance(0.0, 0.0, -5.0), 5.0, 1e-9);
  EXPECT_NEAR(distance(0.0, 0.0, 62.0), 2.0, 1e-9);
  EXPECT_EQ(LocateInFan(flat.shape, {0.0, 0.0, 62.0}).face, FanPlace::Far);
  EXPECT_EQ(LocateInFan(flat.shape, {23.0, 0.0, 30.0}).face, FanPlace::FanSide);
}

TEST(FanModel, GradientsAreThoseOfDifferences)
{
  ProbeGeometry offset = ProbeGeometry::Convex(1.2, 50.0, 0.8, 30.0, 0.0, 90.0);
  offset.fanOffset = 0.1;
  ProbeGeometry plane = ProbeGeometry::Convex(1.2, 50.0, 0.0, 1.0, 0.0, 90.0);
  plane.sweepWidth = 0.0;
  for (const ProbeGeometry& shape :
       {offset, plane, ProbeGeometry::Linear(40.0, 20.0, 0.0, 60.0), ProbeGeometry::Convex(0.3, 20.0, 1.1, 80.0, 0.0, 40.0)}) {
    const FanModel model = Oblique(shape);
    Random random(4);
    std::array<int, FanPlace::faces> seen{};
    for (int trial = 0; trial < 200; ++trial) {
      // A point next to a face: off its foot a bent face is only nearly the distance's level.
      BeamPoint beam{random.Uniform(0.1, 0.9) * shape.depthMax, random.Uniform(-0.4, 0.4), random.Uniform(-0.4, 0.4)};
      const double side = trial & 1 ? 0.5 : -0.5;
      const int face = trial / 2 % FanPlace::faces;
      if (face == FanPlace::FanSide)
        beam.fan = side;
      else if (face == FanPlace::SweepSide)
        beam.sweep = side;
      else
        beam.depth = face == FanPlace::Near ? shape.depthMin : shape.depthMax;
      if (shape.IsPlane() && face == FanPlace::SweepSide)
        continue;
      const Eigen::Vector3d inProbe = PointOf(shape, beam) + 1e-3 * random.Direction();
      const Eigen::Vector3d point = model.probeToWorld * inProbe;
      const FanPlace at = LocateInFan(shape, inProbe);
      ASSERT_EQ(at.face, face);
      ++seen[static_cast<std::size_t>(face)];
      const FanVector gradient = FanGradient(shape, inProbe, at);
      for (int unknown = 0; unknown < FanModel::unknowns; ++unknown) {
        constexpr double step = 1e-6; // angles from 0 on: a flat face is looked at from its one side
        const double difference = (DistanceOf(Moved(model, unknown, step), point) - at.distance) / step;
        if (!shape.IsPlane() || (unknown != FanModel::SweepAngle && unknown != FanModel::SweepWidth)) {
          EXPECT_NEAR(gradient[unknown], difference, 2e-3 * std::max(1.0, std::abs(difference)))
              << "unknown " << unknown << ", face " << face;
        }
      }
    }
    for (const int face : {FanPlace::FanSide, FanPlace::Near, FanPlace::Far})
      EXPECT_EQ(seen[static_cast<std::size_t>(face)], 50) << face;
  }
}
