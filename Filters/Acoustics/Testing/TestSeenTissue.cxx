// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/SeenTissue.h"
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

constexpr double assumed = 1540.0;
const Material tissue = Clear("tissue", assumed, 1000), fat = Clear("fat", 1450, 950), fast = Clear("fast", 1620, 1000);

// A flat probe: its beams are parallel to z, so that what is linear along x and y is exact between them.
SynthesisParameters Flat()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Linear(32.0, 16.0, 2.0, 60.0);
  p.elements = 17;
  p.steps = 5;
  p.samples = 400;
  return p;
}

SynthesisParameters Bent(int elements = 33, int steps = 17)
{
  SynthesisParameters p = Flat();
  p.probe = ProbeGeometry::Convex(0.9, 30.0, 0.7, 25.0, 2.0, 70.0);
  p.probeToWorld = Pose(Eigen::Translation3d(10, -20, 30) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()));
  p.elements = elements;
  p.steps = steps;
  return p;
}

// Some point of the fan, in the world.
Vector3d AnyPoint(const SynthesisParameters& p, Random& random)
{
  const BeamPoint at{random.Uniform(p.probe.depthMin, p.probe.depthMax), random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5)};
  return p.probeToWorld * PointOf(p.probe, at);
}

// What really lies where the image shows a point: along a ray of its own. NaN where sound does not get to.
Vector3d TissueAt(const AcousticScene& scene, const SynthesisParameters& p, const Vector3d& shown)
{
  const BeamPoint at = BeamPointAt(p.probe, p.probeToWorld.inverse() * shown).value();
  RayStart start;
  start.origin = p.probeToWorld * PointOf(p.probe, {0.0, at.fan, at.sweep});
  start.direction = p.probeToWorld.linear() * DirectionOf(p.probe, at);
  start.across = start.direction.unitOrthogonal();
  start.inside = scene.BodiesAt(start.origin);
  for (const SoundSegment& s : TracePath(scene, p.transport, ConditionsOf(p), start).segments)
    if (s.bounces == 0 && at.depth <= s.scanDepth + s.length * s.scanDepthPerMm)
      return s.from + (at.depth - s.scanDepth) / s.scanDepthPerMm * s.direction;
  return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// Everything behind a plane through (0, 0, depth) that is tilted about y, down to a depth that no sound reaches.
void AddBehindPlane(TissueSurface& surface, const Material& material, double depth, double tilt)
{
  AddBox(surface, material, Vector3f(-200, -200, 0), Vector3f(200, 200, 300));
  const Eigen::Affine3d place = Eigen::Translation3d(0, 0, depth) * Eigen::AngleAxisd(tilt, Vector3d::UnitY());
  for (auto point = surface.points.end() - 8; point != surface.points.end(); ++point)
    *point = (place * point->cast<double>()).cast<float>();
}

TEST(SeenTissue, WithOneSpeedOfSoundAllIsSeenWhereItIs)
{
  TissueSurface surface = Background(tissue);
  AddSphere(surface, Clear("heavy", assumed, 1200), Vector3d(0, 0, 60), 15.0);
  const AcousticScene scene(surface);
  for (const SynthesisParameters& p : {Flat(), Bent()}) {
    const SeenTissue map(scene, p);
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
      const Vector3d point = AnyPoint(p, random);
      const auto seen = map.Seen(point);
      ASSERT_TRUE(seen) << point.transpose();
      EXPECT_LT((*seen - point).norm(), 1e-6);
    }
  }
}

TEST(SeenTissue, BelowALayerOfFatAllIsSeenDeeper)
{
  const double from = 8.0, thickness = 12.5;
  TissueSurface surface = Background(tissue);
  AddBox(surface, fat, Vector3f(-100, -100, from), Vector3f(100, 100, from + thickness));
  const SeenTissue map(AcousticScene(surface), Flat());
  for (const double depth : {3.0, 10.0, 20.0, 30.0, 55.0}) {
    const double inFat = std::clamp(depth - from, 0.0, thickness);
    for (const double x : {0.0, -3.3}) {
      const auto seen = map.Seen(Vector3d(x, 1.7, depth));
      ASSERT_TRUE(seen);
      EXPECT_LT((*seen - Vector3d(x, 1.7, depth + inFat * (assumed / fat.soundSpeed - 1.0))).norm(), 1e-5) << depth;
    }
  }
}

