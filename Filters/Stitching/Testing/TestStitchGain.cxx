// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/StitchGain.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

using namespace echorama;

namespace {

double Anatomy(int i, int j, int k)
{
  return 100.0 + 25.0 * std::sin(0.21 * i) * std::cos(0.17 * j + 0.3) + 15.0 * std::sin(0.11 * (i + j) + 0.19 * k);
}

struct Look {
  double gain = 1.0, offset = 0.0; // the volume shows (anatomy - offset) / gain
  double noise = 0.0;              // of its smooth part
};

// A view of the anatomy. The detail is of standard deviation 10: its share common of it is the same in all volumes.
CoarseVolume View(const GridBox& box, const Look& look, std::uint64_t seed, double common = 0.0)
{
  CoarseVolume volume;
  volume.inside = {box, Volume<unsigned char>(box.size, 1)};
  volume.value = {box, Volume<float>(box.size)};
  volume.low = {box, Volume<float>(box.size)};
  for (int k = 0; k < box.size[2]; ++k)
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i) {
        const int x = box.first[0] + i, y = box.first[1] + j, z = box.first[2] + k;
        const std::uint64_t place = static_cast<std::uint64_t>((z * 1000 + y) * 1000 + x);
        Random own(seed, place), all(99, place);
        const double low = (Anatomy(x, y, z) - look.offset) / look.gain + look.noise * own.Normal();
        const double detail = std::sqrt(1.0 - common) * own.Normal() + std::sqrt(common) * all.Normal();
        volume.low.values.View()(i, j, k) = static_cast<float>(low);
        volume.value.values.View()(i, j, k) = static_cast<float>(low + 10.0 * detail);
      }
  return volume;
}

// The looks that a perfect estimate finds: those planted, with the mean that the contract fixes.
void ExpectLooks(const StitchGains& found, const std::vector<Look>& planted, double gainTolerance, double offsetTolerance)
{
  double logMean = 0.0, offset = 0.0;
  for (const Look& look : planted)
    logMean += std::log(look.gain) / static_cast<double>(planted.size());
  for (std::size_t v = 0; v < planted.size(); ++v)
    offset += planted[v].offset / static_cast<double>(planted.size());
  // All volumes shown alike, up to one gain and offset of the whole.
  const double whole = std::exp(-logMean);
  for (std::size_t v = 0; v < planted.size(); ++v) {
    EXPECT_NEAR(found.gain[v], planted[v].gain * whole, gainTolerance) << "volume " << v;
    EXPECT_NEAR(found.offset[v], (planted[v].offset - offset) * whole, offsetTolerance) << "volume " << v;
  }
}

std::vector<CoarseVolume> Chain(const std::vector<Look>& looks, int step = 24)
{
  std::vector<CoarseVolume> volumes;
  for (std::size_t v = 0; v < looks.size(); ++v)
    volumes.push_back(View({{step * static_cast<int>(v), 0, 0}, {40, 30, 12}}, looks[v], v + 1));
  return volumes;
}

void ExpectUntouched(const StitchGains& gains)
{
  for (const double gain : gains.gain)
    EXPECT_EQ(gain, 1.0);
  for (const double offset : gains.offset)
    EXPECT_EQ(offset, 0.0);
}

} // namespace

TEST(StitchGain, FindsWhatWasPlantedInAChain)
{
  const std::vector<Look> looks{{1.0, 0.0}, {1.3, -12.0}, {0.8, 9.0}};
  ExpectLooks(EstimateStitchGains(Chain(looks), true), looks, 1e-4, 0.01);
}

TEST(StitchGain, NoiseInBothVolumesDoesNotBendTheGain)
{
  // A regression of one on the other would find slopes too small by noise^2 / contrast^2, some ten percent.
  const std::vector<Look> looks{{1.0, 0.0, 6.0}, {1.25, -5.0, 6.0 / 1.25}, {0.9, 4.0, 6.0 / 0.9}};
  ExpectLooks(EstimateStitchGains(Chain(looks), true), looks, 0.02, 2.0);
}

