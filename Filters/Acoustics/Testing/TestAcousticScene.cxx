// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/AcousticScene.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

const Material water = Clear("water", 1500, 1000);
const Material red = Clear("red", 1550, 1050), green = Clear("green", 1600, 1100), blue = Clear("blue", 1450, 900);

int MediumAt(const AcousticScene& scene, const Vector3f& point)
{
  std::int32_t medium = -1;
  scene.MediumAt(&point, 1, &medium);
  EXPECT_EQ(medium, scene.MediumOf(scene.BodiesAt(point.cast<double>()))) << point.transpose(); // two ways to ask
  return medium;
}

struct Passage {
  double distance;
  int after;
};

std::vector<Passage> Passages(const AcousticScene& scene, const Vector3d& origin, const Vector3d& direction)
{
  SceneRay ray;
  ray.origin = origin;
  ray.direction = direction.normalized();
  ray.inside = scene.BodiesAt(origin);
  std::vector<Passage> passages;
  Crossing crossing;
  int medium = scene.MediumOf(ray.inside);
  while (scene.NextCrossing(ray, 1e9, crossing)) {
    EXPECT_EQ(crossing.before, medium);
    EXPECT_LE(crossing.normal.dot(ray.direction), 0.0);
    EXPECT_NEAR(crossing.normal.norm(), 1.0, 1e-9);
    medium = crossing.after;
    passages.push_back({crossing.distance, crossing.after});
    if (passages.size() > 10000)
      break;
  }
  return passages;
}

} // namespace

TEST(BodySet, IsASortedSetOfAnySize)
{
  BodySet set;
  Random random(3);
  std::vector<bool> model(60, false);
  for (int i = 0; i < 5000; ++i) {
    const auto shell = static_cast<std::int32_t>(random.Below(60));
    if (random.Uniform() < (i / 500 % 2 ? 0.3 : 0.7)) {
      set.Insert(shell);
      model[static_cast<std::size_t>(shell)] = true;
    } else {
      set.Erase(shell);
      model[static_cast<std::size_t>(shell)] = false;
    }
    std::vector<std::int32_t> expected;
    for (std::int32_t s = 0; s < 60; ++s) {
      if (model[static_cast<std::size_t>(s)])
        expected.push_back(s);
      EXPECT_EQ(set.Contains(s), model[static_cast<std::size_t>(s)]);
    }
    EXPECT_EQ(std::vector<std::int32_t>(set.begin(), set.end()), expected);
    const BodySet copy = set;
    EXPECT_TRUE(copy == set);
  }
}

TEST(AcousticScene, NothingInIt)
{
  const AcousticScene scene(Background(water));
  EXPECT_TRUE(scene.Empty());
  EXPECT_EQ(MediumAt(scene, Vector3f(1, 2, 3)), 0);
  EXPECT_TRUE(Passages(scene, Vector3d::Zero(), Vector3d::UnitX()).empty());
}

TEST(AcousticScene, RefusesWhatCannotBe)
{
  TissueSurface surface = Background(water);
  AddBox(surface, red, {0, 0, 0}, {1, 1, 1});
  surface.triangles[3][1] = 99;
  EXPECT_THROW(AcousticScene scene(surface), Error);
}

