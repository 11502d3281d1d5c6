// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/LocalStatistics.h"
#include "Filters/Embedding/ToneMapping.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {

namespace {

const Eigen::Vector3d spacing(1.0, 1.0, 1.0);

// Grain on a background that varies by a factor of five from end to end.
Volume<float> Noise()
{
  Volume<float> volume({72, 60, 48});
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 72; ++i) {
        Random random(11, static_cast<std::uint64_t>((k * 60 + j) * 72 + i));
        const double level = 30.0 + 1.7 * i;
        volume.View()(i, j, k) = static_cast<float>(level * (1.0 + 0.25 * random.Normal()));
      }
  return volume;
}

} // namespace

TEST(ToneMapping, GrainHasMeanZeroAndDeviationOneEverywhere)
{
  Volume<float> volume = Noise();
  Volume<float> grain(volume.Dimensions());
  ExtractGrain({3.0, true}, volume.View(), {}, spacing, grain.View());
  const LocalStatistics local(VolumeView<const float>(grain.View()), {}, spacing, 3.0);
  for (const int i : {4, 20, 50, 68})
    for (const int k : {3, 24, 44}) {
      float mean = 9.0f, deviation = 9.0f;
      local.Row(30, k, i, i + 1, &mean, &deviation);
      EXPECT_NEAR(mean, 0.0f, 0.04f);
      EXPECT_NEAR(deviation, 1.0f, 0.03f);
    }
}

TEST(ToneMapping, AQuotientHasMeanOneEverywhere)
{
  Volume<float> volume = Noise();
  ExtractGrain({3.0, false}, volume.View(), {}, spacing, volume.View()); // in place
  const LocalStatistics local(VolumeView<const float>(volume.View()), {}, spacing, 3.0);
  for (const int i : {4, 20, 50, 68}) {
    float mean = 9.0f, deviation = 9.0f;
    local.Row(30, 24, i, i + 1, &mean, &deviation);
    EXPECT_NEAR(mean, 1.0f, 0.01f);
    EXPECT_NEAR(deviation, 0.25f, 0.04f); // what is removed is the level, the contrast stays
  }
}

// Rows with nothing, a part and all of it wanted.
TEST(ToneMapping, WhatIsWantedIsTheSameAsWithoutAsking)
{
  const Volume<float> volume = Noise();
  Volume<unsigned char> region(volume.Dimensions()), wanted(volume.Dimensions());
  for (int k = 0; k < 48; ++k)
    for (int j = 2; j < 60; ++j)
      for (int i = 5; i < 70; ++i) {
        region.View()(i, j, k) = i + j > 20;
        wanted.View()(i, j, k) = i + j > 20 && k > 10 && (k > 40 || (i > 20 && i < 60 && i % 3 != 0));
      }
  for (const bool matchDeviation : {true, false}) {
    Volume<float> all(volume.Dimensions()), some(volume.Dimensions());
    ExtractGrain({3.0, matchDeviation}, volume.View(), region.View(), spacing, all.View());
    ExtractGrain({3.0, matchDeviation}, volume.View(), region.View(), spacing, some.View(), {}, wanted.View());
    for (std::ptrdiff_t at = 0; at < all.View().Size(); ++at)
      if (wanted.View()[at]) {
        ASSERT_EQ(some.View()[at], all.View()[at]);
      }
  }
  Volume<float> grain(volume.Dimensions());
  const Volume<unsigned char> other({3, 3, 3});
  EXPECT_THROW(ExtractGrain({3.0, true}, volume.View(), {}, spacing, grain.View(), {}, other.View()), Error);
}

