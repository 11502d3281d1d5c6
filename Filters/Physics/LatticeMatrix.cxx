// SPDX-License-Identifier: BSD-3-Clause
// A product reads the matrix once, which is nearly all its time: hence half of the blocks, and 16 bits. The blocks of neighbours
// that come before are those of the rows before, transposed, which are still in the cache.
//
// To coarsen, the triple product is formed one axis after the other: along an axis a coarse node takes itself and half of its
// neighbours, and in the stencil the same holds for the columns, so that each coarse entry is a sum of at most seven fine ones.
// Axis z comes first: it halves what is left to do with loops along x.
#include "LatticeMatrix.h"
#include "Core/Base/Parallel.h"
#include "IndependentLoop.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>

namespace echorama {
namespace {

constexpr float PackedOne = 32767.0f;

// y += blocks * x along a row. Entries of a block are \a across apart from row to row, \a along from column to column.
template <class Entry>
[[gnu::always_inline]] inline void AddBlocks(const Entry* a, std::ptrdiff_t across, std::ptrdiff_t along, const float* const* x,
                                             std::ptrdiff_t shift, int count, float* y)
{
  const Entry *b = a + across, *c = b + across;
  const float *x0 = x[0] + shift, *x1 = x[1] + shift, *x2 = x[2] + shift;
  float *y0 = y, *y1 = y + count, *y2 = y1 + count;
  ECHORAMA_INDEPENDENT
  for (int i = 0; i < count; ++i) {
    y0[i] += static_cast<float>(a[i]) * x0[i] + static_cast<float>(a[along + i]) * x1[i] +
             static_cast<float>(a[2 * along + i]) * x2[i];
    y1[i] += static_cast<float>(b[i]) * x0[i] + static_cast<float>(b[along + i]) * x1[i] +
             static_cast<float>(b[2 * along + i]) * x2[i];
    y2[i] += static_cast<float>(c[i]) * x0[i] + static_cast<float>(c[along + i]) * x1[i] +
             static_cast<float>(c[2 * along + i]) * x2[i];
  }
}

// What a row of nodes is multiplied with: for each of 13 offsets the runs of the row itself, and of the row from which the
// opposite offset leads here (none at the rim).
template <class Entry>
struct ProductRow {
  int padded;
  const float* x[3];
  const Entry* after;      // entries of offset 14 ...
  const Entry* before[13]; // of the same offset, shifted to the node that comes before
  std::ptrdiff_t shift[13];

