// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/LocalStatistics.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <utility>
#include <vector>

namespace echorama {

namespace {

struct Values {
  Volume<float> mean, deviation;
};

template <class T>
Values All(const LocalStatistics& statistics, const Volume<T>& like)
{
  Values values{Volume<float>(like.Dimensions()), Volume<float>(like.Dimensions())};
  for (int k = 0; k < like.Dimensions()[2]; ++k)
    for (int j = 0; j < like.Dimensions()[1]; ++j)
      statistics.Row(j, k, 0, like.Dimensions()[0], values.mean.View().Row(j, k), values.deviation.View().Row(j, k));
  return values;
}

const Eigen::Vector3d unit(1.0, 1.0, 1.0);

} // namespace

TEST(LocalStatistics, AConstantHasThatMeanAndNoDeviation)
{
  const Volume<unsigned short> volume({30, 21, 17}, 60001);
  Volume<unsigned char> region(volume.Dimensions());
  for (int k = 3; k < 9; ++k)
    for (int j = 5; j < 20; ++j)
      for (int i = 2; i < 12; ++i)
        region.View()(i, j, k) = 1;
  const Values got = All(LocalStatistics(volume.View(), region.View(), unit, 3.0), volume);
  for (std::ptrdiff_t at = 0; at < got.mean.View().Size(); ++at) {
    EXPECT_EQ(got.mean.View()[at], 60001.0f);
    EXPECT_EQ(got.deviation.View()[at], 0.0f);
  }
}

// Against the sums of the Gaussian window itself, over the region alone.
TEST(LocalStatistics, IsTheNormalisedGaussianWindow)
{
  Volume<float> volume({40, 36, 32});
  Volume<unsigned char> region(volume.Dimensions());
  const Eigen::Vector3d spacing(0.8, 1.0, 1.2);
  const double sigma = 4.0;
  for (int k = 0; k < 32; ++k)
    for (int j = 0; j < 36; ++j)
      for (int i = 0; i < 40; ++i) {
        Random random(5, static_cast<std::uint64_t>((k * 36 + j) * 40 + i));
        volume.View()(i, j, k) = static_cast<float>(100.0 + 2.0 * i - j + 20.0 * random.Normal());
        region.View()(i, j, k) = i + j > 24 && k > 4;
      }
  const Values got = All(LocalStatistics(VolumeView<const float>(volume.View()), region.View(), spacing, sigma), volume);
  for (const auto& at : {std::array<int, 3>{20, 20, 16}, {30, 8, 10}, {14, 12, 6}, {36, 30, 28}}) {
    double weight = 0.0, first = 0.0, second = 0.0;
    for (int k = 0; k < 32; ++k)
      for (int j = 0; j < 36; ++j)
        for (int i = 0; i < 40; ++i)
          if (region.View()(i, j, k)) {
            const Eigen::Vector3d d = spacing.cwiseProduct(Eigen::Vector3d(i - at[0], j - at[1], k - at[2]));
            const double w = std::exp(-0.5 * d.squaredNorm() / (sigma * sigma)), v = static_cast<double>(volume.View()(i, j, k));
            weight += w;
            first += w * v;
            second += w * v * v;
          }
    const double mean = first / weight, deviation = std::sqrt(second / weight - mean * mean);
    EXPECT_NEAR(got.mean.View()(at[0], at[1], at[2]), mean, 1.0);
    EXPECT_NEAR(got.deviation.View()(at[0], at[1], at[2]), deviation, 0.04 * deviation);
  }
}

// The response to a single bright voxel is the window itself: along each axis, whatever blocks are used, its second moment is the
// square of the standard deviation that was asked for.
TEST(LocalStatistics, TheWindowIsAsWideAsAskedFor)
{
  const Eigen::Vector3d spacing(0.5, 1.0, 2.0);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double voxels : {1.5, 3.0, 4.5, 6.0, 9.0}) {
      std::array<int, 3> size{1, 1, 1};
      size[axis] = 180;
      double sum = 0.0, first = 0.0, second = 0.0;
      for (int at = 84; at < 96; ++at) { // at all places within a block of 1, 2, 3, 4 or 6 voxels
        Volume<float> volume(size);
        volume.View()[at] = 1000.0f;
        const LocalStatistics statistics(VolumeView<const float>(volume.View()), {}, spacing,
                                         voxels * spacing[static_cast<Eigen::Index>(axis)]);
        const Values got = All(statistics, volume);
        for (int i = 30; i < 150; ++i) {
          const double mean = static_cast<double>(got.mean.View()[i]);
          sum += mean;
          first += mean * (i - at);
          second += mean * (i - at) * (i - at);
        }
      }
      EXPECT_NEAR(first / sum, 0.0, 0.01) << axis << " " << voxels;
      EXPECT_NEAR(second / sum / (voxels * voxels), 1.0, 0.012) << axis << " " << voxels;
    }
}

