// SPDX-License-Identifier: BSD-3-Clause
// Over a flat skin at z = 3, from a face of 16 mm by 12 mm.
#include "Core/Base/Error.h"
#include "Filters/Physics/GelMotion.h"
#include "GelScene.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using namespace echorama::testing;

namespace {

constexpr double skinZ = 3.0, byItsSpeed = std::numeric_limits<double>::quiet_NaN();

Pose At(double x, double z)
{
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(x, 0.0, z);
  return pose;
}

GelCoatParameters Coarse(double ml)
{
  GelCoatParameters parameters;
  parameters.amountMl = ml;
  parameters.coverage = 0.6;
  parameters.settleS = 0.02;
  return parameters;
}

// 0.8 ml: about what lies between the face and skin 4 mm before it.
GelMotion Start(const TissueSurface& skin = SkinBlock(skinZ), double ml = 0.8, const Pose& first = At(0.0, -1.0))
{
  return GelMotion(skin, LinearProbe(first), {}, {}, Coarse(ml));
}

struct Heap {
  double mm3 = 0.0;
  Vector3d centre = Vector3d::Zero();
};

// What is positive, in a box.
Heap GelIn(const GelCoat& coat, const Vector3d& low, const Vector3d& high)
{
  const Eigen::Affine3d toPoint = coat.grid.IndexToWorld();
  const int row = coat.grid.dimensions[0], rows = coat.grid.dimensions[1];
  Heap heap;
  double count = 0.0;
  for (std::size_t n = 0; n < coat.level.size(); ++n) {
    const int at = static_cast<int>(n);
    const Vector3d point = toPoint * Vector3d(at % row, at / row % rows, at / row / rows);
    if (!(coat.level[n] > 0.0f) || (point.array() < low.array()).any() || (point.array() > high.array()).any())
      continue;
    heap.centre += point;
    count += 1.0;
  }
  heap.mm3 = count * coat.grid.spacing.prod();
  heap.centre /= std::max(count, 1.0);
  return heap;
}

Heap GelOnSkin(const GelCoat& coat, double x)
{
  return GelIn(coat, {x - 18, -20, skinZ - 6}, {x + 18, 20, skinZ});
}

void ExpectBalance(const GelCoat& coat, double ml)
{
  EXPECT_NEAR(coat.putOnMm3, 1000.0 * ml, 0.02 * 1000.0 * ml);
  EXPECT_NEAR(coat.leftMm3 + coat.goneMm3, coat.putOnMm3, 1e-6 * coat.putOnMm3);
}

} // namespace

TEST(GelMotion, LiftingOffLeavesGelOnFaceAndSkin)
{
  ECHORAMA_SKIP_SANITIZED();
  GelMotion motion = Start();
  motion.Move(At(0, -1), byItsSpeed);
  const GelCoat pressed = motion.Look(true);
  EXPECT_GT(pressed.coupled, 0.7);
  motion.Move(At(0, -30), byItsSpeed);
  const GelCoat lifted = motion.Look(true);
  ExpectBalance(lifted, 0.8);
  EXPECT_EQ(lifted.coupled, 0.0);
  const double onSkin = GelOnSkin(lifted, 0.0).mm3, onFace = GelIn(lifted, {-20, -20, -40}, {20, 20, -20}).mm3;
  EXPECT_GT(onSkin, 150.0);
  EXPECT_GT(onFace, 150.0);
  EXPECT_NEAR(lifted.volumeMm3, lifted.leftMm3, 0.02 * lifted.leftMm3);
  EXPECT_NEAR(lifted.seconds, motion.Seconds(), 1e-12);
  EXPECT_GT(motion.Seconds(), 29.0 / 40.0);
}

TEST(GelMotion, WhatIsLeftAtOnePlaceIsMissingAtTheNext)
{
  ECHORAMA_SKIP_SANITIZED();
  GelMotion motion = Start();
  motion.Move(At(0, -1), byItsSpeed);
  motion.Move(At(0, -15), byItsSpeed);
  const double left = GelOnSkin(motion.Look(false), 0.0).mm3;
  motion.Move(At(40, -15), byItsSpeed);
  motion.Move(At(40, -1), byItsSpeed);
  const GelCoat second = motion.Look(true);
  ExpectBalance(second, 0.8);
  GelMotion fresh = Start(SkinBlock(skinZ), 0.8, At(40, -1));
  fresh.Move(At(40, -1), byItsSpeed);
  EXPECT_LT(second.coupled, fresh.Look(true).coupled - 0.1);
  EXPECT_NEAR(GelOnSkin(second, 0.0).mm3, left, 0.1 * left) << "it has not stayed";
  // Back over the first place, there is gel again.
  motion.Move(At(40, -15), byItsSpeed);
  motion.Move(At(0, -15), byItsSpeed);
  motion.Move(At(0, -1), byItsSpeed);
  const GelCoat back = motion.Look(true);
  EXPECT_GT(back.coupled, second.coupled + 0.05);
  ExpectBalance(back, 0.8);
}

