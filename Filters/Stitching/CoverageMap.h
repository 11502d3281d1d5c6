// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/ZeroedMemory.h"
#include "GridBox.h"
#include <vector>

namespace echorama {

/// How many volumes cover each voxel of a grid (255: 255 and more), kept for the voxels of their boxes alone: a byte for each of
/// these and eight for each row of the grid, however far the volumes are apart.
class CoverageMap {
public:
  CoverageMap() = default;
  /// Begins with zeros. \param boxes of the volumes, within the grid
  CoverageMap(const std::array<int, 3>& dimensions, const std::vector<GridBox>& boxes);

  const std::array<int, 3>& Dimensions() const { return dimensions_; } ///< of the grid
  std::size_t Bytes() const { return counts_.size(); }                 ///< voxels of all boxes

  ///@{
  /// The count of a voxel, which must lie in a box; those of the rest of the row of that box follow.
  const unsigned char* At(int i, int j, int k) const;
  unsigned char* At(int i, int j, int k)
  {
    return const_cast<unsigned char*>(static_cast<const CoverageMap&>(*this).At(i, j, k));
  }
  ///@}

  /// Writes the counts of \a count voxels of a row from (first, j, k), in boxes and between them.
  void Copy(int first, int j, int k, int count, unsigned char* out) const;

  /// Runs body(first, end, counts) for what boxes have of a row, from left to right; between two runs is a voxel at least.
  template <class Body>
  void ForRuns(int j, int k, const Body& body) const
  {
    const std::size_t row = Row(j, k);
    for (std::size_t run = starts_[row]; run < starts_[row + 1]; ++run)
      body(runs_[run].first, runs_[run].end, counts_.data() + runs_[run].start);
  }

private:
  struct Run {
    int first, end;
    std::size_t start; // of its counts
  };
  std::size_t Row(int j, int k) const
  {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(dimensions_[1]) + static_cast<std::size_t>(j);
  }
  std::array<int, 3> dimensions_{0, 0, 0};
  std::vector<std::size_t> starts_; // of the runs of each row, and all of them
  std::vector<Run> runs_;
  Zeroed<unsigned char> counts_;
};

} // namespace echorama