TEST(LocalStatistics, BelowAVoxelTheWindowIsTheVoxel)
{
  Volume<short> volume({7, 5, 3});
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = static_cast<short>(17 * at % 101);
  const Values got = All(LocalStatistics(VolumeView<const short>(volume.View()), {}, unit, 0.0), volume);
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at) {
    EXPECT_NEAR(got.mean.View()[at], volume.View()[at], 1e-4);
    EXPECT_NEAR(got.deviation.View()[at], 0.0, 1e-3);
  }
}

TEST(LocalStatistics, APartOfARowIsThatPart)
{
  Volume<float> volume({50, 6, 5});
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = static_cast<float>(Random(8, static_cast<std::uint64_t>(at)).Uniform());
  const LocalStatistics statistics(VolumeView<const float>(volume.View()), {}, unit, 3.0);
  const Values whole = All(statistics, volume);
  for (const auto& [first, end] : {std::pair(0, 1), {7, 31}, {49, 50}}) {
    std::vector<float> mean(static_cast<std::size_t>(end - first) + 1, -1.0f), deviation(mean);
    statistics.Row(3, 2, first, end, mean.data(), deviation.data());
    for (int i = first; i < end; ++i) {
      EXPECT_EQ(mean[static_cast<std::size_t>(i - first)], whole.mean.View()(i, 3, 2));
      EXPECT_EQ(deviation[static_cast<std::size_t>(i - first)], whole.deviation.View()(i, 3, 2));
    }
    EXPECT_EQ(mean.back(), -1.0f) << "nothing behind the end is written";
    EXPECT_EQ(deviation.back(), -1.0f);
  }
}

TEST(LocalStatistics, MeansAloneAreTheSameMeans)
{
  Volume<float> volume({41, 23, 19});
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = static_cast<float>(50.0 + 10.0 * Random(3, static_cast<std::uint64_t>(at)).Normal());
  const VolumeView<const float> view = volume.View();
  const LocalStatistics both(view, {}, unit, 2.5), alone(view, {}, unit, 2.5, {}, 0.0, true);
  std::vector<float> mean(41), deviation(41), meanAlone(41);
  both.Row(9, 8, 0, 41, mean.data(), deviation.data());
  alone.Row(9, 8, 0, 41, meanAlone.data(), nullptr);
  EXPECT_EQ(meanAlone, mean);
  EXPECT_THROW(alone.Row(9, 8, 0, 41, meanAlone.data(), deviation.data()), Error);
}

TEST(LocalStatistics, WhatIsOutsideOrNoNumberDoesNotCount)
{
  Volume<float> volume({20, 20, 20}, 7.0f);
  Volume<unsigned char> region(volume.Dimensions(), 1);
  volume.View()(10, 10, 10) = std::numeric_limits<float>::quiet_NaN();
  volume.View()(3, 9, 15) = std::numeric_limits<float>::infinity();
  volume.View()(4, 4, 4) = 1e9f;
  region.View()(4, 4, 4) = 0;
  const Values got = All(LocalStatistics(VolumeView<const float>(volume.View()), region.View(), unit, 2.0), volume);
  for (const float mean : got.mean.View())
    EXPECT_EQ(mean, 7.0f);
}

TEST(LocalStatistics, FarFromTheRegionItIsTheWhole)
{
  Volume<unsigned char> volume({90, 4, 1}, 10), region(volume.Dimensions());
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      region.View()(i, j, 0) = 1;
      volume.View()(i, j, 0) = static_cast<unsigned char>(i % 2 ? 30 : 10);
    }
  const Values got = All(LocalStatistics(VolumeView<const unsigned char>(volume.View()), region.View(), unit, 3.0), volume);
  EXPECT_FLOAT_EQ(got.mean.View()(80, 2, 0), 20.0f);
  EXPECT_FLOAT_EQ(got.deviation.View()(80, 2, 0), 10.0f);
  const Volume<unsigned char> none(volume.Dimensions());
  const Values nothing = All(LocalStatistics(VolumeView<const unsigned char>(volume.View()), none.View(), unit, 3.0), volume);
  EXPECT_EQ(nothing.mean.View()(80, 2, 0), 0.0f);
  EXPECT_EQ(nothing.deviation.View()(80, 2, 0), 0.0f);
}

TEST(LocalStatistics, ALargeOffsetCostsNoDigits)
{
  Volume<double> volume({24, 24, 24});
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = 1e6 + (at % 2 ? 1.0 : -1.0);
  const Values got = All(LocalStatistics(VolumeView<const double>(volume.View()), {}, unit, 3.0), volume);
  EXPECT_NEAR(got.deviation.View()(12, 12, 12), 1.0, 1e-3);
}

