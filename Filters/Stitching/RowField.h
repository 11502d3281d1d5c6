// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/ZeroedMemory.h"
#include "GridBox.h"
#include <memory>
#include <vector>

namespace echorama {

/// One span of voxels [First, End) per row of a grid: the smallest that holds all voxels of interest of that row. What is
/// kept per voxel of a thin or slanted overlap is kept in spans, not in a box.
class RowSpans {
public:
  RowSpans() = default;
  /// \param box where rows are, in indices of the grid; spans lie within it
  /// \param first, end per row of the box (x fastest: row = (k - box.first[2]) * box.size[1] + j - box.first[1]), indices of the
  /// grid; first == end: an empty row
  RowSpans(const GridBox& box, std::vector<int> first, std::vector<int> end);

  const GridBox& Box() const { return box_; }
  std::ptrdiff_t Count() const { return start_.empty() ? 0 : start_.back(); } ///< voxels in all spans
  ///@{
  /// Of the row (j, k) of the grid; rows outside of the box are empty.
  int First(int j, int k) const { return box_.HasRow(j, k) ? first_[Row(j, k)] : 0; }
  int End(int j, int k) const { return box_.HasRow(j, k) ? end_[Row(j, k)] : 0; }
  ///@}
  /// Number of the voxel First(j, k) in a dense array over all spans. The row must be in the box.
  std::ptrdiff_t Start(int j, int k) const { return start_[Row(j, k)]; }

private:
  std::size_t Row(int j, int k) const
  {
    return static_cast<std::size_t>(k - box_.first[2]) * static_cast<std::size_t>(box_.size[1]) +
           static_cast<std::size_t>(j - box_.first[1]);
  }
  GridBox box_;
  std::vector<int> first_, end_;
  std::vector<std::ptrdiff_t> start_; // per row, and the whole at the end
};

/// Values of the voxels of spans; they begin with zeros.
template <class T>
struct RowField {
  std::shared_ptr<const RowSpans> spans;
  Zeroed<T> values;

  RowField() = default;
  explicit RowField(std::shared_ptr<const RowSpans> where)
    : spans(std::move(where)), values(static_cast<std::size_t>(spans->Count()))
  {
  }
  /// The span of a row, or nullptr where it is empty; Row(j, k)[i - spans->First(j, k)] belongs to (i, j, k).
  const T* Row(int j, int k) const
  {
    return spans && spans->First(j, k) < spans->End(j, k) ? values.data() + spans->Start(j, k) : nullptr;
  }
  T* Row(int j, int k) { return const_cast<T*>(static_cast<const RowField&>(*this).Row(j, k)); }
};

} // namespace echorama
