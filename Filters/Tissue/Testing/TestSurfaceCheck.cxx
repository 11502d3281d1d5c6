// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Tissue/Icosphere.h"
#include "Filters/Tissue/SurfaceCheck.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

using namespace echorama;
using Eigen::Vector3f;

namespace {

constexpr double pi = 3.141592653589793;

void Add(TriangleSurface& to, const TriangleSurface& other, bool turned = false)
{
  const auto first = static_cast<std::uint32_t>(to.points.size());
  to.points.insert(to.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles)
    to.triangles.push_back(turned ? std::array<std::uint32_t, 3>{a + first, c + first, b + first}
                                  : std::array<std::uint32_t, 3>{a + first, b + first, c + first});
}

TriangleSurface Ball(double radius, const Vector3f& centre = Vector3f::Zero(), int level = 2)
{
  const Icosphere mesh = Icosphere::Make(level);
  TriangleSurface surface;
  for (const auto& point : mesh.points)
    surface.points.push_back((radius * point).cast<float>() + centre);
  surface.triangles = mesh.triangles;
  return surface;
}

TriangleSurface Cube(const Vector3f& low, float edge)
{
  TriangleSurface cube;
  for (int i = 0; i < 8; ++i)
    cube.points.push_back(low + edge * Vector3f(float(i & 1), float(i >> 1 & 1), float(i >> 2)));
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return cube;
}

// As files have them: every triangle with points of its own.
TriangleSurface Exploded(const TriangleSurface& surface)
{
  TriangleSurface soup;
  for (const auto& corners : surface.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.points.size());
    for (const std::uint32_t corner : corners)
      soup.points.push_back(surface.points[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

using Integer = Eigen::Matrix<long long, 3, 1>;
long long Volume(const Integer& a, const Integer& b, const Integer& c, const Integer& d)
{
  return (a - d).dot((b - d).cross(c - d));
}

// Whether an edge goes through a triangle; whole numbers, so without rounding.
bool PiercesExactly(const Integer& p, const Integer& q, const std::array<Integer, 3>& t)
{
  const long long a = Volume(t[0], t[1], t[2], p), b = Volume(t[0], t[1], t[2], q);
  if (a == 0 || b == 0 || (a > 0) == (b > 0))
    return false;
  const long long u = Volume(p, q, t[0], t[1]), v = Volume(p, q, t[1], t[2]), w = Volume(p, q, t[2], t[0]);
  return ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) && (u == 0) + (v == 0) + (w == 0) < 2;
}

} // namespace

TEST(SurfaceCheck, ABallIsSound)
{
  const SurfaceReport report = CheckSurface(Ball(10.0, {3, -4, 5}, 3));
  EXPECT_TRUE(report.IsSound());
  EXPECT_EQ(report.Faults(), "");
  EXPECT_EQ(report.triangles, 1280);
  EXPECT_EQ(report.components, 1);
  EXPECT_NEAR(report.volumeMm3 / (4000.0 / 3.0 * pi), 0.9914, 1e-4);
  EXPECT_TRUE(CheckSurface(Cube({0, 0, 0}, 7)).IsSound());
  EXPECT_NEAR(CheckSurface(Cube({50, 60, 70}, 7)).volumeMm3, 343.0, 1e-6);
}

TEST(SurfaceCheck, FindsHolesAndWhereTheyAre)
{
  TriangleSurface open = Cube({10, 10, 10}, 2);
  open.triangles.pop_back(); // half of the side x = 12
  const SurfaceReport report = CheckSurface(open);
  EXPECT_EQ(report.openEdges.count, 3);
  EXPECT_FALSE(report.IsClosed());
  for (const Vector3f& place : report.openEdges.places)
    EXPECT_EQ(place.x(), 12.0f);
  EXPECT_NE(report.Faults().find("3 open edges (first at 12 "), std::string::npos) << report.Faults();
  SurfaceCheckParameters few;
  few.mostPlaces = 1;
  EXPECT_EQ(CheckSurface(open, few).openEdges.places.size(), 1u);
}

TEST(SurfaceCheck, FindsCrowdsTurnedTrianglesAndInsideOut)
{
  TriangleSurface crowd = Cube({0, 0, 0}, 2);
  crowd.points.push_back({9, 9, 9});
  crowd.triangles.push_back({0, 1, 8}); // a flap
  EXPECT_EQ(CheckSurface(crowd).crowdedEdges.count, 1);
  EXPECT_EQ(CheckSurface(crowd).openEdges.count, 2);

  TriangleSurface turned = Ball(5.0);
  std::swap(turned.triangles[7][0], turned.triangles[7][1]);
  const SurfaceReport report = CheckSurface(turned);
  EXPECT_EQ(report.inconsistentEdges.count, 3);
  EXPECT_EQ(report.insideOut.count, 0);

  TriangleSurface inside;
  Add(inside, Ball(5.0), true);
  EXPECT_EQ(CheckSurface(inside).insideOut.count, 1);
  EXPECT_EQ(CheckSurface(inside).inconsistentEdges.count, 0);
  EXPECT_LT(CheckSurface(inside).volumeMm3, 0.0);
}

TEST(SurfaceCheck, NestedComponentsAreCavities)
{
  TriangleSurface shell = Ball(10.0);
  Add(shell, Ball(6.0), true);
  EXPECT_TRUE(CheckSurface(shell).IsSound()) << CheckSurface(shell).Faults();
  EXPECT_EQ(CheckSurface(shell).cavities, 1);
  Add(shell, Ball(3.0)); // an island in the hole
  Add(shell, Ball(4.0, {30, 0, 0}));
  const SurfaceReport report = CheckSurface(shell);
  EXPECT_TRUE(report.IsSound()) << report.Faults();
  EXPECT_EQ(report.components, 4);
  EXPECT_EQ(report.cavities, 1);

  TriangleSurface wrong = Ball(10.0); // a hole that faces outwards
  Add(wrong, Ball(6.0));
  EXPECT_EQ(CheckSurface(wrong).insideOut.count, 1);
  EXPECT_EQ(MendSurface(wrong).turnedTriangles, 320);
  EXPECT_TRUE(CheckSurface(wrong).IsSound());

  TriangleSurface crossing = Ball(10.0); // neither is inside of the other
  Add(crossing, Ball(6.0, {8, 0, 0}));
  EXPECT_EQ(CheckSurface(crossing).cavities, 0);
  EXPECT_EQ(CheckSurface(crossing).insideOut.count, 0);
}

TEST(SurfaceCheck, FindsSelfIntersections)
{
  TriangleSurface crossing = Ball(10.0);
  Add(crossing, Ball(10.0, {15, 0, 0}));
  const SurfaceReport report = CheckSurface(crossing);
  EXPECT_GT(report.selfIntersections.count, 20);
  for (const Vector3f& place : report.selfIntersections.places) // near the circle where the spheres meet
    EXPECT_NEAR((place - Vector3f(7.5f, 0, 0)).norm(), std::sqrt(100.0f - 56.25f), 1.6f);

  TriangleSurface apart = Ball(10.0);
  Add(apart, Ball(10.0, {20.001f, 0, 0}));
  EXPECT_EQ(CheckSurface(apart).selfIntersections.count, 0);

  TriangleSurface cubes = Cube({0, 0, 0}, 2); // edges go through the diagonals of faces
  Add(cubes, Cube({1, 1, 1}, 2));
  EXPECT_GT(CheckSurface(cubes).selfIntersections.count, 0);

  SurfaceCheckParameters without;
  without.selfIntersections = false;
  EXPECT_EQ(CheckSurface(crossing, without).selfIntersections.count, 0);
}

TEST(SurfaceCheck, TouchingIsNoCrossing)
{
  TriangleSurface corner = Cube({0, 0, 0}, 2); // a corner of the one on a face of the other
  TriangleSurface turned = Cube({0, 0, 0}, 1);
  for (Vector3f& point : turned.points) // on its tip
    point = Vector3f(point.x() - point.y(), point.x() + point.y() - 2 * point.z(), point.sum()) + Vector3f(1, 1, 2);
  Add(corner, turned);
  EXPECT_EQ(CheckSurface(corner).selfIntersections.count, 0);

  TriangleSurface edge = Cube({0, 0, 0}, 2); // edge to edge
  Add(edge, Cube({2, 2, 0}, 2));
  EXPECT_EQ(CheckSurface(edge).selfIntersections.count, 0);

  TriangleSurface face = Cube({0, 0, 0}, 2); // half a face to half a face: the same plane twice
  Add(face, Cube({2, 1, 0}, 2));
  EXPECT_GT(CheckSurface(face).selfIntersections.count, 0);
}

TEST(SurfaceCheck, NeighboursThatFoldOverCross)
{
  // A fan about the origin whose first triangle stabs the opposite one, though they share a corner.
  TriangleSurface fan;
  fan.points = {{0, 0, 0}, {4, -1, 0}, {4, 1, 0}, {3, 0, -1}, {3, 0, 1}};
  fan.triangles = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_EQ(CheckSurface(fan).selfIntersections.count, 1);
  fan.points[3].y() = fan.points[4].y() = 5; // beside it
  EXPECT_EQ(CheckSurface(fan).selfIntersections.count, 0);
  // Folded flat along the shared edge, and unfolded.
  TriangleSurface fold;
  fold.points = {{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, 0.5f, 0}, {1, -1, 0}};
  fold.triangles = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_EQ(CheckSurface(fold).selfIntersections.count, 1);
  fold.triangles[1] = {1, 0, 4};
  EXPECT_EQ(CheckSurface(fold).selfIntersections.count, 0);
  fold.triangles[1] = {0, 1, 2}; // twice the same
  EXPECT_EQ(CheckSurface(fold).selfIntersections.count, 1);
}

TEST(SurfaceCheck, ASoupOfWholeNumbersAgreesWithExactArithmetic)
{
  Random random(3);
  TriangleSurface soup;
  std::vector<std::array<Integer, 3>> exact;
  for (std::uint32_t i = 0; i < 300; ++i) {
    std::array<Integer, 3> corners;
    const Integer middle(static_cast<long long>(random.Below(24)), static_cast<long long>(random.Below(24)),
                         static_cast<long long>(random.Below(24)));
    for (Integer& corner : corners) {
      for (int axis = 0; axis < 3; ++axis)
        corner[axis] = middle[axis] + static_cast<long long>(random.Below(9));
      soup.points.push_back(corner.cast<float>());
    }
    exact.push_back(corners);
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  std::int64_t crossings = 0;
  for (std::size_t i = 0; i < exact.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      bool flat = (exact[i][1] - exact[i][0]).cross(exact[i][2] - exact[i][0]).isZero() ||
                  (exact[j][1] - exact[j][0]).cross(exact[j][2] - exact[j][0]).isZero();
      bool crosses = false;
      for (std::size_t k = 0; k < 3; ++k)
        crosses = crosses || PiercesExactly(exact[i][k], exact[i][(k + 1) % 3], exact[j]) ||
                  PiercesExactly(exact[j][k], exact[j][(k + 1) % 3], exact[i]);
      crossings += crosses && !flat;
    }
  EXPECT_GT(crossings, 100);
  EXPECT_EQ(CheckSurface(soup).selfIntersections.count, crossings);
}

TEST(SurfaceCheck, WeldsWhatFilesTakeApart)
{
  TriangleSurface soup = Exploded(Ball(10.0));
  EXPECT_EQ(CheckSurface(soup).openEdges.count, 3 * 320);
  EXPECT_EQ(CheckSurface(soup).components, 320);
  for (std::size_t i = 0; i < soup.points.size(); ++i) // a bit of rounding
    soup.points[i] += 1e-4f * Vector3f(float(i % 3), float(i % 2), float(i % 5)) / 5.0f;
  const SurfaceMending mending = MendSurface(soup);
  EXPECT_EQ(mending.weldedPoints, 3 * 320 - 162);
  EXPECT_EQ(mending.droppedTriangles, 0);
  EXPECT_EQ(mending.turnedTriangles, 0);
  EXPECT_TRUE(CheckSurface(soup).IsSound()) << CheckSurface(soup).Faults();

  TriangleSurface equal = Exploded(Ball(10.0));
  SurfaceMendParameters exactly;
  exactly.weldMm = 0.0;
  MendSurface(equal, exactly);
  EXPECT_EQ(equal.points.size(), 162u);
}

TEST(SurfaceCheck, TurnsWhatIsTurned)
{
  TriangleSurface mixed = Ball(10.0);
  Random random(5);
  std::int64_t turned = 0;
  for (auto& corners : mixed.triangles)
    if (random.Uniform() < 0.4) {
      std::swap(corners[0], corners[1]);
      ++turned;
    }
  EXPECT_GT(CheckSurface(mixed).inconsistentEdges.count, 100);
  EXPECT_EQ(MendSurface(mixed).turnedTriangles, turned);
  EXPECT_TRUE(CheckSurface(mixed).IsSound());

  TriangleSurface inside; // far from the origin, and open
  Add(inside, Ball(10.0, {500, 500, -700}), true);
  inside.triangles.erase(inside.triangles.begin(), inside.triangles.begin() + 100);
  EXPECT_EQ(MendSurface(inside).turnedTriangles, 220);
  SurfaceMendParameters leave;
  leave.orient = false;
  TriangleSurface left;
  Add(left, Ball(1.0), true);
  EXPECT_EQ(MendSurface(left, leave).turnedTriangles, 0);
}

TEST(SurfaceCheck, ClosesHoles)
{
  SurfaceMendParameters close;
  close.closeHoles = true;
  TriangleSurface ball = Ball(10.0, {5, 6, 7}, 3);
  const double whole = CheckSurface(ball).volumeMm3;
  EXPECT_EQ(MendSurface(ball, close).closedHoles, 0);
  ball.triangles.erase(ball.triangles.begin() + 100); // one triangle
  std::vector<std::array<std::uint32_t, 3>> kept;     // and a cap: cut off at x = 12 or so
  for (const auto& corners : ball.triangles)
    if (ball.points[corners[0]].x() < 12 || ball.points[corners[1]].x() < 12 || ball.points[corners[2]].x() < 12)
      kept.push_back(corners);
  ball.triangles = kept;
  for (const bool turned : {false, true}) {
    TriangleSurface open;
    Add(open, ball, turned);
    const SurfaceMending mending = MendSurface(open, close);
    EXPECT_EQ(mending.closedHoles, 2);
    EXPECT_EQ(mending.turnedTriangles, turned ? static_cast<std::int64_t>(kept.size()) : 0);
    const SurfaceReport report = CheckSurface(open);
    EXPECT_TRUE(report.IsSound()) << report.Faults();
    const double height = 10.0 - 7.0; // of the cap
    EXPECT_NEAR((whole - report.volumeMm3) / (pi * height * height * (30.0 - height) / 3.0), 0.9, 0.2);
  }
  TriangleSurface cube = Cube({0, 0, 0}, 2);
  cube.triangles.erase(cube.triangles.begin() + 11);
  EXPECT_EQ(MendSurface(cube, close).closedHoles, 1);
  EXPECT_TRUE(CheckSurface(cube).IsSound());
  TriangleSurface tent; // two triangles back to back, of which one is missing
  tent.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  tent.triangles = {{0, 1, 2}};
  MendSurface(tent, close);
  EXPECT_EQ(CheckSurface(tent).openEdges.count, 0);
  TriangleSurface branching = Ball(10.0); // two holes that share a corner stay open
  const std::uint32_t corner = branching.triangles[0][0];
  std::vector<std::array<std::uint32_t, 3>> around;
  for (const auto& corners : branching.triangles)
    if (corners[0] == corner || corners[1] == corner || corners[2] == corner)
      around.push_back(corners);
  const auto drop = [&branching](const std::array<std::uint32_t, 3>& corners) {
    branching.triangles.erase(std::find(branching.triangles.begin(), branching.triangles.end(), corners));
  };
  const auto share = [](const std::array<std::uint32_t, 3>& a, const std::array<std::uint32_t, 3>& b) {
    return std::count_if(a.begin(), a.end(), [&b](std::uint32_t point) { return std::count(b.begin(), b.end(), point) > 0; });
  };
  drop(around[0]);
  drop(*std::find_if(around.begin(), around.end(), [&](const auto& corners) { return share(corners, around[0]) == 1; }));
  EXPECT_EQ(MendSurface(branching, close).closedHoles, 0);
  EXPECT_EQ(CheckSurface(branching).openEdges.count, 6);
}

TEST(SurfaceCheck, DropsWhatIsNoTriangle)
{
  TriangleSurface surface = Ball(10.0);
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  surface.points.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  surface.points.push_back({90, 90, 90}); // of no triangle
  surface.triangles.push_back({0, 0, 1});
  surface.triangles.push_back({0, 1, first});
  EXPECT_EQ(CheckSurface(surface).degenerateTriangles.count, 2);
  const SurfaceMending mending = MendSurface(surface);
  EXPECT_EQ(mending.droppedTriangles, 2);
  EXPECT_EQ(surface.points.size(), first);
  EXPECT_TRUE(CheckSurface(surface).IsSound()) << CheckSurface(surface).Faults();
  // One without area that has three corners is told, and stays: without it there were a hole.
  surface.points.push_back(0.5f * (surface.points[surface.triangles[0][0]] + surface.points[surface.triangles[0][1]]));
  surface.triangles.push_back({surface.triangles[0][0], surface.triangles[0][1], first});
  EXPECT_EQ(CheckSurface(surface).degenerateTriangles.count, 1);
  EXPECT_EQ(MendSurface(surface).droppedTriangles, 0);
}

TEST(SurfaceCheck, NothingAndBadInput)
{
  TriangleSurface none;
  EXPECT_EQ(CheckSurface(none).Faults(), "no triangles");
  EXPECT_FALSE(CheckSurface(none).IsSound());
  EXPECT_EQ(MendSurface(none).droppedTriangles, 0);
  TriangleSurface bad = Ball(1.0);
  bad.triangles[3][1] = 162;
  EXPECT_THROW(CheckSurface(bad), Error);
  EXPECT_THROW(MendSurface(bad), Error);
  TriangleSurface ball = Ball(1.0);
  for (const double distance : {-1.0, 11.0, std::numeric_limits<double>::quiet_NaN()}) {
    SurfaceMendParameters p;
    p.weldMm = distance;
    EXPECT_THROW(MendSurface(ball, p), Error);
  }
  SurfaceCheckParameters p;
  p.mostPlaces = -1;
  EXPECT_THROW(CheckSurface(ball, p), Error);
  EXPECT_THROW(CheckSurface(ball, {}, Progress([](double) { return false; })), Error);
}

TEST(SurfaceCheck, SameOnAnyThreads)
{
  TriangleSurface crossing = Ball(10.0, {0, 0, 0}, 4);
  Add(crossing, Ball(10.0, {12, 1, 2}, 4));
  const SurfaceReport many = CheckSurface(crossing);
  const ThreadLimit one(1);
  const SurfaceReport alone = CheckSurface(crossing);
  EXPECT_EQ(many.selfIntersections.count, alone.selfIntersections.count);
  EXPECT_EQ(many.selfIntersections.places, alone.selfIntersections.places);
  EXPECT_GT(many.selfIntersections.count, 100);
}
