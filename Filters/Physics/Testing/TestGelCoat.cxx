// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Physics/GelMotion.h"
#include "GelScene.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

GelCoatParameters Amount(double ml, double coverage = 0.9)
{
  GelCoatParameters parameters;
  parameters.amountMl = ml;
  parameters.coverage = coverage;
  parameters.settleS = 0.02;
  return parameters;
}

// Of what is positive between two depths and not in the head.
double LevelVolume(const GelCoat& coat, double fromZ, double toZ)
{
  const ProbeShape head(LinearProbe().geometry);
  const Eigen::Affine3d toPoint = coat.grid.IndexToWorld();
  const int row = coat.grid.dimensions[0], rows = coat.grid.dimensions[1];
  int count = 0;
  for (std::size_t n = 0; n < coat.level.size(); ++n) {
    const int at = static_cast<int>(n);
    const Vector3d point = toPoint * Vector3d(at % row, at / row % rows, at / row / rows);
    count += coat.level[n] > 0.0f && point.z() > fromZ && point.z() < toZ && head.Distance(point) > 0.0;
  }
  return count * coat.grid.spacing.prod();
}

} // namespace

// Between a flat face of 16 mm by 12 mm (26 by 22 with its margin) and skin 3 mm away: 3 ml are more than what lies there.
// Pressed that fast, gel gives way by a few percent of its volume.
TEST(GelCoat, FillsTheGap)
{
  ECHORAMA_SKIP_SANITIZED();
  const GelCoat coat = SpreadGel(SkinBlock(3.0), nullptr, {LinearProbe()}, {}, {}, Amount(3.0));
  EXPECT_EQ(coat.coupled, 1.0);
  for (const GelBeam& beam : coat.face) {
    EXPECT_NEAR(beam.gelMm, 3.0, 0.3);
    EXPECT_EQ(beam.airMm, 0.0);
    EXPECT_NEAR(beam.start.z(), 0.0, 1e-9);
  }
  EXPECT_NEAR(coat.volumeMm3, 3000.0, 120.0);
  EXPECT_EQ(coat.report.gone, 0);
  // Its surface lies up to a quarter of a cell outside, so that cracks between particles are no air.
  EXPECT_GT(LevelVolume(coat, -60.0, 3.0), 3000.0);
  EXPECT_LT(LevelVolume(coat, -60.0, 3.0), 1.2 * 3000.0);
}

TEST(GelCoat, LeavesAirWhereItDoesNotReach)
{
  const GelCoat coat = SpreadGel(SkinBlock(3.0), nullptr, {LinearProbe()}, {}, {}, Amount(0.3, 0.5));
  const double share = 300.0 / 3.0 / (16.0 * 12.0); // of the face, were its sides straight
  EXPECT_NEAR(coat.coupled, share, 0.25 * share);
  const GelBeam &middle = coat.face[24 * 48 + 24], &corner = coat.face[0];
  EXPECT_TRUE(middle.couples);
  EXPECT_NEAR(middle.gelMm, 3.0, 0.3);
  EXPECT_FALSE(corner.couples);
  EXPECT_TRUE(corner.meetsSkin);
  EXPECT_NEAR(corner.airMm, 3.0, 0.3);
}

TEST(GelCoat, WithoutGelThereIsAir)
{
  const GelCoat coat = SpreadGel(SkinBlock(3.0), nullptr, {LinearProbe()}, {}, {}, Amount(0.0));
  EXPECT_EQ(coat.coupled, 0.0);
  EXPECT_EQ(coat.volumeMm3, 0.0);
  EXPECT_NEAR(coat.face[100].airMm, 3.0, 0.3);
  EXPECT_LT(*std::max_element(coat.level.begin(), coat.level.end()), 0.0f);
}