TEST(SeenTissue, SnellsLawAtAnObliquePlane)
{
  for (const Material& behind : {fat, fast})
    for (const double tilt : {0.15, -0.4}) {
      TissueSurface surface = Background(tissue);
      AddBehindPlane(surface, behind, 20.0, tilt);
      const SynthesisParameters p = Flat();
      const SeenTissue map(AcousticScene(surface), p);
      const double ratio = behind.soundSpeed / assumed;
      const double turn = tilt - std::asin(ratio * std::sin(tilt)); // about y, of the beam behind the plane
      for (const double x : {-7.0, 0.4, 9.9})
        for (const double scanDepth : {14.0, 37.0, 58.0}) {
          const double meets = 20.0 - x * std::tan(tilt), way = std::max(0.0, scanDepth - meets) * ratio;
          const Vector3d point = scanDepth < meets ? Vector3d(x, -2.5, scanDepth)
                                                   : Vector3d(x + way * std::sin(turn), -2.5, meets + way * std::cos(turn));
          const auto seen = map.Seen(point);
          ASSERT_TRUE(seen);
          EXPECT_LT((*seen - Vector3d(x, -2.5, scanDepth)).norm(), 1e-5)
              << behind.name << " " << tilt << " " << point.transpose();
        }
    }
}

TEST(SeenTissue, ARayToWhereAPointIsSeenMeetsThePoint)
{
  TissueSurface surface = Background(tissue);
  const SynthesisParameters at = Bent();
  AddSphere(surface, fat, at.probeToWorld * Vector3d(0, 0, 30), 14.0, 5);
  AddSphere(surface, fast, at.probeToWorld * Vector3d(9, -6, 50), 8.0, 5);
  const AcousticScene scene(surface);
  // The displacement is linear between beams, so that twice as many beams leave a quarter of the error.
  std::vector<double> largest;
  for (const int finer : {1, 2}) {
    const SynthesisParameters p = Bent(64 * finer + 1, 48 * finer + 1);
    const SeenTissue map(scene, p);
    Random random(2);
    std::vector<double> errors;
    double moved = 0.0;
    const int points = 2000;
    for (int i = 0; i < points; ++i) {
      const Vector3d point = AnyPoint(p, random);
      if (const auto seen = map.Seen(point)) {
        errors.push_back((TissueAt(scene, p, *seen) - point).norm());
        moved = std::max(moved, (*seen - point).norm());
      }
    }
    ASSERT_GT(errors.size(), 0.85 * points); // less those at the edge of the fan, and beside the rims of the spheres
    EXPECT_GT(moved, 5.0);
    const auto last = errors.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(errors.size()));
    std::nth_element(errors.begin(), last, errors.end());
    largest.push_back(*last);
  }
  EXPECT_LT(largest[0], 0.03);
  EXPECT_LT(largest[1], largest[0] / 3.0);
}

TEST(SeenTissue, BehindALensThatSpreadsBeams)
{
  TissueSurface surface = Background(tissue);
  AddSphere(surface, Clear("lens", 1850, 850), Vector3d(0, 0, 20), 8.0, 6);
  const AcousticScene scene(surface);
  SynthesisParameters p = Flat();
  p.probe = ProbeGeometry::Linear(4.0, 4.0, 2.0, 60.0);
  p.elements = p.steps = 41;
  const SeenTissue map(scene, p);
  for (const Vector3d& shown : {Vector3d(0.33, 0.0, 52), Vector3d(-0.87, 0.52, 55), Vector3d(1.05, -1.11, 50)}) {
    const Vector3d point = TissueAt(scene, p, shown);
    EXPECT_GT(point.head<2>().norm(), 2.5 * shown.head<2>().norm()); // displacement grows faster than the beams are apart
    const auto seen = map.Seen(point);
    ASSERT_TRUE(seen) << shown.transpose();
    EXPECT_LT((*seen - shown).norm(), 0.02);
  }
}

