// SPDX-License-Identifier: BSD-3-Clause
#include "VisitedSpace.h"
#include <algorithm>
#include <cmath>

namespace echorama {

VisitedSpace::VisitedSpace(const Eigen::AlignedBox3d& box, double cellMm) : box_(box), cell_(cellMm)
{
  if (box.isEmpty())
    return;
  constexpr double maxCells = 16777216.0;
  Eigen::Array3d count;
  for (;; cell_ *= 2.0) {
    count = (box.sizes().array() / cell_).floor() + 1.0;
    if (count.prod() <= maxCells)
      break;
  }
  count_ = count.cast<int>();
  marks_ = std::make_unique<std::atomic<std::uint8_t>[]>(static_cast<std::size_t>(count_.cast<std::ptrdiff_t>().prod()));
}

VisitedSpace::Range VisitedSpace::CellsOf(const Eigen::AlignedBox3d& box) const
{
  // Clamped before the conversion: a box may lie anywhere.
  const Eigen::Array3d most = count_.cast<double>();
  const Eigen::Array3d first = ((box.min() - box_.min()).array() / cell_).floor().max(0.0).min(most),
                       last = ((box.max() - box_.min()).array() / cell_).floor().max(-1.0).min(most - 1.0);
  return {first.cast<int>(), last.cast<int>()};
}

void VisitedSpace::MarkLine(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, double radius)
{
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / cell_)));
  const double step = length / pieces;
  for (int piece = 0; piece < pieces; ++piece) {
    Eigen::AlignedBox3d box(from + piece * step * direction);
    box.extend(from + (piece + 1) * step * direction);
    box.min().array() -= radius;
    box.max().array() += radius;
    const Range range = CellsOf(box);
    const double most = radius + 0.5 * std::sqrt(3.0) * cell_; // from the line to the middle of a cell
    const Eigen::Vector3d middle = from + (piece + 0.5) * step * direction;
    for (int k = range.first[2]; k <= range.last[2]; ++k)
      for (int j = range.first[1]; j <= range.last[1]; ++j)
        for (int i = range.first[0]; i <= range.last[0]; ++i) {
          std::atomic<std::uint8_t>& mark = marks_[Index(i, j, k)];
          if (mark.load(std::memory_order_relaxed)) // most are; reading does not take the line away from others
            continue;
          const Eigen::Vector3d offset = box_.min() + cell_ * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - middle;
          if ((offset - offset.dot(direction) * direction).norm() <= most)
            mark.store(1, std::memory_order_relaxed);
        }
  }
}

bool VisitedSpace::Touches(const Eigen::AlignedBox3d& box) const
{
  if (!marks_ || box.isEmpty())
    return false;
  const Range range = CellsOf(box);
  for (int k = range.first[2]; k <= range.last[2]; ++k)
    for (int j = range.first[1]; j <= range.last[1]; ++j)
      for (int i = range.first[0]; i <= range.last[0]; ++i)
        if (marks_[Index(i, j, k)].load(std::memory_order_relaxed))
          return true;
  return false;
}

} // namespace echorama
