// SPDX-License-Identifier: BSD-3-Clause
//
// A beam is straight, in the world and in voxel indices, so the map of the probe is worked out once per beam.
#include "BeamSampling.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

// How far apart the first and the last step of the sweep are at this depth of the middle beam, mm.
double SweepSpan(const ProbeGeometry& geometry, double depth)
{
  return std::abs(geometry.Sweep().Span(geometry.Fan().PointOf({geometry.fanOffset, depth}).y()));
}

} // namespace

std::array<int, 3> BeamDimensionsFor(const ProbeGeometry& geometry, double spacingMm)
{
  geometry.Check();
  if (!(spacingMm > 0.0) || !std::isfinite(spacingMm))
    throw Error(Error::Kind::InvalidParameter, "beam volume: the spacing must be positive");
  const auto count = [spacingMm](double extent) {
    return static_cast<int>(std::min(std::ceil(extent / spacingMm - 1e-3), 1e9)) + 1;
  };
  const double far = geometry.depthMax;
  std::array<int, 3> dimensions{std::max(2, count(far - geometry.depthMin)), std::max(2, count(geometry.Fan().Span(far))), 1};
  if (!geometry.IsPlane())
    dimensions[2] = std::max(2, count(std::max(SweepSpan(geometry, far), SweepSpan(geometry, geometry.depthMin))));
  CheckBeamVolume(dimensions, geometry);
  return dimensions;
}

double VoxelSize(const ImageGeometry& geometry)
{
  const Eigen::Vector3d& spacing = geometry.spacing;
  return geometry.dimensions[2] == 1 ? std::sqrt(spacing.x() * spacing.y()) : std::cbrt(spacing.prod());
}

template <class T>
Volume<float> SampleBeams(const PosedVolume<T>& volume, const PlacedProbe& probe, const std::array<int, 3>& dimensions,
                          const Progress& progress)
{
  CheckBeamVolume(dimensions, probe.geometry);
  volume.geometry.Check("the volume whose beams are sampled");
  if (!IsRotation(probe.probeToWorld.linear()) || !probe.probeToWorld.translation().allFinite())
    throw Error(Error::Kind::BadInput, "beam sampling: the pose of the probe is not rigid");
  if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
      (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
    throw Error(Error::Kind::BadInput, "beam sampling: the volume has other dimensions than its geometry");

  const ProbeGeometry& geometry = probe.geometry;
  const Eigen::Affine3d probeToIndex = volume.geometry.WorldToIndex() * probe.probeToWorld;
  const Sampler<T> sampler(volume.intensity, volume.valid);
  const auto [samples, beams, steps] = dimensions;
  const double step = (geometry.depthMax - geometry.depthMin) / (samples - 1);
  Volume<float> sampled(dimensions, std::numeric_limits<float>::quiet_NaN());
  const auto view = sampled.View();
  ParallelFor(static_cast<std::ptrdiff_t>(beams) * steps, progress,
              [&, samples = samples, beams = beams, steps = steps](std::ptrdiff_t beam) {
                const int j = static_cast<int>(beam % beams), k = static_cast<int>(beam / beams);
                BeamPoint at;
                at.depth = geometry.depthMin;
                at.fan = static_cast<double>(j) / (beams - 1) - 0.5;
                at.sweep = steps > 1 ? static_cast<double>(k) / (steps - 1) - 0.5 : 0.0;
                const Eigen::Vector3d first = probeToIndex * PointOf(geometry, at);
                const Eigen::Vector3d onward = step * (probeToIndex.linear() * DirectionOf(geometry, at));
                float* row = view.Row(j, k);
                for (int i = 0; i < samples; ++i) {
                  const Eigen::Vector3d index = first + i * onward;
                  if (double value = 0.0; sampler.Linear(index.x(), index.y(), index.z(), value))
                    row[i] = static_cast<float>(value);
                }
              });
  return sampled;
}

std::array<int, 3> RimOf(const ProbeGeometry& geometry, const std::array<int, 3>& n, const ImageGeometry& sampled)
{
  // The nearest voxel of a point lies at most half a voxel's diagonal off.
  const double reach = 0.87 * sampled.spacing.head(n[2] == 1 ? 2 : 3).maxCoeff();
  const auto across = [reach](double span, int count) {
    if (count < 3)
      return 0;
    const double most = 0.05 * (count - 1);
    return std::min(static_cast<int>(std::ceil(std::min(reach * (count - 1) / std::max(span, 1e-9), most))), (count - 1) / 2);
  };
  const double step = (geometry.depthMax - geometry.depthMin) / (n[0] - 1);
  const int deep = std::min(static_cast<int>(std::ceil(reach / step)), (n[0] - 2) / 2);
  return {deep, across(geometry.Fan().Span(geometry.depthMin), n[1]),
          n[2] == 1 ? 0 : across(SweepSpan(geometry, geometry.depthMin), n[2])};
}

#define EchoramaInstantiate(T)                                                                                                   \
  template Volume<float> SampleBeams<T>(const PosedVolume<T>&, const PlacedProbe&, const std::array<int, 3>&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
