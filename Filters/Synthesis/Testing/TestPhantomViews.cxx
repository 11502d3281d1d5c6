// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Synthesis/Phantom.h"
#include "Filters/Synthesis/PhantomViews.h"
#include <algorithm>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

// How far two poses are apart: the largest of turn (radians) and move (mm).
double Apart(const Pose& a, const Pose& b)
{
  const Pose between = a.inverse() * b;
  return std::max(RotationAngle(between), between.translation().norm());
}

} // namespace

TEST(PhantomViews, NeighboursOverlapAsStated)
{
  const ProbeGeometry probe = PhantomParameters().probe;
  for (const double overlap : {0.3, 0.55, 0.8}) {
    const auto views = PhantomViews(probe, 4, overlap);
    ASSERT_EQ(views.size(), 4u);
    for (std::size_t i = 0; i + 1 < views.size(); ++i) {
      const Pose step = views[i].probeToWorld.inverse() * views[i + 1].probeToWorld;
      EXPECT_NEAR(OverlapFraction(probe, step), overlap, 0.01);
      EXPECT_GT(RotationAngle(step), 0.02);
    }
  }
  EXPECT_EQ(OverlapFraction(probe, Pose::Identity()), 1.0);
  Pose away = Pose::Identity();
  away.translation().x() = 1000.0;
  EXPECT_EQ(OverlapFraction(probe, away), 0.0);
}

TEST(PhantomViews, TheSetIsCentredAndItsGainsDiffer)
{
  const auto views = PhantomViews(PhantomParameters().probe, 3);
  EXPECT_LT(Apart(views[1].probeToWorld, Pose::Identity()), 1e-10);
  EXPECT_LT(Apart(views[0].probeToWorld.inverse(), views[2].probeToWorld), 1e-10);
  EXPECT_NE(views[0].gainDb, views[1].gainDb);
  EXPECT_NE(views[1].gainDb, views[2].gainDb);
}

TEST(PhantomViews, BadRequestsAreRefused)
{
  const ProbeGeometry probe = PhantomParameters().probe;
  EXPECT_THROW(PhantomViews(probe, 0), Error);
  EXPECT_THROW(PhantomViews(probe, 3, 0.0), Error);
  EXPECT_THROW(PhantomViews(probe, 3, 1.0), Error);
  EXPECT_THROW(PhantomViews(probe, 3, std::numeric_limits<double>::quiet_NaN()), Error);
  EXPECT_THROW(PhantomViews(ProbeGeometry(), 3), Error);
}

TEST(KnockedPose, HasTheStatedSizeAboutTheCentre)
{
  const Eigen::Vector3d centre(10, -20, 60);
  for (std::uint64_t item = 0; item < 20; ++item) {
    const Pose knock = KnockedPose(5, item, 8.0, 6.0, centre);
    EXPECT_NEAR((knock * centre - centre).norm(), 8.0, 1e-9);
    EXPECT_NEAR(RotationAngle(knock), 6.0 * 0.017453292519943295, 1e-9);
    EXPECT_TRUE(IsRotation(knock.linear(), 1e-12));
    EXPECT_LT(Apart(knock, KnockedPose(5, item, 8.0, 6.0, centre)), 1e-12);
    EXPECT_GT(Apart(knock, KnockedPose(5, item + 1, 8.0, 6.0, centre)), 0.01);
    EXPECT_GT(Apart(knock, KnockedPose(6, item, 8.0, 6.0, centre)), 0.01);
  }
  EXPECT_LT(Apart(KnockedPose(1, 1, 0.0, 0.0, centre), Pose::Identity()), 1e-12);
  EXPECT_THROW(KnockedPose(1, 1, -1.0, 0.0, centre), Error);
  EXPECT_THROW(KnockedPose(1, 1, 1.0, std::numeric_limits<double>::infinity(), centre), Error);
}
