// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <atomic>
#include <cstdint>
#include <Eigen/Geometry>
#include <memory>

namespace echorama {

/// Where sound has been: a lattice of cubic cells over a box, of which some are marked. Marking is safe from many threads, and
/// the marks do not depend on their order.
class VisitedSpace {
public:
  /// \param cellMm edge of a cell, > 0; doubled until there are at most 2^24 cells
  VisitedSpace(const Eigen::AlignedBox3d& box, double cellMm);

  /// Marks every cell that comes near a line of \a length (mm) along the unit vector \a direction: all within \a radius, and some
  /// beyond.
  void MarkLine(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, double radius);

  /// Whether a box holds a part of a marked cell.
  bool Touches(const Eigen::AlignedBox3d& box) const;

  const Eigen::AlignedBox3d& Box() const { return box_; }

private:
  struct Range {
    Eigen::Array3i first, last;
  };
  Range CellsOf(const Eigen::AlignedBox3d& box) const;
  std::size_t Index(int i, int j, int k) const
  {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(i);
  }

  Eigen::AlignedBox3d box_;
  double cell_;
  Eigen::Array3i count_ = Eigen::Array3i::Zero();
  std::unique_ptr<std::atomic<std::uint8_t>[]> marks_;
};

} // namespace echorama
