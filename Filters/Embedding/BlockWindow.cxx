// SPDX-License-Identifier: BSD-3-Clause
//
// Sixteen neighbours at a time, whose sums stay in registers. Each number is summed from the middle outwards, so that it does not
// depend on how many are worked out side by side.
#include "BlockWindow.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {

namespace {

constexpr int Piece = 16;

// Four numbers, from anywhere in memory.
using Quad = double __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void StartQuad(Quad& sum, double weight, const double* middle)
{
  std::memcpy(&sum, middle, sizeof sum);
  sum *= weight;
}

[[gnu::always_inline]] inline void AddQuads(Quad& sum, double weight, const double* before, const double* after)
{
  Quad a, b;
  std::memcpy(&a, before, sizeof a);
  std::memcpy(&b, after, sizeof b);
  sum += weight * (a + b);
}

[[gnu::always_inline]] inline void SumPiece(const double* half, int reach, const double* middle, std::ptrdiff_t step, double* out)
{
  Quad s0, s1, s2, s3;
  StartQuad(s0, half[0], middle);
  StartQuad(s1, half[0], middle + 4);
  StartQuad(s2, half[0], middle + 8);
  StartQuad(s3, half[0], middle + 12);
  for (int d = 1; d <= reach; ++d) {
    const double *before = middle - d * step, *after = middle + d * step;
    AddQuads(s0, half[d], before, after);
    AddQuads(s1, half[d], before + 4, after + 4);
    AddQuads(s2, half[d], before + 8, after + 8);
    AddQuads(s3, half[d], before + 12, after + 12);
  }
  std::memcpy(out, &s0, sizeof s0);
  std::memcpy(out + 4, &s1, sizeof s1);
  std::memcpy(out + 8, &s2, sizeof s2);
  std::memcpy(out + 12, &s3, sizeof s3);
}

void SumPieces(const double* half, int reach, const double* middle, std::ptrdiff_t step, int count, double* out)
{
  if (count >= Piece) {
    for (int next = 0; next < count; next += Piece) {
      const int i = std::min(next, count - Piece); // the last piece may overlap the one before
      SumPiece(half, reach, middle + i, step, out + i);
    }
    return;
  }
  for (int i = 0; i < count; ++i) {
    double sum = half[0] * middle[i];
    for (int d = 1; d <= reach; ++d)
      sum += half[d] * (middle[i - d * step] + middle[i + d * step]);
    out[i] = sum;
  }
}

} // namespace

std::vector<double> HalfWindow(double sigma)
{
  std::vector<double> half(sigma > 0.0 ? static_cast<std::size_t>(std::ceil(3.0 * sigma)) + 1 : 1, 1.0);
  for (std::size_t d = 1; d < half.size(); ++d)
    half[d] = std::exp(-0.5 * static_cast<double>(d * d) / (sigma * sigma));
  return half;
}

void SumWindow(const std::vector<double>& half, const double* middle, std::ptrdiff_t step, int count, double* out)
{
  SumPieces(half.data(), static_cast<int>(half.size()) - 1, middle, step, count, out);
}

void SumWindowAlongZ(const std::vector<double>& half, const std::array<int, 3>& size, const std::vector<SliceExtent>& extents,
                     int j, double* sums)
{
  // What of the row is not 0 in some slice, and the slices of which that may be so.
  int first = size[0], end = 0, from = size[2], to = 0;
  for (int k = 0; k < size[2]; ++k) {
    const SliceExtent& extent = extents[static_cast<std::size_t>(k)];
    if (extent.Empty() || j < extent.begin[1] || j >= extent.end[1])
      continue;
    first = std::min(first, extent.begin[0]);
    end = std::max(end, extent.end[0]);
    from = std::min(from, k);
    to = k + 1;
  }
  const int reach = static_cast<int>(half.size()) - 1;
  if (from >= to || reach == 0)
    return;
  constexpr int width = 4 * Piece;
  const int firstOut = std::max(0, from - reach), endOut = std::min(size[2], to + reach);
  const std::ptrdiff_t slice = static_cast<std::ptrdiff_t>(size[0]) * size[1];
  thread_local std::vector<double> strip;
  strip.assign(static_cast<std::size_t>(endOut - firstOut + 2 * reach) * width, 0.0); // beyond both ends there is nothing
  for (int i = first; i < end; i += width) {
    const int count = std::min(width, end - i);
    double* const row = sums + static_cast<std::ptrdiff_t>(j) * size[0] + i;
    double* const middle = strip.data() + static_cast<std::ptrdiff_t>(reach) * width;
    for (int k = from; k < to; ++k)
      std::copy_n(row + k * slice, count, middle + static_cast<std::ptrdiff_t>(k - firstOut) * width);
    for (int k = firstOut; k < endOut; ++k)
      SumWindow(half, middle + static_cast<std::ptrdiff_t>(k - firstOut) * width, width, count, row + k * slice);
  }
}

} // namespace echorama
