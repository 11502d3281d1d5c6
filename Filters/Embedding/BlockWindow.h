// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace echorama {

/// One half of a Gaussian window: its weight in the middle, which is 1, and at 1, 2, ... steps. \a sigma in steps; 0: the
/// middle alone.
std::vector<double> HalfWindow(double sigma);

/// out[i], i in [0, count): the sum over a window of the numbers \a step apart around middle[i], which must all be there.
void SumWindow(const std::vector<double>& half, const double* middle, std::ptrdiff_t step, int count, double* out);

/// Where a slice of sums is not 0: columns and rows [begin, end).
struct SliceExtent {
  std::array<int, 2> begin{0, 0}, end{0, 0};
  bool Empty() const { return end[0] <= begin[0] || end[1] <= begin[1]; }
};

/// The window along z, in place, over row \a j of all slices: \a sums has slices of size[0] x size[1] numbers, which are 0 beyond
/// \a extents.
void SumWindowAlongZ(const std::vector<double>& half, const std::array<int, 3>& size, const std::vector<SliceExtent>& extents,
                     int j, double* sums);

} // namespace echorama
