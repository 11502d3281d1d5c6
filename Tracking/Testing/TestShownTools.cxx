// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ShownTools.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

ToolPose At(const std::string& name, double x, TransformStatus status = TransformStatus::Valid)
{
  return {name, 1.0, NaN, Pose(Eigen::Translation3d(x, 0.0, 0.0)), status};
}

} // namespace

TEST(ShownTools, OnePerFrameInTheWorld)
{
  PoseStream stream;
  for (const ToolPose& pose : {At("ProbeToTracker", 10.0), At("ReferenceToTracker", 3.0), At("StylusToReference", 1.0),
                               At("StylusToTracker", 4.0), At("nonsense", 7.0)})
    stream.Add(pose);
  stream.Add(At("NeedleToTracker", 0.0, TransformStatus::Missing));
  const LiveTransforms transforms(stream);
  const auto shown = ShowTools(stream.Tools(), transforms, "Reference", NaN);
  ASSERT_EQ(shown.size(), 4u); // the stylus once
  EXPECT_EQ(shown[0].frame, "Needle");
  EXPECT_EQ(shown[0].status, TransformStatus::Missing);
  EXPECT_TRUE(shown[0].toWorld.isApprox(Eigen::Affine3d::Identity()));
  EXPECT_TRUE(std::isnan(shown[0].time));
  EXPECT_EQ(shown[1].name, "ProbeToTracker");
  EXPECT_EQ(shown[1].frame, "Probe");
  EXPECT_EQ(shown[1].status, TransformStatus::Valid);
  EXPECT_EQ(shown[1].time, 1.0);
  EXPECT_NEAR(shown[1].toWorld.translation().x(), 7.0, 1e-12);
  // The world itself lies where it is, and is as valid as the tracker sees it.
  EXPECT_EQ(shown[2].frame, "Reference");
  EXPECT_EQ(shown[2].status, TransformStatus::Valid);
  EXPECT_TRUE(shown[2].toWorld.isApprox(Eigen::Affine3d::Identity()));
  EXPECT_EQ(shown[3].frame, "Stylus");
}

TEST(ShownTools, AWorldThatIsNotSeenIsMissing)
{
  PoseStream stream;
  stream.Add(At("ReferenceToTracker", 3.0, TransformStatus::Missing));
  const auto shown = ShowTools(stream.Tools(), LiveTransforms(stream), "Reference", NaN);
  ASSERT_EQ(shown.size(), 1u);
  EXPECT_EQ(shown[0].status, TransformStatus::Missing);
}
