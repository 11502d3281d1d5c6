// SPDX-License-Identifier: BSD-3-Clause
// Coarse levels keep the shape by numbers, not by finer rules: the tie of two cells is the sum of the ties of their voxels
// across the face, halved for the doubled distance, so a cell that is partly void is tied less. The ties to known voxels are
// summed in the cell; KnownTie is what is left of them one level up, for they end at the known voxel and not at a cell's
// centre (between 5/8 and 1 in one dimension, depending on how cells fall; smaller makes cycles overshoot there).
#include "Core/Base/Error.h"
#include "MembraneLevels.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr std::ptrdiff_t CellsOfOneTask = 32768;
constexpr std::ptrdiff_t CoarsestUnknowns = 200; // solved directly

// Ties of a row of the finest level to lower neighbours, and to known voxels; 0 where there is no unknown.
void TiesOfVoxels(const unsigned char* code, const unsigned char* below, const unsigned char* above, const unsigned char* before,
                  const unsigned char* behind, float wx, float wy, float wz, int begin, int end, float* __restrict x,
                  float* __restrict y, float* __restrict z, float* __restrict known)
{
  const auto is = [](unsigned char c) { return (c & MembraneCounts) != 0 ? 1 : 0; };
  for (int i = begin; i < end; ++i) {
    const int own = is(code[i]), left = is(code[i - 1]), down = is(below[i]), front = is(before[i]);
    x[i] = wx * static_cast<float>(own & left);
    y[i] = wy * static_cast<float>(own & down);
    z[i] = wz * static_cast<float>(own & front);
    known[i] = static_cast<float>(own) * (wx * static_cast<float>((code[i] & 3) - left - is(code[i + 1])) +
                                          wy * static_cast<float>(((code[i] >> 2) & 3) - down - is(above[i])) +
                                          wz * static_cast<float>(((code[i] >> 4) & 3) - front - is(behind[i])));
  }
}

// As AddToCells, but of each cell's voxels only the lower one.
void AddLower(const float* from, float factor, int begin, int end, float* __restrict to)
{
  for (int cell = (begin + 1) >> 1; cell < (end + 1) >> 1; ++cell)
    to[cell] += factor * from[2 * cell];
}

void JoinKinds(const unsigned char* kind, int begin, int end, bool halved, unsigned char* __restrict to)
{
  for (int i = begin; i < end && !halved; ++i)
    to[i] |= kind[i];
  if (!halved || begin >= end)
    return;
  if (begin & 1)
    to[begin >> 1] |= kind[begin];
  for (int cell = (begin + 1) >> 1; cell < end >> 1; ++cell)
    to[cell] |= kind[2 * cell] | kind[2 * cell + 1];
  if (end & 1)
    to[end >> 1] |= kind[end - 1];
}

} // namespace

void AddToCells(const float* from, float factor, int begin, int end, bool halved, float* __restrict to)
{
  for (int i = begin; i < end && !halved; ++i)
    to[i] += factor * from[i];
  if (!halved || begin >= end)
    return;
  if (begin & 1)
    to[begin >> 1] += factor * from[begin];
  for (int cell = (begin + 1) >> 1; cell < end >> 1; ++cell)
    to[cell] = (to[cell] + factor * from[2 * cell]) + factor * from[2 * cell + 1];
  if (end & 1)
    to[end >> 1] += factor * from[end - 1];
}

MembraneRows::MembraneRows(std::array<int, 2> lowest, std::array<int, 2> extent, const std::vector<std::array<int, 2>>& unknowns)
  : low(lowest), size(extent), rows(static_cast<std::size_t>(extent[0] + 2) * static_cast<std::size_t>(extent[1] + 2))
{
  for (int z = 0; z < size[1]; ++z)
    for (int y = 0; y < size[0]; ++y) {
      const auto& span = unknowns[static_cast<std::size_t>(z) * static_cast<std::size_t>(size[0]) + static_cast<std::size_t>(y)];
      if (span[0] >= span[1])
        continue;
      Row& own = At(low[0] + y, low[1] + z);
      own.begin = span[0];
      own.end = span[1];
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
          Row& near = At(low[0] + y + dy, low[1] + z + dz);
          near.first = near.first < near.last ? std::min(near.first, span[0] - 1) : span[0] - 1;
          near.last = std::max(near.last, span[1] + 1);
        }
    }
  for (Row& row : rows) {
    row.at = count - row.first;
    count += row.last - row.first;
  }
}

std::ptrdiff_t MembraneRows::Grain() const
{
  return std::max<std::ptrdiff_t>(1, CellsOfOneTask * size[1] / std::max<std::ptrdiff_t>(1, count));
}