TEST(StitchGain, SolvesRingsAndManyVolumesTogether)
{
  // Twenty volumes in a ring: every volume also overlaps the next but one, and noise makes the pairs contradict each other.
  Random random(5);
  std::vector<Look> looks;
  std::vector<CoarseVolume> volumes;
  for (int v = 0; v < 20; ++v) {
    const double gain = std::exp(random.Uniform(-0.25, 0.25));
    looks.push_back({gain, random.Uniform(-15.0, 15.0), 3.0 / gain});
    const double angle = 6.283185307179586 * v / 20.0;
    const GridBox box{{50 + static_cast<int>(50.0 * std::cos(angle)), 50 + static_cast<int>(50.0 * std::sin(angle)), 0},
                      {45, 45, 6}};
    volumes.push_back(View(box, looks.back(), static_cast<std::uint64_t>(v) + 1));
  }
  const StitchGains found = EstimateStitchGains(volumes, true);
  ExpectLooks(found, looks, 0.02, 2.0);
  double logs = 0.0, offsets = 0.0;
  for (int v = 0; v < 20; ++v) {
    logs += std::log(found.gain[v]);
    offsets += found.offset[v];
  }
  EXPECT_NEAR(logs, 0.0, 1e-9);
  EXPECT_NEAR(offsets, 0.0, 1e-7);
}

TEST(StitchGain, IsTheSameForVolumesInAnotherOrder)
{
  const std::vector<Look> looks{{1.0, 0.0, 4.0}, {1.3, -12.0, 4.0}, {0.8, 9.0, 4.0}};
  std::vector<CoarseVolume> volumes = Chain(looks);
  const StitchGains found = EstimateStitchGains(volumes, true);
  std::swap(volumes[0], volumes[2]);
  const StitchGains swapped = EstimateStitchGains(volumes, true);
  for (int v = 0; v < 3; ++v) {
    EXPECT_NEAR(found.gain[v], swapped.gain[2 - v], 1e-5);
    EXPECT_NEAR(found.offset[v], swapped.offset[2 - v], 1e-3);
  }
}

TEST(StitchGain, AShadowDoesNotPullTheOthers)
{
  const std::vector<Look> looks{{1.0, 0.0, 2.0}, {1.2, -8.0, 2.0}, {0.9, 5.0, 2.0}};
  // A third of the middle volume is black; it lies in the overlap with the first, and nobody says so.
  std::vector<CoarseVolume> volumes = Chain(looks);
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 16; ++i)
        volumes[1].low.values.View()(i, j, k) *= 0.1f;
  ExpectLooks(EstimateStitchGains(volumes, true), looks, 0.02, 2.0);

  // Nearly all of the overlap is black: only trust can tell.
  volumes = Chain(looks);
  volumes[1].trust = {volumes[1].inside.box, Volume<float>(volumes[1].inside.box.size, 1.0f)};
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 26; ++j)
      for (int i = 0; i < 16; ++i) {
        volumes[1].low.values.View()(i, j, k) *= 0.1f;
        volumes[1].trust.values.View()(i, j, k) = 0.02f;
      }
  ExpectLooks(EstimateStitchGains(volumes, true), looks, 0.04, 4.0);

  // Wholly black and not to be trusted: nothing is said of it.
  std::fill(volumes[1].trust.values.View().begin(), volumes[1].trust.values.View().end(), 0.01f);
  ExpectUntouched(EstimateStitchGains(volumes, true));
}

TEST(StitchGain, APairThatContradictsTheOthersCountsLittle)
{
  // All of one overlap of four in a square is brighter in one volume: the other pairs say what is right.
  const std::vector<Look> looks(4, Look{1.0, 0.0, 1.0});
  std::vector<CoarseVolume> volumes;
  for (int v = 0; v < 4; ++v)
    volumes.push_back(View({{v % 2 * 20, v / 2 * 20, 0}, {32, 32, 8}}, looks[v], static_cast<std::uint64_t>(v) + 1));
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 20; i < 32; ++i)
        volumes[0].low.values.View()(i, j, k) += 40.0f;
  const StitchGains found = EstimateStitchGains(volumes, true);
  for (int v = 0; v < 4; ++v) {
    EXPECT_NEAR(found.gain[v], 1.0, 0.05);
    EXPECT_NEAR(found.gain[v] * 100.0 + found.offset[v], 100.0, 3.0); // least squares alone is 10 off
  }
}

