// SPDX-License-Identifier: BSD-3-Clause
// Runs of zeros along x are the nodes of a union-find: one pass over the voxels finds the runs and joins each with those
// that it touches in the row and in the slice before; runs at the border join node 0, the outside. A second pass over the
// runs marks those of the outside. Cost: one look at every voxel, and 12 bytes per run.
#include "BorderZeros.h"
#include "Core/Base/JoinedSets.h"
#include <algorithm>
#include <cmath>
#include <vector>

namespace echorama {
namespace {

template <class T>
bool IsNothing(T value)
{
  if constexpr (std::is_floating_point_v<T>)
    return value == T(0) || !std::isfinite(value);
  else
    return value == T(0);
}

struct Run {
  int begin, end; // voxels of one row
};

} // namespace

template <class T>
std::int64_t ValidFromBorderZeros(VolumeView<const T> voxels, VolumeView<unsigned char> valid)
{
  const auto [nx, ny, nz] = voxels.Dimensions();
  std::vector<Run> runs;
  std::vector<std::size_t> rows{0}; // the first run of each row, and one beyond the last
  rows.reserve(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz) + 1);
  JoinedSets sets(1); // 0, the outside, stays the name of its set; run r is node r + 1
  const auto joinWithRow = [&](std::size_t first, std::size_t row) {
    // Both rows' runs are in order: walk them together.
    std::size_t a = first, b = rows[row];
    while (a < runs.size() && b < rows[row + 1]) {
      if (runs[a].begin < runs[b].end && runs[b].begin < runs[a].end)
        sets.Join(a + 1, b + 1);
      if (runs[a].end < runs[b].end)
        ++a;
      else
        ++b;
    }
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const T* row = voxels.Row(j, k);
      const std::size_t first = runs.size(), number = rows.size() - 1;
      // An image of one slice has its border at the rim of the slice, not all over it.
      const bool border = j == 0 || j == ny - 1 || (nz > 1 && (k == 0 || k == nz - 1));
      for (int i = 0; i < nx;) {
        if (!IsNothing(row[i])) {
          ++i;
          continue;
        }
        const int begin = i;
        while (i < nx && IsNothing(row[i]))
          ++i;
        runs.push_back({begin, i});
        sets.Add();
        if (border || begin == 0 || i == nx)
          sets.Join(0, runs.size());
      }
      if (j > 0)
        joinWithRow(first, number - 1);
      if (k > 0)
        joinWithRow(first, number - static_cast<std::size_t>(ny));
      rows.push_back(runs.size());
    }

  std::fill(valid.begin(), valid.end(), static_cast<unsigned char>(1));
  std::int64_t missing = 0;
  for (std::size_t row = 0; row + 1 < rows.size(); ++row)
    for (std::size_t r = rows[row]; r < rows[row + 1]; ++r) {
      unsigned char* const target = valid.Data() + voxels.RowStride() * static_cast<std::ptrdiff_t>(row);
      const bool outside = sets.Of(r + 1) == 0;
      for (int i = runs[r].begin; i < runs[r].end; ++i) {
        bool invalid = outside;
        if constexpr (std::is_floating_point_v<T>)
          invalid = invalid || !std::isfinite(voxels[voxels.RowStride() * static_cast<std::ptrdiff_t>(row) + i]);
        target[i] = invalid ? 0 : 1;
        missing += invalid;
      }
    }
  return missing;
}

template <class T>
bool LooksValidEverywhere(VolumeView<const T> slab, int first, int slices)
{
  const auto [nx, ny, nz] = slab.Dimensions();
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const T* row = slab.Row(j, k);
      const bool outerSlice = slices > 1 && (first + k == 0 || first + k == slices - 1);
      if (j == 0 || j == ny - 1 || outerSlice) {
        if (std::any_of(row, row + nx, IsNothing<T>))
          return false;
        continue;
      }
      if (IsNothing(row[0]) || IsNothing(row[nx - 1]))
        return false;
      if constexpr (std::is_floating_point_v<T>)
        if (!std::all_of(row, row + nx, [](T value) { return std::isfinite(value); }))
          return false;
    }
  return true;
}

#define ECHORAMA_INSTANTIATE(T)                                                                                                  \
  template std::int64_t ValidFromBorderZeros<T>(VolumeView<const T>, VolumeView<unsigned char>);                                 \
  template bool LooksValidEverywhere<T>(VolumeView<const T>, int, int);
ECHORAMA_INSTANTIATE(char)
ECHORAMA_INSTANTIATE(signed char)
ECHORAMA_INSTANTIATE(unsigned char)
ECHORAMA_INSTANTIATE(short)
ECHORAMA_INSTANTIATE(unsigned short)
ECHORAMA_INSTANTIATE(int)
ECHORAMA_INSTANTIATE(unsigned int)
ECHORAMA_INSTANTIATE(long)
ECHORAMA_INSTANTIATE(unsigned long)
ECHORAMA_INSTANTIATE(long long)
ECHORAMA_INSTANTIATE(unsigned long long)
ECHORAMA_INSTANTIATE(float)
ECHORAMA_INSTANTIATE(double)
#undef ECHORAMA_INSTANTIATE

} // namespace echorama
