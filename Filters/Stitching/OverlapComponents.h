// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "RegionMap.h"
#include <utility>
#include <vector>

namespace echorama {

/// The connected pieces (by faces) of where volumes overlap, and the volumes that meet in each. Where only two meet, what the
/// one gets the other lacks: a membrane has to be found for one of them alone.
class OverlapComponents {
public:
  OverlapComponents() = default;
  explicit OverlapComponents(const RegionMap& regions); ///< after RegionMap::GiveCores

  int Count() const { return static_cast<int>(first_.size()); }

  /// Runs body(begin, end, partner) for the runs of overlap voxels [begin, end) of a row, from left to right. The partner is the
  /// other volume when \a volume is one of only two that are in the piece or touch it, -1 when there are more (or both claim
  /// the same core).
  template <class Body>
  void ForRuns(int volume, int j, int k, const Body& body) const
  {
    const std::size_t row = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(j);
    for (std::size_t run = starts_[row]; run < starts_[row + 1]; ++run)
      body(runs_[run].begin, runs_[run].end, Partner(runs_[run].piece, volume));
  }

private:
  struct Run {
    int begin, end, piece;
  };
  int Partner(int piece, int volume) const
  {
    if (many_[piece])
      return -1;
    return first_[piece] == volume ? second_[piece] : first_[piece];
  }
  int rows_ = 0; // of one slice
  std::vector<Run> runs_;
  std::vector<std::size_t> starts_; // per row, and the whole at the end
  std::vector<int> first_, second_; // per piece, the volumes that meet; -1: none
  std::vector<char> many_;          // per piece
};

} // namespace echorama
