// SPDX-License-Identifier: BSD-3-Clause
//
// Two rounds of the same: measure the local mean and deviation (LocalStatistics), take them out. The first leaves some per cent
// of either, because a window's own voxel is in its mean; the second hardly any. Cost: two passes to measure and two to correct,
// the second of these over what is wanted alone.
#include "ToneMapping.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "LocalStatistics.h"
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace echorama {

namespace {

// The mean of the local numbers that divide: what is far below it is nothing to divide by.
struct Level {
  double sum = 0.0, count = 0.0;
  Level& operator+=(const Level& other)
  {
    sum += other.sum;
    count += other.count;
    return *this;
  }
  double Mean() const { return count > 0.0 ? sum / count : 0.0; }
};

// The part [first, second) of a row outside of which a mask is 0.
std::pair<int, int> PartOfRow(VolumeView<const unsigned char> mask, std::ptrdiff_t row, int count)
{
  if (mask.Empty())
    return {0, count};
  const unsigned char* const at = mask.Data() + row * count;
  int first = 0, end = count;
  while (first < end && !at[first])
    ++first;
  while (first < end && !at[end - 1])
    --end;
  return {first, end};
}

bool IsReal(VolumeView<const float> volume, VolumeView<const unsigned char> region, std::ptrdiff_t at)
{
  return (region.Empty() || region[at]) && std::isfinite(volume[at]);
}

// Below that there is nothing to divide by.
float FloorOf(bool byDeviation, const LocalStatistics& statistics, VolumeView<const float> from,
              VolumeView<const unsigned char> region)
{
  const auto& n = from.Dimensions();
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const Level level = ParallelSum<Level>(rows, 64, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    Level sum;
    for (std::ptrdiff_t row = begin; row < end; row += 4) { // a quarter of them tells enough
      const auto [first, last] = PartOfRow(region, row, n[0]);
      statistics.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), first, last, mean.data() + first,
                     byDeviation ? deviation.data() + first : nullptr);
      for (int i = first; i < last; ++i)
        if (IsReal(from, region, row * n[0] + i)) {
          const std::size_t at = static_cast<std::size_t>(i);
          sum += {std::abs(static_cast<double>(byDeviation ? deviation[at] : mean[at])), 1.0};
        }
    }
    return sum;
  });
  return static_cast<float>(1e-3 * level.Mean());
}

// \param wanted part of the region where the result is asked for; elsewhere it stays as it is
void Normalise(bool byDeviation, const LocalStatistics& statistics, float floor, VolumeView<const float> from,
               VolumeView<const unsigned char> region, VolumeView<const unsigned char> wanted, VolumeView<float> to,
               const Progress& progress)
{
  const auto& n = from.Dimensions();
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const float none = byDeviation ? 0.0f : 1.0f;
  ParallelRanges(rows, 64, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      float* const out = to.Data() + row * n[0];
      const auto [first, last] = PartOfRow(wanted.Empty() ? region : wanted, row, n[0]);
      if (wanted.Empty()) {
        std::fill(out, out + first, none);
        std::fill(out + last, out + n[0], none);
      }
      statistics.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), first, last, mean.data() + first,
                     byDeviation ? deviation.data() + first : nullptr);
      for (int i = first; i < last; ++i) {
        const std::ptrdiff_t voxel = row * n[0] + i;
        const std::size_t at = static_cast<std::size_t>(i);
        const float divisor = byDeviation ? deviation[at] : mean[at];
        out[i] = !IsReal(from, region, voxel) || !(divisor > floor)
                     ? none
                     : (byDeviation ? from[voxel] - mean[at] : from[voxel]) / divisor;
      }
    }
  });
}

} // namespace

ParameterList Describe(ToneMappingParameters& p)
{
  return {
      Parameter("SmoothMm", p.smoothMm, {0, Unlimited, true}, "mm",
                "Standard deviation of the blur that parts grain from the rest."),
      Parameter("MatchDeviation", p.matchDeviation, "Match the local deviation too, not the local mean alone."),
  };
}

void ExtractGrain(const ToneMappingParameters& parameters, VolumeView<const float> intensity,
                  VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing, VolumeView<float> grain,
                  const Progress& progress, VolumeView<const unsigned char> wanted)
{
  CheckRanges(parameters);
  if (intensity.Dimensions() != grain.Dimensions() || (!region.Empty() && region.Dimensions() != intensity.Dimensions()) ||
      (!wanted.Empty() && wanted.Dimensions() != intensity.Dimensions()))
    throw Error(Error::Kind::BadInput, "tone mapping: the volumes do not have one size");
  const bool byDeviation = parameters.matchDeviation, meansAlone = !byDeviation;
  const LocalStatistics first(intensity, region, spacing, parameters.smoothMm, progress.Part(0.0, 0.3), 0.0, meansAlone);
  Normalise(byDeviation, first, FloorOf(byDeviation, first, intensity, region), intensity, region, {}, grain,
            progress.Part(0.3, 0.5));
  const LocalStatistics second(VolumeView<const float>(grain), region, spacing, parameters.smoothMm, progress.Part(0.5, 0.8), 0.0,
                               meansAlone);
  Normalise(byDeviation, second, FloorOf(byDeviation, second, grain, region), grain, region, wanted, grain,
            progress.Part(0.8, 1.0));
}

BlockSums SumsOfFirstRound(const ToneMappingParameters& parameters, const BlockSums& sums, const LocalStatistics& first,
                           int begin, int end)
{
  const auto& count = sums.Grid().count;
  BlockSums grain(sums.Grid(), begin);
  grain.Grow(end);
  ParallelFor(end - begin, [&](std::ptrdiff_t slice) {
    const int K = begin + static_cast<int>(slice);
    std::vector<float> means(static_cast<std::size_t>(count[0])), deviations(means.size());
    for (int J = 0; J < count[1]; ++J) {
      first.RowOfBlocks(J, K, means.data(), deviations.data());
      const double *weight = sums.Row(0, J, K), *values = sums.Row(1, J, K), *squares = sums.Row(2, J, K);
      double* const to[3] = {grain.Row(0, J, K), grain.Row(1, J, K), grain.Row(2, J, K)};
      for (int I = 0; I < count[0]; ++I) {
        const auto at = static_cast<std::size_t>(I);
        const double divisor = static_cast<double>(parameters.matchDeviation ? deviations[at] : means[at]);
        const double mean = parameters.matchDeviation ? static_cast<double>(means[at]) : 0.0;
        to[0][I] = weight[I];
        if (divisor > 0.0) {
          to[1][I] = (values[I] - mean * weight[I]) / divisor;
          to[2][I] = (squares[I] - mean * (2.0 * values[I] - mean * weight[I])) / (divisor * divisor);
        } else if (!parameters.matchDeviation)
          to[1][I] = to[2][I] = weight[I];
      }
    }
  });
  return grain;
}

void ExtractGrain(const ToneMappingParameters& parameters, const LocalStatistics& first, const LocalStatistics& second,
                  VolumeView<float> noise, VolumeView<const unsigned char> wanted, const Progress& progress)
{
  Normalise(parameters.matchDeviation, first, 0.0f, noise, wanted, wanted, noise, progress.Part(0.0, 0.5));
  Normalise(parameters.matchDeviation, second, 0.0f, noise, wanted, wanted, noise, progress.Part(0.5, 1.0));
}

} // namespace echorama
