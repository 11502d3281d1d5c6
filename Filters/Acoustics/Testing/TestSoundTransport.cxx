// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/SoundTransport.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

const Material water = Clear("water", 1500, 1000);
const Material tissue = Clear("tissue", 1540, 1060), dense = Clear("dense", 3000, 1900);
const Material air = Clear("air", 343, 1.2);

SoundConditions Conditions(double assumed = 1540.0)
{
  SoundConditions conditions;
  conditions.assumedSoundSpeed = assumed;
  conditions.maxScanDepth = 200.0;
  return conditions;
}

SoundTransport Transport(double faceReflection = 0.0)
{
  SoundTransport transport;
  transport.faceReflection = faceReflection;
  return transport;
}

SoundPath Trace(const AcousticScene& scene, const Vector3d& origin, const Vector3d& direction,
                const SoundTransport& transport = Transport(), const SoundConditions& conditions = Conditions())
{
  RayStart start;
  start.origin = origin;
  start.direction = direction.normalized();
  start.across = Vector3d(1, 0.1, 0).cross(start.direction).normalized();
  start.inside = scene.BodiesAt(origin);
  return TracePath(scene, transport, conditions, start);
}

// What must hold of every path.
void CheckSound(const AcousticScene& scene, const SoundPath& path, const SoundConditions& conditions = Conditions())
{
  for (std::size_t i = 0; i < path.segments.size(); ++i) {
    const SoundSegment& s = path.segments[i];
    ASSERT_TRUE(s.from.allFinite());
    EXPECT_NEAR(s.direction.norm(), 1.0, 1e-9);
    EXPECT_NEAR(s.across.norm(), 1.0, 1e-9);
    EXPECT_NEAR(s.across.dot(s.direction), 0.0, 1e-9);
    EXPECT_GT(s.length, 0.0);
    EXPECT_LE(std::abs(s.amplitude), 1.0);
    EXPECT_GE(s.attenuation, 0.0);
    EXPECT_LE(s.scanDepth + s.length * s.scanDepthPerMm, conditions.maxScanDepth + 1e-6);
    EXPECT_GE(s.medium, 0);
    EXPECT_LT(s.medium, static_cast<int>(scene.Materials().size()));
  }
  for (const SurfaceEcho& echo : path.echoes) {
    EXPECT_LE(std::abs(echo.amplitude), 1.0);
    EXPECT_LE(echo.scanDepth, conditions.maxScanDepth + 1e-6);
  }
}

} // namespace

TEST(SoundTransport, NothingInTheWay)
{
  const AcousticScene scene(Background(water));
  const SoundPath path = Trace(scene, {1, 2, 3}, {0.1, 0, 1});
  CheckSound(scene, path);
  ASSERT_EQ(path.segments.size(), 1u);
  EXPECT_TRUE(path.echoes.empty());
  EXPECT_EQ(path.rays, 0);
  EXPECT_NEAR(path.segments[0].length, 200.0 * 1500 / 1540, 1e-9);
  EXPECT_NEAR(path.segments[0].scanDepthPerMm, 1540.0 / 1500.0, 1e-12);
}

TEST(SoundTransport, LooksAway)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-50, -50, 10}, {50, 50, 60});
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, -1});
  EXPECT_EQ(path.segments.size(), 1u);
  EXPECT_EQ(path.rays, 0);
}

TEST(SoundTransport, DepthAndSizeOfThePlaneEcho)
{
  TissueSurface surface = Background(water);
  AddBox(surface, tissue, {-50, -50, 40}, {50, 50, 300});
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1});
  CheckSound(scene, path);
  ASSERT_EQ(path.echoes.size(), 1u);
  const double z1 = water.Impedance(), z2 = tissue.Impedance(), r = (z2 - z1) / (z2 + z1);
  EXPECT_NEAR(path.echoes[0].scanDepth, 40.0 * 1540 / 1500, 1e-4);
  EXPECT_NEAR(path.echoes[0].amplitude, r, 1e-9);
  EXPECT_NEAR(path.segments[1].amplitude, 1 - r * r, 1e-9);
  EXPECT_NEAR(path.segments[1].way, 40.0, 1e-4);
  EXPECT_EQ(path.segments[1].medium, 1);
}

