// SPDX-License-Identifier: BSD-3-Clause
// Points are kept relative to the centroid and moved by one map in single precision, voxels are their own mask (NaN where not
// real).
#include "VolumeOverlap.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ValidPoints.h"
#include "MetricBlock.h"
#include <algorithm>

namespace echorama {
namespace {

bool Holds(VolumeView<const float> voxels, const Map& m, const Eigen::Vector3f& p)
{
  const float at[3] = {m.xx * p.x() + m.xy * p.y() + m.xz * p.z() + m.x0, m.yx * p.x() + m.yy * p.y() + m.yz * p.z() + m.y0,
                       m.zx * p.x() + m.zy * p.y() + m.zz * p.z() + m.z0};
  int nearest[3];
  for (int axis = 0; axis < 3; ++axis) {
    const int last = voxels.Dimensions()[static_cast<std::size_t>(axis)] - 1;
    const float end = static_cast<float>(last);
    if (!(at[axis] >= -0.5f && at[axis] < end + 0.5f))
      return false;
    const float clamped = std::clamp(at[axis], 0.0f, end);
    const int cell = std::min(static_cast<int>(clamped), last - 1);
    nearest[axis] = cell + (clamped - static_cast<float>(cell) >= 0.5f ? 1 : 0);
  }
  const float value = voxels(nearest[0], nearest[1], nearest[2]);
  return value == value;
}

} // namespace

OverlapPoints::OverlapPoints(const PlacedVolume& volume, int count, std::uint64_t seed)
{
  const PyramidLevel& coarsest = volume.pyramid->back();
  const VolumeView<const float> own = coarsest.intensity.View();
  const Sampler<float> sampler(own, {});
  const Eigen::Affine3d toWorld = coarsest.geometry.IndexToWorld(), toIndex = coarsest.geometry.WorldToIndex();
  std::ptrdiff_t real = 0;
  centre = toWorld * ValidCentroid<float>(own, {}, real);
  for (const Eigen::Vector3d& index : ValidPoints<float>(own, {}, count, seed)) {
    const Eigen::Vector3d p = toWorld * index, at = toIndex * p;
    double value = 0.0;
    if (sampler.Linear(at.x(), at.y(), at.z(), value))
      fromCentre.push_back((p - centre).cast<float>());
  }
}

double OverlapOf(const OverlapPoints& points, const Pose& volumeToWorld, const std::vector<PlacedLevel>& fixed)
{
  Pose fromCentre = volumeToWorld;
  fromCentre.translation() = volumeToWorld * points.centre;
  std::vector<Map> maps;
  for (const PlacedLevel& placed : fixed)
    maps.push_back(
        MapOf(Eigen::Affine3d(placed.level->geometry.Moved(placed.volumeToWorld).WorldToIndex().matrix() * fromCentre.matrix())));
  std::ptrdiff_t covered = 0;
  for (const Eigen::Vector3f& p : points.fromCentre)
    for (std::size_t f = 0; f < fixed.size(); ++f)
      if (Holds(fixed[f].level->intensity.View(), maps[f], p)) {
        ++covered;
        break;
      }
  return points.fromCentre.empty() ? 0.0 : static_cast<double>(covered) / static_cast<double>(points.fromCentre.size());
}

double OverlapOf(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving, int points, std::uint64_t seed)
{
  std::vector<PlacedLevel> levels;
  for (const PlacedVolume& volume : fixed)
    levels.push_back({&volume.pyramid->back(), volume.volumeToWorld});
  return OverlapOf(OverlapPoints(moving, points, seed), moving.volumeToWorld, levels);
}

} // namespace echorama
