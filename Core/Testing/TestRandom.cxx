// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include <gtest/gtest.h>
#include <set>

namespace {

using echorama::Random;
using Words = std::array<std::uint32_t, 4>;

// The known answers that the authors of the generator publish with it.
TEST(Random, KnownAnswersOfPhilox)
{
  EXPECT_EQ(Random::Block({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}));
  EXPECT_EQ(Random::Block({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}), (Words{0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}));
  EXPECT_EQ(Random::Block({0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u}, {0xa4093822u, 0x299f31d0u}),
            (Words{0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}));
}

TEST(Random, AStreamIsNamedBySeedAndItem)
{
  Random a(1, 2), again(1, 2);
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(a.Bits(), again.Bits());
  // Seeds and items that differ only in their high words, too.
  std::set<std::uint32_t> firsts;
  for (const std::uint64_t seed : {0ull, 1ull, 1ull << 32, 1ull << 63})
    for (const std::uint64_t item : {0ull, 1ull, 1ull << 32, 1ull << 63})
      firsts.insert(Random(seed, item).Bits());
  EXPECT_EQ(firsts.size(), 16u);
}

TEST(Random, BlocksFollowTheCounter)
{
  Random stream(9, 7);
  for (std::uint32_t block = 0; block < 3; ++block) {
    const Words expected = Random::Block({block, 0, 7, 0}, {9, 0});
    for (const std::uint32_t word : expected)
      EXPECT_EQ(stream.Bits(), word);
  }
}

TEST(Random, UniformFillsItsInterval)
{
  Random random(3);
  const int count = 200000;
  std::array<int, 20> bins{};
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const double u = random.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++bins[static_cast<std::size_t>(u * 20)];
    sum += u;
    squares += u * u;
  }
  double chi = 0.0;
  for (const int bin : bins)
    chi += (bin - count / 20.0) * (bin - count / 20.0) / (count / 20.0);
  EXPECT_LT(chi, 43.8); // 19 degrees of freedom, one in a thousand
  EXPECT_NEAR(sum / count, 0.5, 0.003);
  EXPECT_NEAR(squares / count, 1.0 / 3.0, 0.003);
}

TEST(Random, BelowReachesEveryValueAndNoOther)
{
  Random random(4);
  std::array<int, 7> counts{};
  for (int i = 0; i < 70000; ++i) {
    const std::uint64_t value = random.Below(7);
    ASSERT_LT(value, 7u);
    ++counts[value];
  }
  for (const int count : counts)
    EXPECT_NEAR(count, 10000, 400);
  EXPECT_EQ(random.Below(1), 0u);
  std::uint64_t largest = 0;
  for (int i = 0; i < 1000; ++i)
    largest = std::max(largest, random.Below(std::uint64_t{1} << 63));
  EXPECT_GT(largest, std::uint64_t{1} << 62) << "all bits take part";
}

TEST(Random, NormalHasItsMoments)
{
  Random random(5);
  const int count = 200000;
  double m1 = 0.0, m2 = 0.0, m4 = 0.0;
  for (int i = 0; i < count; ++i) {
    const double x = random.Normal();
    m1 += x / count;
    m2 += x * x / count;
    m4 += x * x * x * x / count;
  }
  EXPECT_NEAR(m1, 0.0, 0.01);
  EXPECT_NEAR(m2, 1.0, 0.015);
  EXPECT_NEAR(m4, 3.0, 0.12);
}

TEST(Random, DirectionsCoverTheSphereEvenly)
{
  Random random(6);
  const int count = 100000;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d d = random.Direction();
    ASSERT_NEAR(d.norm(), 1.0, 1e-14);
    mean += d / count;
    second += d * d.transpose() / count;
  }
  EXPECT_LT(mean.norm(), 0.01);
  EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.01);
}

} // namespace
