// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Acoustics/RaySamples.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <vector>

using namespace echorama;

namespace {

std::vector<std::vector<double>> Points(Sampling sampling, std::uint32_t count, int dimensions, std::uint64_t seed = 1,
                                        std::uint64_t beam = 0)
{
  std::vector<std::vector<double>> points(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    RaySamples samples(sampling, seed, beam, i, count);
    for (int d = 0; d < dimensions; ++d)
      points[i].push_back(samples.Next());
  }
  return points;
}

} // namespace

TEST(RaySamples, LieInTheUnitIntervalAndAreSeeded)
{
  for (const Sampling sampling : {Sampling::Random, Sampling::Stratified, Sampling::Sobol}) {
    const auto points = Points(sampling, 1000, 30);
    std::array<double, 30> means{};
    for (const auto& point : points)
      for (std::size_t d = 0; d < 30; ++d) {
        EXPECT_GE(point[d], 0.0);
        EXPECT_LT(point[d], 1.0);
        means[d] += point[d] / 1000;
      }
    for (const double mean : means)
      EXPECT_NEAR(mean, 0.5, 0.05);
    EXPECT_EQ(points, Points(sampling, 1000, 30));
    EXPECT_NE(points, Points(sampling, 1000, 30, 2));
    EXPECT_NE(points, Points(sampling, 1000, 30, 1, 1));
  }
}

TEST(RaySamples, EveryStratumOnce)
{
  for (const std::uint32_t count : {1u, 2u, 3u, 17u, 100u, 256u, 1000u}) {
    const auto points = Points(Sampling::Stratified, count, 5);
    for (std::size_t d = 0; d < 5; ++d) {
      std::vector<int> hits(count, 0);
      for (const auto& point : points)
        ++hits[static_cast<std::size_t>(point[d] * count)];
      EXPECT_EQ(std::count(hits.begin(), hits.end(), 1), static_cast<std::ptrdiff_t>(count));
    }
  }
}

TEST(RaySamples, SobolFillsEveryElementaryInterval)
{
  // Scrambling keeps the net: of 2^m points each has its own interval of 2^-m in every dimension, and in the first two every
  // box of that area has one.
  for (const unsigned m : {4u, 8u}) {
    const std::uint32_t count = 1u << m;
    for (std::uint64_t beam = 0; beam < 5; ++beam) {
      const auto points = Points(Sampling::Sobol, count, RaySamples::sobolDimensions, 7, beam);
      for (std::size_t d = 0; d < static_cast<std::size_t>(RaySamples::sobolDimensions); ++d) {
        std::set<int> intervals;
        for (const auto& point : points)
          intervals.insert(static_cast<int>(point[d] * count));
        EXPECT_EQ(intervals.size(), count) << d;
      }
      for (unsigned split = 0; split <= m; ++split) {
        std::set<std::pair<int, int>> boxes;
        for (const auto& point : points)
          boxes.insert({static_cast<int>(point[0] * (1u << split)), static_cast<int>(point[1] * (1u << (m - split)))});
        EXPECT_EQ(boxes.size(), count) << split;
      }
    }
  }
}

TEST(RaySamples, IntegratesAtItsRate)
{
  // RMS error over beams of a smooth function of four numbers.
  const auto rms = [](Sampling sampling, std::uint32_t count) {
    double squares = 0.0;
    for (std::uint64_t beam = 0; beam < 60; ++beam) {
      double sum = 0.0;
      for (const auto& p : Points(sampling, count, 4, 3, beam))
        sum += p[0] * p[1] * std::exp(p[2]) * std::cos(p[3]);
      const double error = sum / count - 0.25 * (std::exp(1.0) - 1.0) * std::sin(1.0);
      squares += error * error / 60;
    }
    return std::sqrt(squares);
  };
  const auto slope = [&rms](Sampling sampling) { return std::log2(rms(sampling, 1024) / rms(sampling, 64)) / 4.0; };
  EXPECT_NEAR(slope(Sampling::Random), -0.5, 0.1);
  EXPECT_LT(slope(Sampling::Sobol), -0.9);
  EXPECT_LT(rms(Sampling::Stratified, 256), 0.7 * rms(Sampling::Random, 256));
}
