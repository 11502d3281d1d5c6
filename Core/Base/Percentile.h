// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

namespace echorama {

/// The least of the numbers (at least one) that a \a share, in [0, 1], of them does not exceed: nearest rank.
inline double Percentile(std::vector<double> numbers, double share)
{
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(numbers.size()))) - 1;
  const auto nth = numbers.begin() + std::max<std::ptrdiff_t>(rank, 0);
  std::nth_element(numbers.begin(), nth, numbers.end());
  return *nth;
}

/// The upper one of the two in the middle where their number is even. At least one value.
inline double Median(std::vector<double> values)
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

} // namespace echorama