TEST(AcousticScene, TheLastBodyCounts)
{
  TissueSurface surface = Background(water);
  AddBox(surface, red, {0, 0, 0}, {10, 10, 10});
  AddBox(surface, green, {4, 4, 4}, {6, 6, 6});  // nested
  AddBox(surface, blue, {8, 3, 3}, {14, 7, 7});  // overlaps
  AddBox(surface, red, {10, 0, 0}, {12, 10, 2}); // touches the first
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().shells, 4);
  EXPECT_EQ(MediumAt(scene, {-1, 5, 5}), 0);
  EXPECT_EQ(MediumAt(scene, {1, 5, 5}), 1);
  EXPECT_EQ(MediumAt(scene, {5, 5, 5}), 2);
  EXPECT_EQ(MediumAt(scene, {9, 5, 5}), 3);
  EXPECT_EQ(MediumAt(scene, {13, 5, 5}), 3);
  EXPECT_EQ(MediumAt(scene, {11, 5, 1}), 1);
  const auto through = Passages(scene, {-5, 5.1, 4.9}, Vector3d::UnitX());
  ASSERT_EQ(through.size(), 5u); // red, green, red, blue over red's own end, water
  const double where[] = {5, 9, 11, 13, 19};
  const int after[] = {1, 2, 1, 3, 0};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(through[i].distance, where[i], 1e-5);
    EXPECT_EQ(through[i].after, after[i]);
  }
  const auto touching = Passages(scene, {-5, 1, 1}, Vector3d::UnitX()); // red to red: no border
  ASSERT_EQ(touching.size(), 2u);
  EXPECT_NEAR(touching[1].distance, 17.0, 1e-5);
}

TEST(AcousticScene, MediaAgreeWithTheSpheresTheyAreMadeOf)
{
  // Two hundred spheres that overlap as they like. Points near a surface are left out: facets lie within the sphere.
  TissueSurface surface = Background(water);
  Random random(7);
  struct Ball {
    Vector3d centre;
    double radius;
    int material;
  };
  std::vector<Ball> balls;
  const Material* materials[] = {&red, &green, &blue};
  for (int i = 0; i < 200; ++i) {
    const Vector3d centre(random.Uniform(0, 60), random.Uniform(0, 60), random.Uniform(0, 60));
    const double radius = random.Uniform(1, 9);
    AddSphere(surface, *materials[i % 3], centre, radius, 3);
    balls.push_back({centre, radius, surface.bodies.back().material});
  }
  const AcousticScene scene(surface);
  std::vector<Vector3f> points;
  std::vector<int> expected;
  while (points.size() < 20000) {
    const Vector3d p(random.Uniform(-5, 65), random.Uniform(-5, 65), random.Uniform(-5, 65));
    int medium = 0;
    bool close = false;
    for (const Ball& ball : balls) {
      const double distance = (p - ball.centre).norm() / ball.radius;
      close = close || (distance > 0.95 && distance < 1.001);
      if (distance < 1.0)
        medium = ball.material;
    }
    if (close)
      continue;
    points.push_back(p.cast<float>());
    expected.push_back(medium);
  }
  std::vector<std::int32_t> media(points.size());
  scene.MediumAt(points.data(), points.size(), media.data());
  int wrong = 0, wrongByRays = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    wrong += media[i] != expected[i];
    if (i < 3000)
      wrongByRays += scene.MediumOf(scene.BodiesAt(points[i].cast<double>())) != expected[i];
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(wrongByRays, 0);

  // Along rays: the medium between two crossings is that of the points there.
  for (int i = 0; i < 300; ++i) {
    const Vector3d origin(random.Uniform(-10, 70), random.Uniform(-10, 70), random.Uniform(-10, 70));
    const Vector3d direction = random.Direction();
    const auto passages = Passages(scene, origin, direction);
    for (std::size_t k = 0; k + 1 < passages.size(); ++k) {
      if (passages[k + 1].distance - passages[k].distance < 0.01)
        continue;
      const Vector3d middle = origin + 0.5 * (passages[k].distance + passages[k + 1].distance) * direction;
      EXPECT_EQ(scene.MediumOf(scene.BodiesAt(middle)), passages[k].after);
    }
    if (!passages.empty()) {
      EXPECT_EQ(passages.back().after, 0);
    }
  }
}

TEST(AcousticScene, TangentAndTouchingSpheres)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, red, {0, 0, 0}, 10); // all touch in a point: outside, inside, and along the line of the rays
  AddSphere(surface, green, {20, 0, 0}, 10);
  AddSphere(surface, blue, {5, 0, 0}, 5);
  const AcousticScene scene(surface);
  const auto through = Passages(scene, {-20, 0, 0}, Vector3d::UnitX()); // through the points where they touch, all corners
  ASSERT_EQ(through.size(), 4u);
  const double where[] = {10, 20, 30, 50};
  const int after[] = {1, 3, 2, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(through[i].distance, where[i], 1e-4);
    EXPECT_EQ(through[i].after, after[i]);
  }
  // Tangent rays graze the corner at the top, or pass by: they come out as they went in.
  for (double height = 9.9999; height < 10.0001; height += 1e-6) {
    const auto grazing = Passages(scene, {-20, 0, height}, Vector3d::UnitX());
    EXPECT_EQ(grazing.empty() ? 0 : grazing.back().after, 0);
  }
}

