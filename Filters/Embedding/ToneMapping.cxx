// SPDX-License-Identifier: BSD-3-Clause
//
// Two rounds of the same: measure the local mean and deviation (LocalStatistics), take them out. The first leaves some per cent
// of either, because a window's own voxel is in its mean; the second hardly any. Cost: two passes to measure and two to correct.
#include "ToneMapping.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "LocalStatistics.h"
#include <cmath>

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

void Normalise(bool byDeviation, const LocalStatistics& statistics, VolumeView<const float> from,
               VolumeView<const unsigned char> region, VolumeView<float> to, const Progress& progress)
{
  const auto& n = from.Dimensions();
  const auto real = [&](std::ptrdiff_t at) { return (region.Empty() || region[at]) && std::isfinite(from[at]); };
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const Level level = ParallelSum<Level>(rows, 64, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    Level sum;
    for (std::ptrdiff_t row = begin; row < end; row += 4) { // a quarter of them tells enough
      statistics.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), 0, n[0], mean.data(), deviation.data());
      for (int i = 0; i < n[0]; ++i)
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
      statistics.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), 0, n[0], mean.data(), deviation.data());
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t voxel = row * n[0] + i;
        const std::size_t at = static_cast<std::size_t>(i);
        const float divisor = byDeviation ? deviation[at] : mean[at];
        to[voxel] = !real(voxel) || !(divisor > floor) ? none : (byDeviation ? from[voxel] - mean[at] : from[voxel]) / divisor;
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
                  const Progress& progress)
{
  CheckRanges(parameters);
  if (intensity.Dimensions() != grain.Dimensions() || (!region.Empty() && region.Dimensions() != intensity.Dimensions()))
    throw Error(Error::Kind::BadInput, "tone mapping: the volumes do not have one size");
  const LocalStatistics first(intensity, region, spacing, parameters.smoothMm, progress.Part(0.0, 0.3));
  Normalise(parameters.matchDeviation, first, intensity, region, grain, progress.Part(0.3, 0.5));
  const LocalStatistics second(VolumeView<const float>(grain), region, spacing, parameters.smoothMm, progress.Part(0.5, 0.8));
  Normalise(parameters.matchDeviation, second, grain, region, grain, progress.Part(0.8, 1.0));
}

} // namespace echorama