MembraneLevels::MembraneLevels(MembraneRows rows, Zeroed<unsigned char> codes, const Eigen::Vector3d& spacing,
                               const Progress& progress)
  : codes_(std::move(codes))
{
  const double least = spacing.minCoeff();
  weights_ = (least / spacing.array()).square();
  levels_.reserve(64);
  levels_.emplace_back();
  Level& finest = levels_.front();
  finest.rows = std::move(rows);
  finest.value = Zeroed<float>(static_cast<std::size_t>(finest.rows.count));
  finest.right = Zeroed<float>(static_cast<std::size_t>(finest.rows.count));
  finest.unknowns = ParallelSum<std::ptrdiff_t>(finest.rows.count, CellsOfOneTask, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::ptrdiff_t count = 0;
    for (std::ptrdiff_t at = begin; at < end; ++at)
      count += (codes_[static_cast<std::size_t>(at)] & MembraneCounts) != 0;
    return count;
  });
  Eigen::Vector3d size = spacing;
  while (levels_.back().unknowns > CoarsestUnknowns) {
    progress(0.0);
    Level& last = levels_.back();
    int lowest = std::numeric_limits<int>::max(), highest = std::numeric_limits<int>::min();
    for (const auto& row : last.rows.rows)
      if (row.begin < row.end) {
        lowest = std::min(lowest, row.begin);
        highest = std::max(highest, row.end);
      }
    const int extent[3] = {highest - lowest, last.rows.size[0], last.rows.size[1]};
    double finestSize = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      if (extent[axis] > 1)
        finestSize = std::min(finestSize, size[axis]);
    for (int axis = 0; axis < 3; ++axis)
      if ((last.halved[axis] = extent[axis] > 1 && size[axis] <= 1.5 * finestSize))
        size[axis] *= 2.0;
    levels_.emplace_back();
    BuildCoarse(Count() - 2);
  }
  BuildCoarsest();
  known_.clear();
  kinds_ = {};
}