// In the gap that a lens leaves between the beams that it bends and those that just pass it, nothing is heard.
TEST(SeenTissue, BesideTheBeamsOfALensNothingIsSeen)
{
  TissueSurface surface = Background(tissue);
  AddSphere(surface, Clear("lens", 1450, 1060), Vector3d(0, 0, 20), 8.0, 6);
  const AcousticScene scene(surface);
  SynthesisParameters p = Flat();
  p.elements = 65;
  p.steps = 33;
  const SeenTissue map(scene, p);
  const Vector3d bent = TissueAt(scene, p, Vector3d(7.7, 0, 55)), straight = TissueAt(scene, p, Vector3d(8.3, 0, 55));
  ASSERT_GT((bent - straight).norm(), 5.0);
  EXPECT_FALSE(map.Seen(0.4 * bent + 0.6 * straight));
  EXPECT_TRUE(map.Seen(straight + Vector3d(1.0, 0, 0)));
}

TEST(SeenTissue, ABallIsReallySeenThere)
{
  Material glitter = tissue;
  glitter.name = "glitter";
  glitter.scattererDensity = 1000.0;
  glitter.backscatterDb = 20.0;
  for (const Vector3d& centre : {Vector3d(-6, 1, 38), Vector3d(5, -2, 45)}) {
    TissueSurface surface = Background(tissue);
    AddBox(surface, Clear("prism", 1350, 1000), Vector3f(-30, -30, -6), Vector3f(30, 30, 6));
    for (Vector3f& point : surface.points)
      if (point.z() > 0.0f)
        point.z() = 15.0f + 0.5f * point.x();
    AddSphere(surface, glitter, centre, 0.4, 2);
    const AcousticScene scene(surface);

    SynthesisParameters p = Flat();
    p.probe = ProbeGeometry::Linear(12.0, 8.0, 35.0, 55.0);
    p.probeToWorld.translation() = Vector3d(centre.x(), 0.0, 0.0);
    p.elements = 25;
    p.steps = 17;
    p.samples = 200;
    p.scatterersPerMm3 = 100.0;
    p.transducer.lateralFocusMm = p.transducer.elevationFocusMm = 40.0;
    p.wideBeams = centre.x() > 0.0;
    // The middle of the power of the ball's echoes, over several draws of its scatterers.
    Vector3d sum = Vector3d::Zero();
    double power = 0.0;
    for (p.seed = 1; p.seed <= 5; ++p.seed) {
      const BeamEchoes echoes = SynthesizeEchoes(scene, p);
      const auto n = echoes.baseband.Dimensions();
      for (int step = 0; step < n[2]; ++step)
        for (int element = 0; element < n[1]; ++element)
          for (int i = 0; i < n[0]; ++i) {
            const double weight = std::norm(echoes.baseband.View().Row(element, step)[i]);
            BeamPoint at = BeamOf(p, element, step);
            at.depth = p.probe.depthMin + (p.probe.depthMax - p.probe.depthMin) * i / (n[0] - 1);
            sum += weight * (p.probeToWorld * PointOf(p.probe, at));
            power += weight;
          }
    }
    const auto seen = SeenTissue(scene, p).Seen(centre);
    ASSERT_TRUE(seen);
    EXPECT_LT((sum / power - *seen).norm(), 0.3);
    EXPECT_GT((*seen - centre).norm(), 2.0);
  }
}

TEST(SeenTissue, WhatSoundDoesNotGetToIsNotSeen)
{
  TissueSurface surface = Background(fast);
  AddBox(surface, StandardMaterial("bone"), Vector3f(-30, -30, 20), Vector3f(0, 30, 50));
  const SynthesisParameters p = Flat();
  const SeenTissue map(AcousticScene(surface), p);
  EXPECT_FALSE(map.Seen(Vector3d(-5, 0, 55)));
  EXPECT_TRUE(map.Seen(Vector3d(5, 0, 55)));
  const auto before = map.Seen(Vector3d(-5, 0, 19.99)); // shown less deep than the sound along its beam gets
  ASSERT_TRUE(before);
  EXPECT_NEAR(before->z(), 19.99 * assumed / fast.soundSpeed, 1e-5);

  TissueSurface steep = Background(tissue);
  AddBehindPlane(steep, Clear("very fast", 3000, 1000), 30.0, 0.7);
  const SeenTissue total(AcousticScene(steep), p);
  EXPECT_TRUE(total.Seen(Vector3d(0, 0, 29.9)));
  for (const double depth : {31.0, 40.0, 55.0})
    EXPECT_FALSE(total.Seen(Vector3d(0, 0, depth)));
}