TEST(SoundTransport, EqualImpedancesCastNoSecondaryRays)
{
  TissueSurface surface = Background(water);
  Material same = water;
  same.name = "same";
  same.attenuation = 1.0; // another material, no border for sound
  AddSphere(surface, same, {0, 0, 50}, 20);
  AddSphere(surface, water, {3, 0, 50}, 5);
  const AcousticScene scene(surface);
  for (double x = -30.0; x <= 30.0; x += 0.37) {
    const SoundPath path = Trace(scene, {x, 0.1, 0}, {0, 0, 1});
    EXPECT_TRUE(path.echoes.empty());
    for (const SoundSegment& segment : path.segments) {
      EXPECT_EQ(segment.bounces, 0);
      EXPECT_NEAR((segment.direction - Vector3d::UnitZ()).norm(), 0.0, 1e-12);
    }
  }
}

TEST(SoundTransport, AttenuationFollowsPathAndFrequency)
{
  TissueSurface surface = Background(water);
  Material lossy = tissue;
  lossy.name = "lossy";
  lossy.attenuation = 0.7;
  lossy.attenuationPower = 1.1;
  AddBox(surface, lossy, {-50, -50, 10}, {50, 50, 300});
  const AcousticScene scene(surface);
  for (const double frequency : {1.0, 2.0, 5.0}) {
    SoundConditions conditions = Conditions();
    conditions.frequencyMHz = frequency;
    const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1}, Transport(), conditions);
    const SoundSegment& s = path.segments[1];
    const double dbPerCm = 10.0 * s.attenuation / 2.0 * 20.0 / std::log(10.0); // one way
    EXPECT_NEAR(dbPerCm, 0.7 * std::pow(frequency, 1.1), 1e-9);
  }
}

TEST(SoundTransport, SnellAtEveryCrossing)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, tissue, {0, 0, 60}, 40, 4);
  AddSphere(surface, dense, {10, 0, 60}, 12, 4);
  const AcousticScene scene(surface);
  int bends = 0;
  for (double x = -39.0; x < 39.0; x += 0.31) {
    const SoundPath path = Trace(scene, {x, 0.2, 0}, {0.02, 0.05, 1});
    CheckSound(scene, path);
    for (std::size_t i = 0; i + 1 < path.segments.size(); ++i) {
      const SoundSegment &a = path.segments[i], &b = path.segments[i + 1];
      if (b.bounces != 0)
        break;
      const double ca = scene.Materials()[static_cast<std::size_t>(a.medium)].soundSpeed;
      const double cb = scene.Materials()[static_cast<std::size_t>(b.medium)].soundSpeed;
      // cb/ca a - b is along the normal: so the tangential parts obey Snell's law.
      const Vector3d along = cb * a.direction - ca * b.direction;
      if (ca == cb || along.norm() < 1e-9 * ca)
        continue;
      const Vector3d normal = along.normalized();
      const double sineA = a.direction.cross(normal).norm(), sineB = b.direction.cross(normal).norm();
      EXPECT_NEAR(sineA * cb, sineB * ca, 1e-6 * ca);
      EXPECT_NEAR((a.from + a.length * a.direction - b.from).norm(), 0.0, 2.0 * scene.Tolerance());
      ++bends;
    }
  }
  EXPECT_GT(bends, 300);

  // A plane at a known angle: against the closed form.
  TissueSurface plane = Background(water);
  AddBox(plane, dense, {-500, -500, 30}, {500, 500, 300});
  const AcousticScene flat(plane);
  for (double angle = 0.0; angle < std::asin(0.5); angle += 0.013) {
    const SoundPath path = Trace(flat, {0, 0, 0}, {std::sin(angle), 0, std::cos(angle)});
    ASSERT_GE(path.segments.size(), 2u);
    EXPECT_NEAR(path.segments[1].direction[0], 2.0 * std::sin(angle), 1e-6);
  }
}

TEST(SoundTransport, TotalReflection)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-500, -500, 30}, {500, 500, 300});
  const AcousticScene scene(surface);
  const double critical = std::asin(1500.0 / 3000.0);
  const double below = critical - 0.01, above = critical + 0.01;
  const SoundPath through = Trace(scene, {0, 0, 0}, {std::sin(below), 0, std::cos(below)});
  const SoundPath back = Trace(scene, {0, 0, 0}, {std::sin(above), 0, std::cos(above)});
  EXPECT_TRUE(std::any_of(through.segments.begin(), through.segments.end(), [](const SoundSegment& s) { return s.medium == 1; }));
  EXPECT_TRUE(std::none_of(back.segments.begin(), back.segments.end(), [](const SoundSegment& s) { return s.medium == 1; }));
  ASSERT_EQ(back.segments.size(), 2u);
  EXPECT_NEAR(back.segments[1].amplitude, 1.0, 1e-12);
  EXPECT_NEAR(back.segments[1].direction[2], -std::cos(above), 1e-9);

  for (const double angle : {1.55, 1.57, 1.5707}) { // grazing
    const SoundPath grazing = Trace(scene, {-400, 0, 29.0}, {std::sin(angle), 0, std::cos(angle)});
    CheckSound(scene, grazing);
  }
}

