// SPDX-License-Identifier: BSD-3-Clause
// Spans of rows know where they lie and how many voxels come before each: a dense numbering of what is of interest.
#include "RowField.h"
#include "Core/Base/Error.h"

namespace echorama {

RowSpans::RowSpans(const GridBox& box, std::vector<int> first, std::vector<int> end)
  : box_(box), first_(std::move(first)), end_(std::move(end))
{
  const std::size_t rows = box.Empty() ? 0 : static_cast<std::size_t>(box.size[1]) * static_cast<std::size_t>(box.size[2]);
  if (first_.size() != rows || end_.size() != rows)
    throw Error(Error::Kind::InvalidParameter, "spans need one first and one end per row of their box");
  start_.assign(rows + 1, 0);
  for (std::size_t row = 0; row < rows; ++row) {
    if (first_[row] > end_[row] ||
        (first_[row] < end_[row] && (first_[row] < box.first[0] || end_[row] > box.first[0] + box.size[0])))
      throw Error(Error::Kind::InvalidParameter, "a span must lie within its box");
    start_[row + 1] = start_[row] + (end_[row] - first_[row]);
  }
}

} // namespace echorama