TEST(AcousticScene, LayersWithoutThickness)
{
  TissueSurface surface = Background(water);
  AddBox(surface, red, {-10, -10, 0}, {10, 10, 10});
  AddBox(surface, blue, {-10, -10, 10}, {10, 10, 10});  // none at all
  AddBox(surface, blue, {-5, -5, 5}, {5, 5, 5.00001f}); // thinner than the tolerance
  AddBox(surface, green, {-10, -10, 10}, {10, 10, 20});
  const AcousticScene scene(surface);
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const Vector3d origin(random.Uniform(-3, 3), random.Uniform(-3, 3), -5);
    const Vector3d direction = Vector3d(random.Uniform(-0.1, 0.1), random.Uniform(-0.1, 0.1), 1).normalized();
    const auto through = Passages(scene, origin, direction);
    ASSERT_EQ(through.size(), 3u);
    EXPECT_EQ(through[0].after, 1);
    EXPECT_EQ(through[1].after, 3);
    EXPECT_EQ(through[2].after, 0);
    EXPECT_NEAR(through[1].distance * direction[2], 15.0, 1e-4);
  }
  EXPECT_EQ(MediumAt(scene, {1, 1, 9}), 1);
  EXPECT_EQ(MediumAt(scene, {1, 1, 11}), 3);
}

TEST(AcousticScene, TwoHundredNestedShells)
{
  TissueSurface surface = Background(water);
  for (int i = 0; i < 200; ++i)
    AddSphere(surface, Clear("m" + std::to_string(i), 1500 + i, 1000), {0, 0, 0}, 50.0 - 0.2 * i, 2);
  const AcousticScene scene(surface);
  const auto through = Passages(scene, {-60, 0.1, 0.2}, Vector3d::UnitX());
  ASSERT_EQ(through.size(), 400u);
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(through[static_cast<std::size_t>(i)].after, i + 1);
    EXPECT_EQ(through[static_cast<std::size_t>(399 - i)].after, i);
  }
  EXPECT_EQ(scene.BodiesAt({0, 0, 0}).Count(), 200);
  EXPECT_EQ(MediumAt(scene, {0.1f, 0, 0}), 200);
}

TEST(AcousticScene, InsideOutIsTurned)
{
  TissueSurface surface = Background(water);
  const int body = AddBody(surface, red);
  AddSphere(surface, body, {0, 0, 0}, 10, 3, true); // inside out
  AddSphere(surface, body, {40, 0, 0}, 8, 3);
  const int hollow = AddBody(surface, green);
  AddBox(surface, hollow, {100, 0, 0}, {120, 20, 20});
  AddBox(surface, hollow, {105, 5, 5}, {115, 15, 15}, true); // a cavity
  AddBox(surface, hollow, {108, 8, 8}, {112, 12, 12});       // with something in it
  const int everted = AddBody(surface, blue);                // the same, inside out as a whole
  AddBox(surface, everted, {200, 0, 0}, {220, 20, 20}, true);
  AddBox(surface, everted, {205, 5, 5}, {215, 15, 15});
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().turnedShells, 3);
  EXPECT_EQ(scene.GetNotes().cavities, 2);
  EXPECT_EQ(MediumAt(scene, {0, 0, 0}), 1);
  EXPECT_EQ(MediumAt(scene, {40, 0, 0}), 1);
  EXPECT_EQ(MediumAt(scene, {20, 0, 0}), 0);
  EXPECT_EQ(MediumAt(scene, {102, 10, 10}), 2);
  EXPECT_EQ(MediumAt(scene, {106, 10, 10}), 0);
  EXPECT_EQ(MediumAt(scene, {110, 10, 10}), 2);
  EXPECT_EQ(MediumAt(scene, {202, 10, 10}), 3);
  EXPECT_EQ(MediumAt(scene, {210, 10, 10}), 0);
  EXPECT_EQ(Passages(scene, {90, 10.3, 10.1}, Vector3d::UnitX()).size(), 6u + 4u);
}

