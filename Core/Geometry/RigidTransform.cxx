// SPDX-License-Identifier: BSD-3-Clause
// Series replace the quotients sin(a)/a and its kin near a = 0; near a = pi the axis is read from the symmetric part of
// the rotation (through the quaternion), because the antisymmetric part vanishes there.
#include "Core/Geometry/RigidTransform.h"
#include <cmath>
#include <Eigen/SVD>

namespace echorama {

Eigen::Matrix3d Hat(const Eigen::Vector3d& v)
{
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

namespace {

// (1 - cos a) / a^2 and (a - sin a) / a^3
double CosineQuotient(double a)
{
  if (a < 1e-2)
    return 0.5 - a * a / 24.0 + a * a * a * a / 720.0;
  const double half = std::sin(0.5 * a);
  return 2.0 * half * half / (a * a);
}
double SineQuotient(double a)
{
  return a < 1e-2 ? 1.0 / 6.0 - a * a / 120.0 + a * a * a * a / 5040.0 : (a - std::sin(a)) / (a * a * a);
}

// The Jacobian V of SE(3): the translation of Exp is V times the twist's translational part.
Eigen::Matrix3d TranslationJacobian(const Eigen::Vector3d& v)
{
  const Eigen::Matrix3d W = Hat(v);
  const double a = v.norm();
  return Eigen::Matrix3d::Identity() + CosineQuotient(a) * W + SineQuotient(a) * W * W;
}

} // namespace

Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& v)
{
  const Eigen::Matrix3d W = Hat(v);
  const double a = v.norm();
  const double s = a < 1e-2 ? 1.0 - a * a / 6.0 + a * a * a * a / 120.0 : std::sin(a) / a;
  return Eigen::Matrix3d::Identity() + s * W + CosineQuotient(a) * W * W;
}

Eigen::Vector3d LogRotation(const Eigen::Matrix3d& R)
{
  Eigen::Quaterniond q(R);
  q.normalize();
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double s = v.norm(), w = sign * q.w();
  if (s < 1e-8) // angle / sin(angle / 2) = 2 to second order
    return 2.0 * v;
  return v * (2.0 * std::atan2(s, w) / s);
}

Pose Exp(const Twist& twist)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(twist.tail<3>());
  pose.translation() = TranslationJacobian(twist.tail<3>()) * twist.head<3>();
  return pose;
}

Twist Log(const Pose& pose)
{
  Twist twist;
  twist.tail<3>() = LogRotation(pose.linear());
  twist.head<3>() = TranslationJacobian(twist.tail<3>()).partialPivLu().solve(pose.translation());
  return twist;
}

Pose Interpolate(const Pose& a, const Pose& b, double t)
{
  Pose pose = Pose::Identity();
  pose.linear() = a.linear() * ExpRotation(t * LogRotation(a.linear().transpose() * b.linear()));
  pose.translation() = (1.0 - t) * a.translation() + t * b.translation();
  return pose;
}

Pose MotionAbout(const Eigen::Vector3d& centre, const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(rotation);
  pose.translation() = centre - pose.linear() * centre + translation;
  return pose;
}

double RotationAngle(const Pose& pose)
{
  return LogRotation(pose.linear()).norm();
}

Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& M)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const bool isMirror = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0;
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, isMirror ? -1.0 : 1.0).asDiagonal() * svd.matrixV().transpose();
}

bool IsRotation(const Eigen::Matrix3d& M, double tolerance)
{
  return M.allFinite() && (M.transpose() * M - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= tolerance &&
         M.determinant() > 0.0;
}

} // namespace echorama
