// SPDX-License-Identifier: BSD-3-Clause
//
// 1. The noise is sampled along its own beams, at its voxel size (BeamSampling).
// 2. A beam volume of the target with the same distances between samples is copied from it: along each axis an index of the one
//    is an index of the other, shifted and mirrored at the ends. Three short tables, then one copy.
// 3. Scan conversion makes voxels of that. It is the only place that knows how voxels and beams go together.
#include "FanFilling.h"
#include "BeamSampling.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace echorama {

namespace {

// Mirrors an index into [first, last]: a triangle wave that repeats neither end.
int Mirrored(std::ptrdiff_t index, int first, int last)
{
  const std::ptrdiff_t length = last - first;
  if (length <= 0)
    return first;
  std::ptrdiff_t at = (index - first) % (2 * length);
  at = at < 0 ? at + 2 * length : at;
  return first + static_cast<int>(at <= length ? at : 2 * length - at);
}

// For each index of the target that of the noise.
std::vector<int> MirrorTable(int count, std::ptrdiff_t shift, int noiseCount, int rim)
{
  std::vector<int> table(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    table[static_cast<std::size_t>(i)] = Mirrored(i + shift, rim, noiseCount - 1 - rim);
  return table;
}

double Halfway(const ProbeGeometry& g)
{
  return 0.5 * (g.depthMin + g.depthMax);
}

double SweepSpanHalfway(const ProbeGeometry& g)
{
  return std::abs(g.Sweep().Span(g.Fan().PointOf({g.fanOffset, Halfway(g)}).y()));
}

// How many samples cover \a extent with the distances at which \a count cover \a noiseExtent.
int CountFor(double extent, double noiseExtent, int count)
{
  const double wanted = extent / std::max(noiseExtent, 1e-9) * (count - 1);
  if (!(wanted < std::numeric_limits<int>::max() - 2.0))
    throw Error(Error::Kind::TooLarge, "filling a fan: it would take " + std::to_string(wanted) + " samples of the noise across");
  return std::max(1, static_cast<int>(std::lround(wanted))) + 1;
}

} // namespace

void FillFanFromBeams(VolumeView<const float> beams, const ProbeGeometry& noiseFan, const std::array<int, 3>& rim,
                      const PlacedProbe& target, const ImageGeometry& grid, VolumeView<float> intensity,
                      VolumeView<unsigned char> valid, const Progress& progress)
{
  const auto& n = beams.Dimensions();
  CheckBeamVolume(n, noiseFan);
  target.geometry.Check();
  const ProbeGeometry& fan = target.geometry;
  if (noiseFan.IsPlane() && !fan.IsPlane())
    throw Error(Error::Kind::BadInput, "filling a fan: the noise is a single plane, but the fan sweeps");
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (rim[axis] < 0 || 2 * rim[axis] >= n[axis])
      throw Error(Error::Kind::InvalidParameter, "filling a fan: the rim leaves nothing of the noise");

  const double step = (noiseFan.depthMax - noiseFan.depthMin) / (n[0] - 1);
  std::array<int, 3> size{CountFor(fan.depthMax - fan.depthMin, noiseFan.depthMax - noiseFan.depthMin, n[0]),
                          CountFor(fan.Fan().Span(Halfway(fan)), noiseFan.Fan().Span(Halfway(noiseFan)), n[1]), 1};
  if (!fan.IsPlane())
    size[2] = CountFor(SweepSpanHalfway(fan), SweepSpanHalfway(noiseFan), n[2]);
  CheckBeamVolume(size, fan);
  const double deeper = std::round((fan.depthMin - noiseFan.depthMin) / step);
  const auto depths = MirrorTable(size[0], static_cast<std::ptrdiff_t>(deeper), n[0], rim[0]);
  const auto fans = MirrorTable(size[1], (n[1] - size[1]) / 2, n[1], rim[1]);
  const auto sweeps = MirrorTable(size[2], (n[2] - size[2]) / 2, n[2], rim[2]);

  Volume<float> mirrored(size);
  const auto view = mirrored.View();
  ParallelFor(size[2], progress.Part(0.0, 0.3), [&](std::ptrdiff_t k) {
    for (int j = 0; j < size[1]; ++j) {
      const float* from = beams.Row(fans[static_cast<std::size_t>(j)], sweeps[static_cast<std::size_t>(k)]);
      float* to = view.Row(j, static_cast<int>(k));
      for (int i = 0; i < size[0]; ++i)
        to[i] = from[depths[static_cast<std::size_t>(i)]];
    }
  });
  ScanConvert<float>(view, fan, target.probeToWorld, grid, intensity, valid, progress.Part(0.3, 1.0));
}

template <class T>
void FillFan(const PosedVolume<T>& noise, const PlacedProbe& noiseFan, const PlacedProbe& target, const ImageGeometry& grid,
             VolumeView<float> intensity, VolumeView<unsigned char> valid, const Progress& progress)
{
  noise.geometry.Check("the noise");
  const auto dimensions = BeamDimensionsFor(noiseFan.geometry, VoxelSize(noise.geometry));
  const Volume<float> beams = SampleBeams(noise, noiseFan, dimensions, progress.Part(0.0, 0.4));
  FillFanFromBeams(beams.View(), noiseFan.geometry, RimOf(noiseFan.geometry, dimensions, noise.geometry), target, grid, intensity,
                   valid, progress.Part(0.4, 1.0));
}

std::ptrdiff_t PutRealNoise(VolumeView<const float> real, VolumeView<const unsigned char> there,
                            VolumeView<const unsigned char> form, VolumeView<float> noise)
{
  std::ptrdiff_t missing = 0;
  for (std::ptrdiff_t at = 0; at < noise.Size(); ++at)
    if (there[at])
      noise[at] = real[at];
    else if (form[at])
      ++missing;
  return missing;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void FillFan<T>(const PosedVolume<T>&, const PlacedProbe&, const PlacedProbe&, const ImageGeometry&,                  \
                           VolumeView<float>, VolumeView<unsigned char>, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
