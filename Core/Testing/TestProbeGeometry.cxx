// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbeGeometry.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace {

using namespace echorama;
constexpr double degree = RadiansPerDegree;

// The textbook form with radii, written from the picture of the probe alone.
Eigen::Vector3d ByRadii(double phi, double fanRadius, double psi, double sweepRadius, double depth)
{
  const double x = (fanRadius + depth) * std::sin(phi), rho = (fanRadius + depth) * std::cos(phi) - fanRadius;
  return {x, (rho + sweepRadius) * std::sin(psi), (rho + sweepRadius) * std::cos(psi) - sweepRadius};
}

struct Named {
  const char* name;
  ProbeGeometry geometry;
};

std::vector<Named> Geometries()
{
  const auto convex = [](double fan, double fanRadius, double sweep, double sweepRadius) {
    return ProbeGeometry::Convex(fan * degree, fanRadius, sweep * degree, sweepRadius, 5.0, 120.0);
  };
  return {{"convex", convex(70, 40, 60, 25)},
          {"equal radii", convex(75, 40, 70, 40)},
          {"tiny radii", convex(80, 1e-7, 75, 1e-9)},
          {"half circle", convex(180, 40, 60, 25)},
          {"half circle, equal radii", convex(180, 40, 60, 40)},
          {"beyond the sweep axis", convex(140, 40, 60, 20)},
          {"wider than half a circle", convex(250, 15, 90, 60)},
          {"wide sweep", convex(60, 10, 300, 40)},
          {"flat", ProbeGeometry::Linear(50, 40, 0, 60)},
          {"phased", ProbeGeometry::Phased(90 * degree, 80 * degree, 0, 150)},
          {"phased, starting deep", ProbeGeometry::Phased(90 * degree, 80 * degree, 20, 150)},
          {"flat array, turned", {0.0, 50.0, 60 * degree, 20.0, 0.0, 80.0}},
          {"phased array, moved", {90 * degree, 0.0, 0.0, 40.0, 2.0, 80.0}},
          {"off centre", {35 * degree, 6.0, 40 * degree, 7.0, 14.0, 60.0, 0.41}},
          {"far off centre", {60 * degree, 30.0, 50 * degree, 50.0, 0.0, 60.0, -1.4}},
          {"flat, off centre", {0.0, 20.0, 0.0, 40.0, 0.0, 60.0, 1.3}},
          {"curvature 1e-12", {50e-12, 50.0, 40e-12, 40.0, 0.0, 60.0}},
          {"curvature 1e-160", {50e-160, 50.0, 40e-160, 40.0, 0.0, 60.0}},
          {"curvature 1e-4", {50e-4, 50.0, 40e-4, 40.0, 0.0, 60.0}},
          {"from inside the housing", ProbeGeometry::Convex(70 * degree, 40, 60 * degree, 55, -30.0, 60.0)}};
}

TEST(ProbeGeometry, IsTheTorusOfItsRadii)
{
  const ProbeGeometry g = ProbeGeometry::Convex(70 * degree, 40, 60 * degree, 25, 0, 100);
  EXPECT_NO_THROW(g.Check());
  EXPECT_LT(PointOf(g, {0, 0, 0}).norm(), 1e-13) << "the origin is the centre of the face";
  for (const double fan : {-0.5, -0.2, 0.0, 0.4})
    for (const double sweep : {-0.5, 0.1, 0.5})
      for (const double depth : {0.0, 33.0, 100.0}) {
        const Eigen::Vector3d expected = ByRadii(fan * g.fanAngle, 40, sweep * g.sweepAngle, 25, depth);
        EXPECT_LT((PointOf(g, {depth, fan, sweep}) - expected).norm(), 1e-12);
      }
}

TEST(ProbeGeometry, AnOffsetTakesAPieceOfTheArray)
{
  const ProbeGeometry whole = ProbeGeometry::Convex(80 * degree, 40, 60 * degree, 25, 0, 100);
  ProbeGeometry piece = ProbeGeometry::Convex(20 * degree, 40, 60 * degree, 25, 0, 100);
  piece.fanOffset = 1.25; // from 15 to 35 degrees
  EXPECT_NO_THROW(piece.Check());
  for (const double degrees : {15.0, 22.0, 35.0})
    for (const double sweep : {-0.5, 0.2, 0.5}) {
      const BeamPoint inWhole{30.0, degrees / 80.0, sweep}, inPiece{30.0, (degrees - 25.0) / 20.0, sweep};
      EXPECT_LT((PointOf(whole, inWhole) - PointOf(piece, inPiece)).norm(), 1e-12);
      EXPECT_LT((DirectionOf(whole, inWhole) - DirectionOf(piece, inPiece)).norm(), 1e-14);
    }
  EXPECT_FALSE(BeamPointAt(piece, PointOf(whole, {30.0, 14.9 / 80.0, 0.0})));
  EXPECT_FALSE(BeamPointAt(piece, PointOf(whole, {30.0, 35.1 / 80.0, 0.0})));
}

