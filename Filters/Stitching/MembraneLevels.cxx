// SPDX-License-Identifier: BSD-3-Clause
// Multigrid on what is left of a box: rows of unknowns between known voxels and the void. How the levels are made:
// MembraneCoarsening.cxx.
//
// Smoothing: red-black Gauss-Seidel, two sweeps before and two after the coarse level. A half sweep computes both colours and
// multiplies one by zero, for that makes plain vector loops; memory is what costs. Chunks of slices are worked on like a wave
// (Sweep), and all half sweeps with the residual and its restriction pass through the caches once.
//
// Interpolation is trilinear. Known cells hold 0; cells of the void, which the linear weights also reach, are filled with the
// mean of their neighbours, and restriction is the transpose of all that.
#include "MembraneLevels.h"
#include "MembraneLanes.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int Sweeps = 2; // before, and after, the coarser level

struct Around { // a row of values and its four neighbours, each by x
  float* own;
  const float *below, *above, *before, *behind;
};

// Loops over rows have no branches, so that they become vector instructions: what must not change is multiplied by 0.

// 1 for voxels of the colour that are unknowns, else 0.
[[gnu::always_inline]] inline float Take(int i, int parity, int unknown)
{
  return static_cast<float>(~(i ^ parity) & 1 & unknown);
}

[[gnu::always_inline]] inline int IsUnknown(int code)
{
  return (code & MembraneCounts) != 0 ? 1 : 0;
}

// The sum of the ties of a voxel; 1 for one that is not an unknown.
[[gnu::always_inline]] inline float Diagonal(int code, float wx, float wy, float wz)
{
  return wx * static_cast<float>(code & 3) + wy * static_cast<float>((code >> 2) & 3) + wz * static_cast<float>((code >> 4) & 3) +
         static_cast<float>(1 - IsUnknown(code));
}

// Of one colour; those of the other are only read, so the order within a row does not matter.
void RelaxFine(float* own, const float* below, const float* above, const float* before, const float* behind, const float* right,
               const unsigned char* codes, float wx, float wy, float wz, int begin, int end, int parity, float* __restrict step)
{
  if (wx == 1.0f && wy == 1.0f && wz == 1.0f) { // then the diagonal is a sum of bytes
    ForLanes<MembraneByteLanes>(
        begin, end, [&](int i, int, float) __attribute__((always_inline)) {
          const unsigned char code = codes[i];
          const float sum = own[i - 1] + own[i + 1] + (below[i] + above[i]) + (before[i] + behind[i]);
          const auto count = static_cast<unsigned char>((code & 3) + ((code >> 2) & 3) + ((code >> 4) & 3));
          const auto diagonal = static_cast<unsigned char>(count + (count == 0 ? 1 : 0));
          const auto take = static_cast<unsigned char>((count == 0 ? 0 : 1) & ~(i ^ parity));
          step[i] = static_cast<float>(take) * ((right[i] + sum) / static_cast<float>(diagonal) - own[i]);
        });
  } else {
    ForLanes<MembraneByteLanes>(
        begin, end, [&](int i, int, float) __attribute__((always_inline)) {
          const int code = codes[i];
          const float sum = wx * (own[i - 1] + own[i + 1]) + wy * (below[i] + above[i]) + wz * (before[i] + behind[i]);
          const float value = (right[i] + sum) / Diagonal(code, wx, wy, wz);
          step[i] = Take(i, parity, IsUnknown(code)) * (value - own[i]);
        });
  }
  ECHORAMA_MEMBRANE_SEPARATE
  for (int i = begin; i < end; ++i)
    own[i] += step[i];
}

void StartFine(float* own, const float* right, const unsigned char* codes, float wx, float wy, float wz, int begin, int end,
               int parity)
{
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        own[i] = Take(i, parity, IsUnknown(codes[i])) * right[i] / Diagonal(codes[i], wx, wy, wz);
      });
}

