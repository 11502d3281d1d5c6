// SPDX-License-Identifier: BSD-3-Clause
#include "CoverageMap.h"
#include <utility>

namespace echorama {

CoverageMap::CoverageMap(const std::array<int, 3>& dimensions, const std::vector<GridBox>& boxes) : dimensions_(dimensions)
{
  std::size_t voxels = 0;
  std::vector<const GridBox*> here; // of a slice
  std::vector<std::pair<int, int>> row;
  starts_.reserve(static_cast<std::size_t>(dimensions[1]) * static_cast<std::size_t>(dimensions[2]) + 1);
  starts_.push_back(0);
  for (int k = 0; k < dimensions[2]; ++k) {
    here.clear();
    for (const GridBox& box : boxes)
      if (!box.Empty() && k >= box.first[2] && k < box.first[2] + box.size[2])
        here.push_back(&box);
    for (int j = 0; j < dimensions[1]; ++j) {
      row.clear();
      for (const GridBox* box : here)
        if (box->HasRow(j, k))
          row.emplace_back(box->first[0], box->first[0] + box->size[0]);
      std::sort(row.begin(), row.end());
      for (const auto& [first, end] : row) {
        if (runs_.size() > starts_.back() && first <= runs_.back().end) { // they touch: one run
          const int before = std::exchange(runs_.back().end, std::max(runs_.back().end, end));
          voxels += static_cast<std::size_t>(runs_.back().end - before);
        } else {
          runs_.push_back({first, end, voxels});
          voxels += static_cast<std::size_t>(end - first);
        }
      }
      starts_.push_back(runs_.size());
    }
  }
  counts_ = Zeroed<unsigned char>(voxels);
}

const unsigned char* CoverageMap::At(int i, int j, int k) const
{
  std::size_t run = starts_[Row(j, k)];
  while (i >= runs_[run].end)
    ++run;
  return counts_.data() + runs_[run].start + (i - runs_[run].first);
}

void CoverageMap::Copy(int first, int j, int k, int count, unsigned char* out) const
{
  int done = first;
  ForRuns(j, k, [&](int begin, int end, const unsigned char* counts) {
    const int from = std::max(begin, done), to = std::min(end, first + count);
    if (from >= to)
      return;
    std::fill(out + (done - first), out + (from - first), static_cast<unsigned char>(0));
    std::copy(counts + (from - begin), counts + (to - begin), out + (from - first));
    done = to;
  });
  std::fill(out + (done - first), out + count, static_cast<unsigned char>(0));
}

} // namespace echorama