// A slope that is steeper than the grain is coarse: the window alone takes it for deviation, the grain's does not.
TEST(LocalStatistics, TheDeviationOfGrainLeavesSlopesOut)
{
  Volume<float> volume({60, 40, 40});
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 60; ++i)
        volume.View()(i, j, k) =
            static_cast<float>(5.0 * i + 4.0 * Random(6, static_cast<std::uint64_t>((k * 40 + j) * 60 + i)).Normal());
  const Values plain = All(LocalStatistics(VolumeView<const float>(volume.View()), {}, unit, 4.0), volume);
  const Values grain = All(GrainStatistics(VolumeView<const float>(volume.View()), {}, unit, 4.0), volume);
  EXPECT_NEAR(plain.deviation.View()(30, 20, 20), std::hypot(4.0, 5.0 * 4.0), 1.5);
  EXPECT_NEAR(grain.deviation.View()(30, 20, 20), 4.0, 0.4);
  EXPECT_EQ(grain.mean.View()(30, 20, 20), plain.mean.View()(30, 20, 20));
}

// The trend is worked out for some slices at a time: where one such part follows another nothing may be seen of it, whether its
// blocks are as thin as a voxel or not. Held against the squares about a trend of the whole volume, averaged over the window.
TEST(LocalStatistics, TheTrendOfATallVolumeHasNoJoints)
{
  Volume<float> volume({11, 9, 700});
  Volume<unsigned char> region(volume.Dimensions());
  for (int k = 0; k < 700; ++k)
    for (std::ptrdiff_t at = 0; at < 99; ++at) {
      const std::ptrdiff_t voxel = 99 * k + at;
      volume.View()[voxel] =
          static_cast<float>(100.0 + 40.0 * std::sin(0.1 * k) + 5.0 * Random(9, static_cast<std::uint64_t>(voxel)).Normal());
      region.View()[voxel] = (k / 9 + at / 11) % 4 != 0;
    }
  const VolumeView<const float> view = volume.View();
  for (const double sigma : {3.0, 9.0}) {
    const Values trend = All(LocalStatistics(view, region.View(), unit, 0.5 * sigma), volume);
    Volume<float> squares(volume.Dimensions());
    for (std::ptrdiff_t at = 0; at < view.Size(); ++at)
      squares.View()[at] = std::pow(view[at] - trend.mean.View()[at], 2.0f);
    const Values wanted = All(LocalStatistics(VolumeView<const float>(squares.View()), region.View(), unit, sigma), volume);
    const Values got = All(GrainStatistics(view, region.View(), unit, sigma), volume);
    for (std::ptrdiff_t at = 0; at < view.Size(); ++at)
      ASSERT_NEAR(got.deviation.View()[at], std::sqrt(wanted.mean.View()[at]), 1e-4f) << sigma << " " << at / 99;
  }
}

TEST(LocalStatistics, WhatSpentStatisticsLeaveInTheirMemoryIsNotSeen)
{
  Volume<float> volume({70, 50, 60});
  Volume<unsigned char> region(volume.Dimensions());
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = static_cast<float>(Random(4, static_cast<std::uint64_t>(at)).Normal());
  for (int k = 20; k < 30; ++k)
    for (int j = 10; j < 25; ++j)
      for (int i = 12; i < 40; ++i)
        region.View()(i, j, k) = 1;
  const VolumeView<const float> view = volume.View();
  LocalStatistics everywhere(view, {}, unit, 1.0);
  const Values fresh = All(LocalStatistics(view, region.View(), unit, 2.0), volume);
  const Values again = All(LocalStatistics(view, region.View(), unit, 2.0, {}, 0.0, false, &everywhere), volume);
  for (std::ptrdiff_t at = 0; at < view.Size(); ++at) {
    ASSERT_EQ(again.mean.View()[at], fresh.mean.View()[at]);
    ASSERT_EQ(again.deviation.View()[at], fresh.deviation.View()[at]);
  }
}

TEST(LocalStatistics, DoesNotDependOnThreads)
{
  Volume<float> volume({50, 40, 30});
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at)
    volume.View()[at] = static_cast<float>(Random(3, static_cast<std::uint64_t>(at)).Uniform());
  const Values many = All(LocalStatistics(VolumeView<const float>(volume.View()), {}, unit, 2.0), volume);
  const ThreadLimit one(1);
  const Values single = All(LocalStatistics(VolumeView<const float>(volume.View()), {}, unit, 2.0), volume);
  EXPECT_TRUE(std::equal(many.mean.View().begin(), many.mean.View().end(), single.mean.View().begin()));
  EXPECT_TRUE(std::equal(many.deviation.View().begin(), many.deviation.View().end(), single.deviation.View().begin()));
}

