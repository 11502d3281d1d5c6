// SPDX-License-Identifier: BSD-3-Clause
// Mean absolute difference: of intensities brought to mean 0 and deviation 1 over each volume, once. Differences below a tenth
// of a deviation count squared, so that there is a slope to follow.
#include "Metric.h"

namespace echorama {

const Metric MadMetric{"mad", 0.1, false, NoLimit, SeeIntensity};

} // namespace echorama
