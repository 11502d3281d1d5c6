// SPDX-License-Identifier: BSD-3-Clause
//
// A voxel is inside when all 27 of its neighbourhood are of the region. Slices are searched in parallel and joined in order.
#include "RegionSurface.h"
#include "Core/Base/Parallel.h"
#include <algorithm>

namespace echorama {

namespace {

bool IsInner(VolumeView<const unsigned char> region, int i, int j, int k)
{
  const auto& n = region.Dimensions();
  const std::array<int, 3> at{i, j, k};
  std::array<int, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    reach[axis] = n[axis] > 1 ? 1 : 0;
    if (reach[axis] && (at[axis] == 0 || at[axis] == n[axis] - 1))
      return false;
  }
  for (int dk = -reach[2]; dk <= reach[2]; ++dk)
    for (int dj = -reach[1]; dj <= reach[1]; ++dj)
      for (int di = -reach[0]; di <= reach[0]; ++di)
        if (!region(i + di, j + dj, k + dk))
          return false;
  return true;
}

} // namespace

std::vector<std::array<int, 3>> SurfaceOf(VolumeView<const unsigned char> region, const Progress& progress)
{
  const auto& n = region.Dimensions();
  std::vector<std::vector<std::array<int, 3>>> slices(static_cast<std::size_t>(n[2]));
  ParallelFor(n[2], progress, [&](std::ptrdiff_t k) {
    auto& found = slices[static_cast<std::size_t>(k)];
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (region(i, j, static_cast<int>(k)) && !IsInner(region, i, j, static_cast<int>(k)))
          found.push_back({i, j, static_cast<int>(k)});
  });
  std::vector<std::array<int, 3>> surface;
  for (const auto& slice : slices)
    surface.insert(surface.end(), slice.begin(), slice.end());
  return surface;
}

} // namespace echorama
