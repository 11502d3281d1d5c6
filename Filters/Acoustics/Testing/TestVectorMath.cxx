// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Acoustics/RandomBlocks.h"
#include "Filters/Acoustics/VectorMath.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;

TEST(VectorMath, ExponentialIsRightToItsLastDigits)
{
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const auto x = static_cast<float>(random.Uniform(-80.0, 80.0));
    const double exact = std::exp(static_cast<double>(x));
    // Single precision holds an exponent of 80 to 4e-6.
    ASSERT_NEAR(static_cast<double>(Exponential(x)) / exact, 1.0, 3e-7 + 1e-7 * std::abs(static_cast<double>(x))) << x;
  }
  EXPECT_EQ(Exponential(0.0f), 1.0f);
}

TEST(VectorMath, CosineAndSineOfWholeTurns)
{
  Random random(2);
  for (int i = 0; i < 100000; ++i) {
    const auto turn = static_cast<float>(random.Uniform(-2.0, 2.0));
    const double angle = 6.283185307179586 * static_cast<double>(turn);
    float cosine, sine;
    CosineAndSine(turn, cosine, sine);
    ASSERT_NEAR(static_cast<double>(cosine), std::cos(angle), 2e-6) << turn;
    ASSERT_NEAR(static_cast<double>(sine), std::sin(angle), 2e-6) << turn;
  }
}

TEST(VectorMath, LogarithmNearBothEnds)
{
  Random random(3);
  const auto check = [](double u) {
    const double exact = -std::log1p(-u);
    ASSERT_NEAR(static_cast<double>(MinusLogOfRest(u)), exact, 3e-7 * exact) << u;
  };
  for (int i = 0; i < 100000; ++i) {
    check(random.Uniform());
    check(std::pow(10.0, random.Uniform(-16.0, 0.0)) * 0.999);
    check(1.0 - std::pow(10.0, random.Uniform(-15.0, 0.0)) * 0.999);
  }
  EXPECT_EQ(MinusLogOfRest(0.0), 0.0f);
  check(1.0 - 1.0 / 9007199254740992.0); // the greatest that Random gives
}

TEST(VectorMath, RandomBlocksAreThoseOfRandom)
{
  Random random(4);
  std::uint32_t words[4][24], before[4][24];
  for (int n = 0; n < 4; ++n)
    for (int i = 0; i < 24; ++i)
      words[n][i] = before[n][i] = random.Bits();
  const std::array<std::uint32_t, 2> key{random.Bits(), random.Bits()};
  RandomBlocks(words, key);
  for (int i = 0; i < 24; ++i) {
    const auto block = Random::Block({before[0][i], before[1][i], before[2][i], before[3][i]}, key);
    for (std::size_t n = 0; n < 4; ++n)
      ASSERT_EQ(words[n][i], block[n]);
  }
}