  ProductRow(const LatticeShape& shape, int j, int k, const LatticeField<float>& field) : padded(shape.Padded())
  {
    for (int c = 0; c < 3; ++c)
      x[c] = field.Component(c) + shape.At(0, j, k);
  }
};

template <class Entry>
[[gnu::always_inline]] inline void AddNeighbours(const ProductRow<Entry>& row, float* product)
{
  const int padded = row.padded;
  for (int n = 0; n < 13; ++n) {
    AddBlocks(row.after + static_cast<std::ptrdiff_t>(9 * n) * padded, 3 * padded, padded, row.x, row.shift[n], padded, product);
    if (row.before[n])
      AddBlocks(row.before[n], padded, 3 * padded, row.x, -row.shift[n], padded, product);
  }
}

void MultiplyFloatRow(const ProductRow<float>& row, float* product)
{
  std::fill(product, product + 3 * row.padded, 0.0f);
  AddBlocks(row.after - 9 * row.padded, 3 * row.padded, row.padded, row.x, 0, row.padded, product);
  AddNeighbours(row, product);
}

void MultiplyPackedRow(const ProductRow<std::int16_t>& row, const float* const* own, float* product)
{
  const int padded = row.padded;
  std::fill(product, product + 3 * padded, 0.0f);
  AddNeighbours(row, product);
  float *y0 = product, *y1 = product + padded, *y2 = y1 + padded;
  const float *x0 = row.x[0], *x1 = row.x[1], *x2 = row.x[2];
  const float *xx = own[0], *xy = own[1], *xz = own[2], *yy = own[3], *yz = own[4], *zz = own[5];
  constexpr float part = 1.0f / PackedOne;
  ECHORAMA_INDEPENDENT
  for (int i = 0; i < padded; ++i) {
    y0[i] = y0[i] * part + (xx[i] * x0[i] + xy[i] * x1[i] + xz[i] * x2[i]);
    y1[i] = y1[i] * part + (xy[i] * x0[i] + yy[i] * x1[i] + yz[i] * x2[i]);
    y2[i] = y2[i] * part + (xz[i] * x0[i] + yz[i] * x1[i] + zz[i] * x2[i]);
  }
}

// What a fine entry gives to a coarse one: fine node 2c + node, fine offset from there, coarse offset from c.
struct Share {
  int node, from, to;
  float weight;
};
constexpr Share shares[] = {{-1, -1, -1, 0.5f}, {-1, 0, -1, 0.25f}, {0, -1, -1, 0.5f}, {-1, 0, 0, 0.25f}, {-1, 1, 0, 0.5f},
                            {0, -1, 0, 0.5f},   {0, 0, 0, 1.0f},    {0, 1, 0, 0.5f},   {1, -1, 0, 0.5f},  {1, 0, 0, 0.25f},
                            {1, 0, 1, 0.25f},   {1, 1, 1, 0.5f},    {0, 1, 1, 0.5f}};

// sum[i] += weight * fine[i], or, along x, of every second one.
void AddRun(float* sum, const float* fine, float weight, int begin, int end)
{
  ECHORAMA_INDEPENDENT
  for (int i = begin; i < end; ++i)
    sum[i] += weight * fine[i];
}

// to = from, scaled at both ends.
void PackRun(const float* from, const float* unscale, const float* other, std::int16_t* to, int count)
{
  ECHORAMA_INDEPENDENT
  for (int i = 0; i < count; ++i) {
    const float value = from[i] * unscale[i] * other[i] * PackedOne;
    to[i] = static_cast<std::int16_t>(std::min(std::max(value + (value < 0.0f ? -0.5f : 0.5f), -PackedOne), PackedOne));
  }
}

// What rounding took from the forces on the nodes, when all of them move as one.
void LostRun(const float* from, const std::int16_t* packed, const float* unscale, const float* other, const float* otherScale,
             float part, float* lost, int begin, int end)
{
  ECHORAMA_INDEPENDENT
  for (int i = begin; i < end; ++i)
    lost[i] += part * (from[i] * unscale[i] * other[i] - static_cast<float>(packed[i]) * (1.0f / PackedOne)) *
               (otherScale[i] * unscale[i]);
}

// How far the node at an offset of 14 + n lies.
std::ptrdiff_t ShiftOf(const LatticeShape& shape, int n)
{
  const int offset = n + LatticeMatrix::Own + 1;
  return (offset / 9 - 1) * shape.slice + (offset / 3 % 3 - 1) * shape.row + offset % 3 - 1;
}

// Where a product finds the blocks of a row of nodes, and of those before it; \a start tells where those of a row begin.
template <class Entry, class Start>
void SetBlocks(ProductRow<Entry>& row, const LatticeShape& shape, int j, int k, const Start& start)
{
  row.after = start(j, k);
  for (int n = 0; n < 13; ++n) {
    const int offset = n + LatticeMatrix::Own + 1, fj = j - (offset / 3 % 3 - 1), fk = k - (offset / 9 - 1);
    const bool isThere = fj >= 0 && fk >= 0 && fj < shape.nodes[1];
    row.before[n] = isThere ? start(fj, fk) + static_cast<std::ptrdiff_t>(9 * n) * row.padded - (offset % 3 - 1) : nullptr;
    row.shift[n] = ShiftOf(shape, n);
  }
}

Eigen::Matrix3f OwnBlock(const LatticeMatrix& matrix, int i, int j, int k)
{
  Eigen::Matrix3f block;
  for (int entry = 0; entry < 9; ++entry)
    block(entry / 3, entry % 3) = matrix.At(i, j, k, LatticeMatrix::Own, entry / 3, entry % 3);
  return block;
}

constexpr int ownRows[6] = {0, 0, 0, 1, 1, 2}, ownColumns[6] = {0, 1, 2, 1, 2, 2};

} // namespace

LatticeMatrix::LatticeMatrix(const LatticeShape& shape)
  : shape_(shape), rowSize_(static_cast<std::ptrdiff_t>(Entries) * shape.Padded() + 2 * LatticeShape::Lanes),
    data_(static_cast<std::size_t>(rowSize_ * shape.nodes[1] * shape.nodes[2]), 0.0f)
{
}

void LatticeMatrix::Clear()
{
  ParallelFor(shape_.nodes[2], [&](std::ptrdiff_t k) {
    float* begin = Row(0, static_cast<int>(k));
    std::fill(begin, begin + rowSize_ * shape_.nodes[1], 0.0f);
  });
}

void LatticeMatrix::KeepOnly(const std::vector<float>& live)
{
  ParallelFor(shape_.nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < shape_.nodes[1]; ++j)
      for (int offset = Own; offset < 27; ++offset) {
        const std::ptrdiff_t shift = (offset / 9 - 1) * shape_.slice + (offset / 3 % 3 - 1) * shape_.row + offset % 3 - 1;
        const float* own = live.data() + shape_.At(0, j, k);
        float* run = Row(j, k) + static_cast<std::ptrdiff_t>((offset - Own) * 9) * shape_.Padded();
        for (int entry = 0; entry < 9; ++entry, run += shape_.Padded())
          for (int i = 0; i < shape_.nodes[0]; ++i)
            run[i] *= own[i] * own[i + shift];
      }
  });
}

