// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A camera whose optics no model holds quite, in a shell, and what it sees of marks there: for tests and benchmarks.
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Filters/Tissue/Icosphere.h"
#include "Tracking/Optical/SurfaceMap.h"
#include <cmath>

namespace echorama::truth {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A lens with what Kannala and Brandt leave out: elements that are off their axis (Brown 1966), a sensor that is tilted.
struct TrueCamera {
  FisheyeLens lens;
  Pose cameraToShell = Pose::Identity();
  double decentringX = 0.0, decentringY = 0.0, tiltX = 0.0, tiltY = 0.0; ///< at a radius of 1 radian

  std::optional<Vector2d> PixelOf(const Vector3d& point) const
  {
    const auto plain = lens.Project(cameraToShell.inverse() * point);
    if (!plain)
      return std::nullopt;
    const Vector2d m((plain->x() - lens.centreX) / lens.focal, (plain->y() - lens.centreY) / lens.focal);
    const double squared = m.squaredNorm(), xy = m.x() * m.y();
    Vector2d off = m;
    off.x() += 2.0 * decentringX * xy + decentringY * (squared + 2.0 * m.x() * m.x());
    off.y() += decentringX * (squared + 2.0 * m.y() * m.y()) + 2.0 * decentringY * xy;
    off /= 1.0 + tiltX * m.x() + tiltY * m.y();
    return Vector2d(lens.centreX + lens.focal * off.x(), lens.centreY + lens.focal * off.y());
  }
  bool Sees(const TrackedSkin& skin, const Vector3d& point) const ///< nothing hides it, and the picture holds it
  {
    const Vector3d along = point - cameraToShell.translation();
    const auto hit = skin.Along(cameraToShell.translation(), along);
    const auto pixel = PixelOf(point);
    return hit && pixel && lens.Covers(*pixel) && (hit->seen - point).norm() < 1e-3 * along.norm();
  }
};

/// A sphere's upper part, or all of it, stretched to \a radii.
inline TriangleSurface Ellipsoid(const Vector3d& radii, int level, double above = -2.0)
{
  const Icosphere sphere = Icosphere::Make(level);
  TriangleSurface surface;
  for (const Vector3d& point : sphere.points)
    surface.points.push_back(point.cwiseProduct(radii).cast<float>());
  for (const auto& triangle : sphere.triangles)
    if (sphere.points[triangle[0]].z() > above && sphere.points[triangle[1]].z() > above &&
        sphere.points[triangle[2]].z() > above)
      surface.triangles.push_back(triangle);
  return surface;
}

/// Marks on the skin that the camera sees: about as many as asked for, spread over its picture up to \a mostDegrees from the
/// axis, observed with noise. \param noisePx \param placementMm standard deviations per axis: of the pixel, and of the hand
inline std::vector<SurfaceObservation> Observe(const TrueCamera& camera, const TrackedSkin& skin, int count, double mostDegrees,
                                               double noisePx, double placementMm, std::uint64_t seed)
{
  std::vector<SurfaceObservation> observations;
  constexpr double Golden = 2.399963229728653;
  for (int i = 0; i < count; ++i) { // a spiral of equal areas in the picture
    const double angle = std::sqrt((i + 0.5) / count) * mostDegrees / DegreesPerRadian, turn = Golden * i;
    const Vector3d direction(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
    const auto hit = skin.Along(camera.cameraToShell.translation(), camera.cameraToShell.linear() * direction);
    if (!hit)
      continue;
    Random random(seed, static_cast<std::uint64_t>(i));
    const Vector3d error = placementMm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    const auto pixel = camera.PixelOf(skin.NearestTo(hit->point + error)->seen);
    if (!pixel)
      continue;
    SurfaceObservation o;
    o.pixel = *pixel + noisePx * Vector2d(random.Normal(), random.Normal());
    o.covariance = noisePx * noisePx * Eigen::Matrix2d::Identity();
    o.point = hit->point;
    o.mark = i + 1;
    if (camera.lens.Covers(o.pixel))
      observations.push_back(o);
  }
  return observations;
}

} // namespace echorama::truth
