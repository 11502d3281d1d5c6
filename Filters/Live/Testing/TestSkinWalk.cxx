// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Random.h"
#include "Filters/Live/SkinWalk.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>

using namespace echorama;
using Eigen::Vector3d, Eigen::Vector3f;

namespace {

struct Surface {
  std::vector<Vector3f> points;
  std::vector<SkinMesh::Triangle> triangles;

  std::shared_ptr<const SkinMesh> Mesh() const { return std::make_shared<const SkinMesh>(points, triangles); }
};

// A square in the plane z = 0, from -size to size, normal +z; cells are shaken, or all points fall on a grid.
Surface Square(int cells, double size, double shaken = 0.0)
{
  Surface s;
  Random random(5);
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const double step = 2.0 * size / cells, shake = inner ? shaken * step : 0.0;
      s.points.emplace_back(static_cast<float>(-size + i * step + random.Uniform(-shake, shake)),
                            static_cast<float>(-size + j * step + random.Uniform(-shake, shake)), 0.0f);
    }
  const auto at = [cells](int i, int j) { return static_cast<std::uint32_t>(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return s;
}

// An octahedron whose triangles are cut in four again and again.
Surface Sphere(double radius, int levels)
{
  Surface s;
  std::vector<Vector3d> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  s.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, isNew] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (isNew)
        points.push_back((points[a] + points[b]).normalized());
      return found->second;
    };
    std::vector<SkinMesh::Triangle> finer;
    for (const auto& t : s.triangles) {
      const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      for (const SkinMesh::Triangle& part : {SkinMesh::Triangle{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}})
        finer.push_back(part);
    }
    s.triangles = finer;
  }
  for (const Vector3d& point : points)
    s.points.push_back((radius * point).cast<float>());
  return s;
}

// From -1 to 1, two triangles a side, outwards.
Surface Cube()
{
  Surface s;
  for (int n = 0; n < 8; ++n)
    s.points.emplace_back(n & 1 ? 1.0f : -1.0f, n & 2 ? 1.0f : -1.0f, n & 4 ? 1.0f : -1.0f);
  for (const auto& q : std::vector<std::array<std::uint32_t, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    s.triangles.push_back({q[0], q[1], q[2]});
    s.triangles.push_back({q[0], q[2], q[3]});
  }
  return s;
}

std::string ReasonAgainst(const Surface& s)
{
  try {
    s.Mesh();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    return error.what();
  }
  return "none";
}

SkinWalk WalkFrom(const std::shared_ptr<const SkinMesh>& mesh, const Vector3d& point, const Vector3d& heading)
{
  SkinWalk walk(mesh);
  walk.PutNearest(point);
  walk.Put(walk.Place(), heading);
  return walk;
}

} // namespace

TEST(SkinWalk, GoesStraightOnAPlaneWhateverItsTriangles)
{
  SkinWalk walk = WalkFrom(Square(20, 50.0, 0.4).Mesh(), {-30.0, -20.0, 0.0}, {1.0, 0.3, 0.0});
  const Vector3d x = Vector3d(1.0, 0.3, 0.0).normalized(), y = Vector3d(0, 0, -1).cross(x);
  const auto moved = walk.Step(40.0, -25.0);
  EXPECT_EQ(moved.stop, SkinWalk::Stop::None);
  EXPECT_DOUBLE_EQ(moved.mm, std::hypot(40.0, 25.0));
  EXPECT_LT((walk.Point() - (Vector3d(-30, -20, 0) + 40.0 * x - 25.0 * y)).norm(), 1e-9);
  EXPECT_LT((walk.Heading() - x).norm(), 1e-9);
  EXPECT_LT((walk.Normal() - Vector3d(0, 0, 1)).norm(), 1e-6);
}