void LatticeMatrix::MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const
{
  ProductRow<float> row(shape_, j, k, x);
  SetBlocks(row, shape_, j, k, [this](int rowJ, int rowK) { return Row(rowJ, rowK) + 9 * shape_.Padded(); });
  MultiplyFloatRow(row, product);
}

void LatticeMatrix::Coarsen(int axis, LatticeMatrix& coarse) const
{
  const std::array<int, 3>& nodes = coarse.shape_.nodes;
  const int stride = axis == 0 ? 1 : axis == 1 ? 3 : 9, padded = shape_.Padded(), coarsePadded = coarse.shape_.Padded();
  ParallelFor(nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < nodes[1]; ++j) {
      float* to = coarse.Row(j, k);
      std::fill(to, to + coarse.rowSize_, 0.0f);
      for (int other = 0; other < 9; ++other) // the offsets along the other two axes
        for (const Share& share : shares) {
          const int base = axis == 0 ? other * 3 + 1 : axis == 1 ? other / 3 * 9 + 3 + other % 3 : 9 + other;
          const int target = base + share.to * stride;
          int fj = axis == 1 ? 2 * j + share.node : j, fk = axis == 2 ? 2 * k + share.node : k;
          if (target < Own || fj < 0 || fk < 0 || fj >= shape_.nodes[1] || fk >= shape_.nodes[2])
            continue;
          // A block of a neighbour that comes before is found there, transposed.
          int offset = base + share.from * stride, shift = 0;
          const bool isTurned = offset < Own;
          if (isTurned) {
            shift = offset % 3 - 1;
            fj += offset / 3 % 3 - 1;
            fk += offset / 9 - 1;
            offset = 26 - offset;
            if (fj < 0 || fk < 0 || fj >= shape_.nodes[1] || fk >= shape_.nodes[2])
              continue;
          }
          const float* from = Row(fj, fk) + shift;
          const int begin = std::max(0, -shift), end = shape_.nodes[0] - std::max(0, shift);
          for (int entry = 0; entry < 9; ++entry) {
            const int source = isTurned ? entry % 3 * 3 + entry / 3 : entry;
            const float* fine = from + static_cast<std::ptrdiff_t>((offset - Own) * 9 + source) * padded;
            float* sum = to + static_cast<std::ptrdiff_t>((target - Own) * 9 + entry) * coarsePadded;
            if (axis == 0) {
              for (int i = 0; i < nodes[0]; ++i) {
                const int fi = 2 * i + share.node;
                if (fi >= begin && fi < end)
                  sum[i] += share.weight * fine[fi];
              }
            } else {
              AddRun(sum, fine, share.weight, begin, end);
            }
          }
        }
    }
  });
}

PackedLatticeMatrix::PackedLatticeMatrix(const LatticeShape& shape)
  : shape_(shape),
    data_(static_cast<std::size_t>(Entries * static_cast<std::ptrdiff_t>(shape.Padded()) * shape.nodes[1] * shape.nodes[2] +
                                   2 * LatticeShape::Lanes)),
    scale_(static_cast<std::size_t>(shape.size), 0.0f), unscale_(scale_)
{
  for (int n = 0; n < 6; ++n)
    own_[n] = inverse_[n] = scale_;
}