TEST(SoundTransport, AirStopsSound)
{
  TissueSurface surface = Background(tissue);
  AddBox(surface, air, {-50, -50, 30}, {50, 50, 40});
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1});
  CheckSound(scene, path);
  ASSERT_FALSE(path.echoes.empty());
  EXPECT_LT(path.echoes[0].amplitude, -0.999);
  for (const SoundSegment& segment : path.segments)
    if (segment.bounces == 0 && segment.from[2] > 39.0) {
      EXPECT_LT(20.0 * std::log10(std::abs(segment.amplitude)), -60.0);
    }
}

TEST(SoundTransport, ShadowBehindBone)
{
  TissueSurface surface = Background(StandardMaterial("tissue"));
  AddSphere(surface, StandardMaterial("bone"), {0, 0, 50}, 5, 4);
  const AcousticScene scene(surface);
  const auto levelBehind = [&](double x) { // of the direct way, dB
    const SoundPath path = Trace(scene, {x, 0.01, 0}, {0, 0, 1});
    double level = -400.0;
    for (const SoundSegment& s : path.segments)
      if (s.bounces == 0 && s.from[2] <= 80.0 && (s.from + s.length * s.direction)[2] >= 80.0)
        level = 20.0 * std::log10(s.amplitude * std::exp(-s.attenuation * (80.0 - s.from[2]) / s.direction[2]));
    return level;
  };
  EXPECT_LT(levelBehind(0.02), levelBehind(7.0) - 20.0);
  EXPECT_LT(levelBehind(4.0), levelBehind(7.0) - 20.0); // beyond the critical angle: nothing
  EXPECT_NEAR(levelBehind(7.0), levelBehind(15.0), 1e-9);
}

TEST(SoundTransport, MirrorImageBehindASpecularPlane)
{
  // A plane at 45 degrees turns the way sideways to a sphere: its echo appears straight ahead, at the length of the whole way.
  TissueSurface surface = Background(water);
  AddBox(surface, air, {-20, -20, 0}, {20, 20, 5});
  const Eigen::AngleAxisf turn(0.25f * 3.14159265f, Vector3f::UnitY());
  for (Vector3f& point : surface.points)
    point = turn * point + Vector3f(0, 0, 50);
  AddSphere(surface, dense, {-60, 0, 50}, 10, 5);
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0.001, 0.002, 0}, {0, 0, 1});
  CheckSound(scene, path);
  bool found = false;
  for (const SurfaceEcho& echo : path.echoes)
    if (echo.bounces == 1 && std::abs(echo.way - 100.0) < 0.1) { // 50 down, 50 sideways
      found = true;
      EXPECT_NEAR(echo.scanDepth, echo.way * 1540 / 1500, 1e-6);
    }
  EXPECT_TRUE(found);
}

TEST(SoundTransport, ReverberationBetweenTwoPlates)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-90, -90, 30}, {90, 90, 32});
  AddBox(surface, dense, {-90, -90, 45}, {90, 90, 300});
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1});
  CheckSound(scene, path);
  const double r = (dense.Impedance() - water.Impedance()) / (dense.Impedance() + water.Impedance()), t = 1 - r * r;
  const double toFar = 30.0 + 13.0 + 2.0 / 2.0; // in mm of water: plates are twice as fast
  bool direct = false, again = false;
  for (const SurfaceEcho& echo : path.echoes) {
    const double way = echo.scanDepth * 1500 / 1540;
    if (std::abs(way - toFar) < 1e-3 && echo.bounces == 0) {
      direct = true;
      EXPECT_NEAR(echo.amplitude, t * t * r, 1e-6);
    }
    if (std::abs(way - (toFar + 13.0)) < 1e-3 && echo.bounces == 1) { // 2 d2 - d1: once more between the plates
      again = true;
      EXPECT_NEAR(echo.amplitude, t * t * r * r * r, 1e-6);
    }
  }
  EXPECT_TRUE(direct);
  EXPECT_TRUE(again);
}

