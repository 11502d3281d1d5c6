// SPDX-License-Identifier: BSD-3-Clause
// A product reads the matrix once, which is all its time. To coarsen, the triple product is formed one axis after the other:
// along an axis a coarse node takes itself and half of its neighbours, and in the stencil the same holds for the columns, so that
// each coarse entry is a sum of at most seven fine ones. Axis z comes first: it halves what is left to do with loops along x.
#include "LatticeMatrix.h"
#include "Core/Base/Multiversion.h"
#include "Core/Base/Parallel.h"
#include <algorithm>

namespace echorama {
namespace {

ECHORAMA_HOT void StencilRow(const float* a, int padded, const float* const* x, const std::ptrdiff_t* shifts, float* product)
{
  float *y0 = product, *y1 = product + padded, *y2 = product + 2 * padded;
  std::fill(product, product + 3 * padded, 0.0f);
  for (int offset = 0; offset < 27; ++offset, a += 9 * padded) {
    const float *x0 = x[0] + shifts[offset], *x1 = x[1] + shifts[offset], *x2 = x[2] + shifts[offset];
    const float *a0 = a, *a1 = a + 3 * padded, *a2 = a + 6 * padded;
#pragma GCC ivdep
    for (int i = 0; i < padded; ++i) {
      y0[i] += a0[i] * x0[i] + a0[padded + i] * x1[i] + a0[2 * padded + i] * x2[i];
      y1[i] += a1[i] * x0[i] + a1[padded + i] * x1[i] + a1[2 * padded + i] * x2[i];
      y2[i] += a2[i] * x0[i] + a2[padded + i] * x1[i] + a2[2 * padded + i] * x2[i];
    }
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

void LatticeMatrix::MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const
{
  std::ptrdiff_t shifts[27];
  for (int offset = 0; offset < 27; ++offset)
    shifts[offset] = (offset / 9 - 1) * shape_.slice + (offset / 3 % 3 - 1) * shape_.row + offset % 3 - 1;
  const std::ptrdiff_t at = shape_.At(0, j, k);
  const float* const starts[3] = {x.Component(0) + at, x.Component(1) + at, x.Component(2) + at};
  StencilRow(Row(j, k), shape_.Padded(), starts, shifts, product);
}

LatticeMatrix LatticeMatrix::Coarsened(int axis, const std::vector<float>* live) const
{
  std::array<int, 3> nodes = shape_.nodes;
  nodes[static_cast<std::size_t>(axis)] = CoarseCount(nodes[static_cast<std::size_t>(axis)]);
  LatticeMatrix coarse{LatticeShape(nodes)};
  const int stride = axis == 0 ? 1 : axis == 1 ? 3 : 9, padded = shape_.Padded(), coarsePadded = coarse.shape_.Padded();
  ParallelFor(nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < nodes[1]; ++j) {
      float* to = coarse.Row(j, k);
      for (const Share& share : shares) {
        const int fj = axis == 1 ? 2 * j + share.node : j, fk = axis == 2 ? 2 * k + share.node : k;
        if (fj < 0 || fk < 0 || fj >= shape_.nodes[1] || fk >= shape_.nodes[2])
          continue;
        const float* from = Row(fj, fk);
        for (int other = 0; other < 9; ++other) { // the offsets along the other two axes
          const int base = axis == 0 ? other * 3 + 1 : axis == 1 ? other / 3 * 9 + 3 + other % 3 : 9 + other;
          const float* mask = live ? live->data() + shape_.At(0, fj, fk) : nullptr;
          const int offset = base + share.from * stride;
          const std::ptrdiff_t shift = (offset / 9 - 1) * shape_.slice + (offset / 3 % 3 - 1) * shape_.row + offset % 3 - 1;
          for (int entry = 0; entry < 9; ++entry) {
            const float* fine = from + static_cast<std::ptrdiff_t>(offset * 9 + entry) * padded;
            float* sum = to + static_cast<std::ptrdiff_t>((base + share.to * stride) * 9 + entry) * coarsePadded;
            if (axis == 0) {
              for (int i = 0; i < nodes[0]; ++i) {
                const int fi = 2 * i + share.node;
                if (fi >= 0 && fi < shape_.nodes[0])
                  sum[i] += share.weight * (mask ? mask[fi] * mask[fi + shift] : 1.0f) * fine[fi];
              }
            } else if (mask) {
#pragma GCC ivdep
              for (int i = 0; i < padded; ++i)
                sum[i] += share.weight * mask[i] * mask[i + shift] * fine[i];
            } else {
#pragma GCC ivdep
              for (int i = 0; i < padded; ++i)
                sum[i] += share.weight * fine[i];
            }
          }
        }
      }
    }
  });
  return coarse;
}

} // namespace echorama