TEST(SkinWalk, PassesThroughPointsAndAlongEdgesOfTheMesh)
{
  const auto mesh = Square(20, 50.0).Mesh();
  for (const Vector3d& heading : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(1, 1, 0), Vector3d(-1, 1, 0)})
    for (const double side : {1.0, -1.0}) {
      SkinWalk walk = WalkFrom(mesh, {0, 0, 0}, side * heading);
      for (int n = 0; n < 8; ++n)
        EXPECT_EQ(walk.Step(5.0, 0.0).stop, SkinWalk::Stop::None);
      EXPECT_LT((walk.Point() - 40.0 * side * heading.normalized()).norm(), 1e-9) << heading.transpose();
    }
}

TEST(SkinWalk, HasTheProbesAxes)
{
  SkinWalk walk = WalkFrom(Square(4, 50.0).Mesh(), {3, 4, 0}, {1, 0, 0});
  Pose pose = walk.PoseOf();
  EXPECT_TRUE(IsRotation(pose.linear(), 1e-9));
  EXPECT_LT((pose.linear().col(0) - Vector3d(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((pose.linear().col(2) - Vector3d(0, 0, -1)).norm(), 1e-6);
  EXPECT_LT((pose.translation() - Vector3d(3, 4, 0)).norm(), 1e-9);
  walk.Step(0.0, 2.0); // along y of the probe
  EXPECT_LT((walk.Point() - (pose * Vector3d(0, 2, 0))).norm(), 1e-6);
  walk.Turn(0.5); // about z of the probe
  EXPECT_LT((walk.PoseOf().linear() - pose.linear() * ExpRotation({0, 0, 0.5})).norm(), 1e-6);
  ProbeHold hold;
  hold.rotate = 0.5;
  hold.pressMm = 3.0;
  walk.Turn(-0.5);
  EXPECT_LT((walk.PoseOf(hold).linear() - pose.linear() * ExpRotation({0, 0, 0.5})).norm(), 1e-6);
  EXPECT_NEAR(walk.PoseOf(hold).translation()[2], -3.0, 1e-6);
  hold = {};
  hold.tilt = 0.2;
  EXPECT_LT((walk.PoseOf(hold).linear() - pose.linear() * ExpRotation({0.2, 0, 0})).norm(), 1e-6);
  hold = {};
  hold.rock = 0.2;
  EXPECT_LT((walk.PoseOf(hold).linear() - pose.linear() * ExpRotation({0, 0.2, 0})).norm(), 1e-6);
}

TEST(SkinWalk, ComesRoundASphere)
{
  // Great circles in 100 steps. They miss by what the mesh differs from the sphere, which falls with the size of its triangles.
  const double radius = 50.0, length = 2.0 * Pi * radius;
  std::array<double, 2> away{}, turned{}, aside{}, tipped{};
  for (const std::size_t finer : {0u, 1u}) {
    const auto mesh = Sphere(radius, finer == 0 ? 5 : 6).Mesh(); // edges of 2.5 and 1.2 mm
    const int trials = 50;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(11, static_cast<std::uint64_t>(trial));
      const Vector3d start = radius * random.Direction();
      SkinWalk walk = WalkFrom(mesh, start, start.cross(random.Direction()));
      const Vector3d from = walk.Point(), heading = walk.Heading(), axis = from.cross(heading).normalized();
      for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(walk.Step(length / 100, 0.0).stop, SkinWalk::Stop::None);
        aside[finer] = std::max(aside[finer], std::abs(walk.Point().dot(axis)));
        tipped[finer] = std::max(tipped[finer], (walk.Normal() - walk.Point().normalized()).norm() * DegreesPerRadian);
      }
      away[finer] += (walk.Point() - from).squaredNorm() / trials;
      turned[finer] += (walk.Heading() - heading).squaredNorm() / trials;
    }
    RecordProperty(finer == 0 ? "coarse" : "fine",
                   Format("RMS %.3f mm, %.3f degrees; furthest aside %.3f mm, normal %.3f degrees", std::sqrt(away[finer]),
                          std::sqrt(turned[finer]) * DegreesPerRadian, aside[finer], tipped[finer]));
  }
  for (const auto& error : {away, turned})
    EXPECT_GT(std::sqrt(error[0]), 1.8 * std::sqrt(error[1]));
  EXPECT_GT(tipped[0], 1.8 * tipped[1]);
  EXPECT_LT(std::sqrt(away[1]), 0.2); // of a way of 314 mm
  EXPECT_LT(std::sqrt(turned[1]), 0.25 * RadiansPerDegree);
  EXPECT_LT(aside[1], 0.6);
  EXPECT_LT(tipped[1], 0.4);
}

TEST(SkinWalk, TurnsByTheAreaOfATriangleOnASphere)
{
  // Three quarters of great circles with right turns between them come back, and have turned by 90 degrees on the way.
  const double radius = 50.0, quarter = 0.5 * Pi * radius;
  SkinWalk walk = WalkFrom(Sphere(radius, 6).Mesh(), {35, 34, 10}, {0, 0, 1});
  const Vector3d from = walk.Point(), heading = walk.Heading();
  for (int side = 0; side < 3; ++side) {
    walk.Step(quarter, 0.0);
    walk.Turn(0.5 * Pi);
  }
  EXPECT_LT((walk.Point() - from).norm(), 0.3);
  EXPECT_LT(std::acos(std::min(1.0, walk.Heading().dot(heading))), 0.5 * RadiansPerDegree); // 3 x 90 turned + 90 of the sphere
}

TEST(SkinWalk, KeepsLengthOverTheEdgeOfACube)
{
  SkinWalk walk = WalkFrom(Cube().Mesh(), {0.3, 0.1, 1.0}, {1, 0.5, 0});
  walk.Step(2.0, 0.0); // 0.7 mm of x on top, the rest down the side x = 1
  const Vector3d unit = Vector3d(1.0, 0.5, 0.0).normalized();
  EXPECT_LT((walk.Point() - Vector3d(1.0, 0.1 + 2.0 * unit[1], 1.0 - (2.0 * unit[0] - 0.7))).norm(), 1e-6);
}

TEST(SkinWalk, HasNoJumpsAtCreases)
{
  // The smallest steps, over all edges of a cube: position and pose change by as little, and do change altogether.
  for (int trial = 0; trial < 20; ++trial) {
    Random random(3, static_cast<std::uint64_t>(trial));
    SkinWalk walk = WalkFrom(Cube().Mesh(), random.Direction() * 1.5, random.Direction());
    Pose before = walk.PoseOf(), first = before;
    double furthest = 0.0;
    std::uint32_t crossed = 0;
    for (int n = 0; n < 20000; ++n) {
      const std::uint32_t triangle = walk.Place().triangle;
      ASSERT_NEAR(walk.Step(3e-4, 1e-4).mm, std::hypot(3e-4, 1e-4), 1e-15);
      const Pose now = walk.PoseOf();
      EXPECT_LT((now.translation() - before.translation()).norm(), 3.2e-4);
      if (walk.Place().triangle != triangle) {
        // Some 1 radian per mm is the bend itself; next to a corner, where ways to both sides part, it may be more.
        if (walk.Place().weights.maxCoeff() < 0.9) {
          EXPECT_LT(RotationAngle(before.inverse() * now), 4e-3) << trial << " at step " << n;
        }
        ++crossed;
      }
      furthest = std::max(furthest, RotationAngle(first.inverse() * now));
      before = now;
    }
    EXPECT_GE(crossed, 4u);
    EXPECT_GT(furthest, 1.0);
  }
}

TEST(SkinWalk, WithinTheCreaseItIsTheStepThatCountsNotTheEdge)
{
  // Across an edge away from its middle, where the normals of both sides and of the edge lie in no plane: on the very edge,
  // both triangles show the same.
  const auto mesh = Cube().Mesh();
  SkinWalk walk = WalkFrom(mesh, {0.4, 0.5, 1.0}, {1, 0.2, 0});
  walk.Step(std::hypot(0.6, 0.12) - 1e-7, 0.0);
  const Pose before = walk.PoseOf();
  const std::uint32_t triangle = walk.Place().triangle;
  walk.Step(2e-7, 0.0);
  ASSERT_NE(walk.Place().triangle, triangle);
  EXPECT_LT(RotationAngle(before.inverse() * walk.PoseOf()), 1e-6);
}

TEST(SkinWalk, ComesBackTheWayItWent)
{
  for (const auto& mesh : {Sphere(50.0, 5).Mesh(), Cube().Mesh()})
    for (int trial = 0; trial < 50; ++trial) {
      Random random(7, static_cast<std::uint64_t>(trial));
      SkinWalk walk(mesh);
      const double a = random.Uniform(0.1, 0.4), b = random.Uniform(0.1, 0.4);
      walk.Put({static_cast<std::uint32_t>(random.Below(mesh->TriangleCount())), {a, b, 1.0 - a - b}}, random.Direction());
      const Pose first = walk.PoseOf();
      const double size = first.translation().norm(), along = random.Uniform(-2, 2) * size, across = random.Uniform(-2, 2) * size;
      for (int n = 0; n < 10; ++n)
        walk.Step(0.1 * along, 0.1 * across);
      EXPECT_GT((walk.Point() - first.translation()).norm(), 1e-3 * size);
      for (int n = 0; n < 10; ++n)
        walk.Step(-0.1 * along, -0.1 * across);
      EXPECT_LT((walk.Point() - first.translation()).norm(), 1e-7 * size) << trial;
      EXPECT_LT(RotationAngle(first.inverse() * walk.PoseOf()), 1e-5) << trial;
    }
}

TEST(SkinWalk, StopsAtTheBorderAndSaysSo)
{
  SkinWalk walk = WalkFrom(Square(7, 50.0, 0.3).Mesh(), {10, 0, 0}, {1, 0, 0});
  const auto moved = walk.Step(100.0, 0.0);
  EXPECT_EQ(moved.stop, SkinWalk::Stop::Border);
  EXPECT_NEAR(moved.mm, 40.0, 1e-9);
  EXPECT_LT((walk.Point() - Vector3d(50, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(walk.Step(1.0, 0.0).mm, 0.0);
  EXPECT_EQ(walk.Step(-30.0, 0.0).stop, SkinWalk::Stop::None);
  EXPECT_LT((walk.Point() - Vector3d(20, 0, 0)).norm(), 1e-9);
}

TEST(SkinWalk, GoesThroughFlatTriangles)
{
  // Two halves of a square whose common edge has a point more on one side; a triangle that is a line closes the gap.
  Surface s;
  for (const auto& p : {Vector3f(-1, -1, 0), Vector3f(1, -1, 0), Vector3f(1, 1, 0), Vector3f(-1, 1, 0), Vector3f(0.5f, 0.5f, 0)})
    s.points.push_back(p);
  s.triangles = {{0, 1, 4}, {1, 2, 4}, {0, 2, 3}, {0, 4, 2}};
  const auto mesh = s.Mesh();
  EXPECT_EQ(mesh->Repaired().borderEdges, 4u);
  for (const double from : {-0.8, -0.2, 0.2, 0.45, 0.55, 0.8}) {
    SkinWalk walk = WalkFrom(mesh, {from + 0.1, from - 0.1, 0}, {-1, 0.9, 0});
    const Vector3d unit = Vector3d(-1, 0.9, 0).normalized(), start = walk.Point();
    for (const double way : {0.2, -0.2}) {
      EXPECT_EQ(walk.Step(way, 0.0).stop, SkinWalk::Stop::None);
      EXPECT_LT((walk.Point() - (start + std::max(way, 0.0) * unit)).norm(), 1e-7) << from;
    }
    EXPECT_LT((walk.Heading() - unit).norm(), 1e-6);
  }
}

TEST(SkinWalk, MeetsNoEndAtManyPointsOfAMesh)
{
  // Straight through the points of a sphere's mesh, where all edges meet.
  const Surface sphere = Sphere(50.0, 3);
  const auto mesh = sphere.Mesh();
  for (std::size_t p = 0; p < sphere.points.size(); ++p) {
    const Vector3d point = sphere.points[p].cast<double>();
    const Vector3d beside = sphere.points[(p + 17) % sphere.points.size()].cast<double>();
    SkinWalk walk = WalkFrom(mesh, 0.8 * point + 0.2 * beside, point - beside);
    EXPECT_EQ(walk.Step(20.0, 0.0).stop, SkinWalk::Stop::None);
    walk.PutNearest(point);
    EXPECT_EQ(walk.Step(3.0, 4.0).stop, SkinWalk::Stop::None);
    EXPECT_LT((walk.Point() - point).norm(), 5.0 + 1e-9);
    EXPECT_GT((walk.Point() - point).norm(), 4.5);
  }
}

TEST(SkinMesh, TurnsTrianglesOutwards)
{
  Surface cube = Cube();
  for (std::size_t t = 0; t < cube.triangles.size(); t += 3)
    std::swap(cube.triangles[t][0], cube.triangles[t][1]);
  const auto mesh = cube.Mesh();
  EXPECT_EQ(mesh->Repaired().turned, 4u);
  EXPECT_EQ(mesh->Repaired().borderEdges, 0u);
  for (std::uint32_t t = 0; t < mesh->TriangleCount(); ++t)
    EXPECT_GT(mesh->FaceOf(t).normal.dot(mesh->FaceOf(t).corner[0]), 0.9);
  for (auto& t : cube.triangles = Cube().triangles)
    std::swap(t[0], t[1]);
  EXPECT_EQ(cube.Mesh()->Repaired().turned, 12u); // all inside out
}

TEST(SkinMesh, KeepsTheSideOfMostOfAnOpenSurface)
{
  Surface square = Square(4, 1.0);
  std::swap(square.triangles[5][0], square.triangles[5][1]);
  const auto mesh = square.Mesh();
  EXPECT_EQ(mesh->Repaired().turned, 1u);
  for (std::uint32_t t = 0; t < mesh->TriangleCount(); ++t)
    EXPECT_EQ(mesh->FaceOf(t).normal, Vector3d(0, 0, 1));
}

TEST(SkinMesh, JoinsLooseTriangles)
{
  Surface loose;
  const Surface cube = Cube();
  for (const auto& t : cube.triangles) {
    const auto n = static_cast<std::uint32_t>(loose.points.size());
    for (const std::uint32_t corner : t)
      loose.points.push_back(cube.points[corner]);
    loose.triangles.push_back({n, n + 1, n + 2});
  }
  loose.triangles.push_back(loose.triangles[3]); // there twice
  loose.triangles.push_back({0, 1, 0});          // a line
  const auto mesh = loose.Mesh();
  EXPECT_EQ(mesh->TriangleCount(), 12u);
  EXPECT_EQ(mesh->Repaired().leftOut, 2u);
  EXPECT_EQ(mesh->Repaired().joinedPoints, 28u);
  EXPECT_EQ(mesh->Repaired().borderEdges, 0u);
}

TEST(SkinMesh, GoesOnAcrossTheAirWhereFourTrianglesMeet)
{
  // Two cubes that share an edge only: from the top of one, the way leads down its own side, or across to the other cube where
  // that faces it, and never through the edge into a body.
  Surface two = Cube();
  const Surface other = Cube();
  const auto shift = static_cast<std::uint32_t>(two.points.size());
  for (const Vector3f& p : other.points)
    two.points.push_back(p + Vector3f(2, 0, 2));
  for (auto t : other.triangles) {
    for (auto& corner : t)
      corner += shift;
    two.triangles.push_back(t);
  }
  const auto mesh = two.Mesh();
  EXPECT_EQ(mesh->Repaired().crowdedEdges, 1u);
  EXPECT_EQ(mesh->Repaired().borderEdges, 0u);
  SkinWalk walk = WalkFrom(mesh, {0.5, 0.2, 1.0}, {1, 0, 0}); // on top of the first, towards the wall x = 1 of the second
  EXPECT_EQ(walk.Step(1.0, 0.0).stop, SkinWalk::Stop::None);
  EXPECT_LT((walk.Point() - Vector3d(1.0, 0.2, 1.5)).norm(), 1e-6);
}

TEST(SkinMesh, ASurfaceWithOneSideHasABorderMore)
{
  Surface strip; // of Moebius, of 12 pieces
  const int pieces = 12;
  for (int n = 0; n < pieces; ++n) {
    const double a = 2.0 * Pi * n / pieces, half = 0.5 * a;
    for (const double side : {-1.0, 1.0})
      strip.points.emplace_back(static_cast<float>((5.0 + side * std::cos(half)) * std::cos(a)),
                                static_cast<float>((5.0 + side * std::cos(half)) * std::sin(a)),
                                static_cast<float>(side * std::sin(half)));
  }
  for (std::uint32_t n = 0; n < pieces; ++n) {
    const bool last = n + 1 == pieces;
    const std::uint32_t a = 2 * n, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    strip.triangles.push_back({a, c, d});
    strip.triangles.push_back({a, d, b});
  }
  const auto mesh = strip.Mesh();
  EXPECT_EQ(mesh->Repaired().borderEdges, 2u * pieces + 2u);
  EXPECT_EQ(WalkFrom(mesh, {5, 0, 0}, {0, 1, 0}).Step(100.0, 0.0).stop, SkinWalk::Stop::Border);
}

TEST(SkinMesh, RefusesWhatIsNoSurface)
{
  Surface s = Cube();
  s.triangles.clear();
  EXPECT_EQ(ReasonAgainst(s), "the skin: it has no triangles");
  s = Cube();
  s.triangles[4][1] = 8;
  EXPECT_EQ(ReasonAgainst(s), "the skin: triangle 4 has corner 8, but there are 8 points");
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 2e6f}) {
    s = Cube();
    s.points[3][1] = bad;
    EXPECT_EQ(ReasonAgainst(s), "the skin: point 3 is not finite, or further than 1e6 mm from the origin");
  }
  s = Cube();
  for (auto& p : s.points)
    p[1] = p[2] = p[0];
  EXPECT_NE(ReasonAgainst(s).find("all its triangles are flat"), std::string::npos);
  s = Cube(); // a point that no triangle has is no matter
  s.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f);
  EXPECT_EQ(ReasonAgainst(s), "none");
}

TEST(SkinWalk, StaysOnAnyTriangles)
{
  // Triangles between the points of a small grid, at random: lines, crowded edges, sheets that cross and touch.
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    Random random(21, trial);
    Surface s;
    for (int n = 0; n < 12; ++n)
      s.points.emplace_back(static_cast<float>(random.Below(3)), static_cast<float>(random.Below(3)),
                            static_cast<float>(random.Below(2)));
    const auto corner = [&random] { return static_cast<std::uint32_t>(random.Below(12)); };
    for (int n = 0; n < 40; ++n)
      s.triangles.push_back({corner(), corner(), corner()});
    const auto mesh = s.Mesh();
    SkinWalk walk(mesh);
    for (int n = 0; n < 50; ++n) {
      const double along = random.Uniform(-2, 2), across = random.Uniform(-2, 2);
      const Vector3d before = walk.Point();
      const auto moved = walk.Step(along, across);
      const double length = std::hypot(along, across);
      ASSERT_LE(moved.mm, length);
      ASSERT_TRUE(moved.stop != SkinWalk::Stop::None || moved.mm == length);
      ASSERT_LE((walk.Point() - before).norm(), moved.mm + 1e-9);
      ASSERT_GE(walk.Place().weights.minCoeff(), 0.0);
      ASSERT_NEAR(walk.Place().weights.sum(), 1.0, 1e-12);
      ASSERT_FALSE(mesh->FaceOf(walk.Place().triangle).flat);
      ASSERT_TRUE(IsRotation(walk.PoseOf().linear(), 1e-9));
      if (moved.stop != SkinWalk::Stop::None)
        walk.PutNearest(3.0 * random.Direction());
      walk.Turn(random.Uniform(-1, 1));
    }
  }
}