TEST(SeenTissue, OutsideOfTheFanNothingIsSeen)
{
  const AcousticScene scene(Background(fast));
  for (const SynthesisParameters& p : {Flat(), Bent(129, 65)}) {
    const SeenTissue map(scene, p);
    const double longer = fast.soundSpeed / assumed, off = 1e-3;
    const auto isSeen = [&](double depth, double fan, double sweep) {
      return map.Seen(p.probeToWorld * PointOf(p.probe, {depth * longer, fan, sweep})).has_value();
    };
    EXPECT_TRUE(isSeen(p.probe.depthMin + off, 0.1, 0.1));
    EXPECT_FALSE(isSeen(p.probe.depthMin - off, 0.1, 0.1));
    EXPECT_TRUE(isSeen(p.probe.depthMax - off, 0.1, 0.1));
    EXPECT_FALSE(isSeen(p.probe.depthMax + off, 0.1, 0.1));
    for (const double side : {-1.0, 1.0}) {
      EXPECT_TRUE(isSeen(30.0, side * (0.5 - off), 0.1));
      EXPECT_FALSE(isSeen(30.0, side * (0.5 + off), 0.1));
      EXPECT_TRUE(isSeen(30.0, 0.1, side * (0.5 - off)));
      EXPECT_FALSE(isSeen(30.0, 0.1, side * (0.5 + off)));
    }
    EXPECT_FALSE(map.Seen(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())));
    EXPECT_FALSE(map.Seen(Vector3d::Constant(1e300)));
  }
}

TEST(SeenTissue, OfASinglePlaneWhatItImages)
{
  TissueSurface surface = Background(tissue);
  AddBehindPlane(surface, fat, 20.0, 0.3);
  const AcousticScene scene(surface);
  const SynthesisParameters p = SliceOf(Flat(), 0.25); // at y = 4
  const SeenTissue volume(scene, Flat()), plane(scene, p);
  const Vector3d point(3, 4, 40);
  const auto inVolume = volume.Seen(point), inPlane = plane.Seen(point);
  ASSERT_TRUE(inVolume && inPlane);
  EXPECT_LT((*inVolume - *inPlane).norm(), 1e-5);
  EXPECT_FALSE(plane.Seen(point + Vector3d(0, 0.1, 0)));
}

TEST(SeenTissue, AMovingProbeShowsPlanesElsewhere)
{
  SynthesisParameters p = Flat();
  for (int step = 0; step < p.steps; ++step) // the planes lie half as far apart again as the scanner thinks
    p.stepPoses.emplace_back(Eigen::Translation3d(1.0, 2.0 * (step - 2), 0.0));
  const SeenTissue map(AcousticScene(Background(tissue)), p);
  const auto seen = map.Seen(Vector3d(4, 9, 30));
  ASSERT_TRUE(seen);
  EXPECT_LT((*seen - Vector3d(3, 6, 30)).norm(), 1e-5);
  EXPECT_FALSE(map.Seen(Vector3d(4, 12.1, 30)));
}

TEST(SeenTissue, DoesNotDependOnThreads)
{
  TissueSurface surface = Background(tissue);
  AddSphere(surface, fat, Bent().probeToWorld * Vector3d(0, 0, 35), 12.0);
  const AcousticScene scene(surface);
  std::vector<std::vector<Vector3d>> made;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const SeenTissue map(scene, Bent());
    Random random(3);
    auto& places = made.emplace_back();
    for (int i = 0; i < 300; ++i)
      places.push_back(map.Seen(AnyPoint(Bent(), random)).value_or(Vector3d::Zero()));
  }
  EXPECT_EQ(made[0], made[1]);
  EXPECT_EQ(made[0], made[2]);
}

TEST(SeenTissue, RefusesAndStops)
{
  const AcousticScene scene(Background(tissue));
  SynthesisParameters p = Flat();
  p.mode = SynthesisParameters::Mode::Counting;
  EXPECT_THROW(SeenTissue(scene, p), Error);
  p = Flat();
  p.elements = 1;
  EXPECT_THROW(SeenTissue(scene, p), Error);
  EXPECT_THROW(SeenTissue(scene, Flat(), Progress([](double) { return false; })), Error);
}

} // namespace