void ResidualFine(const float* own, const float* below, const float* above, const float* before, const float* behind,
                  const float* right, const unsigned char* codes, float wx, float wy, float wz, int begin, int end,
                  float* __restrict residual)
{
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        const int code = codes[i];
        const float sum = wx * (own[i - 1] + own[i + 1]) + wy * (below[i] + above[i]) + wz * (before[i] + behind[i]);
        residual[i] = static_cast<float>(IsUnknown(code)) * (right[i] + sum - Diagonal(code, wx, wy, wz) * own[i]);
      });
}

void RelaxCoarse(float* own, const float* below, const float* above, const float* before, const float* behind, const float* x,
                 const float* y, const float* yNext, const float* z, const float* zNext, const float* inverse, const float* right,
                 int begin, int end, int parity, float* __restrict step)
{
  ForLanes<MembraneFloatLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        const float sum = x[i] * own[i - 1] + x[i + 1] * own[i + 1] + y[i] * below[i] + yNext[i] * above[i] + z[i] * before[i] +
                          zNext[i] * behind[i];
        step[i] = Take(i, parity, 1) * ((right[i] + sum) * inverse[i] - own[i]);
      });
  ECHORAMA_MEMBRANE_SEPARATE
  for (int i = begin; i < end; ++i)
    own[i] += step[i];
}

void StartCoarse(float* own, const float* right, const float* inverse, int begin, int end, int parity)
{
  ForLanes<MembraneFloatLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) { own[i] = Take(i, parity, 1) * right[i] * inverse[i]; });
}

void ResidualCoarse(const float* own, const float* below, const float* above, const float* before, const float* behind,
                    const float* x, const float* y, const float* yNext, const float* z, const float* zNext, const float* inverse,
                    const float* right, int begin, int end, float* __restrict residual)
{
  ForLanes<MembraneFloatLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        const float sum = x[i] * own[i - 1] + x[i + 1] * own[i + 1] + y[i] * below[i] + yNext[i] * above[i] + z[i] * before[i] +
                          zNext[i] * behind[i];
        const float unknown = inverse[i] > 0.0f ? 1.0f : 0.0f;
        residual[i] = unknown * (right[i] + sum) - unknown * own[i] / (inverse[i] + (1.0f - unknown));
      });
}

// Two voxels of a row share a cell; each gives three quarters to its own and one to the nearest other.
void HalveRow(const float* fine, float* __restrict coarse, int begin, int end)
{
  ForLanes<MembraneFloatLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        coarse[i] = 0.75f * (fine[2 * i] + fine[2 * i + 1]) + 0.25f * (fine[2 * i - 1] + fine[2 * i + 2]);
      });
}

void DoubleRow(const float* coarse, float* __restrict fine, int begin, int end)
{
  ForLanes<MembraneFloatLanes>(
      begin, end, [&](int i, int, float) __attribute__((always_inline)) {
        fine[2 * i] = 0.75f * coarse[i] + 0.25f * coarse[i - 1];
        fine[2 * i + 1] = 0.75f * coarse[i] + 0.25f * coarse[i + 1];
      });
}

void AddRow(const float* from, float weight, float* to, int begin, int end)
{
  ECHORAMA_MEMBRANE_SEPARATE
  for (int i = begin; i < end; ++i)
    to[i] += weight * from[i];
}

void PutFine(const float* from, const unsigned char* codes, float keep, float* to, int begin, int end)
{
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int, float fresh) __attribute__((always_inline)) {
        const float kept = fresh * keep + (1.0f - fresh);
        to[i] = static_cast<float>(IsUnknown(codes[i])) * (kept * to[i] + fresh * from[i]);
      });
}

void PutCoarse(const float* from, const float* inverse, float keep, float* to, int begin, int end)
{
  ECHORAMA_MEMBRANE_SEPARATE
  for (int i = begin; i < end; ++i)
    to[i] = (inverse[i] > 0.0f ? 1.0f : 0.0f) * (keep * to[i] + from[i]);
}

// The cells that a voxel along one axis gives to and takes from.
struct Partners {
  int count;
  int cell[2];
  float weight[2];
};

