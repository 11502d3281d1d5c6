// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Stitching/BlendWeights.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <vector>

using namespace echorama;

namespace {
constexpr float infinite = std::numeric_limits<float>::infinity();
}

TEST(BlendWeights, ScaleIsTheRampFromEmptyToPure)
{
  EXPECT_FLOAT_EQ(BlendScale(3.0f, 1.0f), 0.25f);
  EXPECT_EQ(BlendScale(0.0f, 2.0f), 1.0f);
  EXPECT_EQ(BlendScale(2.0f, 0.0f), 0.0f);
}

TEST(BlendWeights, ScaleIsDefinedWhereARegionIsMissing)
{
  EXPECT_EQ(BlendScale(2.0f, infinite), 1.0f);
  EXPECT_EQ(BlendScale(infinite, 2.0f), 0.0f);
  EXPECT_EQ(BlendScale(infinite, infinite), 1.0f);
}

TEST(BlendWeights, FollowTheFormula)
{
  const float scales[] = {0.2f, 0.7f, 0.5f};
  for (const double b : {1.0, 1.5, 2.0, 3.7}) {
    float weights[3];
    BlendWeights(scales, nullptr, 3, BlendPower(b), weights);
    double sum = 0.0;
    for (const float s : scales)
      sum += std::pow(s, b);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(weights[i], std::pow(scales[i], b) / sum, 1e-6) << "b = " << b;
  }
}

TEST(BlendWeights, ExtremeSharpness)
{
  const float scales[] = {1e-3f, 2e-3f, 0.0f};
  float weights[3];
  BlendWeights(scales, nullptr, 3, BlendPower(0.0), weights);
  for (const float w : weights)
    EXPECT_FLOAT_EQ(w, 1.0f / 3.0f);
  BlendWeights(scales, nullptr, 3, BlendPower(1000.0), weights); // both powers underflow to 0 when they are not divided first
  EXPECT_EQ(weights[0], 0.0f);
  EXPECT_EQ(weights[1], 1.0f);
  EXPECT_EQ(weights[2], 0.0f);
}

TEST(BlendWeights, AllScalesZeroIsAnEvenShare)
{
  const float scales[] = {0.0f, 0.0f, 0.0f, 0.0f};
  float weights[4];
  for (const double b : {0.0, 1.5, 1000.0}) {
    BlendWeights(scales, nullptr, 4, BlendPower(b), weights);
    for (const float w : weights)
      EXPECT_EQ(w, 0.25f);
  }
}

TEST(BlendWeights, FactorsMultiplyTheWeights)
{
  Random random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t n = 1 + random.Below(20);
    const double bs[] = {0.0, 0.01, 1.0, 1.5, 30.0, 32.0};
    const double b = bs[random.Below(6)];
    const BlendPower power(b);
    std::vector<float> scales(n), factors(n), weights(n);
    std::vector<double> expected(n);
    double total = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      scales[i] = static_cast<float>(random.Uniform(0.05, 1.0));
      factors[i] = random.Below(3) == 0 ? 0.01f : static_cast<float>(random.Uniform(0.01, 1.0));
      total += expected[i] = static_cast<double>(factors[i]) * std::pow(static_cast<double>(scales[i]), b);
    }
    BlendWeights(scales.data(), factors.data(), n, power, weights.data());
    EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1.0, 1e-5);
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_NEAR(weights[i], expected[i] / total, 1e-4) << "trial " << trial;
  }
}

TEST(BlendWeights, PowersAgreeWithThePowerFunction)
{
  for (const double b : {0.0, 0.5, 1.0, 1.5, 2.0, 32.0, 1000.0})
    for (int step = 0; step <= 100; ++step) {
      const float ratio = 0.01f * static_cast<float>(step);
      EXPECT_NEAR(BlendPower(b)(ratio), std::pow(static_cast<double>(ratio), b), 1e-5) << b << " " << ratio;
    }
}
