// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Stitching/BlendWeights.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

using namespace echorama;

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

using Rows = std::vector<std::vector<float>>; // one per volume

std::vector<const float*> PointersTo(const Rows& rows)
{
  std::vector<const float*> pointers;
  for (const auto& row : rows)
    pointers.push_back(row.empty() ? nullptr : row.data());
  return pointers;
}

// \param factors none, or a row per volume; an empty one: 1
Rows WeightsOf(const Rows& scales, double b, const Rows& factors = {})
{
  const std::size_t count = scales.front().size();
  Rows weights(scales.size(), std::vector<float>(count));
  std::vector<float*> to;
  for (auto& row : weights)
    to.push_back(row.data());
  std::vector<float> scratch(2 * count);
  BlendWeights(PointersTo(scales).data(), factors.empty() ? nullptr : PointersTo(factors).data(), scales.size(), count,
               BlendPower(b), to.data(), scratch.data());
  return weights;
}

// The weights of volumes at one voxel.
std::vector<float> WeightsAt(const std::vector<float>& scales, double b)
{
  Rows rows;
  for (const float scale : scales)
    rows.push_back({scale});
  std::vector<float> weights;
  for (const auto& row : WeightsOf(rows, b))
    weights.push_back(row.front());
  return weights;
}

// What a blend of details is made of, at a row of voxels, and what the formulas make of it, voxel by voxel and in double.
template <class A>
struct Scene {
  std::vector<std::vector<A>> value, low;
  Rows weight, share, deviation;
  std::vector<float> correlation;
  float most = 2.0f;

  Scene(std::size_t volumes, std::size_t count, std::uint64_t seed) : correlation(volumes * volumes, 1.0f)
  {
    Random random(seed);
    Rows scales(volumes, std::vector<float>(count));
    for (auto& row : scales)
      for (float& scale : row)
        scale = static_cast<float>(random.Uniform(0.0, 1.0));
    weight = WeightsOf(scales, 1.5);
    share = WeightsOf(scales, 32.0);
    for (std::size_t v = 0; v < volumes; ++v) {
      value.emplace_back(count);
      low.emplace_back(count);
      deviation.emplace_back(count);
      for (std::size_t i = 0; i < count; ++i) {
        low[v][i] = static_cast<A>(random.Uniform(20.0, 200.0));
        value[v][i] = low[v][i] + static_cast<A>(random.Uniform(-20.0, 20.0));
        deviation[v][i] = random.Below(7) == 0 ? 0.0f : static_cast<float>(random.Uniform(1.0, 30.0));
      }
      for (std::size_t u = 0; u < v; ++u)
        correlation[v * volumes + u] = correlation[u * volumes + v] = static_cast<float>(random.Uniform(0.0, 1.0));
    }
  }

  std::vector<A> Blended(bool split) const
  {
    const std::size_t count = value.front().size();
    std::vector<const A*> values, lows;
    for (const auto& of : value)
      values.push_back(of.data());
    for (const auto& of : low)
      lows.push_back(of.data());
    const auto weights = PointersTo(weight), shares = PointersTo(share), deviations = PointersTo(deviation);
    std::vector<float> scratch(2 * count);
    std::vector<A> sum(count), result(count);
    BlendRow<A> row;
    row.volumes = value.size();
    row.count = count;
    row.value = values.data();
    row.weight = weights.data();
    row.low = lows.data();
    row.share = shares.data();
    row.deviation = deviations.data();
    row.correlation = correlation.data();
    row.mostAmplified = most;
    row.scratch = scratch.data();
    if (split)
      BlendSplit(row, sum.data(), result.data());
    else
      BlendMean(row, result.data());
    return result;
  }

  double Expected(std::size_t i, bool split) const
  {
    double mean = 0.0, smooth = 0.0, strength = 0.0, sum = 0.0, variance = 0.0;
    for (std::size_t v = 0; v < value.size(); ++v) {
      mean += static_cast<double>(weight[v][i]) * static_cast<double>(value[v][i]);
      smooth += static_cast<double>(weight[v][i]) * static_cast<double>(low[v][i]);
      strength += static_cast<double>(weight[v][i]) * static_cast<double>(deviation[v][i]);
    }
    for (std::size_t v = 0; v < value.size(); ++v) {
      const double own = deviation[v][i], h = share[v][i];
      const double amplified =
          own > 0.0 ? std::clamp(strength / own, 1.0 / static_cast<double>(most), static_cast<double>(most)) : 1.0;
      sum += h * amplified * static_cast<double>(value[v][i] - low[v][i]);
      for (std::size_t u = 0; u < value.size(); ++u)
        variance += h * static_cast<double>(share[u][i]) * static_cast<double>(correlation[v * value.size() + u]);
    }
    return split ? smooth + sum / std::sqrt(variance) : mean;
  }
};

