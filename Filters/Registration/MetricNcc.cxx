// SPDX-License-Identifier: BSD-3-Clause
// Normalised cross-correlation over the whole overlap: at each pose both volumes are brought to mean 0 and deviation 1 there
// (in MetricPoints.cxx); the mean of (a - b)^2 / 2 is then 1 - NCC. Gain and offset fall out, their drift with the depth does
// not.
#include "Metric.h"

namespace echorama {

void SeeIntensity(const MetricSource& source, MetricLevel& level);

const Metric NccMetric{"ncc", 1e3, true, NoLimit, SeeIntensity};

} // namespace echorama
