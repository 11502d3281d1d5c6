// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VolumeView.h"
#include <algorithm>

namespace echorama {

/// A box of voxels of a grid.
struct GridBox {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> size{0, 0, 0};

  bool Empty() const { return size[0] <= 0 || size[1] <= 0 || size[2] <= 0; }
  std::size_t VoxelCount() const
  {
    return Empty() ? 0
                   : static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  }

  /// Whether the row of voxels (., j, k) of the grid passes through the box.
  bool HasRow(int j, int k) const
  {
    return !Empty() && j >= first[1] && j < first[1] + size[1] && k >= first[2] && k < first[2] + size[2];
  }

  GridBox Intersected(const GridBox& other) const
  {
    GridBox both;
    for (int axis = 0; axis < 3; ++axis) {
      both.first[axis] = std::max(first[axis], other.first[axis]);
      both.size[axis] = std::max(0, std::min(first[axis] + size[axis], other.first[axis] + other.size[axis]) - both.first[axis]);
    }
    return both;
  }
};

/// Values of the voxels of a box of a grid.
template <class T>
struct Boxed {
  GridBox box;
  Volume<T> values; ///< of the size of the box

  /// The row that begins at (box.first[0], j, k), indices of the grid.
  const T* Row(int j, int k) const { return values.View().Row(j - box.first[1], k - box.first[2]); }
  T* Row(int j, int k) { return values.View().Row(j - box.first[1], k - box.first[2]); }
};

/// Rows of a box that one task works on: enough to hide its start, few enough to share out a 2D image.
constexpr std::ptrdiff_t rowsOfOneTask = 16;

/// Runs body(j, k) for every row of a box, in parallel; indices are those of the grid.
template <class Body>
void ForRows(const GridBox& box, const Progress& progress, const Body& body)
{
  if (box.Empty())
    return;
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(box.size[1]) * box.size[2];
  ParallelRanges(rows, rowsOfOneTask, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t row = begin; row < end; ++row)
      body(box.first[1] + static_cast<int>(row % box.size[1]), box.first[2] + static_cast<int>(row / box.size[1]));
  });
}

} // namespace echorama
