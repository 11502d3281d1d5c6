// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/MotionPath.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double pi = Pi;

Pose PoseOf(const Vector3d& position, const Vector3d& turn)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(turn);
  pose.translation() = position;
  return pose;
}

double Distance(const Pose& a, const Pose& b)
{
  return Log(a.inverse() * b).norm();
}

template <class F>
std::vector<TimedPose> Recorded(double seconds, double rate, F&& poseAt)
{
  std::vector<TimedPose> poses;
  for (int i = 0; i <= seconds * rate; ++i)
    poses.push_back({i / rate, poseAt(i / rate)});
  return poses;
}

std::string ReasonAgainst(std::vector<TimedPose> poses, const MotionSmoothing& smoothing = {})
{
  try {
    MotionPath path(std::move(poses), smoothing);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(MotionPath, ConstantVelocityStaysUpToItsEnds)
{
  // Uneven times, and a rotation of many turns.
  Random random(3);
  const auto truth = [](double t) {
    return PoseOf(Vector3d(5, -3, 40) + t * Vector3d(10, 20, -5), {0.0, 0.0, 0.0}) *
           PoseOf({0, 0, 0}, t * Vector3d(0.6, -1.0, 0.8));
  };
  std::vector<TimedPose> poses;
  for (double t = 0.0; t < 12.0; t += random.Uniform(0.01, 0.09))
    poses.push_back({t, truth(t)});
  for (const double sigma : {0.0, 0.001, 0.05, 0.3}) {
    const MotionPath path(poses, {sigma, 0.5});
    for (const TimedPose& pose : path.Poses())
      ASSERT_LT(Distance(pose.pose, truth(pose.time)), 1e-9) << sigma << " " << pose.time;
    for (double t = path.FirstTime(); t < path.LastTime(); t += 0.0137)
      ASSERT_LT(Distance(path.At(t), truth(t)), 1e-9) << sigma << " " << t;
  }
}

TEST(MotionPath, ACircleShrinksByTheKnownFactor)
{
  constexpr double radius = 50.0, w = 2.0 * pi * 0.5, sigma = 0.15;
  const auto circle = Recorded(10.0, 200.0, [&](double t) {
    return PoseOf(radius * Vector3d(std::cos(w * t), std::sin(w * t), 0), {0, 0, w * t});
  });
  const MotionPath path(circle, {sigma, 0.5});
  const double wanted = radius * std::exp(-0.5 * w * w * sigma * sigma);
  for (double t = 1.0; t < 9.0; t += 0.0173) {
    const Pose pose = path.At(t);
    ASSERT_NEAR(pose.translation().norm(), wanted, 2e-3 * radius * (1.0 - std::exp(-0.5 * w * w * sigma * sigma)) + 1e-3);
    ASSERT_NEAR(std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)), std::remainder(w * t, 2.0 * pi), 1e-9); // it turns evenly
  }
}

TEST(MotionPath, AWobbleOfTheRotationShrinksByTheKnownFactor)
{
  constexpr double amplitude = 0.3, w = 2.0 * pi * 2.0, sigma = 0.08;
  const Pose middle = PoseOf({1, 2, 3}, {2.0, -1.5, 1.0}); // near half a turn, where quaternions change their sign
  const Vector3d axis = Vector3d(1, 2, -2) / 3.0;
  const MotionPath path(Recorded(6.0, 400.0,
                                 [&](double t) {
                                   return middle * PoseOf({0, 0, 0}, amplitude * std::sin(w * t) * axis);
                                 }),
                        {sigma, 0.5});
  const double factor = std::exp(-0.5 * w * w * sigma * sigma);
  for (double t = 0.5; t < 5.5; t += 0.0331) {
    const Vector3d turn = LogRotation(middle.linear().transpose() * path.At(t).linear());
    ASSERT_LT((turn - factor * amplitude * std::sin(w * t) * axis).norm(), 1e-3 * amplitude);
  }
}

