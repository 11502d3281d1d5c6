// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Tissue/Icosphere.h"
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <limits>
#include <map>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.141592653589793;

// How far a triangle stays from the origin, by brute force over points of it.
double NearestOf(const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
  double nearest = 2.0;
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j <= 12 - i; ++j)
      nearest = std::min(nearest, (a * i + b * j + c * (12 - i - j)).norm() / 12.0);
  return nearest;
}

} // namespace

TEST(Icosphere, IsClosedOutwardAndOnTheSphere)
{
  for (int level = 0; level <= 4; ++level) {
    const Icosphere mesh = Icosphere::Make(level);
    const int faces = 20 << 2 * level;
    ASSERT_EQ(static_cast<int>(mesh.triangles.size()), faces);
    ASSERT_EQ(static_cast<int>(mesh.points.size()), faces / 2 + 2);
    for (const Vector3d& point : mesh.points)
      EXPECT_NEAR(point.norm(), 1.0, 1e-15);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges; // each way once: closed, and oriented alike
    for (const auto& [a, b, c] : mesh.triangles) {
      ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
      const Vector3d normal = (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]);
      EXPECT_GT(normal.dot(mesh.points[a]), 0.0);
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
    }
  }
}

TEST(Icosphere, DeviationIsTheLargestOfAllTriangles)
{
  for (int level = 0; level <= 4; ++level) {
    const Icosphere mesh = Icosphere::Make(level);
    double nearest = 1.0;
    for (const auto& [a, b, c] : mesh.triangles)
      nearest = std::min(nearest, NearestOf(mesh.points[a], mesh.points[b], mesh.points[c]));
    EXPECT_NEAR(Icosphere::Deviation(level), 1.0 - nearest, 1e-12) << level;
  }
  // Of an icosahedron in the unit sphere: inradius over circumradius.
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  EXPECT_NEAR(Icosphere::Deviation(0), 1.0 - golden * golden / std::sqrt(3.0) / std::sqrt(golden * std::sqrt(5.0)), 1e-12);
}

TEST(Icosphere, VolumeOfTheIcosahedronAndOfTheLimit)
{
  const double edge = 1.0 / std::sin(2.0 * pi / 5.0); // of an icosahedron in the unit sphere
  EXPECT_NEAR(Icosphere::Make(0).Volume(), 5.0 / 12.0 * (3.0 + std::sqrt(5.0)) * edge * edge * edge, 1e-12);
  double missing = 2.0;
  for (int level = 0; level <= 5; ++level) { // falls by four with each level
    const double now = 4.0 / 3.0 * pi - Icosphere::Make(level).Volume();
    EXPECT_GT(now, 0.2 * missing);
    EXPECT_LT(now, 0.9 * missing);
    missing = now;
  }
  EXPECT_LT(missing, 0.0025);
}

TEST(Icosphere, TrueVolumeSharesTheDeviation)
{
  for (int level = 1; level <= 4; ++level) {
    const double outside = std::cbrt(4.0 / 3.0 * pi / Icosphere::Make(level).Volume()) - 1.0;
    EXPECT_NEAR(outside / Icosphere::Deviation(level), 0.65, 0.06);
  }
}

TEST(Icosphere, LevelIsTheLowestThatIsFineEnough)
{
  for (const double radius : {0.1, 1.0, 7.5, 300.0})
    for (const double deviation : {0.01, 0.1, 1.0, 400.0}) {
      const int level = Icosphere::LevelFor(radius, deviation);
      EXPECT_TRUE(level == Icosphere::maxLevel || radius * Icosphere::Deviation(level) <= deviation);
      EXPECT_TRUE(level == 0 || radius * Icosphere::Deviation(level - 1) > deviation);
    }
  EXPECT_EQ(Icosphere::LevelFor(1e6, 1e-6), Icosphere::maxLevel);
}

TEST(Icosphere, RefusesWhatHasNoAnswer)
{
  EXPECT_THROW(Icosphere::Make(-1), Error);
  EXPECT_THROW(Icosphere::Make(9), Error);
  EXPECT_THROW(Icosphere::LevelFor(0.0, 1.0), Error);
  EXPECT_THROW(Icosphere::LevelFor(1.0, 0.0), Error);
  EXPECT_THROW(Icosphere::LevelFor(1.0, std::numeric_limits<double>::quiet_NaN()), Error);
}
