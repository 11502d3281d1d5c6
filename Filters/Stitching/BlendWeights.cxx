// SPDX-License-Identifier: BSD-3-Clause
// The formulas of a blend at one voxel. Scales are compared to the largest among them, s / max s, before they are raised to
// the power b: the largest ratio is 1, the sum is at least 1, and nothing underflows that matters, whatever b is.
#include "BlendWeights.h"
#include <algorithm>
#include <cmath>

namespace echorama {

float BlendScale(float pure, float empty)
{
  if (std::isinf(empty))
    return 1.0f;
  if (std::isinf(pure))
    return 0.0f;
  return empty / (pure + empty);
}

void BlendWeights(const float* scales, const float* factors, std::size_t count, const BlendPower& power, float* weights)
{
  const float largest = count ? *std::max_element(scales, scales + count) : 0.0f;
  float total = 0.0f;
  for (std::size_t i = 0; i < count; ++i) {
    weights[i] = scales[i] < largest ? power(scales[i] / largest) : 1.0f;
    if (factors)
      weights[i] *= factors[i];
    total += weights[i];
  }
  for (std::size_t i = 0; i < count; ++i)
    weights[i] /= total;
}

} // namespace echorama
