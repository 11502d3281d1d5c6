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
    BlendWeights(scales, 3, BlendPower(b), weights);
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
  BlendWeights(scales, 3, BlendPower(0.0), weights);
  for (const float w : weights)
    EXPECT_FLOAT_EQ(w, 1.0f / 3.0f);
  BlendWeights(scales, 3, BlendPower(1000.0), weights); // both powers underflow to 0 when they are not divided first
  EXPECT_EQ(weights[0], 0.0f);
  EXPECT_EQ(weights[1], 1.0f);
  EXPECT_EQ(weights[2], 0.0f);
}

TEST(BlendWeights, AllScalesZeroIsAnEvenShare)
{
  const float scales[] = {0.0f, 0.0f, 0.0f, 0.0f};
  float weights[4];
  for (const double b : {0.0, 1.5, 1000.0}) {
    BlendWeights(scales, 4, BlendPower(b), weights);
    for (const float w : weights)
      EXPECT_EQ(w, 0.25f);
  }
}

TEST(BlendWeights, SumFedOneByOneGivesTheSame)
{
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t n = 1 + random.Below(20);
    const double bs[] = {0.0, 0.5, 1.0, 1.5, 2.0, 30.0, 1000.0};
    const BlendPower power(bs[random.Below(7)]);
    std::vector<float> scales(n), weights(n), values(n);
    BlendSum<float> sum;
    for (std::size_t i = 0; i < n; ++i) {
      scales[i] = random.Below(4) == 0 ? 0.0f : static_cast<float>(random.Uniform());
      values[i] = static_cast<float>(random.Uniform(0.0, 255.0));
      sum.Add(values[i], scales[i], power);
    }
    BlendWeights(scales.data(), n, power, weights.data());
    EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1.0, 1e-5);
    double mean = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_GE(weights[i], 0.0f);
      EXPECT_LE(weights[i], 1.0f);
      EXPECT_NEAR(sum.Weight(scales[i], power), weights[i], 1e-4) << "trial " << trial;
      mean += static_cast<double>(weights[i]) * values[i];
    }
    EXPECT_NEAR(sum.mean, mean, 0.02) << "trial " << trial;
  }
}

TEST(BlendWeights, FactorsMultiplyTheWeights)
{
  Random random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t n = 1 + random.Below(8);
    const double bs[] = {0.0, 0.01, 1.0, 1.5, 30.0};
    const double b = bs[random.Below(5)];
    const BlendPower power(b);
    std::vector<float> scales(n), factors(n), values(n);
    std::vector<double> weights(n);
    BlendSum<float> sum;
    double total = 0.0, mean = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      scales[i] = static_cast<float>(random.Uniform(0.05, 1.0));
      factors[i] = random.Below(3) == 0 ? 0.01f : static_cast<float>(random.Uniform(0.01, 1.0));
      values[i] = static_cast<float>(random.Uniform(0.0, 255.0));
      sum.Add(values[i], scales[i], power, factors[i]);
      total += weights[i] = static_cast<double>(factors[i]) * std::pow(static_cast<double>(scales[i]), b);
    }
    for (std::size_t i = 0; i < n; ++i) {
      mean += weights[i] / total * static_cast<double>(values[i]);
      EXPECT_NEAR(sum.Weight(scales[i], power, factors[i]), weights[i] / total, 1e-4) << "trial " << trial;
    }
    EXPECT_NEAR(sum.mean, mean, 0.02) << "trial " << trial;
  }
}

TEST(BlendWeights, EqualValuesStayToTheLastBit)
{
  Random random(2);
  const BlendPower power(1.5);
  for (const float value : {0.1f, 77.0f, 65535.0f, -1.0e-20f}) {
    BlendSum<float> sum;
    for (int i = 0; i < 20; ++i) {
      sum.Add(value, static_cast<float>(random.Uniform()), power, static_cast<float>(random.Uniform(0.01, 1.0)));
      EXPECT_EQ(sum.mean, value);
    }
  }
}