void MembraneLevels::BuildCoarse(int number)
{
  const Level& fine = levels_[static_cast<std::size_t>(number)];
  Level& coarse = levels_[static_cast<std::size_t>(number) + 1];
  const auto& halved = fine.halved;
  const MembraneRows& from = fine.rows;

  // 1. which cells hold unknowns
  const std::array<int, 2> low{CellOf(from.low[0], halved[1]), CellOf(from.low[1], halved[2])};
  const std::array<int, 2> size{CellOf(from.low[0] + from.size[0] - 1, halved[1]) - low[0] + 1,
                                CellOf(from.low[1] + from.size[1] - 1, halved[2]) - low[1] + 1};
  std::vector<std::array<int, 2>> spans(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]), {0, 0});
  for (int z = from.low[1]; z < from.low[1] + from.size[1]; ++z)
    for (int y = from.low[0]; y < from.low[0] + from.size[0]; ++y) {
      const auto& row = from.At(y, z);
      if (row.begin >= row.end)
        continue;
      auto& span = spans[static_cast<std::size_t>(CellOf(z, halved[2]) - low[1]) * static_cast<std::size_t>(size[0]) +
                         static_cast<std::size_t>(CellOf(y, halved[1]) - low[0])];
      const int begin = CellOf(row.begin, halved[0]), end = CellOf(row.end - 1, halved[0]) + 1;
      span = span[0] < span[1] ? std::array<int, 2>{std::min(span[0], begin), std::max(span[1], end)}
                               : std::array<int, 2>{begin, end};
    }
  coarse.rows = MembraneRows(low, size, spans);
  const MembraneRows& to = coarse.rows;
  const auto cells = static_cast<std::size_t>(to.count);
  if (cells > std::numeric_limits<std::uint32_t>::max())
    throw Error(Error::Kind::TooLarge, "the membrane has too many unknowns");
  for (auto& tie : coarse.tie)
    tie = Zeroed<float>(cells);
  coarse.inverse = Zeroed<float>(cells);
  coarse.value = Zeroed<float>(cells);
  coarse.right = Zeroed<float>(cells);
  Zeroed<float> known(cells);
  Zeroed<unsigned char> kinds(cells);

  // 2. ties of the cells: sums of those of their voxels
  const unsigned char* codes = codes_.data();
  const bool finest = number == 0;
  const float wx = static_cast<float>(weights_[0]), wy = static_cast<float>(weights_[1]), wz = static_cast<float>(weights_[2]);
  const float scale[3] = {halved[0] ? 0.5f : 1.0f, halved[1] ? 0.5f : 1.0f, halved[2] ? 0.5f : 1.0f};
  const Zeroed<unsigned char>& fineKinds = finest ? codes_ : kinds_;
  ParallelRanges(to.size[1] + 2, to.Grain(), Progress(), [&](std::ptrdiff_t zBegin, std::ptrdiff_t zEnd) {
    std::vector<float> ofVoxels;
    for (int Z = to.low[1] - 1 + static_cast<int>(zBegin); Z < to.low[1] - 1 + static_cast<int>(zEnd); ++Z)
      for (int z = halved[2] ? 2 * Z : Z; z <= (halved[2] ? 2 * Z + 1 : Z); ++z) {
        if (z < from.low[1] - 1 || z > from.low[1] + from.size[1])
          continue;
        for (int y = from.low[0] - 1; y <= from.low[0] + from.size[0]; ++y) {
          const int Y = CellOf(y, halved[1]);
          if (Y < to.low[0] - 1 || Y > to.low[0] + to.size[0])
            continue;
          const auto& row = from.At(y, z);
          const auto& cell = to.At(Y, Z);
          const int first = std::max(row.first, halved[0] ? 2 * cell.first : cell.first);
          const int last = std::min(row.last, halved[0] ? 2 * cell.last : cell.last);
          const unsigned char* kind = fineKinds.data() + row.at;
          unsigned char* cellKind = kinds.data() + cell.at;
          JoinKinds(kind, first, last, halved[0], cellKind);
          if (row.begin >= row.end)
            continue;
          const float* ties[4]; // to the lower neighbours along x, y and z, and to known voxels
          if (finest) {
            const auto count = static_cast<std::size_t>(row.end - row.begin);
            ofVoxels.resize(4 * count);
            float* own[4];
            for (std::size_t n = 0; n < 4; ++n)
              ties[n] = own[n] = ofVoxels.data() + n * count - row.begin;
            TiesOfVoxels(codes + row.at, codes + from.At(y - 1, z).at, codes + from.At(y + 1, z).at, codes + from.At(y, z - 1).at,
                         codes + from.At(y, z + 1).at, wx, wy, wz, row.begin, row.end, own[0], own[1], own[2], own[3]);
          } else {
            for (std::size_t axis = 0; axis < 3; ++axis)
              ties[axis] = fine.tie[axis].data() + row.at;
            ties[3] = known_.back().data() + row.at;
          }
          if (halved[0])
            AddLower(ties[0], scale[0], row.begin, row.end, coarse.tie[0].data() + cell.at);
          else
            AddToCells(ties[0], scale[0], row.begin, row.end, false, coarse.tie[0].data() + cell.at);
          if (!halved[1] || (y & 1) == 0)
            AddToCells(ties[1], scale[1], row.begin, row.end, halved[0], coarse.tie[1].data() + cell.at);
          if (!halved[2] || (z & 1) == 0)
            AddToCells(ties[2], scale[2], row.begin, row.end, halved[0], coarse.tie[2].data() + cell.at);
          AddToCells(ties[3], KnownTie, row.begin, row.end, halved[0], known.data() + cell.at);
        }
      }
  });

  // 3. one over their sums
  coarse.unknowns = 0;
  for (int Z = to.low[1]; Z < to.low[1] + to.size[1]; ++Z)
    for (int Y = to.low[0]; Y < to.low[0] + to.size[0]; ++Y) {
      const auto& row = to.At(Y, Z);
      if (row.begin >= row.end)
        continue;
      const Level::Ties t = coarse.TiesOf(Y, Z);
      float* inverse = coarse.inverse.data() + row.at;
      for (int i = row.begin; i < row.end; ++i)
        if ((kinds[static_cast<std::size_t>(row.at + i)] & MembraneCounts) != 0) {
          const float sum =
              t.x[i] + t.x[i + 1] + t.y[i] + t.yNext[i] + t.z[i] + t.zNext[i] + known[static_cast<std::size_t>(row.at + i)];
          inverse[i] = sum > 0.0f ? 1.0f / sum : 0.0f;
          ++coarse.unknowns;
        }
    }
  kinds_ = std::move(kinds);
  known_.assign(1, std::move(known));
  BuildFills(number + 1, kinds_);
}

