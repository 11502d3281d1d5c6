// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
constexpr double pi = Pi;

// Angles at which the formulas change or lose digits.
const double angles[] = {0.0, 1e-300, 1e-12,  1e-9, 1e-8, 3e-8,   1e-5,      1e-3,      0.00999, 0.01,    0.01001,
                         0.5, 1.5,    pi / 2, 2.5,  3.0,  3.1415, pi - 1e-6, pi - 1e-9, pi,      -pi / 3, -pi + 1e-8};

// The matrix exponential of a twist by its series, halved often enough to converge at once.
Eigen::Matrix4d SeriesExponential(const Twist& twist)
{
  Eigen::Matrix4d X = Eigen::Matrix4d::Zero();
  const Eigen::Vector3d w = twist.tail<3>();
  X.topLeftCorner<3, 3>() << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  X.topRightCorner<3, 1>() = twist.head<3>();
  X /= 256.0;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int n = 1; n < 20; ++n) {
    term = term * X / n;
    sum += term;
  }
  for (int i = 0; i < 8; ++i)
    sum = sum * sum;
  return sum;
}

// The largest difference of two entries. (A loop: GCC 12 warns of its own headers in Eigen's reduction of 16 doubles.)
double Difference(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b)
{
  double largest = 0.0;
  for (int i = 0; i < 16; ++i)
    largest = std::fmax(largest, std::abs(a.data()[i] - b.data()[i]));
  return largest;
}

Twist TwistOf(const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation)
{
  Twist twist;
  twist << translation, rotation;
  return twist;
}

TEST(RigidTransform, ExpIsTheMatrixExponential)
{
  Random random(1);
  for (const double angle : angles)
    for (int i = 0; i < 10; ++i) {
      const Twist twist = TwistOf(50.0 * random.Direction(), angle * random.Direction());
      EXPECT_LT(Difference(Exp(twist).matrix(), SeriesExponential(twist)), 1e-11) << angle;
      EXPECT_LT((ExpRotation(twist.tail<3>()) - Exp(twist).linear()).cwiseAbs().maxCoeff(), 1e-15) << angle;
      EXPECT_TRUE(IsRotation(ExpRotation(twist.tail<3>()), 1e-14)) << angle;
    }
}

TEST(RigidTransform, LogIsItsInverse)
{
  Random random(2);
  for (const double angle : angles)
    for (int i = 0; i < 10; ++i) {
      const Twist twist = TwistOf(50.0 * random.Direction(), angle * random.Direction());
      const Twist back = Log(Exp(twist));
      EXPECT_LT(Difference(Exp(back).matrix(), Exp(twist).matrix()), 1e-11) << angle;
      if (std::abs(angle) < 3.1) {
        EXPECT_LT((back - twist).norm(), 1e-11) << angle;
      }
      EXPECT_LE(back.tail<3>().norm(), pi + 1e-15);
    }
  // Small rotations keep their relative accuracy.
  EXPECT_NEAR(LogRotation(ExpRotation({1e-12, 0, 0})).x(), 1e-12, 1e-24);
}

TEST(RigidTransform, LogTakesTheShortWay)
{
  const Eigen::Vector3d v = LogRotation(ExpRotation({0, 0, 2 * pi - 0.5}));
  EXPECT_NEAR(v.z(), -0.5, 1e-14);
  EXPECT_NEAR(RotationAngle(Exp(TwistOf({1, 2, 3}, {0, 4.0, 0}))), 2 * pi - 4.0, 1e-14);
}

TEST(RigidTransform, InterpolatesBetweenItsEnds)
{
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Pose a = Exp(TwistOf(20 * random.Direction(), random.Uniform(0, 3) * random.Direction()));
    const Pose b = Exp(TwistOf(20 * random.Direction(), random.Uniform(0, 3) * random.Direction()));
    EXPECT_LT(Difference(Interpolate(a, b, 0).matrix(), a.matrix()), 1e-14);
    EXPECT_LT(Difference(Interpolate(a, b, 1).matrix(), b.matrix()), 1e-13);
    const Pose middle = Interpolate(a, b, 0.5);
    EXPECT_LT((middle.translation() - 0.5 * (a.translation() + b.translation())).norm(), 1e-13);
    EXPECT_NEAR(RotationAngle(a.inverse() * middle), 0.5 * RotationAngle(a.inverse() * b), 1e-13);
    EXPECT_TRUE(IsRotation(middle.linear(), 1e-13));
  }
}

TEST(RigidTransform, MotionAboutACentreLeavesItThere)
{
  const Eigen::Vector3d centre(10, -20, 30), shift(1, 2, 3);
  const Pose motion = MotionAbout(centre, {0.1, 0.2, -0.3}, shift);
  EXPECT_LT((motion * centre - centre - shift).norm(), 1e-13);
  EXPECT_NEAR(RotationAngle(motion), std::sqrt(0.14), 1e-14);
}

TEST(RigidTransform, NoRotationIsNearerThanTheNearest)
{
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    Eigen::Matrix3d M = ExpRotation(3.0 * random.Direction());
    for (int k = 0; k < 9; ++k)
      M(k / 3, k % 3) += random.Uniform(-0.4, 0.4);
    if (i % 2 == 1)
      M.col(0) = -M.col(0); // nearly a mirror
    const Eigen::Matrix3d nearest = NearestRotation(M);
    ASSERT_TRUE(IsRotation(nearest, 1e-13));
    for (int k = 0; k < 20; ++k) {
      const Eigen::Matrix3d other = ExpRotation(random.Uniform(0.0, k < 10 ? 0.1 : 3.0) * random.Direction()) * nearest;
      EXPECT_LE((nearest - M).norm(), (other - M).norm() + 1e-13);
    }
  }
}

TEST(RigidTransform, WhatIsARotation)
{
  EXPECT_TRUE(IsRotation(Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(IsRotation(ExpRotation({1, 2, 3})));
  EXPECT_FALSE(IsRotation(Eigen::Matrix3d::Zero()));
  EXPECT_FALSE(IsRotation(-Eigen::Matrix3d::Identity())) << "a mirror";
  EXPECT_FALSE(IsRotation(1.001 * Eigen::Matrix3d::Identity())) << "scaled";
  Eigen::Matrix3d sheared = Eigen::Matrix3d::Identity();
  sheared(0, 1) = 1e-3;
  EXPECT_FALSE(IsRotation(sheared));
  EXPECT_TRUE(IsRotation(sheared, 1e-2));
  EXPECT_FALSE(IsRotation(Eigen::Matrix3d::Constant(std::nan(""))));
}

} // namespace