Partners PartnersOf(int fine, bool halved)
{
  if (!halved)
    return {1, {fine, fine}, {1.0f, 0.0f}};
  const int own = fine >> 1;
  return {2, {own, fine & 1 ? own + 1 : own - 1}, {0.75f, 0.25f}};
}

} // namespace

namespace {

// Runs body(y, z, row) for each row with unknowns, slices in parallel.
template <class Body>
void ForRowsOf(const MembraneRows& rows, const Body& body)
{
  ParallelRanges(rows.size[1], rows.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = rows.low[1] + static_cast<int>(begin); z < rows.low[1] + static_cast<int>(end); ++z)
      for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
        const MembraneRows::Row& row = rows.At(y, z);
        if (row.begin < row.end)
          body(y, z, row);
      }
  });
}

Around AroundRow(const MembraneRows& rows, Zeroed<float>& value, int y, int z)
{
  float* data = value.data();
  return {data + rows.At(y, z).at, data + rows.At(y - 1, z).at, data + rows.At(y + 1, z).at, data + rows.At(y, z - 1).at,
          data + rows.At(y, z + 1).at};
}

} // namespace

void MembraneLevels::SolveCoarsest()
{
  Level& level = levels_.back();
  const std::size_t count = coarsest_.size();
  std::vector<double> value(count);
  for (std::size_t row = 0; row < count; ++row) {
    double sum = static_cast<double>(level.right[static_cast<std::size_t>(coarsest_[row])]);
    for (std::size_t n = 0; n < row; ++n)
      sum -= factor_[row * count + n] * value[n];
    value[row] = sum / factor_[row * count + row];
  }
  std::fill(level.value.begin(), level.value.end(), 0.0f);
  for (std::size_t row = count; row-- > 0;) {
    double sum = value[row];
    for (std::size_t n = row + 1; n < count; ++n)
      sum -= factor_[n * count + row] * value[n];
    value[row] = sum / factor_[row * count + row];
    level.value[static_cast<std::size_t>(coarsest_[row])] = static_cast<float>(value[row]);
  }
}

void MembraneLevels::RelaxSlice(int number, int z, int colour, bool fromZero)
{
  Level& level = levels_[static_cast<std::size_t>(number)];
  const float wx = static_cast<float>(weights_[0]), wy = static_cast<float>(weights_[1]), wz = static_cast<float>(weights_[2]);
  std::vector<float> step;
  for (int y = level.rows.low[0]; y < level.rows.low[0] + level.rows.size[0]; ++y) {
    const auto& row = level.rows.At(y, z);
    if (row.begin >= row.end)
      continue;
    step.resize(static_cast<std::size_t>(row.end - row.begin));
    const float* right = level.right.data() + row.at;
    const int parity = (y + z + colour) & 1;
    const Around e = AroundRow(level.rows, level.value, y, z);
    if (number == 0) {
      const unsigned char* codes = codes_.data() + row.at;
      if (fromZero)
        StartFine(e.own, right, codes, wx, wy, wz, row.begin, row.end, parity);
      else
        RelaxFine(e.own, e.below, e.above, e.before, e.behind, right, codes, wx, wy, wz, row.begin, row.end, parity,
                  step.data() - row.begin);
    } else {
      const Level::Ties ties = level.TiesOf(y, z);
      if (fromZero)
        StartCoarse(e.own, right, ties.inverse, row.begin, row.end, parity);
      else
        RelaxCoarse(e.own, e.below, e.above, e.before, e.behind, ties.x, ties.y, ties.yNext, ties.z, ties.zNext, ties.inverse,
                    right, row.begin, row.end, parity, step.data() - row.begin);
    }
  }
}

void MembraneLevels::Aggregate(int number, float factor)
{
  const Level& fine = levels_[static_cast<std::size_t>(number)];
  SumUp(number, [&](const MembraneRows::Row& row, float* to) {
    AddToCells(fine.right.data() + row.at, factor, row.begin, row.end, fine.halved[0], to);
  });
}

