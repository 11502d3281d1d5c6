// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Embedding/BlockWindow.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>

namespace echorama {

namespace {

std::vector<double> RandomNumbers(std::size_t count)
{
  std::vector<double> numbers(count);
  for (std::size_t i = 0; i < count; ++i)
    numbers[i] = Random(7, i).Normal();
  return numbers;
}

// From the first to the last: another order, so sums agree but for rounding.
double PlainSum(const std::vector<double>& half, const std::vector<double>& numbers, std::ptrdiff_t middle, std::ptrdiff_t step)
{
  double sum = 0.0;
  for (std::ptrdiff_t d = 1 - static_cast<std::ptrdiff_t>(half.size()); d < static_cast<std::ptrdiff_t>(half.size()); ++d)
    sum += half[static_cast<std::size_t>(std::abs(d))] * numbers[static_cast<std::size_t>(middle + d * step)];
  return sum;
}

} // namespace

TEST(BlockWindow, HalfAWindowIsThatOfAGaussianToThreeDeviations)
{
  const auto half = HalfWindow(2.0);
  ASSERT_EQ(half.size(), 7u);
  for (std::size_t d = 0; d < half.size(); ++d)
    EXPECT_DOUBLE_EQ(half[d], std::exp(-static_cast<double>(d * d) / 8.0));
  EXPECT_EQ(HalfWindow(0.0), std::vector<double>{1.0});
}

// Rows shorter than what is worked out at once, just as long, and with a rest; neighbours and numbers a stride apart.
TEST(BlockWindow, EveryNumberOfARowIsTheSumOverItsWindow)
{
  const auto half = HalfWindow(1.3);
  const std::ptrdiff_t reach = static_cast<std::ptrdiff_t>(half.size()) - 1;
  for (const std::ptrdiff_t step : {1, 90})
    for (const int count : {1, 15, 16, 17, 31, 32, 50, 83}) {
      const std::ptrdiff_t first = reach * step;
      const auto numbers = RandomNumbers(static_cast<std::size_t>(2 * first + count));
      std::vector<double> out(static_cast<std::size_t>(count) + 1, -1.0);
      SumWindow(half, numbers.data() + first, step, count, out.data());
      for (int i = 0; i < count; ++i)
        EXPECT_NEAR(out[static_cast<std::size_t>(i)], PlainSum(half, numbers, first + i, step), 1e-12) << step << " " << count;
      EXPECT_EQ(out.back(), -1.0) << "written beyond the row";
    }
}

// Slices whose numbers lie in different places, one of them empty: within one row the window reaches from the one to the other.
TEST(BlockWindow, AlongZItReachesOverSlicesAndEndsWithThem)
{
  const std::array<int, 3> size{150, 5, 12};
  const auto half = HalfWindow(0.9);
  const int reach = static_cast<int>(half.size()) - 1;
  const auto random = RandomNumbers(static_cast<std::size_t>(size[0] * size[1] * size[2]));
  std::vector<SliceExtent> extents(static_cast<std::size_t>(size[2]));
  std::vector<double> sums(random.size(), 0.0);
  for (int k = 2; k < size[2]; ++k) {
    if (k == 6)
      continue;
    SliceExtent& extent = extents[static_cast<std::size_t>(k)];
    extent.begin = {3 * k, k % 3};
    extent.end = {150 - 5 * (k % 4), 3 + k % 3};
    for (int j = extent.begin[1]; j < extent.end[1]; ++j)
      for (int i = extent.begin[0]; i < extent.end[0]; ++i) {
        const auto at = static_cast<std::size_t>((k * size[1] + j) * size[0] + i);
        sums[at] = random[at];
      }
  }
  const std::vector<double> before = sums;
  for (int j = 0; j < size[1]; ++j)
    SumWindowAlongZ(half, size, extents, j, sums.data());
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        double sum = 0.0;
        for (int other = std::max(0, k - reach); other <= std::min(size[2] - 1, k + reach); ++other)
          sum += half[static_cast<std::size_t>(std::abs(other - k))] *
                 before[static_cast<std::size_t>((other * size[1] + j) * size[0] + i)];
        ASSERT_NEAR(sums[static_cast<std::size_t>((k * size[1] + j) * size[0] + i)], sum, 1e-12) << i << " " << j << " " << k;
      }
}

} // namespace echorama