TEST(StitchGain, GroupsThatAreNotConnectedAreSolvedApart)
{
  const std::vector<Look> looks{{1.0, 0.0}, {1.3, -12.0}};
  std::vector<CoarseVolume> volumes = Chain(looks);
  volumes.push_back(View({{500, 0, 0}, {20, 20, 5}}, {3.0, 30.0}, 7));
  volumes.push_back(View({{900, 0, 0}, {40, 20, 5}}, {0.9, 3.0}, 8));
  volumes.push_back(View({{920, 0, 0}, {40, 20, 5}}, {1.1, -3.0}, 9));
  const StitchGains found = EstimateStitchGains(volumes, true);
  EXPECT_NEAR(found.gain[1] / found.gain[0], 1.3, 1e-3);
  EXPECT_NEAR(found.gain[1] * found.gain[0], 1.0, 1e-9);
  EXPECT_EQ(found.gain[2], 1.0);
  EXPECT_EQ(found.offset[2], 0.0);
  EXPECT_NEAR(found.gain[4] / found.gain[3], 1.1 / 0.9, 1e-3);
  EXPECT_NEAR(found.gain[4] * found.gain[3], 1.0, 1e-9);
  EXPECT_NEAR(found.offset[3] + found.offset[4], 0.0, 1e-7);
}

TEST(StitchGain, WhatAgreesIsLeftAloneToTheLastBit)
{
  ExpectUntouched(EstimateStitchGains(Chain({{1.0, 0.0}, {1.0, 0.0}, {1.0, 0.0}, {1.0, 0.0}}), true));
  const std::vector<Look> looks{{1.0, 0.0}, {1.3, -12.0}};
  ExpectUntouched(EstimateStitchGains(Chain(looks), false));
  ExpectUntouched(EstimateStitchGains(Chain(looks, 40), true)); // side by side
  ExpectUntouched(EstimateStitchGains({}, true));
  ExpectUntouched(EstimateStitchGains({View({{0, 0, 0}, {5, 5, 1}}, {}, 1)}, true));
  // Too thin an overlap: 5 x 5 voxels.
  ExpectUntouched(EstimateStitchGains({View({{0, 0, 0}, {9, 5, 5}}, {}, 1), View({{8, 0, 0}, {9, 5, 5}}, {1.5, 3.0}, 2)}, true));
  // Boxes that meet where no voxel is inside; voxels that are no numbers.
  std::vector<CoarseVolume> volumes = Chain(looks);
  for (auto* low : {&volumes[0].low, &volumes[0].value})
    std::fill(low->values.View().begin(), low->values.View().end(), std::numeric_limits<float>::quiet_NaN());
  ExpectUntouched(EstimateStitchGains(volumes, true));
  std::fill(volumes[0].inside.values.View().begin(), volumes[0].inside.values.View().end(), static_cast<unsigned char>(0));
  ExpectUntouched(EstimateStitchGains(volumes, true));
}

TEST(StitchGain, ConstantsMeetByOffsetAlone)
{
  std::vector<CoarseVolume> volumes = Chain({{}, {}, {}});
  for (int v = 0; v < 3; ++v)
    std::fill(volumes[v].low.values.View().begin(), volumes[v].low.values.View().end(), 50.0f + 10.0f * v);
  const StitchGains found = EstimateStitchGains(volumes, true);
  for (int v = 0; v < 3; ++v) {
    EXPECT_EQ(found.gain[v], 1.0);
    EXPECT_NEAR(found.offset[v], 10.0 - 10.0 * v, 1e-9);
  }
}

