// SPDX-License-Identifier: BSD-3-Clause
// Along x, then y, then z, as RowSampler goes. At the rim of the lattice the last block goes on.
#include "SmoothRows.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

template <class A>
[[gnu::always_inline]] inline void StretchRow(const float* padded, const int* offsets, const A* fractions, int size, int blocks,
                                              A* __restrict to)
{
  for (int b = 0; b < blocks; ++b)
    for (int r = 0; r < size; ++r) {
      const A below = static_cast<A>(padded[b + offsets[r]]), above = static_cast<A>(padded[b + offsets[r] + 1]);
      to[b * size + r] = below + fractions[r] * (above - below);
    }
}

template <class A>
bool Mix(const A* a, const A* b, const A* c, const A* d, A y, A z, const unsigned char* wanted, int count, A* __restrict to)
{
  int wrong = 0;
  for (int i = 0; i < count; ++i) {
    const A lower = a[i] + y * (b[i] - a[i]), upper = c[i] + y * (d[i] - c[i]), value = lower + z * (upper - lower);
    to[i] = value;
    wrong |= (std::abs(value) <= std::numeric_limits<A>::max() ? 0 : 1) & wanted[i];
  }
  return (wrong & 1) == 0;
}

template <class A>
void Stretch(const float* padded, const int* offsets, const A* fractions, int size, int blocks, A* to)
{
  if (size == 2) // known, so that it becomes vector instructions
    StretchRow(padded, offsets, fractions, 2, blocks, to);
  else
    StretchRow(padded, offsets, fractions, size, blocks, to);
}

} // namespace

template <class A>
SmoothRows<A>::SmoothRows(const BlockLattice& blocks, const Boxed<float>& field) : size_(blocks.size), field_(&field)
{
  if (field.box.Empty())
    return;
  for (int within = 0; within < size_[0]; ++within) {
    const Step step = StepOf(within, 0);
    offsets_.push_back(step.below + 1);
    fractions_.push_back(step.fraction);
  }
  padded_.resize(static_cast<std::size_t>(field.box.size[0]) + 2);
}

template <class A>
typename SmoothRows<A>::Step SmoothRows<A>::StepOf(int within, int axis) const
{
  const int halves = 2 * within - (size_[axis] - 1); // from the middle of its block, in halves of a voxel
  const bool before = halves < 0;
  return {before ? -1 : 0, static_cast<A>((before ? 2 * size_[axis] + halves : halves) / (2.0 * size_[axis]))};
}

template <class A>
typename SmoothRows<A>::Neighbours SmoothRows<A>::NeighboursOf(int voxel, int axis) const
{
  const Step step = StepOf(voxel % size_[axis], axis);
  const int first = field_->box.first[axis], last = first + field_->box.size[axis] - 1;
  const int below = voxel / size_[axis] + step.below;
  // A neighbour that does not count is not looked at: it may not be there.
  return {std::clamp(below, first, last), std::clamp(step.fraction > A(0) ? below + 1 : below, first, last), step.fraction};
}

template <class A>
const A* SmoothRows<A>::Stretched(int bj, int bk)
{
  Kept& kept = kept_[static_cast<std::size_t>((bj & 1) + 2 * (bk & 1))];
  if (kept.bj != bj || kept.bk != bk) {
    const int blocks = field_->box.size[0];
    const float* from = field_->Row(bj, bk);
    padded_.front() = from[0];
    std::copy_n(from, blocks, padded_.begin() + 1);
    padded_.back() = from[blocks - 1];
    kept.row.resize(static_cast<std::size_t>(blocks) * static_cast<std::size_t>(size_[0]));
    Stretch(padded_.data(), offsets_.data(), fractions_.data(), size_[0], blocks, kept.row.data());
    kept.bj = bj;
    kept.bk = bk;
  }
  return kept.row.data();
}

template <class A>
bool SmoothRows<A>::Row(int j, int k, int first, int end, const unsigned char* wanted, A* values)
{
  const Neighbours y = NeighboursOf(j, 1), z = NeighboursOf(k, 2);
  const int skipped = first - field_->box.first[0] * size_[0];
  const A *const a = Stretched(y.below, z.below) + skipped, *const b = Stretched(y.above, z.below) + skipped,
                 *const c = Stretched(y.below, z.above) + skipped, *const d = Stretched(y.above, z.above) + skipped;
  return Mix(a, b, c, d, y.fraction, z.fraction, wanted, end - first, values);
}

template class SmoothRows<float>;
template class SmoothRows<double>;

} // namespace echorama