// Noise that is everywhere alike, in a region whose border cuts blocks: from its sums comes the grain that comes from itself.
TEST(ToneMapping, FromSumsItIsTheSameButForAThousandth)
{
  const std::array<int, 3> n{72, 60, 48};
  Volume<float> volume(n);
  Volume<unsigned char> region(n), wanted(n);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        Random random(12, static_cast<std::uint64_t>((k * 60 + j) * 72 + i));
        volume.View()(i, j, k) = static_cast<float>(100.0 + 25.0 * random.Normal());
        region.View()(i, j, k) = i + j > 20 && k > 2;
        wanted.View()(i, j, k) = i + j > 20 && k > 10 && i < 60;
      }
  const Eigen::Vector3d fine(0.5, 0.5, 0.5);
  for (const bool matchDeviation : {true, false}) {
    const ToneMappingParameters parameters{3.0, matchDeviation};
    Volume<float> all(n), first(n), some = volume;
    ExtractGrain(parameters, volume.View(), region.View(), fine, all.View());
    const Blocks blocks(n, fine, 2.0);
    BlockSums sums(blocks, 0);
    sums.Grow(blocks.count[2]);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        sums.AddRow(0, j, k, std::as_const(volume).View().Row(j, k), std::as_const(region).View().Row(j, k), n[0]);
    const LocalStatistics noise(sums, 0, blocks.count[2], fine, 3.0);
    const BlockSums left = SumsOfFirstRound(parameters, sums, noise, 0, blocks.count[2]);
    const LocalStatistics once(left, 0, blocks.count[2], fine, 3.0);
    ExtractGrain(parameters, noise, once, some.View(), wanted.View());
    double worst = 0.0, squares = 0.0, count = 0.0;
    for (std::ptrdiff_t at = 0; at < all.View().Size(); ++at) {
      if (!wanted.View()[at]) {
        ASSERT_EQ(some.View()[at], volume.View()[at]);
        continue;
      }
      const double difference = static_cast<double>(some.View()[at]) - static_cast<double>(all.View()[at]);
      worst = std::max(worst, std::abs(difference));
      squares += difference * difference;
      count += 1.0;
    }
    const double deviation = matchDeviation ? 1.0 : 0.25;
    EXPECT_LT(std::sqrt(squares / count), 1e-3 * deviation) << matchDeviation;
    EXPECT_LT(worst, 1e-2 * deviation) << matchDeviation;
  }
}

TEST(ToneMapping, ThereAndBackIsTheLevelThatIsGiven)
{
  EXPECT_EQ(ApplyGrain(true, 1.5f, 40.0f, 10.0f), 55.0f);
  EXPECT_EQ(ApplyGrain(false, 1.5f, 40.0f, 10.0f), 60.0f);
}

TEST(ToneMapping, NothingToDivideByIsNoGrain)
{
  for (const float level : {0.0f, 100.0f}) {
    const Volume<float> constant({20, 20, 20}, level);
    Volume<float> grain(constant.Dimensions(), 5.0f);
    ExtractGrain({2.0, true}, constant.View(), {}, spacing, grain.View());
    for (const float value : grain.View())
      EXPECT_EQ(value, 0.0f);
    ExtractGrain({2.0, false}, constant.View(), {}, spacing, grain.View());
    for (const float value : grain.View())
      EXPECT_FLOAT_EQ(value, 1.0f);
  }
  // Half of it black: that half gets none, the other is not harmed.
  Volume<float> half = Noise();
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 60; ++j)
      std::fill(half.View().Row(j, k), half.View().Row(j, k) + 36, 0.0f);
  Volume<float> grain(half.Dimensions());
  ExtractGrain({3.0, false}, half.View(), {}, spacing, grain.View());
  for (const float value : grain.View())
    EXPECT_TRUE(std::isfinite(value) && value < 20.0f);
}

TEST(ToneMapping, OutsideOfTheRegionNothingCounts)
{
  Volume<float> volume = Noise(), other = Noise();
  Volume<unsigned char> region(volume.Dimensions(), 1);
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 40; i < 72; ++i) {
        region.View()(i, j, k) = 0;
        other.View()(i, j, k) = (i + j) % 3 ? 1e6f : std::numeric_limits<float>::quiet_NaN();
      }
  Volume<float> grain(volume.Dimensions()), otherGrain(volume.Dimensions());
  ExtractGrain({3.0, true}, volume.View(), region.View(), spacing, grain.View());
  ExtractGrain({3.0, true}, other.View(), region.View(), spacing, otherGrain.View());
  for (std::ptrdiff_t at = 0; at < grain.View().Size(); ++at)
    ASSERT_EQ(grain.View()[at], otherGrain.View()[at]);
}

TEST(ToneMapping, RefusesBadInput)
{
  Volume<float> volume({4, 4, 4}), other({4, 4, 5});
  EXPECT_THROW(ExtractGrain({0.0, true}, volume.View(), {}, spacing, volume.View()), Error);
  EXPECT_THROW(ExtractGrain({3.0, true}, volume.View(), {}, spacing, other.View()), Error);
}

} // namespace echorama