TEST(SkinWalk, RefusesStepsThatAreNone)
{
  SkinWalk walk(Cube().Mesh());
  const Pose before = walk.PoseOf();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(walk.Step(nan, 0.0), Error);
  EXPECT_THROW(walk.Step(0.0, 1e5), Error);
  EXPECT_THROW(walk.Turn(nan), Error);
  EXPECT_THROW(walk.PutNearest({nan, 0, 0}), Error);
  EXPECT_THROW(walk.Put({99, {1, 0, 0}}, {1, 0, 0}), Error);
  EXPECT_THROW(walk.Put({0, {1, 1, 0}}, {1, 0, 0}), Error);
  EXPECT_THROW(SkinWalk(nullptr), Error);
  EXPECT_EQ(walk.PoseOf().matrix(), before.matrix());
}

TEST(TriangleTree, FindsWhatTryingAllFinds)
{
  const Surface s = Sphere(50.0, 3);
  std::vector<std::uint32_t> all(s.triangles.size());
  for (std::uint32_t t = 0; t < all.size(); ++t)
    all[t] = t;
  const TriangleTree tree(s.points, s.triangles, all);
  const auto mesh = s.Mesh();
  for (int trial = 0; trial < 300; ++trial) {
    Random random(13, static_cast<std::uint64_t>(trial));
    const Vector3d point = random.Direction() * random.Uniform(0.0, 100.0), direction = random.Direction();
    double least = 1e9;
    std::optional<double> first;
    for (std::uint32_t t = 0; t < all.size(); ++t) {
      const TriangleTree one(s.points, s.triangles, {t});
      least = std::min(least, one.NearestTo(s.points, s.triangles, point)->distanceMm);
      if (const auto hit = one.FirstHit(s.points, s.triangles, point, direction))
        first = std::min(first.value_or(1e9), hit->distanceMm);
    }
    EXPECT_EQ(tree.NearestTo(s.points, s.triangles, point)->distanceMm, least);
    const auto hit = tree.FirstHit(s.points, s.triangles, point, direction);
    ASSERT_EQ(hit.has_value(), first.has_value());
    if (hit) {
      EXPECT_EQ(hit->distanceMm, *first);
      EXPECT_LT((mesh->PointAt(hit->place) - (point + hit->distanceMm * direction)).norm(), 1e-9);
    }
    if (point.norm() < 49.0) {
      EXPECT_TRUE(hit.has_value()); // a closed surface has no gaps
    }
  }
}

