// SPDX-License-Identifier: BSD-3-Clause
#include "PoseEdit.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <cmath>

namespace echorama {
namespace {

Eigen::Matrix3d TurnAbout(int axis, double degrees)
{
  const double whole = std::remainder(degrees, 360.0);
  double cosine = std::cos(whole * RadiansPerDegree), sine = std::sin(whole * RadiansPerDegree);
  if (std::remainder(whole, 90.0) == 0.0) {
    cosine = std::round(cosine);
    sine = std::round(sine);
  }
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  matrix(a, a) = matrix(b, b) = cosine;
  matrix(b, a) = sine;
  matrix(a, b) = -sine;
  return matrix;
}

} // namespace

Pose PoseEdit::Motion() const
{
  Pose motion = Pose::Identity();
  motion.linear() = TurnAbout(2, degrees.z()) * TurnAbout(0, degrees.x()) * TurnAbout(1, degrees.y());
  motion.translation() = centreMm - motion.linear() * centreMm + translationMm;
  if (!motion.matrix().allFinite())
    throw Error(Error::Kind::InvalidParameter, "Translation, Rotation and Centre must be numbers");
  return motion;
}

} // namespace echorama