TEST(AcousticScene, PiecesOfABodyMayOverlap)
{
  TissueSurface surface = Background(water);
  const int body = AddBody(surface, red); // a chain of balls in one body
  for (int i = 0; i < 5; ++i)
    AddSphere(surface, body, {6.0 * i, 0, 0}, 5, 3);
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().shells, 5);
  const auto through = Passages(scene, {-10, 0.1, 0.2}, Vector3d::UnitX());
  ASSERT_EQ(through.size(), 2u);
  EXPECT_NEAR(through[1].distance, 39.0, 0.1);
  EXPECT_EQ(MediumAt(scene, {9, 0, 0}), 1);
}

TEST(AcousticScene, TrianglesThatDisagreeAreTurned)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, red, {0, 0, 0}, 10, 3);
  for (std::size_t i = 0; i < surface.triangles.size(); i += 7)
    std::swap(surface.triangles[i][0], surface.triangles[i][1]);
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().turnedShells, 1);
  EXPECT_EQ(scene.GetNotes().sheets, 0);
  Random random(9);
  for (int i = 0; i < 200; ++i) {
    const auto through = Passages(scene, 30.0 * random.Direction(), random.Direction());
    EXPECT_TRUE(through.empty() || through.size() == 2);
  }
  EXPECT_EQ(MediumAt(scene, {1, 2, 3}), 1);
}

TEST(AcousticScene, TrianglesThatShareNoPointsAreWelded)
{
  TissueSurface joined = Background(water), soup = Background(water);
  AddSphere(joined, red, {0, 0, 0}, 10, 3);
  const int body = AddBody(soup, red);
  for (const auto& triangle : joined.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.points.size());
    for (const std::uint32_t corner : triangle)
      soup.points.push_back(joined.points[corner]);
    AddTriangle(soup, body, first, first + 1, first + 2);
  }
  const AcousticScene scene(soup);
  EXPECT_EQ(scene.GetNotes().shells, 1);
  EXPECT_EQ(scene.GetNotes().sheets + scene.GetNotes().leakyShells, 0);
  EXPECT_EQ(MediumAt(scene, {1, 2, 3}), 1);
}

TEST(AcousticScene, ASmallHoleLeavesTheInside)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, red, {0, 0, 0}, 10, 3);
  surface.triangles.erase(surface.triangles.begin() + 100, surface.triangles.begin() + 103);
  surface.bodyOfTriangle.resize(surface.triangles.size());
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().leakyShells, 1);
  EXPECT_EQ(MediumAt(scene, {0, 0, 0}), 1);
  EXPECT_EQ(MediumAt(scene, {0, 0, 11}), 0);
  Random random(11);
  for (int i = 0; i < 2000; ++i) { // whatever way a ray takes, it ends outside
    const auto through = Passages(scene, 30.0 * random.Direction(), random.Direction());
    EXPECT_TRUE(through.empty() || through.back().after == 0);
  }
}

TEST(AcousticScene, AnOpenSurfaceIsASheet)
{
  TissueSurface surface = Background(water);
  AddBox(surface, green, {-20, -20, 5}, {20, 20, 30});
  const int body = AddBody(surface, red);
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (const float x : {-10.0f, 10.0f})
    for (const float y : {-10.0f, 10.0f})
      surface.points.emplace_back(x, y, 10.0f);
  AddTriangle(surface, body, first, first + 1, first + 2);
  AddTriangle(surface, body, first + 1, first + 3, first + 2);
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().sheets, 1);
  SceneRay ray;
  ray.origin = Vector3d(1, 2, 0);
  Crossing crossing;
  ASSERT_TRUE(scene.NextCrossing(ray, 100, crossing));
  EXPECT_EQ(crossing.after, 1);
  EXPECT_EQ(crossing.sheet, -1);
  ASSERT_TRUE(scene.NextCrossing(ray, 100, crossing));
  EXPECT_NEAR(crossing.distance, 10.0, 1e-5);
  EXPECT_EQ(crossing.sheet, 2);
  EXPECT_EQ(crossing.after, 1);
  ASSERT_TRUE(scene.NextCrossing(ray, 100, crossing));
  EXPECT_EQ(crossing.after, 0);
  EXPECT_EQ(MediumAt(scene, {1, 2, 11}), 1);
}