// Rows that are added in any pieces, and slices of blocks of which the first were forgotten: within what the window reaches it is
// all the same to the last bit, and as of the whole but for rounding. Sizes are no multiples of blocks.
TEST(LocalStatistics, OfSumsThatComeAndGo)
{
  const std::array<int, 3> n{41, 23, 61};
  const Eigen::Vector3d spacing(0.5, 0.6, 0.4);
  Volume<float> volume(n);
  Volume<unsigned char> region(n);
  for (std::ptrdiff_t at = 0; at < volume.View().Size(); ++at) {
    volume.View()[at] = static_cast<float>(50.0 + 10.0 * Random(3, static_cast<std::uint64_t>(at)).Normal());
    region.View()[at] = at % 41 + at / 41 % 23 > 20;
  }
  const Values whole = All(LocalStatistics(std::as_const(volume).View(), region.View(), spacing, 2.0), volume);
  const Blocks blocks(n, spacing, 2.0 / 1.5);
  const int reach = LocalStatistics::Reach(blocks, spacing, 2.0), first = 3 + reach;
  BlockSums all(blocks, 0), later(blocks, 2), next(blocks, 5);
  all.Grow(blocks.count[2]);
  later.Grow(5);
  next.Grow(blocks.count[2]);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const float* const row = std::as_const(volume).View().Row(j, k);
      const unsigned char* const counts = std::as_const(region).View().Row(j, k);
      all.AddRow(0, j, k, row, counts, n[0]);
      const int K = k / blocks.size[2], split = 4 * blocks.size[0];
      for (const auto& [from, end] : {std::pair(0, split), std::pair(split, n[0])})
        if (K >= 2)
          (K < 5 ? later : next).AddRow(from, j, k, row + from, counts + from, end - from);
    }
  later.Append(std::move(next));
  later.Forget(first - reach);
  EXPECT_EQ(later.First(), 3);
  EXPECT_EQ(later.End(), blocks.count[2]);
  const LocalStatistics complete(all, 0, blocks.count[2], spacing, 2.0),
      part(later, first - reach, blocks.count[2], spacing, 2.0), moved = part.From({2, 1, 4});
  std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean), partMean(mean), partDeviation(mean);
  int compared = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      complete.Row(j, k, 0, n[0], mean.data(), deviation.data());
      for (int i = 0; i < n[0]; ++i)
        if (region.View()(i, j, k)) {
          EXPECT_NEAR(mean[static_cast<std::size_t>(i)], whole.mean.View()(i, j, k), 1e-4);
          EXPECT_NEAR(deviation[static_cast<std::size_t>(i)], whole.deviation.View()(i, j, k), 1e-4);
        }
      if (blocks.PositionOf(k, 2) < first)
        continue;
      part.Row(j, k, 0, n[0], partMean.data(), partDeviation.data());
      EXPECT_EQ(partMean, mean);
      EXPECT_EQ(partDeviation, deviation);
      if (j >= 1) {
        moved.Row(j - 1, k - 4, 3, 4, partMean.data(), partDeviation.data());
        EXPECT_EQ(partMean[0], mean[5]);
        EXPECT_EQ(partDeviation[0], deviation[5]);
      }
      ++compared;
    }
  EXPECT_GT(compared, 200);
  // At the middle of a block, where blocks have one.
  const int I = 2, J = 1, K = first + 1;
  part.RowOfBlocks(J, K, mean.data(), deviation.data());
  ASSERT_EQ(blocks.size, (std::array<int, 3>{3, 2, 3}));
  complete.Row(J * 2, K * 3 + 1, I * 3 + 1, I * 3 + 2, partMean.data(), partDeviation.data());
  complete.Row(J * 2 + 1, K * 3 + 1, I * 3 + 1, I * 3 + 2, partMean.data() + 1, partDeviation.data() + 1);
  EXPECT_NEAR(mean[I], 0.5f * (partMean[0] + partMean[1]), 0.1f);
  EXPECT_NEAR(deviation[I], 0.5f * (partDeviation[0] + partDeviation[1]), 0.1f);
}

TEST(LocalStatistics, RefusesBadInput)
{
  const Volume<float> volume({4, 4, 4});
  const Volume<unsigned char> region({4, 4, 5});
  EXPECT_THROW(LocalStatistics(volume.View(), region.View(), unit, 1.0), Error);
  EXPECT_THROW(LocalStatistics(volume.View(), {}, unit, -1.0), Error);
  EXPECT_THROW(LocalStatistics(VolumeView<const float>(), {}, unit, 1.0), Error);
  EXPECT_THROW(LocalStatistics(volume.View(), {}, unit, 1.0, Progress([](double) { return false; })), Error);
}

} // namespace echorama
