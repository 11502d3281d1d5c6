// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Physics/GelColliders.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

TEST(GelColliders, ProbeFollowsItsFace)
{
  const ProbeGeometry geometry = ProbeGeometry::Convex(1.2, 40.0, 1.0, 25.0, 0.0, 100.0);
  const GelProbe probe(ProbeShape(geometry, {5.0, 1.0, 30.0}));
  for (const double fan : {-0.5, -0.2, 0.0, 0.4})
    for (const double sweep : {-0.4, 0.0, 0.5})
      for (const double depth : {0.0, 1.0, 5.0}) {
        const BeamPoint beam{depth, fan, sweep};
        const Vector3d point = PointOf(geometry, beam);
        EXPECT_NEAR(probe.Distance(point, 0.0), depth, 1e-9);
        if (depth > 0.0) {
          EXPECT_GT(probe.Normal(point, 0.0).dot(DirectionOf(geometry, beam)), 0.999);
        }
      }
  EXPECT_LT(probe.Distance({0, 0, -5}, 0.0), -1.0);
  EXPECT_GT(probe.Distance({0, 0, -35}, 0.0), 4.0);
  EXPECT_GT(probe.Distance({60, 0, -10}, 0.0), 5.0);
}

TEST(GelColliders, ProbeDistanceNeverFallsFasterThanOneMoves)
{
  const GelProbe probe(ProbeShape(ProbeGeometry::Linear(40.0, 20.0, 0.0, 80.0)));
  double last = probe.Distance({-60, 3, 20}, 0.0);
  for (int n = 1; n <= 1200; ++n) {
    const double next = probe.Distance({-60 + 0.1 * n, 3, 20 - 0.05 * n}, 0.0);
    EXPECT_LE(std::abs(next - last), 0.1119);
    last = next;
  }
}

TEST(GelColliders, ContactSticksSlidesAndLetsGo)
{
  GelCollider floor;
  floor.shape = std::make_shared<GelPlane>();
  floor.end.translation() = Vector3d(3, 0, 0); // moves at 3 mm/s
  const auto after = [&floor](const Vector3d& velocity) {
    GelColliders colliders({floor}, 1.0);
    colliders.SetStep(0.0, 0.001);
    return colliders.Collide(0, {0, 0, -0.1}, velocity);
  };
  EXPECT_LT((after({10, 0, -4}) - Vector3d(3, 0, 0)).norm(), 1e-9);
  EXPECT_LT((after({10, 0, 4}) - Vector3d(3, 0, 0)).norm(), 1e-9);
  floor.contact.stick = false;
  EXPECT_LT((after({10, 0, -4}) - Vector3d(10, 0, 0)).norm(), 1e-9);
  EXPECT_LT((after({10, 0, 4}) - Vector3d(10, 0, 4)).norm(), 1e-9);
  floor.contact.friction = 0.5;
  EXPECT_LT((after({10, 0, -4}) - Vector3d(8, 0, 0)).norm(), 1e-9);
  floor.contact.friction = 10.0;
  EXPECT_LT((after({10, 0, -4}) - Vector3d(3, 0, 0)).norm(), 1e-9);
}

TEST(GelColliders, SkinOnAGridRises)
{
  ImageGeometry geometry;
  geometry.dimensions = {3, 3, 5};
  geometry.origin = Vector3d(-2, -2, -4);
  geometry.spacing = Vector3d(2, 2, 2);
  std::vector<float> begin, end;
  for (int k = 0; k < 5; ++k)
    for (int n = 0; n < 9; ++n) {
      begin.push_back(static_cast<float>(2 * k - 4));
      end.push_back(static_cast<float>(2 * k - 5)); // the surface goes from z = 0 to z = 1
    }
  GelCollider skin;
  skin.shape = std::make_shared<GelDistanceGrid>(geometry, begin, end);
  EXPECT_NEAR(skin.shape->Distance({0.3, -0.7, 1.5}, 0.5), 1.0, 1e-6);
  GelColliders colliders({skin}, 0.5);
  colliders.SetStep(0.5, 0.51);
  EXPECT_LT((colliders.Collide(0, {0, 0, 0.4}, {1, 1, 0}) - Vector3d(0, 0, 2)).norm(), 1e-5);
  EXPECT_NEAR(colliders.Distance(0, {0, 0, 0.6}), 0.1, 1e-6);
  // It is drawn along too; how far it rises is what distances say.
  skin.shape =
      std::make_shared<GelDistanceGrid>(geometry, begin, end, std::vector<Eigen::Vector3f>(45, Eigen::Vector3f(3, -1, 9)));
  GelColliders drawn({skin}, 0.5);
  drawn.SetStep(0.5, 0.51);
  EXPECT_LT((drawn.Collide(0, {0, 0, 0.4}, {1, 1, 0}) - Vector3d(6, -2, 2)).norm(), 1e-5);
  end.pop_back();
  EXPECT_THROW(GelDistanceGrid(geometry, begin, end), Error);
}