TEST(AcousticScene, DegenerateTrianglesAreLeftOut)
{
  TissueSurface surface = Background(water);
  const int body = AddBox(surface, red, {0, 0, 0}, {10, 10, 10});
  AddTriangle(surface, body, 0, 0, 1);
  AddTriangle(surface, body, 2, 2, 2);
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().degenerateTriangles, 2);
  EXPECT_EQ(scene.GetNotes().sheets + scene.GetNotes().leakyShells, 0);
  EXPECT_EQ(Passages(scene, {-1, 5, 5}, Vector3d::UnitX()).size(), 2u);
}

TEST(AcousticScene, BodiesMaySharePoints)
{
  TissueSurface surface = Background(water);
  AddBox(surface, red, {0, 0, 0}, {10, 10, 10});
  AddBox(surface, green, {10, 0, 0}, {20, 10, 10});
  for (auto& triangle : surface.triangles) // the second's points at x = 10 are the first's
    for (std::uint32_t& corner : triangle)
      if (corner >= 8 && corner % 2 == 0)
        corner -= 7;
  const AcousticScene scene(surface);
  EXPECT_EQ(scene.GetNotes().shells, 2);
  EXPECT_EQ(scene.GetNotes().sheets + scene.GetNotes().leakyShells, 0);
  const auto through = Passages(scene, {-1, 5, 5}, Vector3d::UnitX());
  ASSERT_EQ(through.size(), 3u);
  EXPECT_EQ(through[1].after, 2);
}

TEST(AcousticScene, FarFromTheOrigin)
{
  // At 1 km single precision has steps of 0.06 mm: so much the surface may be off, and no more.
  const Vector3d far(1e6, -2e5, 5e5);
  TissueSurface surface = Background(water);
  AddSphere(surface, red, far, 30, 3);
  AddSphere(surface, green, far, 10, 3);
  const AcousticScene scene(surface);
  const auto through = Passages(scene, far - Vector3d(100, 0.3, 0.2), Vector3d::UnitX());
  ASSERT_EQ(through.size(), 4u);
  const double where[] = {70, 90, 110, 130};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(through[i].distance, where[i], 0.1 + 0.5); // facets
  EXPECT_EQ(MediumAt(scene, far.cast<float>()), 2);

  // A ray from far away meets a scene at the origin as sharply as one from close by.
  TissueSurface close = Background(water);
  AddBox(close, red, {-10, -10, -10}, {10, 10, 10});
  const AcousticScene box(close);
  const auto distant = Passages(box, {1, 2, -1e6}, Vector3d::UnitZ());
  ASSERT_EQ(distant.size(), 2u);
  EXPECT_NEAR(distant[0].distance, 1e6 - 10, 1e-4);
  EXPECT_TRUE(Passages(box, {1, 2, -1e6}, -Vector3d::UnitZ()).empty()); // looks away
}

TEST(AcousticScene, ARayThatBeginsOnASurface)
{
  TissueSurface surface = Background(water);
  AddBox(surface, red, {-20, -20, 0}, {20, 20, 40});
  const AcousticScene scene(surface);
  Random random(13);
  for (int i = 0; i < 1000; ++i) { // the probe lies on the skin; rounding puts it in or out
    const Vector3d origin(random.Uniform(-5, 5), random.Uniform(-5, 5), random.Uniform(-1, 1) * 1e-5);
    const auto through = Passages(scene, origin, Vector3d(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), 1));
    ASSERT_FALSE(through.empty());
    EXPECT_EQ(through.back().after, 0);
    EXPECT_NEAR(through.back().distance, 40.0, 4.0);
  }
}