// The face comes to rest 6 mm below where the skin was, and that gives way to 2 mm in front of it. When they first meet nearly
// all is squeezed out to the sides; not all of it comes back.
TEST(GelCoat, IsSqueezedOutByTheProbe)
{
  ECHORAMA_SKIP_SANITIZED();
  const TissueSurface rest = SkinBlock(-6.0), pressed = SkinBlock(2.0);
  const GelCoat coat = SpreadGel(rest, &pressed, {LinearProbe()}, {}, {}, Amount(2.5));
  EXPECT_GT(coat.coupled, 0.8);
  EXPECT_NEAR(coat.volumeMm3, 2500.0, 100.0);
  EXPECT_GT(LevelVolume(coat, -60.0, 2.0), 2500.0);
  EXPECT_LT(LevelVolume(coat, -60.0, 2.0), 1.2 * 2500.0);
  EXPECT_GT(LevelVolume(coat, -60.0, 0.0), 2500.0 - 1.2 * 26.0 * 22.0 * 2.0);
  for (const GelBeam& beam : coat.face)
    EXPECT_NEAR(beam.gelMm + beam.airMm, 2.0, 0.3);
}

// A probe that looks along another axis of another place.
TEST(GelCoat, TurnsWithTheWorld)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(Vector3d(0.8, -1.3, 0.4));
  pose.translation() = Vector3d(100, -250, 30);
  const GelCoat here = SpreadGel(SkinBlock(3.0), nullptr, {LinearProbe()}, {}, {}, Amount(0.3, 0.5));
  const GelCoat there = SpreadGel(SkinBlock(3.0, pose), nullptr, {LinearProbe(pose)}, {}, {}, Amount(0.3, 0.5));
  EXPECT_NEAR(there.coupled, here.coupled, 0.02);
  EXPECT_NEAR(there.volumeMm3, here.volumeMm3, 1.0);
  EXPECT_LT((there.face[7].start - pose * here.face[7].start).norm(), 1e-9);
  EXPECT_LT((there.grid.IndexToWorld() * Vector3d(3, 4, 5) - pose * (here.grid.IndexToWorld() * Vector3d(3, 4, 5))).norm(), 0.1);
}

TEST(GelCoat, DoesNotDependOnThreads)
{
  const auto levels = [](int threads) {
    const ThreadLimit limit(threads);
    return SpreadGel(SkinBlock(3.0), nullptr, {LinearProbe()}, {}, {}, Amount(0.3, 0.5)).level;
  };
  EXPECT_EQ(levels(1), levels(2));
}

TEST(GelCoat, RefusesWhatItCannotPutOn)
{
  const TissueSurface skin = SkinBlock(3.0);
  EXPECT_THROW(SpreadGel(skin, nullptr, {}, {}, {}, Amount(1.0)), Error);
  TissueSurface other = skin;
  other.points.pop_back();
  EXPECT_THROW(SpreadGel(skin, &other, {LinearProbe()}, {}, {}, Amount(1.0)), Error);
  EXPECT_THROW(SpreadGel(skin, nullptr, {LinearProbe()}, {}, {}, Amount(-1.0)), Error);
  EXPECT_THROW(SpreadGel(skin, nullptr, {LinearProbe()}, {}, {}, Amount(300.0)), Error) << "a cap of more than a metre";
  PlacedProbe wider = LinearProbe();
  wider.geometry.fanWidth = 35.0;
  EXPECT_THROW(SpreadGel(skin, nullptr, {LinearProbe(), wider}, {}, {}, Amount(1.0)), Error);
  TissueSurface behind = SkinBlock(3.0);
  behind.Append(SkinBlock(-400.0));
  EXPECT_THROW(SpreadGel(behind, nullptr, {LinearProbe()}, {}, {}, Amount(1.0)), Error) << "no clear way";
  const Progress stop([](double fraction) { return fraction < 0.3; });
  EXPECT_THROW(SpreadGel(skin, nullptr, {LinearProbe()}, {}, {}, Amount(1.0), stop), Error);
}
