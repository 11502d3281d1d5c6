// SPDX-License-Identifier: BSD-3-Clause
#include "ClosedBodies.h"
#include "Core/Base/Error.h"
#include "Filters/Phantoms/BodyShapes.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.14159265358979323846;

const Material& Stuff()
{
  return StandardMaterial("liver");
}

void ExpectClosed(const BodyShape& shape)
{
  EXPECT_TRUE(shape.closed) << shape.name;
  EXPECT_EQ(shape.euler, 2) << shape.name;
  EXPECT_GT(shape.volume, 0.0) << shape.name;
  EXPECT_GT(shape.thinnest, 1e-4) << shape.name;
}

} // namespace

TEST(BodyShapes, BlobsHaveTheVolumeOfTheirEllipsoid)
{
  TissueSurface tissue;
  tissue.MaterialIndex(StandardMaterial("gel"));
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  AddBlob(tissue, "ellipsoid", Stuff(), {10, -20, 30}, EllipsoidRadius({30, 20, 10}, turned), 1.0);
  const std::size_t firstOfBall = tissue.points.size();
  AddBlob(
      tissue, "small ball", Stuff(), {0, 0, 0}, [](const Vector3d&) { return 0.4; }, 1.0);
  tissue.Check();
  const auto shapes = ShapesOf(tissue);
  for (const BodyShape& shape : shapes) {
    ExpectClosed(shape);
    EXPECT_TRUE(shape.starShaped);
  }
  EXPECT_NEAR(shapes[0].volume, 4.0 / 3.0 * pi * 6000.0, 0.005 * 25132.7);
  EXPECT_LT((shapes[0].box.center() - Vector3d(10, -20, 30)).norm(), 0.05);
  for (std::size_t i = 0; i < firstOfBall; ++i) {
    const Vector3d local = turned.transpose() * (tissue.points[i].cast<double>() - Vector3d(10, -20, 30));
    EXPECT_NEAR(local.cwiseQuotient(Vector3d(30, 20, 10)).norm(), 1.0, 1e-5);
  }
}

TEST(BodyShapes, AShellIsAsThickAsItSays)
{
  // Of a ball exactly; of an ellipsoid the distance between both surfaces along the normal, to second order.
  const RadiusOf ball = [](const Vector3d&) { return 20.0; };
  EXPECT_NEAR(Shell(ball, -1.5)(Vector3d::UnitY()), 18.5, 1e-12);
  const Vector3d radii(60, 45, 30);
  const RadiusOf outer = EllipsoidRadius(radii), inner = Shell(outer, -0.8);
  for (int i = 0; i < 200; ++i) {
    const double z = (2.0 * i + 1.0) / 200.0 - 1.0, angle = 2.4 * i, r = std::sqrt(1.0 - z * z);
    const Vector3d d(r * std::cos(angle), r * std::sin(angle), z), p = inner(d) * d;
    // First-order distance of p to the ellipsoid, and its error's order.
    const Vector3d q = p.cwiseQuotient(radii);
    const double distance = q.norm() * (1.0 - q.norm()) / q.cwiseQuotient(radii).norm();
    EXPECT_NEAR(distance, 0.8, 0.04);
  }
}

TEST(BodyShapes, TubesHaveTheVolumeOfTheirLength)
{
  TissueSurface tissue;
  tissue.MaterialIndex(StandardMaterial("gel"));
  std::vector<Vector3d> line, arc;
  for (int i = 0; i <= 40; ++i)
    line.emplace_back(i, 0.0, 5.0);
  for (int i = 0; i <= 200; ++i)
    arc.emplace_back(30.0 * std::cos(0.02 * i), 30.0 * std::sin(0.02 * i), 0.1 * i);
  AddTube(tissue, "straight", Stuff(), line, std::vector<double>(line.size(), 3.0), 0.3);
  AddTube(tissue, "bent", Stuff(), arc, std::vector<double>(arc.size(), 4.0), 0.4);
  const auto shapes = ShapesOf(tissue);
  for (const BodyShape& shape : shapes)
    ExpectClosed(shape);
  const double straight = pi * 9.0 * 40.0 + 4.0 / 3.0 * pi * 27.0;
  EXPECT_NEAR(shapes[0].volume, straight, 0.01 * straight);
  double length = 0.0;
  for (std::size_t i = 1; i < arc.size(); ++i)
    length += (arc[i] - arc[i - 1]).norm();
  const double bent = pi * 16.0 * length + 4.0 / 3.0 * pi * 64.0; // Pappus: the bend does not change it
  EXPECT_NEAR(shapes[1].volume, bent, 0.01 * bent);
}

TEST(BodyShapes, BlocksReachFromTheirUpperSideToTheLower)
{
  TissueSurface tissue;
  tissue.MaterialIndex(StandardMaterial("gel"));
  AddBlock(
      tissue, "block", Stuff(), {-10, -20}, {30, 40}, [](double x, double y) { return 2.0 + 0.1 * x + 0.05 * y; }, 50.0, 1.7);
  const auto shapes = ShapesOf(tissue);
  ExpectClosed(shapes[0]);
  const double mean = 2.0 + 0.1 * 10.0 + 0.05 * 10.0;
  EXPECT_NEAR(shapes[0].volume, 40.0 * 60.0 * (50.0 - mean), 0.5);
  EXPECT_NEAR(shapes[0].box.min().z(), 2.0 - 1.0 - 1.0, 1e-5);
  EXPECT_EQ(shapes[0].box.max(), Vector3d(30, 40, 50));
}

TEST(BodyShapes, WhatIsNoShapeIsRefused)
{
  TissueSurface tissue;
  tissue.MaterialIndex(StandardMaterial("gel"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto ball = [](const Vector3d&) { return 1.0; };
  EXPECT_THROW(AddBlob(
                   tissue, "a", Stuff(), {0, 0, 0}, [](const Vector3d&) { return 0.0; }, 1.0),
               Error);
  EXPECT_THROW(AddBlob(
                   tissue, "b", Stuff(), {0, 0, 0}, [](const Vector3d& d) { return d.x() + d.y() - 0.5; }, 1.0),
               Error);
  EXPECT_THROW(AddBlob(tissue, "c", Stuff(), {0, 0, nan}, ball, 1.0), Error);
  EXPECT_THROW(AddBlob(tissue, "d", Stuff(), {0, 0, 0}, ball, 0.0), Error);
  EXPECT_THROW(AddTube(tissue, "e", Stuff(), {{0, 0, 0}}, {1.0}, 1.0), Error);
  EXPECT_THROW(AddTube(tissue, "f", Stuff(), {{0, 0, 0}, {0, 0, 0}}, {1.0, 1.0}, 1.0), Error);
  EXPECT_THROW(AddTube(tissue, "g", Stuff(), {{0, 0, 0}, {0, 0, 1}}, {1.0, -1.0}, 1.0), Error);
  EXPECT_THROW(AddBlock(
                   tissue, "h", Stuff(), {0, 0}, {0, 1}, [](double, double) { return 0.0; }, 1.0, 1.0),
               Error);
  EXPECT_THROW(AddBlock(
                   tissue, "i", Stuff(), {0, 0}, {1, 1}, [](double, double) { return 2.0; }, 1.0, 1.0),
               Error);
}