void PackedLatticeMatrix::Pack(const LatticeMatrix& matrix)
{
  const auto forRows = [&](const auto& body) {
    ParallelFor(shape_.nodes[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < shape_.nodes[1]; ++j)
        body(j, static_cast<int>(k));
    });
  };
  // How large the own blocks are.
  forRows([&](int j, int k) {
    for (int i = 0; i < shape_.nodes[0]; ++i) {
      const auto at = static_cast<std::size_t>(shape_.At(i, j, k));
      const Eigen::Matrix3f block = OwnBlock(matrix, i, j, k);
      const float size = block.trace() / 3.0f, part = size > 0.0f ? (block / size).determinant() : 0.0f;
      scale_[at] = part > 1e-9f ? std::sqrt(block.diagonal().maxCoeff()) : 0.0f;
      unscale_[at] = part > 1e-9f ? 1.0f / scale_[at] : 0.0f;
    }
  });
  // Blocks of neighbours, scaled and rounded.
  const int padded = shape_.Padded();
  forRows([&](int j, int k) {
    const float *unscale = unscale_.data() + shape_.At(0, j, k), *from = matrix.Row(j, k) + 9 * padded;
    std::int16_t* to = data_.data() + RowAt(j, k);
    for (int n = 0; n < 13; ++n)
      for (int entry = 0; entry < 9; ++entry, from += padded, to += padded)
        PackRun(from, unscale, unscale + ShiftOf(shape_, n), to, shape_.nodes[0]);
  });
  // Own blocks, with what the others lost.
  forRows([&](int j, int k) {
    const std::ptrdiff_t at = shape_.At(0, j, k);
    const float *scale = scale_.data() + at, *unscale = unscale_.data() + at;
    std::vector<float> lost(static_cast<std::size_t>(6 * padded), 0.0f);
    for (int n = 0; n < 13; ++n)
      for (const int side : {1, -1}) {
        const int fj = side > 0 ? j : j - ((n + 14) / 3 % 3 - 1), fk = side > 0 ? k : k - ((n + 14) / 9 - 1);
        const int back = side > 0 ? 0 : (n + 14) % 3 - 1; // how far along x the blocks lie before the node
        if (fj < 0 || fk < 0 || fj >= shape_.nodes[1])
          continue;
        const std::ptrdiff_t shift = side * ShiftOf(shape_, n);
        const int begin = std::max(0, back), end = shape_.nodes[0] + std::min(0, back);
        for (int entry = 0; entry < 9; ++entry) {
          const std::ptrdiff_t run = static_cast<std::ptrdiff_t>(9 * n + entry) * padded - back;
          const int row = entry / 3, column = entry % 3,
                    place = std::min(row, column) + std::max(row, column) + (row * column > 0);
          LostRun(matrix.Row(fj, fk) + 9 * padded + run, data_.data() + RowAt(fj, fk) + run, unscale, unscale + shift,
                  scale + shift, row == column ? 1.0f : 0.5f, lost.data() + place * padded, begin, end);
        }
      }
    for (int i = 0; i < shape_.nodes[0]; ++i) {
      Eigen::Matrix3f block = OwnBlock(matrix, i, j, k) * (unscale[i] * unscale[i]);
      for (int n = 0; n < 6; ++n)
        block(ownRows[n], ownColumns[n]) += lost[static_cast<std::size_t>(n * padded + i)];
      SetOwn(at + i, block);
    }
  });
}

// Of a symmetric block the upper triangle counts.
void PackedLatticeMatrix::SetOwn(std::ptrdiff_t at, const Eigen::Matrix3f& block)
{
  const auto node = static_cast<std::size_t>(at);
  const bool isLive = unscale_[node] > 0.0f;
  const Eigen::Matrix3f inverse =
      isLive ? Eigen::Matrix3f(Eigen::Matrix3f(block.selfadjointView<Eigen::Upper>()).inverse()) : Eigen::Matrix3f::Zero();
  for (int n = 0; n < 6; ++n) {
    own_[n][node] = isLive ? block(ownRows[n], ownColumns[n]) : 0.0f;
    inverse_[n][node] = inverse(ownRows[n], ownColumns[n]);
  }
}

void PackedLatticeMatrix::ChangeOwn(int i, int j, int k, const Eigen::Matrix3f& change)
{
  const auto at = static_cast<std::size_t>(shape_.At(i, j, k));
  Eigen::Matrix3f block = change * (unscale_[at] * unscale_[at]);
  for (int n = 0; n < 6; ++n)
    block(ownRows[n], ownColumns[n]) += own_[n][at];
  SetOwn(shape_.At(i, j, k), block);
}

void PackedLatticeMatrix::MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const
{
  ProductRow<std::int16_t> row(shape_, j, k, x);
  SetBlocks(row, shape_, j, k, [this](int rowJ, int rowK) { return data_.data() + RowAt(rowJ, rowK); });
  const float* own[6];
  for (int n = 0; n < 6; ++n)
    own[n] = own_[n].data() + shape_.At(0, j, k);
  MultiplyPackedRow(row, own, product);
}

} // namespace echorama
