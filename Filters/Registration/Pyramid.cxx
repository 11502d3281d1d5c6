// SPDX-License-Identifier: BSD-3-Clause
// Each level is one pass over the one before it, slice by slice: rows of children are added to their parents in a fixed
// order, so the result does not depend on the threads. NaN marks what is not real from the first level on; a child
// then counts when it equals itself, and the mask is not looked at again.
#include "Filters/Registration/Pyramid.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr float NoValue = std::numeric_limits<float>::quiet_NaN();

std::ptrdiff_t CountReal(const Volume<float>& volume)
{
  const VolumeView<const float> view = volume.View();
  return ParallelSum<std::ptrdiff_t>(view.Size(), 1 << 18, [&view](std::ptrdiff_t begin, std::ptrdiff_t end) {
    return end - begin - std::count_if(view.Data() + begin, view.Data() + end, [](float v) { return std::isnan(v); });
  });
}

template <class T>
PyramidLevel Finest(const PosedVolume<T>& volume, const Progress& progress)
{
  PyramidLevel level{Volume<float>(volume.geometry.dimensions), volume.geometry, 0};
  const VolumeView<float> out = level.intensity.View();
  ParallelFor(out.Slices(), progress, [&](std::ptrdiff_t k) {
    for (std::ptrdiff_t i = k * out.SliceStride(), end = i + out.SliceStride(); i < end; ++i) {
      const float value = static_cast<float>(volume.intensity[i]);
      const bool real = (volume.valid.Empty() || volume.valid[i] != 0) && std::isfinite(value);
      out[i] = real ? value : NoValue;
    }
  });
  level.realVoxels = CountReal(level.intensity);
  return level;
}

template <int Step>
[[gnu::always_inline]] inline void AddEvery(const float* row, int count, float* __restrict sum, float* __restrict real)
{
  for (int i = 0; i < count; ++i) {
    const float value = row[Step * i];
    sum[i] += value == value ? value : 0.0f;
    real[i] += value == value ? 1.0f : 0.0f;
  }
}

// Adds those of a row of children that are real to their parents: each to one, or two of them.
void AddChildren(const float* row, int step, int children, float* sum, float* real)
{
  if (step == 1)
    return AddEvery<1>(row, children, sum, real);
  AddEvery<2>(row, (children + 1) / 2, sum, real);
  AddEvery<2>(row + 1, children / 2, sum, real);
}

void Means(const float* sum, const float* real, float needed, int count, float* mean)
{
  for (int i = 0; i < count; ++i)
    mean[i] = real[i] >= needed ? sum[i] / real[i] : NoValue;
}

PyramidLevel Halved(const PyramidLevel& fine, const std::array<int, 3>& factor)
{
  PyramidLevel coarse;
  coarse.geometry = fine.geometry;
  const VolumeView<const float> in = fine.intensity.View();
  const auto& n = in.Dimensions();
  for (int axis = 0; axis < 3; ++axis) {
    coarse.geometry.dimensions[axis] = (n[axis] + factor[axis] - 1) / factor[axis];
    coarse.geometry.spacing[axis] *= factor[axis];
    coarse.geometry.origin += 0.5 * (factor[axis] - 1) * fine.geometry.spacing[axis] * fine.geometry.direction.col(axis);
  }
  coarse.intensity = Volume<float>(coarse.geometry.dimensions);
  const VolumeView<float> out = coarse.intensity.View();
  const auto& m = out.Dimensions();
  const float needed = static_cast<float>((factor[0] * factor[1] * factor[2] + 1) / 2);
  ParallelFor(m[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice), kEnd = std::min(n[2], (k + 1) * factor[2]);
    std::vector<float> sum(static_cast<std::size_t>(m[0])), real(sum.size());
    for (int j = 0; j < m[1]; ++j) {
      std::fill(sum.begin(), sum.end(), 0.0f);
      std::fill(real.begin(), real.end(), 0.0f);
      for (int c = k * factor[2]; c < kEnd; ++c)
        for (int b = j * factor[1]; b < std::min(n[1], (j + 1) * factor[1]); ++b)
          AddChildren(in.Row(b, c), factor[0], n[0], sum.data(), real.data());
      Means(sum.data(), real.data(), needed, m[0], out.Row(j, k));
    }
  });
  coarse.realVoxels = CountReal(coarse.intensity);
  return coarse;
}

} // namespace

template <class T>
std::vector<PyramidLevel> BuildPyramid(const PosedVolume<T>& volume, const PyramidParameters& p, const Progress& progress)
{
  if (p.levels < 1 || p.smallestSize < 1 || p.smallestCount < 0)
    throw Error(Error::Kind::InvalidParameter, "a pyramid needs at least one level and sizes that are not negative");
  volume.geometry.Check("the volume of the pyramid");
  if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
      (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
    throw Error(Error::Kind::BadInput, "the volume of the pyramid: voxels, valid region and geometry differ in their dimensions");

  std::vector<PyramidLevel> levels;
  levels.push_back(Finest(volume, progress.Part(0.0, 0.7)));
  while (static_cast<int>(levels.size()) < p.levels) {
    const ImageGeometry& g = levels.back().geometry;
    double smallest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      if (g.dimensions[axis] > 1)
        smallest = std::min(smallest, g.spacing[axis]);
    std::array<int, 3> factor{1, 1, 1};
    int longest = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (g.dimensions[axis] > 1 && g.spacing[axis] < 1.4142135 * smallest)
        factor[axis] = 2;
      longest = std::max(longest, (g.dimensions[axis] + factor[axis] - 1) / factor[axis]);
    }
    if (factor == std::array<int, 3>{1, 1, 1} || longest < p.smallestSize)
      break;
    PyramidLevel next = Halved(levels.back(), factor);
    if (next.realVoxels < p.smallestCount)
      break;
    levels.push_back(std::move(next));
    progress(0.7);
  }
  progress(1.0);
  return levels;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template std::vector<PyramidLevel> BuildPyramid<T>(const PosedVolume<T>&, const PyramidParameters&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
