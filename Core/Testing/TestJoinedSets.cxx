// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/JoinedSets.h"
#include "Core/Base/Random.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

TEST(JoinedSets, AreNamedByTheirSmallestMemberInWhateverOrderTheyAreJoined)
{
  JoinedSets<int> sets(90);
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(sets.Add(), 90 + i);
  Random random(3);
  std::vector<std::pair<int, int>> pairs; // of numbers that are alike modulo 7
  for (int i = 7; i < 100; ++i)
    pairs.emplace_back(i, i - 7);
  for (std::size_t i = pairs.size(); i > 1; --i)
    std::swap(pairs[i - 1], pairs[random.Below(i)]);
  for (const auto& [a, b] : pairs)
    EXPECT_TRUE(sets.Join(a, b)) << a;
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(sets.Of(i), i % 7);
    EXPECT_FALSE(sets.Join(i, 98 - 7 * (i / 7) + i % 7 - (i % 7 > 1 ? 7 : 0))) << i;
  }
  EXPECT_TRUE(sets.Join(6, 93)); // 93 = 7 * 13 + 2
  EXPECT_EQ(sets.Of(97), 2);
}

} // namespace