TEST(TriangleTree, MeasuresTheDistanceToATriangle)
{
  const std::vector<Vector3f> points{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const std::vector<SkinMesh::Triangle> triangles{{0, 1, 2}};
  const TriangleTree tree(points, triangles, {0});
  const auto to = [&](const Vector3d& p) { return tree.NearestTo(points, triangles, p)->distanceMm; };
  EXPECT_DOUBLE_EQ(to({1, 1, 3}), 3.0);
  EXPECT_DOUBLE_EQ(to({1, -3, 4}), 5.0);
  EXPECT_DOUBLE_EQ(to({-3, -4, 0}), 5.0);
  EXPECT_DOUBLE_EQ(to({4, 4, 0}), std::sqrt(8.0));
  EXPECT_DOUBLE_EQ(to({7, 0, 4}), 5.0);
  EXPECT_FALSE(tree.NearestTo(points, triangles, {std::nan(""), 0, 0}));
  EXPECT_FALSE(tree.FirstHit(points, triangles, {1, 1, 1}, {0, 0, 0}));
  EXPECT_FALSE(tree.FirstHit(points, triangles, {1, 1, 1}, {0, 0, 1}));
  EXPECT_DOUBLE_EQ(tree.FirstHit(points, triangles, {1, 1, 1}, {0, 0, -2})->distanceMm, 1.0);
  EXPECT_FALSE(TriangleTree().NearestTo(points, triangles, {0, 0, 0}));
}
