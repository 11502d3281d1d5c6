// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Shell/BodySurface.h"
#include "Filters/Tissue/Icosphere.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

TriangleSurface Ball(double radius, int level, const Vector3d& centre = Vector3d::Zero())
{
  const Icosphere sphere = Icosphere::Make(level);
  TriangleSurface surface;
  for (const Vector3d& point : sphere.points)
    surface.points.push_back((centre + radius * point).cast<float>());
  surface.triangles = sphere.triangles;
  return surface;
}

// A block of 10 mm with a quarter cut away along z: its edge within is not convex.
TriangleSurface Angle()
{
  TriangleSurface surface;
  const std::array<Eigen::Vector2f, 6> outline{{{0, 0}, {10, 0}, {10, 5}, {5, 5}, {5, 10}, {0, 10}}};
  for (const float z : {0.0f, 10.0f})
    for (const Eigen::Vector2f& corner : outline)
      surface.points.emplace_back(corner.x(), corner.y(), z);
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t j = (i + 1) % 6;
    surface.triangles.push_back({i, j, j + 6});
    surface.triangles.push_back({i, j + 6, i + 6});
  }
  for (const auto& [a, b, c] : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
    surface.triangles.push_back({a, c, b});
    surface.triangles.push_back({a + 6, b + 6, c + 6});
  }
  return surface;
}

std::string MessageOf(const TriangleSurface& surface)
{
  try {
    const BodySurface body(surface);
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    return error.what();
  }
  return "";
}

TEST(BodySurface, DistancesAndSidesOfABlockWithAnInnerEdge)
{
  const BodySurface body(Angle());
  const auto box = [](const Vector3d& p, const Vector3d& low, const Vector3d& high) { // signed, exact
    const Vector3d beyond = (p - 0.5 * (low + high)).cwiseAbs() - 0.5 * (high - low);
    return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
  };
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p(random.Uniform(-5, 15), random.Uniform(-5, 15), random.Uniform(-5, 15));
    const bool isInside = p.minCoeff() > 0.0 && p.maxCoeff() < 10.0 && (p.x() < 5.0 || p.y() < 5.0);
    double wanted = std::min(box(p, {0, 0, 0}, {10, 5, 10}), box(p, {0, 0, 0}, {5, 10, 10})); // outside
    if (isInside) {
      const double cut = box(p, {5, 5, -100}, {100, 100, 100});
      wanted = -std::min(-box(p, {0, 0, 0}, {10, 10, 10}), cut);
    }
    const BodySurface::Place place = body.PlaceOf(p);
    ASSERT_NEAR(place.distanceMm, wanted, 1e-6) << p.transpose();
    ASSERT_NEAR((place.nearest + place.distanceMm * place.away - p).norm(), 0.0, 1e-6) << p.transpose();
  }
}

TEST(BodySurface, IsTurnedOutwards)
{
  TriangleSurface surface = Ball(10.0, 3);
  for (auto& triangle : surface.triangles)
    std::swap(triangle[0], triangle[1]);
  EXPECT_LT(BodySurface(surface).Distance(Vector3d::Zero()), -9.0);
}

TEST(BodySurface, HolesAreNamedWithNumberPlaceAndLength)
{
  TriangleSurface surface = Angle();
  // Both halves of the side at y = 0, which is 10 by 10, and one of the side at x = 0: a triangle of 10, 10 and its diagonal.
  surface.triangles.erase(surface.triangles.begin(), surface.triangles.begin() + 2);
  const std::vector<SurfaceHole> one = HolesOf(surface);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(one[0].lengthMm, 40.0, 1e-5);
  EXPECT_EQ(one[0].edges, 4u);
  EXPECT_NEAR((one[0].middle - Vector3d(5, 0, 5)).norm(), 0.0, 1e-5);

  TriangleSurface two = Angle();
  two.triangles.erase(two.triangles.begin() + 5); // of the side at y = 5 ... x = 5, whichever: 5, 10 and their diagonal
  two.triangles.erase(two.triangles.begin());     // of the side at y = 0: 10, 10 and the diagonal
  const std::string message = MessageOf(two);
  EXPECT_NE(message.find("it has 2 holes, one of 34.1 mm around (3 edges) at (6.7, 0.0, 3.3), one of 26.2 mm around (3 edges)"),
            std::string::npos)
      << message;
}

TEST(BodySurface, WhatIsNoBodyIsRefusedByName)
{
  EXPECT_NE(MessageOf({}).find("no triangle"), std::string::npos);

  TriangleSurface crossing = Ball(10.0, 3);
  const TriangleSurface other = Ball(10.0, 3, {8.0, 0.3, 0.1});
  const auto first = static_cast<std::uint32_t>(crossing.points.size());
  crossing.points.insert(crossing.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles)
    crossing.triangles.push_back({a + first, b + first, c + first});
  EXPECT_NE(MessageOf(crossing).find("self-intersections"), std::string::npos) << MessageOf(crossing);

  TriangleSurface bad = Ball(10.0, 2);
  bad.points[17].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(MessageOf(bad).find("point 17 of the body is not finite"), std::string::npos) << MessageOf(bad);
  bad.points[17].y() = 3e6f;
  EXPECT_NE(MessageOf(bad).find("further than 100 m"), std::string::npos) << MessageOf(bad);
  TriangleSurface beyond = Ball(10.0, 1);
  beyond.triangles[3][1] = 4000;
  EXPECT_NE(MessageOf(beyond).find("4000"), std::string::npos) << MessageOf(beyond);
}

} // namespace