// A standard deviation of 1e-5 of the mean parts contrast from rounding, in either volume.
TEST(StitchGain, AContrastNearRoundingIsNone)
{
  const auto gainsOf = [](double first, double second) {
    std::vector<CoarseVolume> volumes = Chain({{}, {}});
    const double contrast[] = {first, second};
    for (int v = 0; v < 2; ++v) {
      const auto low = volumes[v].low.values.View();
      for (int k = 0; k < 12; ++k)
        for (int j = 0; j < 30; ++j)
          for (int i = 0; i < 40; ++i) // four levels by turns, of standard deviation 1
            low(i, j, k) = static_cast<float>(4096.0 * (1.0 + ((i + j + k) % 4 - 1.5) / std::sqrt(1.25) * contrast[v]));
    }
    const StitchGains found = EstimateStitchGains(volumes, true);
    EXPECT_NEAR(found.gain[0] * found.gain[1], 1.0, 1e-12);
    return found.gain[0] / found.gain[1];
  };
  EXPECT_NEAR(gainsOf(1.1e-5, 2.2e-5), 2.0, 0.05); // a step of floats is 6e-8 of the mean
  EXPECT_EQ(gainsOf(0.9e-5, 1.8e-5), 1.0);
  EXPECT_EQ(gainsOf(1.8e-5, 0.9e-5), 1.0);
  EXPECT_EQ(gainsOf(6e-8, 6e-8), 1.0);
}

TEST(StitchGain, BlackVolumesAndVolumesWithoutDetailsGiveNumbers)
{
  std::vector<CoarseVolume> volumes;
  for (const std::size_t without : {0, 1}) {
    volumes = Chain({{}, {}});
    volumes[without].value = volumes[without].low;
    EXPECT_EQ(EstimateStitchGains(volumes, true).detailCorrelation, Eigen::MatrixXd::Identity(2, 2));
  }
  for (CoarseVolume& volume : volumes)
    for (auto* field : {&volume.low, &volume.value})
      std::fill(field->values.View().begin(), field->values.View().end(), 0.0f);
  ExpectUntouched(EstimateStitchGains(volumes, true));
}

// 30 shared voxels that count a twentieth each, and of which 12 are left out: all weight is 0.9 of a voxel.
TEST(StitchGain, LittleTrustIsEnoughWhereThereIsNoOther)
{
  std::vector<CoarseVolume> volumes{View({{0, 0, 0}, {4, 6, 5}}, {}, 1), View({{3, 0, 0}, {4, 6, 5}}, {}, 2)};
  for (int v = 0; v < 2; ++v) {
    std::fill(volumes[v].low.values.View().begin(), volumes[v].low.values.View().end(), v ? 30.0f : 50.0f);
    volumes[v].trust = {volumes[v].inside.box, Volume<float>(volumes[v].inside.box.size, v ? 1.0f : 0.05f)};
  }
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 6; ++j)
      volumes[0].low.values.View()(3, j, k) = 90.0f;
  const StitchGains found = EstimateStitchGains(volumes, true);
  EXPECT_EQ(found.gain[0], 1.0);
  EXPECT_NEAR(found.offset[0], -10.0, 1e-9);
  EXPECT_NEAR(found.offset[1], 10.0, 1e-9);
}

// Two pairs of 160 voxels agree, a third of 80 contradicts them by d. Least squares leaves it d / 2. Beyond a hundredth (of the
// brightness for offsets, of the gain for gains) a contradiction counts by its size, which leaves it that hundredth.
TEST(StitchGain, AContradictionCountsByItsSizeBeyondAHundredth)
{
  constexpr int slabs[] = {0, 10, 20, 25}; // along x: volumes 0 and 1, 1 and 2, 0 and 2
  const auto solved = [&](double logGain, double offset) {
    std::vector<CoarseVolume> volumes;
    for (int v = 0; v < 3; ++v) {
      volumes.push_back(View({{0, 0, 0}, {25, 4, 4}}, {}, static_cast<std::uint64_t>(v) + 1));
      Random noise(8, static_cast<std::uint64_t>(v)); // without it, how far rounding goes would decide what an outlier is
      for (int slab = 0; slab < 3; ++slab)
        for (int k = 0; k < 4; ++k)
          for (int j = 0; j < 4; ++j)
            for (int i = slabs[slab]; i < slabs[slab + 1]; ++i) {
              const bool other = v == 2 && slab == 2;
              const double contrast = logGain == 0.0 ? 0.0 : 20.0 * std::sin(1.7 * i + 2.3 * j + 3.1 * k) + 0.1 * noise.Normal();
              volumes[v].inside.values.View()(i, j, k) = slab == v || slab == (v + 2) % 3;
              volumes[v].low.values.View()(i, j, k) =
                  static_cast<float>(100.0 + (other ? offset : 0.0) + contrast * (other ? std::exp(logGain) : 1.0));
            }
    }
    return EstimateStitchGains(volumes, true);
  };
  for (const double d : {0.5, 1.9, 2.5, 10.0}) { // in hundredths
    const StitchGains offsets = solved(0.0, d), gains = solved(0.01 * d, 0.0);
    EXPECT_EQ(offsets.gain[0], 1.0);
    EXPECT_NEAR(offsets.offset[0] - offsets.offset[2], std::min(0.5 * d, 1.0), 1e-4) << d;
    EXPECT_NEAR(100.0 * std::log(gains.gain[0] / gains.gain[2]), std::min(0.5 * d, 1.0), 0.2) << d; // standard error 0.1
  }
}

