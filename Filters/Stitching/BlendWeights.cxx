// SPDX-License-Identifier: BSD-3-Clause
// The formulas of a blend. Each is a few plain loops over a row of voxels, so that it becomes vector instructions.
//
// Scales are compared to the largest among them, s / max s, before they are raised to the power b: the largest ratio is 1,
// the sum is at least 1, and nothing underflows that matters, whatever b is.
#include "BlendWeights.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

#define ECHORAMA_INLINE [[gnu::always_inline]] inline

ECHORAMA_INLINE void Raise(const BlendPower& power, std::size_t count, float* ratio)
{
  switch (power.kind) {
  case BlendPower::Kind::Zero:
    for (std::size_t i = 0; i < count; ++i)
      ratio[i] = 1.0f;
    return;
  case BlendPower::Kind::One:
    return;
  case BlendPower::Kind::OneAndAHalf:
    for (std::size_t i = 0; i < count; ++i)
      ratio[i] *= std::sqrt(ratio[i]);
    return;
  case BlendPower::Kind::Two:
    for (std::size_t i = 0; i < count; ++i)
      ratio[i] *= ratio[i];
    return;
  case BlendPower::Kind::ThirtyTwo:
    for (std::size_t i = 0; i < count; ++i) {
      const float r2 = ratio[i] * ratio[i], r4 = r2 * r2, r8 = r4 * r4, r16 = r8 * r8;
      ratio[i] = r16 * r16;
    }
    return;
  case BlendPower::Kind::Other:
    for (std::size_t i = 0; i < count; ++i)
      ratio[i] = std::pow(ratio[i], power.exponent);
  }
}

// sum := first + sum of weight (value - first)
template <class A>
ECHORAMA_INLINE void Mean(const float* const* weight, const A* const* value, std::size_t volumes, std::size_t count,
                          A* __restrict sum)
{
  const A* const first = value[0];
  std::copy_n(first, count, sum);
  for (std::size_t a = 1; a < volumes; ++a) {
    const float* const w = weight[a];
    const A* const v = value[a];
    for (std::size_t i = 0; i < count; ++i)
      sum[i] += static_cast<A>(w[i]) * (v[i] - first[i]);
  }
}

template <class A>
ECHORAMA_INLINE void Split(const BlendRow<A>& row, A* __restrict sum, A* __restrict result)
{
  const std::size_t count = row.count;
  float* const __restrict strength = row.scratch, * const __restrict variance = row.scratch + count;
  const float most = row.mostAmplified, least = 1.0f / most;
  Mean(row.weight, row.deviation, row.volumes, count, strength);
  Mean(row.weight, row.low, row.volumes, count, result);
  for (std::size_t a = 0; a < row.volumes; ++a) {
    const float *const h = row.share[a], *const own = row.deviation[a];
    const A *const value = row.value[a], *const low = row.low[a];
    const bool begins = a == 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float wanted = strength[i] / own[i];
      const float limited = wanted < least ? least : most < wanted ? most : wanted;
      const float amplified = own[i] > 0.0f ? limited : 1.0f;
      sum[i] = (begins ? A(0) : sum[i]) + static_cast<A>(h[i] * amplified) * (value[i] - low[i]);
      variance[i] = (begins ? 0.0f : variance[i]) + h[i] * h[i];
    }
    for (std::size_t b = 0; b < a; ++b) {
      const float* const other = row.share[b];
      const float correlation = row.correlation[a * row.volumes + b];
      for (std::size_t i = 0; i < count; ++i)
        variance[i] += 2.0f * h[i] * other[i] * correlation;
    }
  }
  for (std::size_t i = 0; i < count; ++i)
    result[i] += sum[i] / static_cast<A>(std::sqrt(variance[i]));
}

template <class A>
ECHORAMA_INLINE void Alone(const A* value, const unsigned char* inside, const unsigned char* coverage, A gain, A offset,
                           std::size_t count, A* __restrict to)
{
  for (std::size_t i = 0; i < count; ++i) {
    const A shown = gain * value[i] + offset;
    to[i] = ((inside[i] & 1) != 0) & (coverage[i] == 1) ? shown : to[i];
  }
}

} // namespace

float BlendScale(float pure, float empty)
{
  if (std::isinf(empty))
    return 1.0f;
  if (std::isinf(pure))
    return 0.0f;
  return empty / (pure + empty);
}

BlendPower::BlendPower(double b)
  : kind(b == 0.0    ? Kind::Zero
         : b == 1.0  ? Kind::One
         : b == 1.5  ? Kind::OneAndAHalf
         : b == 2.0  ? Kind::Two
         : b == 32.0 ? Kind::ThirtyTwo
                     : Kind::Other),
    exponent(static_cast<float>(b))
{
}

void BlendWeights(const float* const* scales, const float* const* factors, std::size_t volumes, std::size_t count,
                  const BlendPower& power, float* const* weights, float* scratch)
{
  float* const __restrict largest = scratch, * const __restrict total = scratch + count;
  for (std::size_t v = 0; v < volumes; ++v) {
    const float* const scale = scales[v];
    for (std::size_t i = 0; i < count; ++i)
      largest[i] = v == 0 || largest[i] < scale[i] ? scale[i] : largest[i];
  }
  for (std::size_t v = 0; v < volumes; ++v) {
    const float* const scale = scales[v];
    float* const __restrict weight = weights[v];
    for (std::size_t i = 0; i < count; ++i)
      weight[i] = scale[i] < largest[i] ? scale[i] / largest[i] : 1.0f;
    Raise(power, count, weight);
    if (const float* const factor = factors ? factors[v] : nullptr)
      for (std::size_t i = 0; i < count; ++i)
        weight[i] *= factor[i];
    for (std::size_t i = 0; i < count; ++i)
      total[i] = (v == 0 ? 0.0f : total[i]) + weight[i];
  }
  for (std::size_t v = 0; v < volumes; ++v) {
    float* const __restrict weight = weights[v];
    for (std::size_t i = 0; i < count; ++i)
      weight[i] /= total[i];
  }
}

// One text for both kinds of numbers.
#define EchoramaRows(A)                                                                                                          \
  void BlendMean(const BlendRow<A>& row, A* result)                                                                              \
  {                                                                                                                              \
    Mean(row.weight, row.value, row.volumes, row.count, result);                                                                 \
  }                                                                                                                              \
  void BlendSplit(const BlendRow<A>& row, A* sum, A* result)                                                                     \
  {                                                                                                                              \
    Split(row, sum, result);                                                                                                     \
  }                                                                                                                              \
  void ApplyGain(const A* value, A gain, A offset, std::size_t count, A* to)                                                     \
  {                                                                                                                              \
    for (std::size_t i = 0; i < count; ++i)                                                                                      \
      to[i] = gain * value[i] + offset;                                                                                          \
  }                                                                                                                              \
  void ShowAlone(const A* value, const unsigned char* inside, const unsigned char* coverage, A gain, A offset,                   \
                 std::size_t count, A* to)                                                                                       \
  {                                                                                                                              \
    Alone(value, inside, coverage, gain, offset, count, to);                                                                     \
  }
EchoramaRows(float) EchoramaRows(double)
#undef EchoramaRows

#undef ECHORAMA_INLINE

} // namespace echorama