TEST(SoundTransport, ReverberationBetweenPlateAndFace)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-90, -90, 30}, {90, 90, 3000});
  const AcousticScene scene(surface);
  const double r = (dense.Impedance() - water.Impedance()) / (dense.Impedance() + water.Impedance()), f = 0.5;
  const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1}, Transport(f));
  CheckSound(scene, path);
  for (int order = 2; order <= 3; ++order) { // echoes at 2 and 3 times the depth
    const double expected = std::pow(r, order) * std::pow(f, order - 1);
    double amplitude = 0.0;
    for (const SurfaceEcho& echo : path.echoes)
      if (std::abs(echo.scanDepth * 1500 / 1540 - 30.0 * order) < 1e-3)
        amplitude += echo.amplitude;
    EXPECT_NEAR(amplitude, expected, 1e-6) << order;
  }
  EXPECT_EQ(Trace(scene, {0, 0, 0}, {0, 0, 1}).echoes.size(), 1u); // without a face there is but one
}

// A face in air is all but mute: what little gets out must get back in as well.
TEST(SoundTransport, FaceInAirSendsNothing)
{
  TissueSurface surface = Background(air);
  AddBox(surface, dense, {-90, -90, 2}, {90, 90, 3000});
  const SoundPath path = Trace(AcousticScene(surface), {0, 0, 0}, {0, 0, 1});
  ASSERT_EQ(path.echoes.size(), 1u);
  const double lens = 1.5, ratio = air.Impedance() / lens;
  EXPECT_NEAR(path.echoes.front().amplitude, 4.0 * ratio / ((1.0 + ratio) * (1.0 + ratio)), 1e-5);
}

TEST(SoundTransport, EnergyNeverGrows)
{
  // Every way that leaves an interface: what went in equals what comes out, and all ways end with less than there was.
  TissueSurface surface = Background(tissue);
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    Material material = Clear("m" + std::to_string(i), random.Uniform(343, 4000), random.Uniform(1, 3000));
    material.roughness = random.Uniform();
    AddSphere(surface, material, {random.Uniform(-30, 30), random.Uniform(-30, 30), random.Uniform(10, 90)},
              random.Uniform(2, 12), 3);
  }
  const AcousticScene scene(surface);
  SoundTransport transport = Transport(0.3);
  transport.dynamicRangeDb = 60.0;
  const SoundTracer tracer(scene, transport, Conditions());
  SoundPath path;
  for (int i = 0; i < 200; ++i) {
    RayStart start;
    start.origin = Vector3d(random.Uniform(-30, 30), random.Uniform(-30, 30), random.Uniform(-10, 90));
    start.direction = random.Direction();
    start.across = start.direction.unitOrthogonal();
    start.inside = scene.BodiesAt(start.origin);
    RaySamples samples(Sampling::Random, 5, static_cast<std::uint64_t>(i), 0, 1);
    tracer.Trace(start, path, &samples);
    CheckSound(scene, path);
    // The direct way only loses; the sum of what leaves it as reflections is at most what it had.
    double before = 1.0;
    for (const SoundSegment& s : path.segments) {
      if (s.bounces != 0)
        break;
      EXPECT_LE(s.amplitude, before + 1e-12);
      before = s.amplitude;
    }
  }
}

TEST(SoundTransport, ReflectedAndTransmittedAreAllThereIs)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-500, -500, 30}, {500, 500, 3000});
  const AcousticScene scene(surface);
  for (double angle = 0.0; angle < 1.5; angle += 0.01) {
    const SoundPath path = Trace(scene, {0, 0, 0}, {std::sin(angle), 0, std::cos(angle)});
    double sum = 0.0;
    for (std::size_t i = 1; i < path.segments.size(); ++i)
      sum += path.segments[i].amplitude;
    if (path.segments.size() > 1) {
      EXPECT_NEAR(sum, 1.0, 1e-6);
    }
  }
}

