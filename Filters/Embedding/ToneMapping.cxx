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

// \param wanted part of the region where the result is asked for; elsewhere it stays as it is
void Normalise(bool byDeviation, const LocalStatistics& statistics, VolumeView<const float> from,
               VolumeView<const unsigned char> region, VolumeView<const unsigned char> wanted, VolumeView<float> to,
               const Progress& progress)
{
  const auto& n = from.Dimensions();
  const auto real = [&](std::ptrdiff_t at) { return (region.Empty() || region[at]) && std::isfinite(from[at]); };
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const Level level = ParallelSum<Level>(rows, 64, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    Level sum;
    for (std::ptrdiff_t row = begin; row < end; row += 4) { // a quarter of them tells enough
      const auto [first, last] = PartOfRow(region, row, n[0]);
      statistics.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), first, last, mean.data() + first,
                     byDeviation ? deviation.data() + first : nullptr);
      for (int i = first; i < last; ++i)
        if (real(row * n[0] + i)) {
          const std::size_t at = static_cast<std::size_t>(i);
          sum += {std::abs(static_cast<double>(byDeviation ? deviation[at] : mean[at])), 1.0};
        }
    }
    return sum;
  });
  const float floor = static_cast<float>(1e-3 * level.Mean()), none = byDeviation ? 0.0f : 1.0f;
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
        out[i] = !real(voxel) || !(divisor > floor) ? none : (byDeviation ? from[voxel] - mean[at] : from[voxel]) / divisor;
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
  const bool meansAlone = !parameters.matchDeviation;
  const LocalStatistics first(intensity, region, spacing, parameters.smoothMm, progress.Part(0.0, 0.3), 0.0, meansAlone);
  Normalise(parameters.matchDeviation, first, intensity, region, {}, grain, progress.Part(0.3, 0.5));
  const LocalStatistics second(VolumeView<const float>(grain), region, spacing, parameters.smoothMm, progress.Part(0.5, 0.8), 0.0,
                               meansAlone);
  Normalise(parameters.matchDeviation, second, grain, region, wanted, grain, progress.Part(0.8, 1.0));
}

} // namespace echorama
