// SPDX-License-Identifier: BSD-3-Clause
// Radius and angle are one-dimensional: Newton's method from the angle that no distortion would give, kept within the range in
// which the radius grows.
#include "FisheyeLens.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <cmath>

namespace echorama {

ParameterList Describe(FisheyeLens& p)
{
  return {
      Parameter("Width", p.width, {16, 8192}, "pixels", "Of the picture."),
      Parameter("Height", p.height, {16, 8192}, "pixels", "Of the picture."),
      Parameter("Focal", p.focal, {1, 1e5}, "pixels", "Pixels per radian at the axis."),
      Parameter("CentreX", p.centreX, {-1e5, 1e5}, "pixels", "Where the axis meets the sensor."),
      Parameter("CentreY", p.centreY, {-1e5, 1e5}, "pixels", "Where the axis meets the sensor."),
      Parameter("K1", p.k1, {-1, 1}, "", "Radial distortion: third power of the angle.").Advanced(),
      Parameter("K2", p.k2, {-1, 1}, "", "Fifth power.").Advanced(),
      Parameter("K3", p.k3, {-1, 1}, "", "Seventh power.").Advanced(),
      Parameter("K4", p.k4, {-1, 1}, "", "Ninth power.").Advanced(),
      Parameter("MaximumAngle", p.maximumAngle, {5, 130}, "degrees", "From the axis; nothing is seen beyond.").Advanced(),
  };
}

double FisheyeLens::Radius(double angle) const
{
  const double t = angle * angle;
  return angle * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4))));
}

double FisheyeLens::Growth(double angle) const
{
  const double t = angle * angle;
  return 1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4)));
}

void FisheyeLens::Check() const
{
  CheckRanges(*this);
  if (GrowsUpTo() < maximumAngle)
    throw Error(Error::Kind::InvalidParameter,
                "k1 to k4 of the lens fold the picture: its radius does not grow with the angle up to MaximumAngle");
}

double FisheyeLens::GrowsUpTo() const
{
  double reached = 0.0;
  for (int step = 0; step <= 200; ++step) {
    const double degrees = maximumAngle * step / 200.0;
    if (!(Growth(degrees / DegreesPerRadian) > 0.0))
      break;
    reached = degrees;
  }
  return reached;
}

std::optional<FisheyeLens::Projection> FisheyeLens::Differentiate(const Eigen::Vector3d& direction) const
{
  const double x = direction.x(), y = direction.y(), z = direction.z();
  const double across = std::hypot(x, y), squared = direction.squaredNorm();
  if (!(squared > 0.0) || (across < 1e-12 * std::sqrt(squared) && z < 0.0))
    return std::nullopt;
  const double angle = std::atan2(across, z);
  // Pixel = centre + focal * stretch * (x, y). At the axis the stretch is 1 / z; its change by the distance to the axis, over
  // that distance, stays finite and does not matter there.
  const bool atAxis = across < 1e-6 * std::sqrt(squared);
  const double growth = Growth(angle), stretch = atAxis ? 1.0 / z : Radius(angle) / across;
  const double byAcross = atAxis ? 0.0 : (growth * z / squared - stretch) / (across * across), byZ = -growth / squared;
  Projection p;
  p.pixel = {centreX + focal * stretch * x, centreY + focal * stretch * y};
  p.byDirection << stretch + x * x * byAcross, x * y * byAcross, x * byZ, x * y * byAcross, stretch + y * y * byAcross, y * byZ;
  p.byDirection *= focal;
  p.byLens << stretch * x, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, stretch * y, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0;
  double power = angle * angle * angle;
  for (int k = 3; k < 7; ++k, power *= angle * angle) {
    const double radius = atAxis ? 0.0 : focal * power / across;
    p.byLens(0, k) = radius * x;
    p.byLens(1, k) = radius * y;
  }
  return p;
}

std::optional<Eigen::Vector2d> FisheyeLens::Project(const Eigen::Vector3d& direction) const
{
  const double across = std::hypot(direction.x(), direction.y());
  const double angle = std::atan2(across, direction.z());
  if (!(angle <= maximumAngle / DegreesPerRadian) || (across == 0.0 && direction.z() == 0.0))
    return std::nullopt;
  const double scale = across > 0.0 ? focal * Radius(angle) / across : 0.0;
  return Eigen::Vector2d(centreX + scale * direction.x(), centreY + scale * direction.y());
}

std::optional<Eigen::Vector3d> FisheyeLens::Unproject(const Eigen::Vector2d& pixel) const
{
  const double x = (pixel.x() - centreX) / focal, y = (pixel.y() - centreY) / focal;
  const double radius = std::hypot(x, y), limit = maximumAngle / DegreesPerRadian;
  if (!(radius <= Radius(limit)))
    return std::nullopt;
  double angle = std::min(radius, limit);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const double step = (Radius(angle) - radius) / Growth(angle);
    angle = std::clamp(angle - step, 0.0, limit);
    if (std::abs(step) < 1e-14)
      break;
  }
  const double scale = radius > 0.0 ? std::sin(angle) / radius : 0.0;
  return Eigen::Vector3d(scale * x, scale * y, std::cos(angle));
}

} // namespace echorama