TEST(AcousticScene, NoRaySlipsThroughAnEdge)
{
  // Aimed at the corners and the middles of edges: exactly where triangles meet.
  TissueSurface surface = Background(water);
  AddSphere(surface, red, {0.1, 0.2, 0.3}, 25, 3);
  const AcousticScene scene(surface);
  const Vector3d inner(0.13, 0.21, 0.37);
  int missed = 0;
  for (const auto& triangle : surface.triangles)
    for (std::size_t side = 0; side < 3; ++side) {
      const Vector3d a = surface.points[triangle[side]].cast<double>(),
                     b = surface.points[triangle[(side + 1) % 3]].cast<double>();
      for (const Vector3d& aim : {a, Vector3d(0.5 * (a + b))}) {
        const auto out = Passages(scene, inner, aim - inner);
        missed += out.size() != 1 || out[0].after != 0;
        const auto in = Passages(scene, aim + 2.0 * (aim - inner), inner - aim);
        missed += in.size() != 2 || in[1].after != 0;
      }
    }
  EXPECT_EQ(missed, 0);
}

TEST(AcousticScene, NormalsAreOfTheCurvedSurface)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, red, {0, 0, 0}, 20, 3);
  AddBox(surface, green, {50, -10, -10}, {70, 10, 10});
  const AcousticScene curved(surface), flat(surface, {}, 0.0);
  double worstCurved = 0.0, worstFlat = 0.0;
  Random random(19);
  for (int i = 0; i < 2000; ++i) {
    SceneRay ray;
    ray.direction = random.Direction();
    ray.origin = -40.0 * ray.direction + 10.0 * random.Direction();
    Crossing crossing;
    SceneRay again = ray;
    ASSERT_TRUE(curved.NextCrossing(ray, 40.0, crossing));
    const Vector3d radial = (ray.origin + crossing.distance * ray.direction).normalized();
    worstCurved = std::max(worstCurved, std::acos(std::min(1.0, crossing.normal.dot(radial))));
    EXPECT_GT(crossing.facet.dot(crossing.normal), 0.98);
    ASSERT_TRUE(flat.NextCrossing(again, 40.0, crossing));
    worstFlat = std::max(worstFlat, std::acos(std::min(1.0, crossing.normal.dot(radial))));
    EXPECT_EQ(crossing.normal, crossing.facet);
  }
  EXPECT_LT(worstCurved, 0.055);
  EXPECT_GT(worstFlat, 0.08);
  for (int i = 0; i < 200; ++i) { // the box has edges
    SceneRay ray;
    ray.origin = Vector3d(45, random.Uniform(-9.99, 9.99), random.Uniform(-9.99, 9.99));
    ray.direction = Vector3d::UnitX();
    Crossing crossing;
    ASSERT_TRUE(curved.NextCrossing(ray, 40.0, crossing));
    EXPECT_NEAR((crossing.normal + Vector3d::UnitX()).norm(), 0.0, 1e-6);
  }
}

TEST(AcousticScene, TheSameOnAnyNumberOfThreads)
{
  TissueSurface surface = Background(water);
  Random random(17);
  for (int i = 0; i < 100; ++i)
    AddSphere(surface, i % 2 ? red : green, Vector3d(random.Uniform(0, 50), random.Uniform(0, 50), random.Uniform(0, 50)),
              random.Uniform(2, 8), 3);
  const AcousticScene many(surface);
  const ThreadLimit limit(1);
  const AcousticScene one(surface);
  for (int i = 0; i < 300; ++i) {
    const Vector3d origin(random.Uniform(-5, 55), random.Uniform(-5, 55), -10.0), direction = random.Direction();
    const auto a = Passages(many, origin, direction), b = Passages(one, origin, direction);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].distance, b[k].distance);
      EXPECT_EQ(a[k].after, b[k].after);
    }
  }
}