template <class A>
void ExpectFormulas()
{
  for (std::size_t volumes = 1; volumes <= 5; ++volumes)
    for (const std::size_t count : {std::size_t(1), std::size_t(7), std::size_t(16), std::size_t(61)})
      for (const bool split : {false, true}) {
        const Scene<A> scene(volumes, count, 10 * count + volumes);
        const std::vector<A> blended = scene.Blended(split);
        for (std::size_t i = 0; i < count; ++i)
          ASSERT_NEAR(blended[i], scene.Expected(i, split), 1e-3) << volumes << " volumes, voxel " << i << " of " << count;
      }
}

} // namespace

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
  const std::vector<float> scales{0.2f, 0.7f, 0.5f};
  for (const double b : {1.0, 1.5, 2.0, 3.7}) {
    const std::vector<float> weights = WeightsAt(scales, b);
    double sum = 0.0;
    for (const float s : scales)
      sum += std::pow(s, b);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(weights[i], std::pow(scales[i], b) / sum, 1e-6) << "b = " << b;
  }
}

TEST(BlendWeights, ExtremeSharpness)
{
  const std::vector<float> scales{1e-3f, 2e-3f, 0.0f};
  for (const float w : WeightsAt(scales, 0.0))
    EXPECT_FLOAT_EQ(w, 1.0f / 3.0f);
  // Both powers underflow to 0 when they are not divided first.
  EXPECT_EQ(WeightsAt(scales, 1000.0), (std::vector<float>{0.0f, 1.0f, 0.0f}));
}

TEST(BlendWeights, AllScalesZeroIsAnEvenShare)
{
  for (const double b : {0.0, 1.5, 1000.0})
    for (const float w : WeightsAt({0.0f, 0.0f, 0.0f, 0.0f}, b))
      EXPECT_EQ(w, 0.25f);
}

TEST(BlendWeights, FactorsMultiplyTheWeights)
{
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t n = 1 + random.Below(20), count = 1 + random.Below(40);
    const double bs[] = {0.0, 0.01, 1.0, 1.5, 30.0, 32.0};
    const double b = bs[random.Below(6)];
    Rows scales(n, std::vector<float>(count)), factors(n);
    std::vector<std::vector<double>> expected(n, std::vector<double>(count));
    std::vector<double> total(count, 0.0);
    for (std::size_t v = 0; v < n; ++v) {
      if (random.Below(4) > 0)
        factors[v].resize(count);
      for (std::size_t i = 0; i < count; ++i) {
        scales[v][i] = static_cast<float>(random.Uniform(0.05, 1.0));
        if (!factors[v].empty())
          factors[v][i] = random.Below(3) == 0 ? 0.01f : static_cast<float>(random.Uniform(0.01, 1.0));
        const double factor = factors[v].empty() ? 1.0 : static_cast<double>(factors[v][i]);
        total[i] += expected[v][i] = factor * std::pow(static_cast<double>(scales[v][i]), b);
      }
    }
    const Rows weights = WeightsOf(scales, b, factors);
    for (std::size_t i = 0; i < count; ++i) {
      double sum = 0.0;
      for (std::size_t v = 0; v < n; ++v) {
        sum += static_cast<double>(weights[v][i]);
        ASSERT_NEAR(weights[v][i], expected[v][i] / total[i], 1e-4) << "trial " << trial << ", voxel " << i;
      }
      ASSERT_NEAR(sum, 1.0, 1e-5);
    }
  }
}

TEST(BlendWeights, PowersAgreeWithThePowerFunction)
{
  std::vector<float> ratios;
  for (int step = 0; step <= 100; ++step)
    ratios.push_back(0.01f * static_cast<float>(step));
  const std::vector<float> ones(ratios.size(), 1.0f);
  for (const double b : {0.0, 0.5, 1.0, 1.5, 2.0, 32.0, 1000.0}) {
    const Rows weights = WeightsOf({ratios, ones}, b);
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      const double power = std::pow(static_cast<double>(ratios[i]), b);
      EXPECT_NEAR(weights[0][i], power / (1.0 + power), 1e-5) << b << " " << ratios[i];
    }
  }
}

TEST(BlendWeights, MeansAndDetailsFollowTheirFormulas)
{
  ExpectFormulas<float>();
  ExpectFormulas<double>();
}

TEST(BlendWeights, WhatIsTheSameInAllStaysToTheLastBit)
{
  Scene<float> scene(4, 61, 5);
  for (std::size_t v = 1; v < 4; ++v) {
    scene.value[v] = scene.value[0];
    scene.low[v] = scene.low[0];
  }
  EXPECT_EQ(scene.Blended(false), scene.value[0]);
  scene.value = scene.low; // no details
  EXPECT_EQ(scene.Blended(true), scene.low[0]);
}

TEST(BlendWeights, GainsAndVoxelsOfOneVolumeAlone)
{
  const std::vector<float> value{1.0f, 2.0f, 3.0f, 4.0f, 5.0f};
  std::vector<float> gained(5), shown(5, -1.0f);
  ApplyGain(value.data(), 2.0f, 0.5f, 5, gained.data());
  EXPECT_EQ(gained, (std::vector<float>{2.5f, 4.5f, 6.5f, 8.5f, 10.5f}));
  // Bit 1 of where a volume is says something else.
  const unsigned char inside[] = {1, 1, 0, 2, 3}, coverage[] = {1, 2, 1, 1, 1};
  ShowAlone(value.data(), inside, coverage, 2.0f, 0.5f, 5, shown.data());
  EXPECT_EQ(shown, (std::vector<float>{2.5f, -1.0f, -1.0f, -1.0f, 10.5f}));
}