TEST(ProbeGeometry, FlatAndPhasedAreTheirClosedForms)
{
  const ProbeGeometry flat = ProbeGeometry::Linear(50, 40, 0, 60);
  EXPECT_EQ(PointOf(flat, {7, 0.25, -0.5}), Eigen::Vector3d(12.5, -20, 7));
  const ProbeGeometry phased = ProbeGeometry::Phased(90 * degree, 60 * degree, 0, 100);
  EXPECT_LT((PointOf(phased, {10, 0.5, 0.5}) - ByRadii(45 * degree, 0, 30 * degree, 0, 10)).norm(), 1e-13);
}

TEST(ProbeGeometry, DirectionIsTheDerivativeAlongTheBeam)
{
  Random random(11);
  for (const Named& n : Geometries())
    for (int i = 0; i < 20; ++i) {
      const BeamPoint b{random.Uniform(10, 50), random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5)};
      const Eigen::Vector3d slope = (PointOf(n.geometry, {b.depth + 1, b.fan, b.sweep}) - PointOf(n.geometry, b));
      EXPECT_LT((slope - DirectionOf(n.geometry, b)).norm(), 1e-11) << n.name;
      EXPECT_NEAR(DirectionOf(n.geometry, b).norm(), 1.0, 1e-15) << n.name;
    }
}

TEST(ProbeGeometry, InverseOfPoint)
{
  Random random(5);
  for (const Named& n : Geometries()) {
    const ProbeGeometry& g = n.geometry;
    ASSERT_NO_THROW(g.Check()) << n.name;
    for (int i = 0; i < 4000; ++i) {
      BeamPoint b{random.Uniform(g.depthMin, g.depthMax), random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5)};
      if (i < 27) // corners, edges and middles
        b = {g.depthMin + (g.depthMax - g.depthMin) * 0.5 * (i % 3), 0.5 * (i / 3 % 3) - 0.5, 0.5 * (i / 9) - 0.5};
      const Eigen::Vector3d point = PointOf(g, b);
      const auto back = BeamPointAt(g, point);
      ASSERT_TRUE(back) << n.name << ": depth " << b.depth << " fan " << b.fan << " sweep " << b.sweep;
      EXPECT_LT((PointOf(g, *back) - point).norm(), 1e-9) << n.name;
      // Coordinates of a beam can only be told as sharply as a unit of them is long.
      const double fanSpan = g.Fan().Span(b.depth), rho = g.Fan().PointOf({b.fan, b.depth}).y();
      const double sweepSpan = std::abs(g.Sweep().Span(rho));
      EXPECT_NEAR(back->depth, b.depth, 1e-9) << n.name;
      if (fanSpan > 1e-3) {
        EXPECT_NEAR(back->fan, b.fan, 1e-9) << n.name;
      }
      if (fanSpan > 1e-3 && sweepSpan > 1e-3) {
        EXPECT_NEAR(back->sweep, b.sweep, 1e-9) << n.name;
      }
    }
  }
}

TEST(ProbeGeometry, PointBeyondTheSweepAxis)
{
  // The nearer of the two answers, phi = 57.5 and psi = -160 degrees, is no beam of this probe.
  const ProbeGeometry g = ProbeGeometry::Convex(140 * degree, 40, 60 * degree, 20, 0, 60);
  const BeamPoint b{0.0, 65.0 / 140.0, 20.0 / 60.0};
  const Eigen::Vector3d point = PointOf(g, b);
  EXPECT_LT((point - ByRadii(65 * degree, 40, 20 * degree, 20, 0)).norm(), 1e-12);
  const auto back = BeamPointAt(g, point);
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->fan * 140, 65.0, 1e-9);
  EXPECT_NEAR(back->sweep * 60, 20.0, 1e-9);
}

