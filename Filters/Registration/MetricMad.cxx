// SPDX-License-Identifier: BSD-3-Clause
// Mean absolute difference: of intensities brought to mean 0 and deviation 1 over each volume, once. Differences below a tenth
// of a deviation count squared, so that there is a slope to follow.
#include "Core/Base/Parallel.h"
#include "Metric.h"

namespace echorama {

void SeeIntensity(const MetricSource& source, MetricLevel& level)
{
  const MeanAndDeviation global = MeanAndDeviationOf(source);
  const double scale = global.deviation > 0.0 ? 1.0 / global.deviation : 0.0;
  level.seen.assign(static_cast<std::size_t>(2 * source.intensity.Size()), 0.0f);
  ParallelRanges(source.intensity.Size(), 1 << 16, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const float v = source.intensity[i];
      if (!(v == v))
        continue;
      level.seen[static_cast<std::size_t>(2 * i)] = static_cast<float>((static_cast<double>(v) - global.mean) * scale);
      level.seen[static_cast<std::size_t>(2 * i + 1)] = static_cast<float>(source.Trust(i));
    }
  });
}

const Metric MadMetric{"mad", 0.1, false, NoLimit, SeeIntensity};

} // namespace echorama
