// SPDX-License-Identifier: BSD-3-Clause
//
// A median does not heed what a few voxels are, and of speckle it lies close to the mean whatever the compression. Cost: at most
// 9^3 voxels to read and to part by the middle one.
#include "SpeckleLevel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

namespace echorama {

namespace {

constexpr int perSide = 4; // of the middle
constexpr double brightest = 3.0;

} // namespace

template <class T>
SpeckleLevel SpeckleLevelAt(VolumeView<const T> intensity, VolumeView<const unsigned char> region,
                            const std::array<int, 3>& middle, const std::array<int, 3>& reach)
{
  std::array<std::vector<int>, 3> places;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int step = std::max(1, (reach[axis] + perSide - 1) / perSide);
    for (int at = middle[axis] - reach[axis] / step * step; at <= middle[axis] + reach[axis]; at += step)
      if (at >= 0 && at < intensity.Dimensions()[axis])
        places[axis].push_back(at);
  }
  std::vector<double> values;
  for (const int k : places[2])
    for (const int j : places[1])
      for (const int i : places[0])
        if (const auto value = static_cast<double>(intensity(i, j, k)); region(i, j, k) && std::isfinite(value))
          values.push_back(value);
  if (values.empty())
    return {};
  const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), half, values.end());
  if (*half < 0.0) // below 0 there is no such thing as three times as bright
    return {};
  const double most = brightest * *half + (std::is_integral_v<T> ? 1.0 : 0.0);
  double count = 0.0, first = 0.0, second = 0.0;
  for (const double value : values)
    if (value <= most) {
      count += 1.0;
      first += value;
      second += value * value;
    }
  const double mean = first / count;
  return {mean, std::sqrt(std::max(0.0, second / count - mean * mean))};
}

#define EchoramaInstantiate(T)                                                                                                   \
  template SpeckleLevel SpeckleLevelAt(VolumeView<const T>, VolumeView<const unsigned char>, const std::array<int, 3>&,          \
                                       const std::array<int, 3>&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