TEST(MotionPath, NoiseFallsByTheKnownFactor)
{
  constexpr double rate = 100.0, sigma = 0.1, mm = 0.7, radians = 0.01;
  Random random(11);
  const Pose rest = PoseOf({10, 20, 30}, {1.0, 2.0, -1.0});
  const auto noise = [&](double size) { return Vector3d(size * Vector3d(random.Normal(), random.Normal(), random.Normal())); };
  const MotionPath path(Recorded(200.0, rate,
                                 [&](double) {
                                   const Vector3d shift = noise(mm), turn = noise(radians);
                                   return PoseOf(rest.translation() + shift, {0, 0, 0}) *
                                          PoseOf({0, 0, 0}, LogRotation(rest.linear())) * PoseOf({0, 0, 0}, turn);
                                 }),
                        {sigma, 0.5});
  double position = 0.0, rotation = 0.0;
  int count = 0;
  for (const TimedPose& pose : path.Poses())
    if (pose.time > 1.0 && pose.time < 199.0) {
      position += (pose.pose.translation() - rest.translation()).squaredNorm() / 3.0;
      rotation += LogRotation(rest.linear().transpose() * pose.pose.linear()).squaredNorm() / 3.0;
      ++count;
    }
  const double factor = std::sqrt(1.0 / (rate * 2.0 * std::sqrt(pi) * sigma));
  EXPECT_NEAR(std::sqrt(position / count), factor * mm, 0.06 * factor * mm);
  EXPECT_NEAR(std::sqrt(rotation / count), factor * radians, 0.06 * factor * radians);
}

TEST(MotionPath, BridgesShortGapsAndRefusesLongOnes)
{
  const auto truth = [](double t) { return PoseOf({10 * t, 0, 0}, {0, 0.5 * t, 0}); };
  std::vector<TimedPose> poses;
  for (const TimedPose& pose : Recorded(10.0, 50.0, truth))
    if (!(pose.time > 2.0 && pose.time < 2.4) && !(pose.time > 6.0 && pose.time < 7.5))
      poses.push_back(pose);
  // What lies behind the long gap is shifted: nothing of it may be felt before it.
  for (TimedPose& pose : poses)
    if (pose.time >= 7.5)
      pose.pose.translation().y() = 1000.0;
  const MotionPath path(poses, {0.3, 0.5});
  EXPECT_LT(Distance(path.At(2.2), truth(2.2)), 1e-9);
  EXPECT_LT(Distance(path.At(6.0), truth(6.0)), 1e-9);
  EXPECT_NEAR(path.At(7.5).translation().y(), 1000.0, 1e-9);
  ASSERT_EQ(path.Gaps().size(), 1u);
  EXPECT_EQ(path.Gaps()[0].from, 6.0);
  EXPECT_EQ(path.Gaps()[0].to, 7.5);
  EXPECT_FALSE(path.Covers(7.0));
  EXPECT_TRUE(path.Covers(6.0));
  try {
    path.At(7.0);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
    EXPECT_STREQ(error.what(),
                 "motion path: at 7 s nothing is known: poses are missing from 6 to 7.5 s, which is too long to be bridged");
  }
  for (const double outside : {-0.001, 10.001, std::nan("")})
    EXPECT_THROW(path.At(outside), Error);
}

TEST(MotionPath, ASinglePoseIsAPath)
{
  const MotionPath path({{3.0, PoseOf({1, 2, 3}, {0, 0, 1})}});
  EXPECT_LT(Distance(path.At(3.0), PoseOf({1, 2, 3}, {0, 0, 1})), 1e-12);
  EXPECT_FALSE(path.Covers(3.1));
}

TEST(MotionPath, SaysWhichPoseIsWrong)
{
  const Pose good = Pose::Identity();
  Pose scaled = good;
  scaled.linear() *= 1.01;
  EXPECT_EQ(ReasonAgainst({}), "motion path: there is no pose");
  EXPECT_EQ(ReasonAgainst({{0.0, good}, {1.0, good}, {1.0, good}}),
            "motion path: pose 2 is of 1 s, and the one before it of 1 s; times must rise");
  EXPECT_EQ(ReasonAgainst({{0.0, good}, {std::nan(""), good}}), "motion path: the time of pose 1 is not finite");
  EXPECT_EQ(ReasonAgainst({{0.5, scaled}}), "motion path: pose 0 (at 0.5 s) is not a rotation and a translation");
  EXPECT_NE(ReasonAgainst({{0.0, good}}, {-1.0, 0.5}).find("WindowSeconds is -1 s; it must be in [0, 60]"), std::string::npos);
  EXPECT_NE(ReasonAgainst({{0.0, good}}, {0.1, 0.0}).find("LongestGapSeconds is 0 s; it must be in (0, 600]"), std::string::npos);
}