TEST(GelMotion, GelGoesWithTheSkin)
{
  ECHORAMA_SKIP_SANITIZED();
  TissueSurface skin = SkinBlock(skinZ);
  GelMotion motion = Start(skin);
  motion.Move(At(0, -1), byItsSpeed);
  motion.Move(At(0, -25), byItsSpeed);
  const Heap before = GelOnSkin(motion.Look(true), 0.0);
  ASSERT_GT(before.mm3, 150.0);
  const Vector3d way(5.0, -3.0, 2.0);
  for (auto& point : skin.points)
    point += way.cast<float>();
  motion.Move(At(0, -25), 0.2, &skin);
  EXPECT_EQ(motion.Tissue().points, skin.points);
  const GelCoat coat = motion.Look(false);
  const Heap after = GelIn(coat, way + Vector3d(-18, -20, skinZ - 6), way + Vector3d(18, 20, skinZ));
  EXPECT_NEAR(after.mm3, before.mm3, 0.1 * before.mm3);
  EXPECT_LT((after.centre - before.centre - way).norm(), 0.5);
}

// The skin waits for the face that comes from afar, and does not rise before the face has gone.
TEST(GelMotion, SkinYieldsWhileTheFaceIsThere)
{
  const TissueSurface rest = SkinBlock(skinZ), pressed = SkinBlock(skinZ + 6.0);
  GelMotion motion = Start(rest, 0.5, At(0, skinZ + 5.0));
  motion.Move(At(0, -20), byItsSpeed);
  GelMotion atOnce = motion, inParts = motion;
  atOnce.Move(At(0, skinZ + 5.0), 1.0, &pressed);
  const double meeting = 23.0 / 28.0; // of the way
  inParts.Move(At(0, skinZ), meeting);
  inParts.Move(At(0, skinZ + 5.0), 1.0 - meeting, &pressed);
  const double one = atOnce.Look(false).coupled, two = inParts.Look(false).coupled;
  EXPECT_GT(two, 0.2);
  EXPECT_NEAR(one, two, 0.1);
  EXPECT_NEAR(atOnce.Seconds(), inParts.Seconds(), 1e-9);
}

TEST(GelMotion, GoesOnFromWhereItWas)
{
  GelMotion motion = Start(SkinBlock(skinZ), 0.3);
  motion.Move(At(0, -1), byItsSpeed);
  GelMotion copy = motion;
  motion.Move(At(8, -1), 0.1);
  const GelCoat expected = motion.Look(false);
  copy.Look(false); // changes nothing
  copy.Move(At(8, -1), 0.1);
  const GelCoat coat = copy.Look(false);
  EXPECT_EQ(coat.level, expected.level);
  EXPECT_EQ(coat.coupled, expected.coupled);
  EXPECT_EQ(coat.report.particleSteps, expected.report.particleSteps);
  EXPECT_EQ(copy.Seconds(), motion.Seconds());
}

// The cap of a bent face is no paraboloid.
TEST(GelMotion, PutsOnWhatItIsTold)
{
  const PlacedProbe probe{ProbeGeometry::Convex(1.2, 40.0, 1.0, 25.0, 0.0, 100.0), At(0, -1)};
  for (const double ml : {5.0, 15.0}) {
    GelCoatParameters parameters;
    parameters.amountMl = ml;
    parameters.cellMm = 3.0;
    GelMotion motion(SkinBlock(skinZ), probe, {}, {}, parameters);
    const GelCoat coat = motion.Look(false);
    EXPECT_NEAR(coat.putOnMm3, 1000.0 * ml, 10.0 * ml);
    EXPECT_EQ(coat.leftMm3, coat.putOnMm3);
    EXPECT_EQ(coat.seconds, 0.0);
  }
}

// A head that goes on leaves behind what it does not take along; what it pushes before its side is neither lost nor doubled.
TEST(GelMotion, SlidesBackAndForth)
{
  ECHORAMA_SKIP_SANITIZED();
  GelMotion motion = Start();
  for (const double x : {0.0, 12.0, -12.0, 12.0, 0.0})
    motion.Move(At(x, -1.0), byItsSpeed);
  const GelCoat coat = motion.Look(true);
  ExpectBalance(coat, 0.8);
  EXPECT_NEAR(coat.volumeMm3, coat.leftMm3, 0.02 * coat.leftMm3);
  EXPECT_GT(coat.coupled, 0.5);
}

TEST(GelMotion, RefusesWhatIsNoMotion)
{
  GelMotion motion = Start(SkinBlock(skinZ), 0.1);
  Pose bent = At(0, -1);
  bent.linear() *= 2.0;
  EXPECT_THROW(motion.Move(bent, 0.1), Error);
  EXPECT_THROW(motion.Move(At(0, -1), -0.1), Error);
  TissueSurface other = SkinBlock(skinZ);
  other.triangles.pop_back();
  other.bodyOfTriangle.pop_back();
  EXPECT_THROW(motion.Move(At(0, -1), 0.1, &other), Error);
}
