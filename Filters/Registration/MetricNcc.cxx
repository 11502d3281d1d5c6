// SPDX-License-Identifier: BSD-3-Clause
// Normalised cross-correlation over the whole overlap: at each pose both volumes are brought to mean 0 and deviation 1 there
// (in MetricPoints.cxx); the mean of (a - b)^2 / 2 is then 1 - NCC. Gain and offset fall out, their drift with the depth does
// not.
#include "Core/Base/Parallel.h"
#include "Metric.h"

namespace echorama {

void SeeIntensity(const MetricSource& source, MetricLevel& level)
{
  const MeanAndDeviation global = MeanAndDeviationOf(source);
  const double scale = global.deviation > 0.0 ? 1.0 / global.deviation : 0.0;
  level.seen.assign(static_cast<std::size_t>(source.intensity.Size()), {});
  ParallelRanges(source.intensity.Size(), 1 << 16, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const float v = source.intensity[i];
      if (!(v == v))
        continue;
      level.seen[static_cast<std::size_t>(i)] = {static_cast<float>((static_cast<double>(v) - global.mean) * scale),
                                                 static_cast<float>(source.Trust(i))};
    }
  });
}

const Metric NccMetric{"ncc", 1e3, true, NoLimit, SeeIntensity};

} // namespace echorama
