// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include <algorithm>
#include <cmath>
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

// Along +x and a little along +y, turning by -y: so the beams of views further on look back at the same body.
TEST(PhantomViews, TheProbeFollowsABodyThatBulgesTowardsIt)
{
  for (const int count : {2, 5}) {
    const auto views = PhantomViews(PhantomParameters().probe, count);
    ASSERT_EQ(static_cast<int>(views.size()), count);
    EXPECT_LT(Apart(views.front().probeToWorld.inverse(), views.back().probeToWorld), 1e-9) << "about the middle";
    const Pose& last = views.back().probeToWorld;
    EXPECT_GT(last.translation().x(), 1.0);
    EXPECT_GT(last.translation().y(), 0.1 * last.translation().x());
    EXPECT_LT(last.translation().y(), 0.5 * last.translation().x());
    EXPECT_LT(last.linear().col(2).x(), -0.01) << "its beams lean back";
    EXPECT_LT(LogRotation(last.linear()).y(), -0.7 * RotationAngle(last)) << "about the sweep's axis more than any other";
    for (const PhantomView& view : views)
      EXPECT_LE(std::abs(view.gainDb), 2.5);
  }
  const auto one = PhantomViews(PhantomParameters().probe, 1);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_LT(Apart(one[0].probeToWorld, Pose::Identity()), 1e-12);
}

TEST(PhantomViews, ShiftedBoxesOverlapByWhatIsLeftOfThem)
{
  const ProbeGeometry box = ProbeGeometry::Linear(48.0, 24.0, 0.0, 96.0); // cells of 1 x 0.5 x 2 mm
  const Eigen::Vector3d sizes(48.0, 24.0, 96.0);
  for (int axis = 0; axis < 3; ++axis)
    for (const double shift : {-12.0, 6.0}) {
      Pose pose = Pose::Identity();
      pose.translation()[axis] = shift;
      EXPECT_NEAR(OverlapFraction(box, pose), 1.0 - std::abs(shift) / sizes[axis], 1e-9) << axis << " " << shift;
    }
  Pose turned = Pose::Identity(); // by a quarter about the beams: a square of 24 of 48 mm is common
  turned.linear() = ExpRotation({0.0, 0.0, 0.5 * 3.14159265358979323846});
  EXPECT_NEAR(OverlapFraction(box, turned), 0.5, 1e-9);
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
  // The way and the axis have nothing to do with each other, and the ways of many knocks nothing with a direction.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double cosines = 0.0;
  for (std::uint64_t item = 0; item < 400; ++item) {
    const Pose knock = KnockedPose(5, item, 1.0, 10.0, centre);
    const Eigen::Vector3d way = knock * centre - centre;
    sum += way / 400.0;
    cosines += std::abs(way.dot(LogRotation(knock.linear()).normalized())) / 400.0;
  }
  EXPECT_LT(sum.norm(), 0.15);
  EXPECT_NEAR(cosines, 0.5, 0.06);
  EXPECT_THROW(KnockedPose(1, 1, 0.0, -1.0, centre), Error);
  EXPECT_THROW(KnockedPose(1, 1, 1.0, 1.0, Eigen::Vector3d(0.0, std::nan(""), 0.0)), Error);
  EXPECT_THROW(KnockedPose(1, 1, -1.0, 0.0, centre), Error);
  EXPECT_THROW(KnockedPose(1, 1, 1.0, std::numeric_limits<double>::infinity(), centre), Error);
}
