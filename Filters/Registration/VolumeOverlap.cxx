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

double OverlapOf(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving, int points, std::uint64_t seed)
{
  const PyramidLevel& coarsest = moving.pyramid->back();
  const VolumeView<const float> own = coarsest.intensity.View();
  const Sampler<float> sampler(own, {});
  const Eigen::Affine3d toWorld = coarsest.geometry.IndexToWorld(), toIndex = coarsest.geometry.WorldToIndex();
  std::ptrdiff_t real = 0, all = 0, covered = 0;
  const Eigen::Vector3d centre = toWorld * ValidCentroid<float>(own, {}, real);
  Pose fromCentre = moving.volumeToWorld;
  fromCentre.translation() = moving.volumeToWorld * centre;
  std::vector<Map> maps;
  for (const PlacedVolume& volume : fixed)
    maps.push_back(MapOf(Eigen::Affine3d(volume.pyramid->back().geometry.Moved(volume.volumeToWorld).WorldToIndex().matrix() *
                                         fromCentre.matrix())));
  for (const Eigen::Vector3d& index : ValidPoints<float>(own, {}, points, seed)) {
    const Eigen::Vector3d p = toWorld * index, at = toIndex * p;
    double value = 0.0;
    if (!sampler.Linear(at.x(), at.y(), at.z(), value))
      continue;
    ++all;
    const Eigen::Vector3f fromIt = (p - centre).cast<float>();
    for (std::size_t f = 0; f < fixed.size(); ++f)
      if (Holds(fixed[f].pyramid->back().intensity.View(), maps[f], fromIt)) {
        ++covered;
        break;
      }
  }
  return static_cast<double>(covered) / static_cast<double>(all);
}

} // namespace echorama
