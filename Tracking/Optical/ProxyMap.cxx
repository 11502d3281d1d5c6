// SPDX-License-Identifier: BSD-3-Clause
// Some 700 triangles are searched one by one, as the dissertation does.
#include "ProxyMap.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>

namespace echorama {

using Eigen::Vector2d;
using Eigen::Vector3d;

ProxyMap::ProxyMap(TriangleSurface proxy, std::vector<Vector2d> pixels, const Vector3d& eye,
                   std::shared_ptr<const TrackedSkin> skin)
  : proxy_(std::move(proxy)), pixels_(std::move(pixels)), eye_(eye), skin_(std::move(skin))
{
  if (!skin_ || !eye.allFinite())
    throw Error(Error::Kind::BadInput, "the proxy's map needs a skin, and an eye that is finite");
  if (pixels_.size() != proxy_.points.size())
    throw Error(Error::Kind::BadInput, "the proxy has " + std::to_string(proxy_.points.size()) + " points, and there are " +
                                           std::to_string(pixels_.size()) + " pixels");
  auto& triangles = proxy_.triangles;
  for (const auto& triangle : triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= pixels_.size() || !proxy_.points[corner].allFinite())
        throw Error(Error::Kind::BadInput,
                    "a triangle of the proxy names point " + std::to_string(corner) + ", which is not there or not finite");
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                 [this](const auto& t) {
                                   return !(pixels_[t[0]].allFinite() && pixels_[t[1]].allFinite() && pixels_[t[2]].allFinite());
                                 }),
                  triangles.end());
  if (triangles.empty())
    throw Error(Error::Kind::BadInput, "no triangle of the proxy was seen");
}

MappedPoint ProxyMap::Map(const Vector2d& pixel, const Eigen::Matrix2d& covariance) const
{
  MappedPoint mapped;
  if (!pixel.allFinite() || !covariance.allFinite())
    return mapped;
  double nearest = std::numeric_limits<double>::infinity();
  Vector3d toProxy = Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> byPixel = Eigen::Matrix<double, 3, 2>::Zero();
  for (const auto& [a, b, c] : proxy_.triangles) {
    Eigen::Matrix2d edges;
    edges << pixels_[b] - pixels_[a], pixels_[c] - pixels_[a];
    if (!(std::abs(edges.determinant()) > 1e-12))
      continue;
    const Eigen::Matrix2d inverse = edges.inverse();
    const Vector2d weights = inverse * (pixel - pixels_[a]);
    if (!(weights.minCoeff() >= -1e-9 && weights.sum() <= 1.0 + 1e-9))
      continue;
    const Vector3d corner = proxy_.points[a].cast<double>();
    Eigen::Matrix<double, 3, 2> sides;
    sides << proxy_.points[b].cast<double>() - corner, proxy_.points[c].cast<double>() - corner;
    const Vector3d there = corner + sides * weights - eye_;
    if (there.norm() < nearest) {
      nearest = there.norm();
      toProxy = there;
      byPixel = sides * inverse;
    }
  }
  if (!std::isfinite(nearest))
    return mapped;
  const auto hit = skin_->Along(eye_, toProxy);
  if (!hit) {
    mapped.status = MappedPoint::Status::NoSkin;
    return mapped;
  }
  const Vector3d along = toProxy / nearest;
  mapped.status = MappedPoint::Status::Mapped;
  mapped.point = hit->point;
  mapped.normal = hit->normal.dot(along) >= 0.0 ? hit->normal : Vector3d(-hit->normal);
  const double cosine = mapped.normal.dot(along);
  mapped.incidenceDegrees = std::acos(std::clamp(cosine, 0.0, 1.0)) * DegreesPerRadian;
  // What moves on the proxy moves on the skin: larger by the distance, and within its tangent plane.
  const Eigen::Matrix3d onSkin = Eigen::Matrix3d::Identity() - along * mapped.normal.transpose() / std::max(cosine, 1e-3);
  const Eigen::Matrix<double, 3, 2> by = hit->distanceMm / nearest * onSkin * byPixel;
  mapped.covariance = by * covariance * by.transpose();
  return mapped;
}

} // namespace echorama
