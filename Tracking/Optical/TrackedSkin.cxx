// SPDX-License-Identifier: BSD-3-Clause
// The inner side of a wall is the skin, each point moved inwards along its normal: the same triangles, so that a place of the one
// is a place of the other.
#include "TrackedSkin.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <cmath>

namespace echorama {

using Eigen::Vector3d;

namespace {

Vector3d Blend(const std::vector<Eigen::Vector3f>& values, const TriangleTree::Triangle& triangle, const Vector3d& weights)
{
  return weights[0] * values[triangle[0]].cast<double>() + weights[1] * values[triangle[1]].cast<double>() +
         weights[2] * values[triangle[2]].cast<double>();
}

Vector3d FaceNormal(const std::vector<Eigen::Vector3f>& points,
                    const TriangleTree::Triangle& triangle) // as long as twice its area
{
  const Vector3d a = points[triangle[0]].cast<double>();
  return (points[triangle[1]].cast<double>() - a).cross(points[triangle[2]].cast<double>() - a);
}

// Which side of a wall is its inner one, triangles say: of closed bodies, and of the upper parts of such.
void FaceOutwards(TriangleSurface& skin)
{
  SurfaceCheckParameters edgesAlone;
  edgesAlone.selfIntersections = false;
  const SurfaceFault turned = CheckSurface(skin, edgesAlone).inconsistentEdges;
  if (turned.count > 0)
    throw Error(Error::Kind::BadInput, "the triangles of the skin face different sides, at " + std::to_string(turned.count) +
                                           " edges: where the inner side of its wall is nobody knows; orient them");
  Vector3d middle = Vector3d::Zero();
  for (const auto& triangle : skin.triangles)
    for (const std::uint32_t corner : triangle)
      middle += skin.points[corner].cast<double>() / (3.0 * static_cast<double>(skin.triangles.size()));
  double outwards = 0.0;
  for (const auto& triangle : skin.triangles)
    outwards += (skin.points[triangle[0]].cast<double>() - middle).dot(FaceNormal(skin.points, triangle));
  if (outwards < 0.0)
    for (auto& triangle : skin.triangles)
      std::swap(triangle[1], triangle[2]);
}

} // namespace

TrackedSkin::TrackedSkin(TriangleSurface skin, double wallMm) : skin_(std::move(skin)), wallMm_(wallMm)
{
  if (skin_.triangles.empty())
    throw Error(Error::Kind::BadInput, "the mesh of the skin has no triangles");
  if (!(wallMm >= 0.0 && wallMm <= 50.0))
    throw Error(Error::Kind::InvalidParameter, "the skin's wall is " + NumberText(wallMm) + " mm thick; it must be in [0, 50]");
  for (const auto& triangle : skin_.triangles)
    for (const std::uint32_t corner : triangle) {
      if (corner >= skin_.points.size())
        throw Error(Error::Kind::BadInput, "a triangle of the skin names point " + std::to_string(corner) + " of " +
                                               std::to_string(skin_.points.size()));
      if (!skin_.points[corner].allFinite())
        throw Error(Error::Kind::BadInput, "point " + std::to_string(corner) + " of the skin is not finite");
    }
  if (wallMm > 0.0)
    FaceOutwards(skin_);
  std::vector<Vector3d> sums(skin_.points.size(), Vector3d::Zero());
  for (const auto& triangle : skin_.triangles)
    for (const std::uint32_t corner : triangle)
      sums[corner] += FaceNormal(skin_.points, triangle);
  for (const Vector3d& sum : sums)
    normals_.push_back(sum.norm() > 0.0 ? Eigen::Vector3f(sum.normalized().cast<float>()) : Eigen::Vector3f(0.0f, 0.0f, 0.0f));
  skinTree_ = TriangleTree(skin_.points, skin_.triangles);
  if (wallMm > 0.0) {
    seen_ = skin_.points;
    for (std::size_t i = 0; i < seen_.size(); ++i)
      seen_[i] -= static_cast<float>(wallMm) * normals_[i];
    seenTree_ = TriangleTree(seen_, skin_.triangles);
  }
}

TrackedSkin::Place TrackedSkin::PlaceOf(const SurfacePoint& at, double distanceMm) const
{
  const auto& triangle = skin_.triangles[at.triangle];
  Place place;
  place.point = Blend(skin_.points, triangle, at.weights);
  place.normal = Blend(normals_, triangle, at.weights);
  if (!(place.normal.norm() > 1e-6))
    place.normal = FaceNormal(skin_.points, triangle);
  place.normal.normalize();
  place.seen = wallMm_ > 0.0 ? Blend(seen_, triangle, at.weights) : place.point;
  place.distanceMm = distanceMm;
  return place;
}

std::optional<TrackedSkin::Place> TrackedSkin::Along(const Vector3d& origin, const Vector3d& direction) const
{
  const auto hit = wallMm_ > 0.0 ? seenTree_.FirstHit(seen_, skin_.triangles, origin, direction)
                                 : skinTree_.FirstHit(skin_.points, skin_.triangles, origin, direction);
  if (!hit)
    return std::nullopt;
  return PlaceOf(hit->place, hit->distanceMm);
}

std::optional<TrackedSkin::Place> TrackedSkin::NearestTo(const Vector3d& point) const
{
  const auto nearest = skinTree_.NearestTo(skin_.points, skin_.triangles, point);
  if (!nearest)
    return std::nullopt;
  return PlaceOf(nearest->place, nearest->distanceMm);
}

std::optional<SeenSurface::Hit> TrackedSkin::FirstHit(const Vector3d& origin, const Vector3d& direction) const
{
  const bool isWall = wallMm_ > 0.0;
  const auto& points = isWall ? seen_ : skin_.points;
  const auto hit = (isWall ? seenTree_ : skinTree_).FirstHit(points, skin_.triangles, origin, direction);
  if (!hit)
    return std::nullopt;
  const auto& triangle = skin_.triangles[hit->place.triangle];
  Vector3d normal = FaceNormal(points, triangle).normalized();
  if (normal.dot(direction) > 0.0)
    normal = -normal;
  return Hit{Blend(points, triangle, hit->place.weights), normal};
}

} // namespace echorama
