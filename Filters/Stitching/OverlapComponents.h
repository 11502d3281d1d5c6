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
  /// After RegionMap::GiveCores. \param coverage the same that the map was made with
  OverlapComponents(const RegionMap& regions, VolumeView<const unsigned char> coverage);

  int Count() const { return static_cast<int>(first_.size()); }

  /// For the piece that (i, j, k), a voxel of the overlap, belongs to: the other one when \a volume is one of only two
  /// that are in it or touch it, -1 when there are more (or both claim the same core).
  class Row {
  public:
    /// Asked for ascending i only.
    int PartnerOf(int volume, int i)
    {
      while (run_ != end_ && i >= run_->end)
        ++run_;
      return run_ == end_ ? -1 : owner_->Partner(run_->piece, volume);
    }

  private:
    friend class OverlapComponents;
    struct Run {
      int begin, end, piece;
    };
    const OverlapComponents* owner_ = nullptr;
    const Run *run_ = nullptr, *end_ = nullptr;
  };
  Row RowAt(int j, int k) const
  {
    Row row;
    row.owner_ = this;
    const std::size_t number = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(j);
    row.run_ = runs_.data() + starts_[number];
    row.end_ = runs_.data() + starts_[number + 1];
    return row;
  }

private:
  int Partner(int piece, int volume) const
  {
    if (many_[piece])
      return -1;
    return first_[piece] == volume ? second_[piece] : first_[piece];
  }
  int rows_ = 0; // of one slice
  std::vector<Row::Run> runs_;
  std::vector<std::size_t> starts_; // per row, and the whole at the end
  std::vector<int> first_, second_; // per piece, the volumes that meet; -1: none
  std::vector<char> many_;          // per piece
};

} // namespace echorama