TEST(SoundTransport, SpecularEchoesNeedAFacingSurface)
{
  TissueSurface surface = Background(water);
  AddBox(surface, tissue, {-500, -500, 30}, {500, 500, 3000});
  Material rough = tissue;
  rough.name = "rough";
  rough.roughness = 1.0;
  TissueSurface roughSurface = Background(water);
  AddBox(roughSurface, rough, {-500, -500, 30}, {500, 500, 3000});
  const AcousticScene smoothScene(surface), roughScene(roughSurface);
  const auto echo = [](const AcousticScene& scene, double degrees) {
    const double angle = degrees * 3.14159265358979 / 180.0;
    const SoundPath path = Trace(scene, {0, 0, 0}, {std::sin(angle), 0, std::cos(angle)});
    return path.echoes.empty() ? 0.0 : std::abs(path.echoes[0].amplitude);
  };
  EXPECT_NEAR(echo(smoothScene, 5.0) / echo(smoothScene, 0.0), std::exp(-0.5), 0.01); // the acceptance of 5 degrees
  EXPECT_LT(echo(smoothScene, 30.0), 1e-6);
  EXPECT_GT(echo(roughScene, 30.0), 1e3 * echo(smoothScene, 30.0)); // Lambert is seen from everywhere
  EXPECT_LT(echo(roughScene, 0.0), echo(smoothScene, 0.0));
}

TEST(SoundTransport, RoughSurfacesSendSoundAnyWay)
{
  TissueSurface surface = Background(water);
  Material rough = dense;
  rough.roughness = 0.5;
  AddBox(surface, rough, {-500, -500, 30}, {500, 500, 3000});
  const AcousticScene scene(surface);
  const SoundTracer tracer(scene, Transport(), Conditions());
  RayStart start;
  start.direction = Vector3d(0.2, 0, 1).normalized();
  start.across = Vector3d::UnitY();
  constexpr int count = 4000;
  int mirrored = 0, turned = 0;
  double cosines = 0.0;
  for (int i = 0; i < count; ++i) {
    RaySamples samples(Sampling::Sobol, 1, 0, static_cast<std::uint32_t>(i), count);
    SoundPath path;
    tracer.Trace(start, path, &samples);
    for (const SoundSegment& s : path.segments)
      if (s.bounces == 1) {
        const bool mirror = (s.direction - Vector3d(start.direction[0], 0, -start.direction[2])).norm() < 1e-6;
        mirrored += mirror;
        turned += !mirror;
        EXPECT_LT(s.direction[2], 0.0);
        if (!mirror)
          cosines -= s.direction[2];
      }
  }
  EXPECT_NEAR(mirrored, 0.5 * count, 0.02 * count);
  EXPECT_NEAR(cosines / turned, 2.0 / 3.0, 0.01); // mean cosine of Lambert's law
}

TEST(SoundTransport, WaysEndBelowTheDynamicRange)
{
  TissueSurface surface = Background(StandardMaterial("liver"));
  AddBox(surface, StandardMaterial("fat"), {-50, -50, 30}, {50, 50, 40});
  const AcousticScene scene(surface);
  for (const double range : {40.0, 80.0, 120.0}) {
    SoundTransport transport = Transport();
    transport.dynamicRangeDb = range;
    const SoundPath path = Trace(scene, {0, 0, 0}, {0, 0, 1}, transport);
    for (const SoundSegment& s : path.segments)
      EXPECT_GE(20.0 * std::log10(s.amplitude * std::exp(-s.attenuation * s.length)), -range - 1e-6);
  }
}

TEST(SoundTransport, WeakReflectionsAreLeftOut)
{
  TissueSurface surface = Background(water);
  AddBox(surface, dense, {-90, -90, 30}, {90, 90, 32});
  AddBox(surface, dense, {-90, -90, 45}, {90, 90, 300});
  const AcousticScene scene(surface);
  RayStart start;
  const SoundPath all = TracePath(scene, Transport(0.2), Conditions(), start);
  start.leastReflected = 0.02;
  const SoundPath some = TracePath(scene, Transport(0.2), Conditions(), start);
  CheckSound(scene, some);
  EXPECT_LT(some.rays, all.rays);
  EXPECT_LT(some.segments.size(), all.segments.size());
  // Nothing is lost by attenuation here: what is louder was followed all the way, and the direct way is untouched.
  const auto listed = [&](const SoundPath& path) {
    std::vector<std::pair<double, double>> list;
    for (const SurfaceEcho& echo : path.echoes)
      if (echo.bounces == 0 || std::abs(echo.amplitude) > start.leastReflected)
        list.emplace_back(echo.scanDepth, echo.amplitude);
    return list;
  };
  EXPECT_EQ(listed(some), listed(all));
  EXPECT_EQ(listed(some).size(), some.echoes.size());
  EXPECT_GT(std::count_if(some.echoes.begin(), some.echoes.end(), [](const SurfaceEcho& echo) { return echo.bounces > 0; }), 0);
  const auto direct = [](const SoundPath& path) {
    double length = 0.0;
    for (const SoundSegment& s : path.segments)
      length += s.bounces == 0 ? s.length : 0.0;
    return length;
  };
  EXPECT_EQ(direct(some), direct(all));
}

