// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Embedding/SpeckleLevel.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;

constexpr std::array<int, 3> size{31, 29, 27}, middle{15, 14, 13}, reach{12, 12, 12};

template <class T>
Volume<T> Made(const std::function<double(int i, int j, int k, double rayleigh)>& value)
{
  Volume<T> made(size);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        Random random(2, static_cast<std::uint64_t>((k * size[1] + j) * size[0] + i));
        made.View()(i, j, k) = static_cast<T>(value(i, j, k, std::hypot(random.Normal(), random.Normal())));
      }
  return made;
}

template <class T>
SpeckleLevel LevelOf(const Volume<T>& volume, const Volume<unsigned char>& region = Volume<unsigned char>(size, 1))
{
  return SpeckleLevelAt<T>(volume.View(), region.View(), middle, reach);
}

TEST(SpeckleLevel, OfSpeckleIsItsMean)
{
  const SpeckleLevel envelope = LevelOf(Made<float>([](int, int, int, double r) { return 40.0 * r; }));
  EXPECT_NEAR(envelope.mean, 40.0 * 1.2533, 2.5);
  EXPECT_NEAR(envelope.deviation, 40.0 * 0.655, 2.0);
  const auto grey = [](double r) { return std::min(255.0, 120.0 + 37.0 * std::log(r + 0.05)); };
  const SpeckleLevel greys = LevelOf(Made<unsigned char>([&](int, int, int, double r) { return grey(r); }));
  EXPECT_NEAR(greys.mean, 122.0, 4.0); // 120 + 37 (log 2 - 0.5772) / 2
  EXPECT_NEAR(greys.deviation, 23.0, 4.0);
}

TEST(SpeckleLevel, IsThatBesideAWall)
{
  const SpeckleLevel level =
      LevelOf(Made<float>([](int, int j, int, double r) { return (j >= 13 && j <= 15 ? 150.0 : 5.0) * r; }));
  EXPECT_NEAR(level.mean, 5.0 * 1.2533, 1.0);
  EXPECT_NEAR(level.deviation, 5.0 * 0.655, 0.9);
}

TEST(SpeckleLevel, WhatFillsMostOfTheWindowStays)
{
  const SpeckleLevel level = LevelOf(Made<float>([](int, int j, int, double r) { return (j >= 6 ? 150.0 : 5.0) * r; }));
  EXPECT_GT(level.mean, 140.0);
}

TEST(SpeckleLevel, WaterThatIsCutOffAtBlackHasALevel)
{
  // Two thirds 0, the others 1: their median is 0, and their mean counts.
  const SpeckleLevel level =
      LevelOf(Made<unsigned char>([](int, int, int, double r) { return r > 1.482 ? 1.0 : 0.0; })); // of exp(-r^2 / 2)
  EXPECT_NEAR(level.mean, 1.0 / 3.0, 0.05);
}

TEST(SpeckleLevel, OnlyNumbersOfTheRegionCount)
{
  Volume<float> volume = Made<float>([](int, int, int, double r) { return 40.0 * r; });
  Volume<unsigned char> region(size, 1);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0] / 2; ++i) {
        region.View()(i, j, k) = 0;
        volume.View()(i, j, k) = 1e6f;
      }
  volume.View()(18, 14, 13) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(LevelOf(volume, region).mean, 40.0 * 1.2533, 4.0);
  EXPECT_TRUE(std::isnan(LevelOf(volume, Volume<unsigned char>(size)).mean)); // none
  const SpeckleLevel decibels = LevelOf(Made<float>([](int, int, int, double r) { return 20.0 * std::log10(r + 1e-3) - 40.0; }));
  EXPECT_TRUE(std::isnan(decibels.mean)); // below 0 nothing is three times as bright
}

} // namespace