TEST(ProbeGeometry, OnTheSweepAxisTheMiddlePlaneIsTaken)
{
  const ProbeGeometry g = ProbeGeometry::Convex(180 * degree, 40, 60 * degree, 40, 0, 60);
  for (const double sweep : {-0.5, 0.0, 0.3}) {
    const Eigen::Vector3d point = PointOf(g, {10.0, 0.5, sweep});
    EXPECT_LT((point - Eigen::Vector3d(50, 0, -40)).norm(), 1e-12);
    const auto back = BeamPointAt(g, point);
    ASSERT_TRUE(back);
    EXPECT_NEAR(back->depth, 10.0, 1e-9);
    EXPECT_NEAR(back->fan, 0.5, 1e-9);
  }
  EXPECT_EQ(BeamPointAt(g, {50, 0, -40})->sweep, 0.0);
  EXPECT_EQ(BeamPointAt(ProbeGeometry::Phased(1, 1, 0, 10), {0, 0, 0})->fan, 0.0);
}

TEST(ProbeGeometry, NothingOutside)
{
  const ProbeGeometry g = ProbeGeometry::Convex(70 * degree, 40, 60 * degree, 25, 5, 100);
  EXPECT_FALSE(BeamPointAt(g, {0, 0, 4.9})) << "before the first sample";
  EXPECT_FALSE(BeamPointAt(g, {0, 0, 100.1})) << "after the last";
  EXPECT_FALSE(BeamPointAt(g, {0, 0, -20})) << "behind the face";
  EXPECT_FALSE(BeamPointAt(g, {0, 0, -60})) << "behind the centre of the fan";
  EXPECT_FALSE(BeamPointAt(g, {0, 0, -200})) << "behind both centres";
  EXPECT_FALSE(BeamPointAt(g, ByRadii(35.1 * degree, 40, 0, 25, 50))) << "beside the fan";
  EXPECT_FALSE(BeamPointAt(g, ByRadii(0, 40, -30.1 * degree, 25, 50))) << "beside the sweep";
  EXPECT_FALSE(BeamPointAt(g, {std::numeric_limits<double>::quiet_NaN(), 0, 10}));
  EXPECT_FALSE(BeamPointAt(g, {0, std::numeric_limits<double>::infinity(), 10}));
  const ProbeGeometry flat = ProbeGeometry::Linear(50, 40, 0, 60);
  EXPECT_FALSE(BeamPointAt(flat, {0, 0, -0.1}));
  EXPECT_FALSE(BeamPointAt(flat, {25.1, 0, 1}));
  EXPECT_FALSE(BeamPointAt(flat, {0, -20.1, 1}));
}

// Whatever comes back must be a sample of the geometry at the point that was asked for.
TEST(ProbeGeometry, AnswersAreInRangeAndAtThePoint)
{
  Random random(17);
  for (const Named& n : Geometries()) {
    int found = 0;
    for (int i = 0; i < 5000; ++i) {
      const Eigen::Vector3d point(random.Uniform(-150, 150), random.Uniform(-150, 150), random.Uniform(-150, 150));
      const auto b = BeamPointAt(n.geometry, point);
      if (!b)
        continue;
      ++found;
      EXPECT_LT((PointOf(n.geometry, *b) - point).norm(), 1e-6) << n.name;
      EXPECT_LE(std::abs(b->fan), 0.5) << n.name;
      EXPECT_LE(std::abs(b->sweep), 0.5) << n.name;
      EXPECT_GE(b->depth, n.geometry.depthMin) << n.name;
      EXPECT_LE(b->depth, n.geometry.depthMax) << n.name;
    }
    EXPECT_GT(found, 5) << n.name;
  }
}

TEST(ProbeGeometry, ApproachesFlatWithoutAJump)
{
  const ProbeGeometry flat{0.0, 50.0, 0.0, 40.0, 0.0, 60.0};
  const Eigen::Vector3d point(13, -9, 41);
  const BeamPoint limit = *BeamPointAt(flat, point);
  for (double curvature = 1e-3; curvature > 1e-320; curvature *= 0.03) {
    const ProbeGeometry bent{50 * curvature, 50.0, 40 * curvature, 40.0, 0.0, 60.0};
    const auto b = BeamPointAt(bent, point);
    ASSERT_TRUE(b) << curvature;
    // First order in the curvature, with a coefficient of some mm (mm^2 for the depth).
    EXPECT_NEAR(b->depth, limit.depth, 1e3 * curvature + 1e-13) << curvature;
    EXPECT_NEAR(b->fan, limit.fan, 1e2 * curvature + 1e-15) << curvature;
    EXPECT_NEAR(b->sweep, limit.sweep, 1e2 * curvature + 1e-15) << curvature;
    EXPECT_LT((PointOf(bent, *b) - point).norm(), 1e-12) << curvature;
  }
}