TEST(SoundTransport, StartsInsideAnObject)
{
  TissueSurface surface = Background(water);
  AddSphere(surface, tissue, {0, 0, 0}, 50, 4);
  AddSphere(surface, dense, {0, 0, 0}, 20, 4);
  const AcousticScene scene(surface);
  const SoundPath path = Trace(scene, {0.1, 0.2, 0.3}, {0, 0, 1});
  ASSERT_GE(path.segments.size(), 3u);
  EXPECT_EQ(path.segments[0].medium, 2);
  EXPECT_EQ(path.segments[1].medium, 1);
  EXPECT_EQ(path.segments[2].medium, 0);
}

TEST(SoundTransport, ReflectionsStayOnTheirSide)
{
  // In a closed mirror box sound goes on in the box's medium, through edges and corners, bounce after bounce.
  TissueSurface surface = Background(air);
  AddBox(surface, tissue, {0, 0, 0}, {20, 20, 20});
  const AcousticScene scene(surface);
  SoundTransport transport = Transport();
  transport.maxBounces = 100;
  transport.dynamicRangeDb = 30.0; // the way out is at -60 dB
  SoundConditions conditions = Conditions();
  conditions.maxScanDepth = 1000.0;
  Random random(21);
  for (int i = 0; i < 200; ++i) {
    const SoundPath path = Trace(scene, {random.Uniform(1, 19), random.Uniform(1, 19), random.Uniform(1, 19)}, random.Direction(),
                                 transport, conditions);
    double length = 0.0;
    for (const SoundSegment& s : path.segments) {
      EXPECT_EQ(s.medium, 1);
      EXPECT_TRUE((s.from.array() > -0.001).all() && (s.from.array() < 20.001).all());
      length += s.length;
    }
    EXPECT_NEAR(length, 1000.0, 1e-3);
  }
}

TEST(SoundTransport, ASheetReflectsAndLetsPass)
{
  TissueSurface surface = Background(water);
  const int body = AddBody(surface, dense);
  for (const float x : {-50.0f, 50.0f})
    for (const float y : {-50.0f, 50.0f})
      surface.points.emplace_back(x, y, 30.0f);
  AddTriangle(surface, body, 0, 1, 2);
  AddTriangle(surface, body, 1, 3, 2);
  const AcousticScene scene(surface);
  const double r = (dense.Impedance() - water.Impedance()) / (dense.Impedance() + water.Impedance());
  for (const Vector3d& direction : {Vector3d(0, 0, 1), Vector3d(0.3, 0.1, 1), Vector3d(-0.4, 0.2, 1)}) {
    const SoundPath path = Trace(scene, {0.3, 0.2, 0}, direction);
    CheckSound(scene, path);
    ASSERT_EQ(path.echoes.size(), 1u); // met once, from the front
    ASSERT_EQ(path.segments.size(), 3u);
    EXPECT_EQ(path.segments[1].medium, 0);
    if (direction[0] == 0.0) {
      EXPECT_NEAR(path.echoes[0].amplitude, r, 1e-9);
      EXPECT_NEAR(path.segments[1].amplitude, 1 - r * r, 1e-9);
    }
  }
}

TEST(SoundTransport, RefusesAbsurdParameters)
{
  const AcousticScene scene(Background(water));
  const auto refuses = [&scene](const SoundTransport& transport, const SoundConditions& conditions) {
    EXPECT_THROW(SoundTracer(scene, transport, conditions), Error);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {-1.0, nan, 1e9}) {
    SoundTransport transport;
    transport.dynamicRangeDb = bad;
    refuses(transport, {});
    transport = {};
    transport.faceReflection = bad;
    refuses(transport, {});
    transport = {};
    transport.faceRadius = bad;
    refuses(transport, {});
    transport = {};
    transport.acceptanceDegrees = bad;
    refuses(transport, {});
    SoundConditions conditions;
    conditions.frequencyMHz = bad;
    refuses({}, conditions);
    conditions = {};
    conditions.assumedSoundSpeed = bad;
    refuses({}, conditions);
    conditions = {};
    conditions.maxScanDepth = bad;
    refuses({}, conditions);
  }
  SoundTransport transport;
  transport.maxBounces = -1;
  refuses(transport, {});
  transport = {};
  transport.maxSegments = 0;
  refuses(transport, {});
}
