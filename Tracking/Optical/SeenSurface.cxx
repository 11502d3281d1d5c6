// SPDX-License-Identifier: BSD-3-Clause
#include "SeenSurface.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <rtcore.h>
#include <string>

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

struct MeshSurface::Tree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Tree()
  {
    if (scene)
      rtcReleaseScene(scene);
    if (device)
      rtcReleaseDevice(device);
  }
};

MeshSurface::MeshSurface(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles)
  : tree_(std::make_unique<Tree>())
{
  if (triangles.empty())
    throw Error(Error::Kind::BadInput, "a skin without triangles cannot be seen");
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= points.size())
        throw Error(Error::Kind::BadInput, "a triangle of the skin names a point that it does not have");
  for (const Eigen::Vector3f& point : points)
    if (!point.allFinite())
      throw Error(Error::Kind::BadInput, "a point of the skin is not finite");
  tree_->device = rtcNewDevice(nullptr);
  if (!tree_->device)
    throw Error(Error::Kind::NotPossible, "Embree does not start on this machine");
  tree_->scene = rtcNewScene(tree_->device);
  rtcSetSceneFlags(tree_->scene, RTC_SCENE_FLAG_ROBUST); // no ray slips between two triangles
  RTCGeometry geometry = rtcNewGeometry(tree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const coordinates = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.size()));
  auto* const corners = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size()));
  if (coordinates && corners) {
    for (std::size_t i = 0; i < points.size(); ++i)
      std::copy_n(points[i].data(), 3, coordinates + 3 * i);
    for (std::size_t i = 0; i < triangles.size(); ++i)
      std::copy_n(triangles[i].data(), 3, corners + 3 * i);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tree_->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(tree_->scene);
  const RTCError problem = rtcGetDeviceError(tree_->device);
  if (problem == RTC_ERROR_OUT_OF_MEMORY || !coordinates || !corners)
    throw Error(Error::Kind::TooLarge, "the skin's " + std::to_string(triangles.size()) + " triangles do not fit in memory");
  if (problem != RTC_ERROR_NONE)
    throw Error(Error::Kind::NotPossible, "Embree cannot take the skin (its error " + std::to_string(problem) + ")");
}

MeshSurface::~MeshSurface() = default;

std::optional<SeenSurface::Hit> MeshSurface::FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin.x());
  ray.ray.org_y = static_cast<float>(origin.y());
  ray.ray.org_z = static_cast<float>(origin.z());
  ray.ray.dir_x = static_cast<float>(direction.x());
  ray.ray.dir_y = static_cast<float>(direction.y());
  ray.ray.dir_z = static_cast<float>(direction.z());
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR < 4
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(tree_->scene, &context, &ray);
#else
  rtcIntersect1(tree_->scene, &ray, nullptr);
#endif
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
    return std::nullopt;
  Eigen::Vector3d normal = Eigen::Vector3f(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z).cast<double>().normalized();
  if (normal.dot(direction) > 0.0)
    normal = -normal;
  return Hit{origin + static_cast<double>(ray.ray.tfar) * direction, normal};
}

} // namespace echorama