TEST(StitchGain, UnlikeVolumesSayNothingOfTheGain)
{
  // Of different contrast, but without a likeness: noise.
  std::vector<CoarseVolume> volumes = Chain({{}, {}});
  for (int v = 0; v < 2; ++v) {
    Random random(3, static_cast<std::uint64_t>(v));
    for (float& low : volumes[v].low.values.View())
      low = static_cast<float>(100.0 + (v ? 20.0 : 10.0) * random.Normal());
  }
  const StitchGains found = EstimateStitchGains(volumes, true);
  EXPECT_EQ(found.gain[0], 1.0);
  EXPECT_EQ(found.gain[1], 1.0);
  EXPECT_NEAR(found.offset[0], 0.0, 0.5);
}

TEST(StitchGain, MeasuresTheCorrelationOfDetails)
{
  for (const double common : {0.0, 0.3, 0.8, 1.0}) {
    const StitchGains found = EstimateStitchGains({View({{0, 0, 0}, {40, 40, 10}}, {}, 1, common),
                                                   View({{10, 0, 0}, {40, 40, 10}}, {1.0, 20.0}, 2, common),
                                                   View({{100, 0, 0}, {4, 4, 1}}, {}, 3, common)},
                                                  false);
    ASSERT_EQ(found.detailCorrelation.rows(), 3);
    ASSERT_EQ(found.detailCorrelation.cols(), 3);
    EXPECT_NEAR(found.detailCorrelation(0, 1), common, 0.03);
    EXPECT_EQ(found.detailCorrelation(0, 1), found.detailCorrelation(1, 0));
    EXPECT_EQ(found.detailCorrelation(0, 2), 0.0);
    for (int v = 0; v < 3; ++v)
      EXPECT_EQ(found.detailCorrelation(v, v), 1.0);
  }
  // Opposite details do not count as negative.
  CoarseVolume a = View({{0, 0, 0}, {20, 20, 5}}, {}, 1), b = a;
  for (std::ptrdiff_t i = 0; i < b.value.values.View().Size(); ++i)
    b.value.values.View()[i] = 2.0f * b.low.values.View()[i] - b.value.values.View()[i];
  EXPECT_EQ(EstimateStitchGains({a, b}, false).detailCorrelation(0, 1), 0.0);
}

TEST(StitchGain, WorksInTheFlat)
{
  const std::vector<Look> looks{{1.0, 0.0}, {0.8, 10.0}};
  ExpectLooks(
      EstimateStitchGains({View({{0, 0, 0}, {60, 50, 1}}, looks[0], 1), View({{30, 5, 0}, {60, 50, 1}}, looks[1], 2)}, true),
      looks, 1e-4, 0.01);
}

TEST(StitchGain, RefusesBoxesThatDiffer)
{
  std::vector<CoarseVolume> volumes = Chain({{}, {}});
  volumes[1].low.box.size[0] -= 1;
  EXPECT_THROW(EstimateStitchGains(volumes, true), Error);
}

TEST(StitchGain, DoesNotDependOnTheNumberOfThreads)
{
  const std::vector<CoarseVolume> volumes = Chain({{1.0, 0.0, 3.0}, {1.3, -12.0, 3.0}, {0.8, 9.0, 3.0}, {1.1, 2.0, 3.0}});
  const StitchGains many = EstimateStitchGains(volumes, true);
  const ThreadLimit limit(1);
  const StitchGains one = EstimateStitchGains(volumes, true);
  EXPECT_EQ(one.gain, many.gain);
  EXPECT_EQ(one.offset, many.offset);
  EXPECT_EQ(one.detailCorrelation, many.detailCorrelation);
}
