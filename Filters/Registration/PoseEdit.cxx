// SPDX-License-Identifier: BSD-3-Clause
#include "PoseEdit.h"
#include "Core/Base/Angles.h"
#include <cmath>

namespace echorama {

ParameterList Describe(PoseEdit& p)
{
  return {
      Parameter("Translation", p.translationMm, {}, "mm", "Motion along the axes of the world, after the rotation."),
      Parameter("Rotation", p.degrees, {}, "degrees", "Turns about the axes of the world: about y first, then x, then z."),
      Parameter("Centre", p.centreMm, {}, "mm", "The point that the rotation turns about."),
  };
}

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
  CheckRanges(*this);
  Pose motion = Pose::Identity();
  motion.linear() = TurnAbout(2, degrees.z()) * TurnAbout(0, degrees.x()) * TurnAbout(1, degrees.y());
  motion.translation() = centreMm - motion.linear() * centreMm + translationMm;
  return motion;
}

} // namespace echorama