void MembraneLevels::BuildFills(int number, const Zeroed<unsigned char>& kinds)
{
  Level& level = levels_[static_cast<std::size_t>(number)];
  const MembraneRows& rows = level.rows;
  const Zeroed<float>& known = known_.back();
  level.voids.start.push_back(0);
  level.knowns.start.push_back(0);
  for (int z = rows.low[1] - 1; z <= rows.low[1] + rows.size[1]; ++z)
    for (int y = rows.low[0] - 1; y <= rows.low[0] + rows.size[0]; ++y) {
      const auto& row = rows.At(y, z);
      for (int i = row.first; i < row.last; ++i) {
        const unsigned char kind = kinds[static_cast<std::size_t>(row.at + i)];
        if ((kind & MembraneCounts) != 0)
          continue;
        const bool isKnown = kind != 0;
        Level::Fill& fill = isKnown ? level.knowns : level.voids;
        const std::size_t start = fill.from.size();
        // Neighbours across faces; if there are none, across edges; then corners.
        for (int reach = 1; reach <= 3 && fill.from.size() == start; ++reach) {
          float sum = 0.0f;
          for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy)
              for (int dx = -1; dx <= 1; ++dx) {
                if (std::abs(dx) + std::abs(dy) + std::abs(dz) != reach || y + dy < rows.low[0] ||
                    y + dy >= rows.low[0] + rows.size[0] || z + dz < rows.low[1] || z + dz >= rows.low[1] + rows.size[1])
                  continue;
                const auto& near = rows.At(y + dy, z + dz);
                if (i + dx < near.first || i + dx >= near.last)
                  continue;
                const auto at = static_cast<std::size_t>(near.at + i + dx);
                if (isKnown) {
                  if ((kinds[at] & MembraneCounts) != 0 && known[at] > 0.0f) {
                    fill.from.push_back(static_cast<std::uint32_t>(at));
                    fill.weight.push_back(1.0f);
                    sum += known[at];
                  }
                } else if (kinds[at] != 0) {
                  sum += 1.0f;
                  if ((kinds[at] & MembraneCounts) != 0) {
                    fill.from.push_back(static_cast<std::uint32_t>(at));
                    fill.weight.push_back(1.0f);
                  }
                }
              }
          for (std::size_t n = start; n < fill.from.size(); ++n)
            fill.weight[n] = 1.0f / sum;
        }
        if (fill.from.size() > start) {
          fill.cell.push_back(static_cast<std::uint32_t>(row.at + i));
          fill.start.push_back(static_cast<std::uint32_t>(fill.from.size()));
        }
      }
    }
}

void MembraneLevels::BuildCoarsest()
{
  Level& level = levels_.back();
  const MembraneRows& rows = level.rows;
  const bool finest = Count() == 1;
  std::vector<int> number(static_cast<std::size_t>(rows.count), -1);
  for (int z = rows.low[1]; z < rows.low[1] + rows.size[1]; ++z)
    for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
      const auto& row = rows.At(y, z);
      for (int i = row.begin; i < row.end; ++i) {
        const auto at = static_cast<std::size_t>(row.at + i);
        if (finest ? (codes_[at] & MembraneCounts) != 0 : level.inverse[at] > 0.0f) {
          number[at] = static_cast<int>(coarsest_.size());
          coarsest_.push_back(row.at + i);
        }
      }
    }
  const std::size_t count = coarsest_.size();
  factor_.assign(count * count, 0.0);
  const auto entry = [&](int row, int column) -> double& {
    return factor_[static_cast<std::size_t>(row) * count + static_cast<std::size_t>(column)];
  };
  for (int z = rows.low[1]; z < rows.low[1] + rows.size[1]; ++z)
    for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
      const auto& row = rows.At(y, z);
      for (int i = row.begin; i < row.end; ++i) {
        const auto at = static_cast<std::size_t>(row.at + i);
        const int own = number[at];
        if (own < 0)
          continue;
        const std::size_t lower[3] = {at - 1, static_cast<std::size_t>(rows.At(y - 1, z).at + i),
                                      static_cast<std::size_t>(rows.At(y, z - 1).at + i)};
        double diagonal = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
          if (finest)
            diagonal += weights_[axis] * static_cast<double>((codes_[at] >> (2 * axis)) & 3);
          const int other = number[lower[axis]];
          if (other >= 0)
            entry(std::max(own, other), std::min(own, other)) =
                -(finest ? weights_[axis] : static_cast<double>(level.tie[axis][at]));
        }
        entry(own, own) = finest ? diagonal : 1.0 / static_cast<double>(level.inverse[at]);
      }
    }
  for (int row = 0; row < static_cast<int>(count); ++row)
    for (int column = 0; column <= row; ++column) {
      double sum = entry(row, column);
      for (int n = 0; n < column; ++n)
        sum -= entry(row, n) * entry(column, n);
      entry(row, column) = row == column ? std::sqrt(std::max(sum, 1e-30)) : sum / entry(column, column);
    }
}

} // namespace echorama