// Adds the residual of a slice to the right side of the next level, with the weights of linear interpolation.
void MembraneLevels::RestrictSlice(int number, int z)
{
  Level& fine = levels_[static_cast<std::size_t>(number)];
  Level& coarse = levels_[static_cast<std::size_t>(number) + 1];
  const auto& halved = fine.halved;
  const MembraneRows &from = fine.rows, &to = coarse.rows;
  const float wx = static_cast<float>(weights_[0]), wy = static_cast<float>(weights_[1]), wz = static_cast<float>(weights_[2]);
  std::vector<float> residual, half;
  for (int y = from.low[0]; y < from.low[0] + from.size[0]; ++y) {
    const auto& row = from.At(y, z);
    if (row.begin >= row.end)
      continue;
    // The residual of the row, with zeros around.
    const int begin = CellOf(row.begin, halved[0]) - (halved[0] ? 1 : 0);
    const int end = CellOf(row.end - 1, halved[0]) + (halved[0] ? 2 : 1);
    const int low = halved[0] ? 2 * begin - 1 : begin;
    residual.assign(static_cast<std::size_t>((halved[0] ? 2 * end + 1 : end) - low), 0.0f);
    float* own = residual.data() - low;
    const Around e = AroundRow(from, fine.value, y, z);
    const float* right = fine.right.data() + row.at;
    if (number == 0)
      ResidualFine(e.own, e.below, e.above, e.before, e.behind, right, codes_.data() + row.at, wx, wy, wz, row.begin, row.end,
                   own);
    else {
      const Level::Ties ties = fine.TiesOf(y, z);
      ResidualCoarse(e.own, e.below, e.above, e.before, e.behind, ties.x, ties.y, ties.yNext, ties.z, ties.zNext, ties.inverse,
                     right, row.begin, row.end, own);
    }
    const float* cells = own;
    if (halved[0]) {
      half.resize(static_cast<std::size_t>(end - begin));
      HalveRow(own, half.data() - begin, begin, end);
      cells = half.data() - begin;
    }
    const Partners ys = PartnersOf(y, halved[1]), zs = PartnersOf(z, halved[2]);
    for (int b = 0; b < zs.count; ++b)
      for (int a = 0; a < ys.count; ++a)
        AddRow(cells, ys.weight[a] * zs.weight[b], coarse.right.data() + to.At(ys.cell[a], zs.cell[b]).at, begin, end);
  }
}

// What went to cells that are filled belongs to those they are filled from.
void MembraneLevels::FoldFills(int number)
{
  Level& level = levels_[static_cast<std::size_t>(number)];
  const Level::Fill& fill = level.voids;
  for (std::size_t n = 0; n < fill.cell.size(); ++n) {
    const float part = level.right[fill.cell[n]];
    for (std::uint32_t m = fill.start[n]; m < fill.start[n + 1]; ++m)
      level.right[fill.from[m]] += part * fill.weight[m];
  }
}

namespace {

void ApplyFill(const MembraneLevels::Level::Fill& fill, const Zeroed<float>& source, Zeroed<float>& value)
{
  ParallelRanges(static_cast<std::ptrdiff_t>(fill.cell.size()), 4096, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
      float sum = 0.0f;
      for (std::uint32_t m = fill.start[n]; m < fill.start[n + 1]; ++m)
        sum += fill.weight[m] * source[fill.from[m]];
      value[fill.cell[n]] = sum;
    }
  });
}

} // namespace

void MembraneLevels::FillVoids(int number)
{
  Level& level = levels_[static_cast<std::size_t>(number)];
  ApplyFill(level.voids, level.value, level.value);
}

