// SPDX-License-Identifier: BSD-3-Clause
// Embree, and nothing of what its hits mean. Cost: some 0.4 s per million triangles on two cores.
#include "SceneTree.h"
#include "Core/Base/Error.h"
#include "EmbreeQuery.h"
#include <algorithm>
#include <tuple>

namespace echorama {
namespace {

bool CountMemory(void* bytes, ssize_t more, bool)
{
  *static_cast<std::atomic<std::int64_t>*>(bytes) += more;
  return true;
}

RTCRayHit RayOf(const SceneTree::Line& line, float near, float far)
{
  RTCRayHit ray;
  ray.ray.org_x = line.origin[0];
  ray.ray.org_y = line.origin[1];
  ray.ray.org_z = line.origin[2];
  ray.ray.dir_x = line.direction[0];
  ray.ray.dir_y = line.direction[1];
  ray.ray.dir_z = line.direction[2];
  ray.ray.tnear = near;
  ray.ray.tfar = far;
  ray.ray.time = 0.0f;
  ray.ray.mask = 0xffffffffu;
  ray.ray.id = 0;
  ray.ray.flags = 0;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

struct Collector {
  EmbreeQuery query; // first, as it asks for
  float slack, nearest, far;
  std::vector<SceneTree::Hit>* hits;
};

// Keeps a hit, and lets Embree look for others up to the slack behind the nearest one so far (and not only before this one).
// Filters may make the end of the ray nearer; this one sets it between the hit and where it was before, which Embree 3 and 4
// read back alike.
void CollectHit(const RTCFilterFunctionNArguments* arguments)
{
  auto& collector = *reinterpret_cast<Collector*>(arguments->context);
  auto& hits = *collector.hits;
  float& distance = RTCRayN_tfar(arguments->ray, 1, 0);
  const std::uint32_t triangle = RTCHitN_primID(arguments->hit, 1, 0);
  if (std::none_of(hits.begin(), hits.end(), [triangle](const SceneTree::Hit& hit) { return hit.triangle == triangle; }))
    hits.push_back({distance,
                    triangle,
                    {RTCHitN_Ng_x(arguments->hit, 1, 0), RTCHitN_Ng_y(arguments->hit, 1, 0), RTCHitN_Ng_z(arguments->hit, 1, 0)},
                    RTCHitN_u(arguments->hit, 1, 0),
                    RTCHitN_v(arguments->hit, 1, 0)});
  collector.nearest = std::min(collector.nearest, distance);
  distance = std::min(collector.nearest + collector.slack, collector.far);
}

} // namespace

void SceneTree::Release::operator()(RTCDeviceTy* device) const
{
  rtcReleaseDevice(device);
}

void SceneTree::Release::operator()(RTCSceneTy* scene) const
{
  rtcReleaseScene(scene);
}

SceneTree::SceneTree(const std::vector<Eigen::Vector3f>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                     const std::vector<std::uint32_t>& kept)
  : bytes_(std::make_unique<std::atomic<std::int64_t>>(0)), device_(rtcNewDevice(nullptr))
{
  RTCDevice device = device_.get();
  if (!device)
    throw Error(Error::Kind::NotPossible, "Embree does not start on this machine");
  rtcSetDeviceMemoryMonitorFunction(device, CountMemory, bytes_.get());
  scene_.reset(rtcNewScene(device));
  rtcSetSceneFlags(scene_.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | embreeQueryFilters));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const coordinates = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.size()));
  auto* const indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), kept.size()));
  if (coordinates && indices) {
    for (std::size_t i = 0; i < points.size(); ++i)
      std::copy_n(points[i].data(), 3, coordinates + 3 * i);
    for (std::size_t i = 0; i < kept.size(); ++i)
      std::copy_n(triangles[kept[i]].data(), 3, indices + 3 * i);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
  const RTCError problem = rtcGetDeviceError(device);
  if (problem == RTC_ERROR_OUT_OF_MEMORY || !coordinates || !indices)
    throw Error(Error::Kind::TooLarge, "the scene's " + std::to_string(kept.size()) + " triangles do not fit in memory");
  if (problem != RTC_ERROR_NONE)
    throw Error(Error::Kind::NotPossible, "Embree cannot build the scene (its error " + std::to_string(problem) + ")");
}

bool SceneTree::FirstHits(const Line& line, float near, float far, float slack, std::vector<Hit>& hits) const
{
  hits.clear();
  RTCRayHit ray = RayOf(line, near, far);
  Collector collector{{}, slack, far, far, &hits};
  collector.query.Ask(scene_.get(), ray, CollectHit);
  const float last = collector.nearest + slack;
  hits.erase(std::remove_if(hits.begin(), hits.end(), [last](const Hit& hit) { return hit.distance > last; }), hits.end());
  // Whatever the order in which the tree came upon them.
  std::sort(hits.begin(), hits.end(),
            [](const Hit& a, const Hit& b) { return std::tie(a.distance, a.triangle) < std::tie(b.distance, b.triangle); });
  return !hits.empty();
}

} // namespace echorama
