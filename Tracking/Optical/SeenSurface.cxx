// SPDX-License-Identifier: BSD-3-Clause
#include "SeenSurface.h"
#include "Core/Base/Error.h"
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {

DomeSurface::DomeSurface(const Eigen::Vector3d& radiiMm) : radii_(radiiMm)
{
  if (!(radii_.allFinite() && radii_.minCoeff() > 0.0))
    throw Error(Error::Kind::InvalidParameter, "the radii of a dome must be above 0");
}

std::optional<SeenSurface::Hit> DomeSurface::FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  const Eigen::Vector3d o = origin.cwiseQuotient(radii_), d = direction.cwiseQuotient(radii_);
  const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - 1.0;
  const double root = b * b - a * c;
  if (!(root >= 0.0 && a > 0.0))
    return std::nullopt;
  for (const double sign : {-1.0, 1.0}) {
    const double t = (-b + sign * std::sqrt(root)) / a;
    const Eigen::Vector3d point = origin + t * direction;
    if (t <= 1e-9 || point.z() < 0.0)
      continue;
    Eigen::Vector3d normal = point.cwiseQuotient(radii_.cwiseProduct(radii_)).normalized();
    if (normal.dot(direction) > 0.0)
      normal = -normal;
    return Hit{point, normal};
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> DomeSurface::Above(double x, double y) const
{
  const double rest = 1.0 - x * x / (radii_.x() * radii_.x()) - y * y / (radii_.y() * radii_.y());
  if (!(rest >= 0.0))
    return std::nullopt;
  return Eigen::Vector3d(x, y, radii_.z() * std::sqrt(rest));
}

} // namespace echorama