TEST(ProbeGeometry, ApproachesAPointWithoutAJump)
{
  const Eigen::Vector3d point(13, -9, 41);
  const BeamPoint limit = *BeamPointAt(ProbeGeometry::Phased(1.2, 1.0, 0, 100), point);
  for (double radius = 10; radius > 1e-300; radius *= 0.03) {
    const ProbeGeometry g = ProbeGeometry::Convex(1.2, radius, 1.0, radius, 0, 100);
    const auto b = BeamPointAt(g, point);
    ASSERT_TRUE(b) << radius;
    EXPECT_NEAR(b->depth, limit.depth, radius + 1e-12) << radius;
    EXPECT_NEAR(b->fan, limit.fan, radius + 1e-13) << radius;
    EXPECT_LT((PointOf(g, *b) - point).norm(), 1e-12) << radius;
  }
}

TEST(ProbeGeometry, SinglePlane)
{
  const ProbeGeometry g{70 * degree, 48.0, 0.0, 0.0, 0.0, 80.0};
  EXPECT_NO_THROW(g.Check());
  EXPECT_TRUE(g.IsPlane());
  const Eigen::Vector3d point = PointOf(g, {20, 0.3, 0});
  EXPECT_EQ(point.y(), 0.0);
  ASSERT_TRUE(BeamPointAt(g, point));
  EXPECT_NEAR(BeamPointAt(g, point)->fan, 0.3, 1e-12);
  EXPECT_EQ(BeamPointAt(g, point)->sweep, 0.0);
  EXPECT_FALSE(BeamPointAt(g, point + Eigen::Vector3d(0, 0.01, 0)));
}

std::string Refusal(const ProbeGeometry& g)
{
  try {
    g.Check();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    return error.what();
  }
  return {};
}

TEST(ProbeGeometry, RefusesWhatIsNoProbe)
{
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const ProbeGeometry good = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 0, 100);
  EXPECT_EQ(Refusal(good), "");
  const auto with = [&good](double ProbeGeometry::*field, double value) {
    ProbeGeometry g = good;
    g.*field = value;
    return g;
  };
  for (const double bad : {-0.1, 6.3, nan, inf}) {
    EXPECT_NE(Refusal(with(&ProbeGeometry::fanAngle, bad)).find("fan angle"), std::string::npos) << bad;
    EXPECT_NE(Refusal(with(&ProbeGeometry::sweepAngle, bad)).find("sweep angle"), std::string::npos) << bad;
  }
  for (const double bad : {-0.1, nan, inf}) {
    EXPECT_NE(Refusal(with(&ProbeGeometry::fanWidth, bad)).find("fan width"), std::string::npos) << bad;
    EXPECT_NE(Refusal(with(&ProbeGeometry::sweepWidth, bad)).find("sweep width"), std::string::npos) << bad;
  }
  for (const double bad : {-200.0, 0.0, nan, inf})
    EXPECT_NE(Refusal(with(&ProbeGeometry::depthMax, bad)).find("depths"), std::string::npos) << bad;
  EXPECT_NE(Refusal(with(&ProbeGeometry::depthMin, -41.0)).find("behind the centre"), std::string::npos);
  for (const double bad : {2.2, -2.2, nan, inf})
    EXPECT_NE(Refusal(with(&ProbeGeometry::fanOffset, bad)).find("offset"), std::string::npos) << bad;
  EXPECT_NE(Refusal({0, 0, 1, 10, 0, 100}).find("single beam"), std::string::npos);
}

TEST(ProbeGeometry, RefusesBeamsThatCross)
{
  const auto convex = [](double fan, double fanRadius, double sweep, double sweepRadius) {
    return ProbeGeometry::Convex(fan * degree, fanRadius, sweep * degree, sweepRadius, 0, 60);
  };
  EXPECT_EQ(Refusal(convex(140, 40, 179, 20)), "") << "one plane at most reaches any point";
  EXPECT_NE(Refusal(convex(140, 40, 181, 20)).find("cross"), std::string::npos);
  EXPECT_EQ(Refusal(convex(140, 40, 300, 40)), "") << "the fan stays before the axis";
  EXPECT_NE(Refusal(convex(200, 40, 300, 40)).find("cross"), std::string::npos);
  EXPECT_EQ(Refusal(convex(180, 40, 300, 40)), "") << "the fan ends on the axis";
}

} // namespace
