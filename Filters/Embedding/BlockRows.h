// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <algorithm>
#include <vector>

namespace echorama {

/// A grid cut into blocks of voxels, the last of an axis may be smaller: what varies slowly is kept once per block.
struct Blocks {
  std::array<int, 3> voxels{};       ///< of the grid
  std::array<int, 3> size{1, 1, 1};  ///< voxels of a block
  std::array<int, 3> count{0, 0, 0}; ///< blocks

  Blocks() = default;
  /// Blocks of about \a mm in each direction, at least a voxel and at most the grid.
  Blocks(const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing, double mm);

  /// Position of a voxel between the middles of whole blocks, in blocks; beyond the first and the last the position of these.
  double PositionOf(int voxel, std::size_t axis) const
  {
    return std::clamp((voxel - 0.5 * (size[axis] - 1)) / size[axis], 0.0, count[axis] - 1.0);
  }
};

/// Reads values at blocks as a trilinear field at the voxels of the grid, a row at a time. Several channels share the work.
class BlockRows {
public:
  /// \param channels views of blocks.count; they must outlive this
  BlockRows(const Blocks& blocks, std::vector<VolumeView<const double>> channels);

  /// Channel c of voxel i of row (j, k), for i in [first, end), goes to values[c][i - first]; nullptr: it is not asked for.
  void Row(int j, int k, int first, int end, double* const* values) const;

private:
  Blocks blocks_;
  std::vector<VolumeView<const double>> channels_;
  std::vector<int> below_;    // per voxel of a row: the block before it,
  std::vector<double> after_; // and how far it is on the way to the next, [0, 1]
};

} // namespace echorama