void MembraneLevels::ProlongSlice(int number, int z, bool add)
{
  Level& fine = levels_[static_cast<std::size_t>(number)];
  const Level& coarse = levels_[static_cast<std::size_t>(number) + 1];
  const auto& halved = fine.halved;
  const float keep = add ? 1.0f : 0.0f;
  std::vector<float> cells, voxels;
  for (int y = fine.rows.low[0]; y < fine.rows.low[0] + fine.rows.size[0]; ++y) {
    const auto& row = fine.rows.At(y, z);
    if (row.begin >= row.end)
      continue;
    const int begin = CellOf(row.begin, halved[0]), end = CellOf(row.end - 1, halved[0]) + 1, border = halved[0] ? 1 : 0;
    cells.assign(static_cast<std::size_t>(end - begin + 2 * border), 0.0f);
    float* cell = cells.data() - (begin - border);
    const Partners ys = PartnersOf(y, halved[1]), zs = PartnersOf(z, halved[2]);
    for (int b = 0; b < zs.count; ++b)
      for (int a = 0; a < ys.count; ++a)
        AddRow(coarse.value.data() + coarse.rows.At(ys.cell[a], zs.cell[b]).at, ys.weight[a] * zs.weight[b], cell, begin - border,
               end + border);
    const float* voxel = cell;
    if (halved[0]) {
      voxels.resize(static_cast<std::size_t>(2 * (end - begin)));
      DoubleRow(cell, voxels.data() - 2 * begin, begin, end);
      voxel = voxels.data() - 2 * begin;
    }
    if (number == 0)
      PutFine(voxel, codes_.data() + row.at, keep, fine.value.data() + row.at, row.begin, row.end);
    else
      PutCoarse(voxel, fine.inverse.data() + row.at, keep, fine.value.data() + row.at, row.begin, row.end);
  }
}

void MembraneLevels::Prolong(int number, bool solution)
{
  Level& coarse = levels_[static_cast<std::size_t>(number) + 1];
  FillVoids(number + 1);
  if (solution)
    ApplyFill(coarse.knowns, coarse.right, coarse.value);
  Sweep(levels_[static_cast<std::size_t>(number)].rows, 1, [&](int, int z) { ProlongSlice(number, z, false); });
  if (solution) // corrections are 0 at known cells
    for (const std::uint32_t at : coarse.knowns.cell)
      coarse.value[at] = 0.0f;
}

void MembraneLevels::Cycle(int number, bool improve, const std::function<void(int z)>& then)
{
  const MembraneRows& rows = levels_[static_cast<std::size_t>(number)].rows;
  if (number == Count() - 1) {
    SolveCoarsest();
    if (then)
      Sweep(rows, 1, [&](int, int z) { then(z); });
    return;
  }
  const int halves = 2 * Sweeps;
  Zeroed<float>& right = levels_[static_cast<std::size_t>(number) + 1].right;
  std::fill(right.begin(), right.end(), 0.0f);
  Sweep(rows, halves + 1, [&](int stage, int z) {
    if (stage < halves)
      RelaxSlice(number, z, stage & 1, stage == 0 && !improve);
    else
      RestrictSlice(number, z);
  });
  FoldFills(number + 1);
  Cycle(number + 1, false, {});
  FillVoids(number + 1);
  // The colours in the opposite order: the cycle as a whole is then symmetric, as conjugate gradients like it.
  Sweep(rows, halves + (then ? 2 : 1), [&](int stage, int z) {
    if (stage == 0)
      ProlongSlice(number, z, true);
    else if (stage <= halves)
      RelaxSlice(number, z, stage & 1, false);
    else
      then(z);
  });
}

void MembraneLevels::Guess()
{
  for (int level = 0; level + 1 < Count(); ++level)
    Aggregate(level, KnownTie);
  SolveCoarsest();
  for (int level = Count() - 2; level >= 0; --level) {
    Prolong(level, true);
    if (level > 0)
      Cycle(level, true, {});
  }
}

void MembraneLevels::Spread()
{
  for (int level = 0; level + 1 < Count(); ++level)
    Aggregate(level, 1.0f);
  SolveCoarsest();
  for (int level = Count() - 2; level >= 0; --level) {
    Prolong(level, false);
    Cycle(level, true, {});
  }
}

} // namespace echorama
