// SPDX-License-Identifier: BSD-3-Clause
// Runs of overlap voxels are joined with those of the row before and of the slice before that they share a face with
// (union-find). Then every volume looks which runs it reaches: within them, or by a face, because a volume that only touches
// a piece is a boundary of it.
#include "OverlapComponents.h"
#include <algorithm>
#include <numeric>

namespace echorama {

OverlapComponents::OverlapComponents(const RegionMap& regions) : rows_(regions.Coverage().Dimensions()[1])
{
  const auto& n = regions.Coverage().Dimensions();
  std::vector<int> parents;
  const auto rootOf = [&parents](int piece) {
    while (parents[piece] != piece)
      piece = parents[piece] = parents[parents[piece]];
    return piece;
  };
  const auto join = [&](std::size_t row, std::size_t other) {
    for (std::size_t a = starts_[row]; a < runs_.size(); ++a)
      for (std::size_t b = starts_[other]; b < starts_[other + 1]; ++b)
        if (runs_[b].begin < runs_[a].end && runs_[a].begin < runs_[b].end)
          parents[rootOf(runs_[a].piece)] = rootOf(runs_[b].piece);
  };
  starts_.push_back(0);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      regions.Coverage().ForRuns(j, k, [&](int first, int end, const unsigned char* counts) {
        const unsigned char* const covered = counts - first;
        for (int i = first; i < end; ++i) {
          if (covered[i] < 2)
            continue;
          const int begin = i;
          while (i < end && covered[i] > 1)
            ++i;
          runs_.push_back({begin, i, static_cast<int>(parents.size())});
          parents.push_back(static_cast<int>(parents.size()));
        }
      });
      const std::size_t row = starts_.size() - 1;
      if (j > 0)
        join(row, row - 1);
      if (k > 0)
        join(row, row - static_cast<std::size_t>(n[1]));
      starts_.push_back(runs_.size());
    }
  // Pieces get numbers without gaps, in the order of their first voxels.
  std::vector<int> numbers(parents.size(), -1);
  for (auto& run : runs_) {
    int& number = numbers[rootOf(run.piece)];
    if (number < 0) {
      number = Count();
      first_.push_back(-1);
      second_.push_back(-1);
    }
    run.piece = number;
  }
  many_.assign(first_.size(), 0);

  // Who is there.
  const auto reaches = [&](int volume, int begin, int end, int j, int k) {
    const GridBox row = GridBox{{begin, j, k}, {end - begin, 1, 1}}.Intersected(regions.Box(volume));
    if (row.Empty())
      return false;
    const unsigned char* inside = regions.MaskRow(volume, j, k) + (row.first[0] - regions.Box(volume).first[0]);
    return std::any_of(inside, inside + row.size[0], [](unsigned char m) { return (m & 1) != 0; });
  };
  for (int v = 0; v < regions.Count(); ++v) {
    const GridBox& box = regions.Box(v);
    if (box.Empty())
      continue;
    for (int k = std::max(0, box.first[2] - 1); k < std::min(n[2], box.first[2] + box.size[2] + 1); ++k)
      for (int j = std::max(0, box.first[1] - 1); j < std::min(n[1], box.first[1] + box.size[1] + 1); ++j) {
        const std::size_t row = static_cast<std::size_t>(k) * n[1] + j;
        for (std::size_t r = starts_[row]; r < starts_[row + 1]; ++r) {
          const auto& run = runs_[r];
          if (many_[run.piece] || first_[run.piece] == v || second_[run.piece] == v)
            continue;
          if (!reaches(v, run.begin - 1, run.end + 1, j, k) && !reaches(v, run.begin, run.end, j - 1, k) &&
              !reaches(v, run.begin, run.end, j + 1, k) && !reaches(v, run.begin, run.end, j, k - 1) &&
              !reaches(v, run.begin, run.end, j, k + 1))
            continue;
          if (first_[run.piece] < 0)
            first_[run.piece] = v;
          else if (second_[run.piece] < 0)
            second_[run.piece] = v;
          else
            many_[run.piece] = 1;
        }
      }
  }
  // Where two claim the same core neither is the rest of the other.
  for (int a = 0; a < regions.Count(); ++a)
    for (int b = a + 1; b < regions.Count(); ++b) {
      if (!regions.HasCore(a) || !regions.HasCore(b))
        continue;
      const GridBox both = regions.Box(a).Intersected(regions.Box(b));
      for (int k = both.first[2]; k < both.first[2] + both.size[2]; ++k)
        for (int j = both.first[1]; j < both.first[1] + both.size[1]; ++j) {
          const std::size_t row = static_cast<std::size_t>(k) * n[1] + j;
          const unsigned char *inA = regions.MaskRow(a, j, k) - regions.Box(a).first[0],
                              *inB = regions.MaskRow(b, j, k) - regions.Box(b).first[0];
          for (std::size_t r = starts_[row]; r < starts_[row + 1]; ++r)
            for (int i = std::max(runs_[r].begin, both.first[0]);
                 i < std::min(runs_[r].end, both.first[0] + both.size[0]) && !many_[runs_[r].piece]; ++i)
              many_[runs_[r].piece] = (inA[i] & inB[i] & 2) != 0;
        }
    }
}

} // namespace echorama
