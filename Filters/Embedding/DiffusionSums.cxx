// SPDX-License-Identifier: BSD-3-Clause
//
// The loops that take all the time. Points are the lanes of vectors; sources come one by one, four at a time so that four
// reciprocals cost one division: 1/a = bcd / abcd. Weights are (nearest / distance)^d, so the largest is 1 whatever d is; far
// ratios are cut where a weight is 2^-100. Weights of four sources are kept in the first-level cache, so any number of rows
// shares them and no loop knows how many there are.
//
// A cluster of sources s = c + e, seen from x with y = x - c, r = |y|, u = y / r^2:
//   |y - e|^-d = r^-d (1 + d u.e + d (d + 2) / 2 (u.e)^2 - d / 2 |e|^2 / r^2 + O((|e| / r)^3)).
// Its factors are folded into the moments. The rows have the same expansion, so errors cancel where the values agree.
#include "DiffusionSums.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace echorama {

namespace {

constexpr int Most = DiffusionBlock::Most;

// log2 of numbers in [1e-9, 2): a power of two, and the series of atanh for what is left in [0.7, 1.4].
[[gnu::always_inline]] inline float Log2(float q)
{
  std::int32_t bits;
  std::memcpy(&bits, &q, sizeof bits);
  const std::int32_t power = (bits - 0x3f3504f3) >> 23;
  bits -= power * (1 << 23);
  float m;
  std::memcpy(&m, &bits, sizeof m);
  const float s = (m - 1.0f) / (m + 1.0f), s2 = s * s;
  const float series = 2.8853900f + s2 * (0.96179669f + s2 * (0.57707802f + s2 * (0.41219858f + s2 * 0.32059890f)));
  return static_cast<float>(power) + s * series;
}

// 2^y for y in [-120, 120]: a power of two, and the series of exp for what is left in [-0.5, 0.5].
[[gnu::always_inline]] inline float Exp2(float y)
{
  const float shifted = y + 12582912.0f; // 1.5 * 2^23: the last bits are those of the nearest integer
  const float rest = y - (shifted - 12582912.0f);
  const float series =
      1.0f + rest * (0.69314718f +
                     rest * (0.24022651f +
                             rest * (0.055504109f + rest * (0.0096181291f + rest * (0.0013333558f + rest * 0.00015403530f)))));
  std::int32_t bits;
  std::memcpy(&bits, &shifted, sizeof bits);
  bits = (bits - 0x4b400000 + 127) << 23;
  float power;
  std::memcpy(&power, &bits, sizeof power);
  return series * power;
}

template <int Whole>
[[gnu::always_inline]] inline float Power(float q, float half)
{
  if constexpr (Whole == 1)
    return q;
  else if constexpr (Whole > 1 && Whole % 2 == 0)
    return Power<Whole / 2>(q * q, half);
  else if constexpr (Whole > 1)
    return q * Power<Whole / 2>(q * q, half);
  else
    return Exp2(half * Log2(q));
}

[[gnu::always_inline]] inline float Squared(float x, float y, float z)
{
  return x * x + y * y + z * z;
}

template <int Whole>
[[gnu::always_inline]] inline void NearLoop(const DiffusionExponent& exponent, const DiffusionNear& near, int rows,
                                            std::size_t begin, std::size_t end, DiffusionBlock& block)
{
  alignas(64) float w0[Most], w1[Most], w2[Most], w3[Most], scale[Most];
  const int points = block.Padded();
  const float half = exponent.half, farthest = exponent.farthest;
  for (int t = 0; t < points; ++t)
    scale[t] = 1.0f / block.nearest[t];
  for (std::size_t s = begin; s < end; s += 4) {
    const float* const x = near.x.data() + s;
    const float* const y = near.y.data() + s;
    const float* const z = near.z.data() + s;
    const float x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3];
    const float y0 = y[0], y1 = y[1], y2 = y[2], y3 = y[3];
    const float z0 = z[0], z1 = z[1], z2 = z[2], z3 = z[3];
    for (int t = 0; t < points; ++t) {
      const float px = block.x[t], py = block.y[t], pz = block.z[t];
      const float a = std::min(Squared(px - x0, py - y0, pz - z0) * scale[t], farthest);
      const float b = std::min(Squared(px - x1, py - y1, pz - z1) * scale[t], farthest);
      const float c = std::min(Squared(px - x2, py - y2, pz - z2) * scale[t], farthest);
      const float d = std::min(Squared(px - x3, py - y3, pz - z3) * scale[t], farthest);
      const float ab = a * b, cd = c * d;
      const float inverse = 1.0f / (ab * cd);
      const float inverseAb = inverse * cd, inverseCd = inverse * ab;
      w0[t] = Power<Whole>(inverseAb * b, half);
      w1[t] = Power<Whole>(inverseAb * a, half);
      w2[t] = Power<Whole>(inverseCd * d, half);
      w3[t] = Power<Whole>(inverseCd * c, half);
    }
    for (int row = 0; row < rows; ++row) {
      const float* const v = near.values[static_cast<std::size_t>(row)].data() + s;
      const float v0 = v[0], v1 = v[1], v2 = v[2], v3 = v[3];
      float* const sums = block.sums[row];
      for (int t = 0; t < points; ++t)
        sums[t] += (w0[t] * v0 + w1[t] * v1) + (w2[t] * v2 + w3[t] * v3);
    }
  }
}

template <int Whole>
[[gnu::always_inline]] inline void FarLoop(const DiffusionExponent& exponent, const DiffusionFar& far, int rows,
                                           DiffusionBlock& block)
{
  alignas(64) float w[Most], ux[Most], uy[Most], uz[Most], q[Most];
  const int points = block.Padded();
  const float half = exponent.half, least = 1.0f / exponent.farthest;
  const float* m = far.moments.data();
  for (std::size_t s = 0; s < far.x.size(); ++s) {
    const float x = far.x[s], y = far.y[s], z = far.z[s];
    for (int t = 0; t < points; ++t) {
      const float dx = block.x[t] - x, dy = block.y[t] - y, dz = block.z[t] - z;
      const float inverse = 1.0f / Squared(dx, dy, dz);
      w[t] = Power<Whole>(std::max(block.nearest[t] * inverse, least), half);
      ux[t] = dx * inverse;
      uy[t] = dy * inverse;
      uz[t] = dz * inverse;
      q[t] = inverse;
    }
    for (int row = 0; row < rows; ++row, m += DiffusionFar::Terms) {
      const float m0 = m[0], mx = m[1], my = m[2], mz = m[3];
      const float xx = m[4], xy = m[5], xz = m[6], yy = m[7], yz = m[8], zz = m[9], trace = m[10];
      float* const sums = block.sums[row];
      for (int t = 0; t < points; ++t)
        sums[t] += w[t] * ((m0 + trace * q[t]) + ux[t] * (mx + xx * ux[t] + xy * uy[t] + xz * uz[t]) +
                           uy[t] * (my + yy * uy[t] + yz * uz[t]) + uz[t] * (mz + zz * uz[t]));
    }
  }
}

void Near(const DiffusionExponent& exponent, const DiffusionNear& near, int rows, std::size_t begin, std::size_t end,
          DiffusionBlock& block)
{
  switch (exponent.whole) {
  case 1:
    return NearLoop<1>(exponent, near, rows, begin, end, block);
  case 2:
    return NearLoop<2>(exponent, near, rows, begin, end, block);
  case 3:
    return NearLoop<3>(exponent, near, rows, begin, end, block);
  case 4:
    return NearLoop<4>(exponent, near, rows, begin, end, block);
  case 8:
    return NearLoop<8>(exponent, near, rows, begin, end, block);
  case 16:
    return NearLoop<16>(exponent, near, rows, begin, end, block);
  case 32:
    return NearLoop<32>(exponent, near, rows, begin, end, block);
  default:
    return NearLoop<0>(exponent, near, rows, begin, end, block);
  }
}

void Far(const DiffusionExponent& exponent, const DiffusionFar& far, int rows, DiffusionBlock& block)
{
  switch (exponent.whole) {
  case 1:
    return FarLoop<1>(exponent, far, rows, block);
  case 2:
    return FarLoop<2>(exponent, far, rows, block);
  case 3:
    return FarLoop<3>(exponent, far, rows, block);
  case 4:
    return FarLoop<4>(exponent, far, rows, block);
  case 8:
    return FarLoop<8>(exponent, far, rows, block);
  case 16:
    return FarLoop<16>(exponent, far, rows, block);
  case 32:
    return FarLoop<32>(exponent, far, rows, block);
  default:
    return FarLoop<0>(exponent, far, rows, block);
  }
}

} // namespace

DiffusionExponent::DiffusionExponent(double exponent)
  : d(exponent), half(static_cast<float>(0.5 * exponent)),
    farthest(static_cast<float>(std::min(1e9, std::exp2(100.0 / (0.5 * exponent)))))
{
  for (const int special : {1, 2, 3, 4, 8, 16, 32})
    if (exponent == 2.0 * special)
      whole = special;
}

float DiffusionExponent::Weight(float squaredRatio) const
{
  return Power<0>(std::max(squaredRatio, 1.0f / farthest), half);
}

void DiffusionBlock::Start()
{
  for (int t = count; t < Padded(); ++t) {
    x[t] = x[0];
    y[t] = y[0];
    z[t] = z[0];
    nearest[t] = nearest[0];
  }
  for (auto& row : sums)
    std::fill(row, row + Most, 0.0f);
}

void DiffusionNear::Clear(int rows)
{
  x.clear();
  y.clear();
  z.clear();
  for (int row = 0; row < rows; ++row)
    values[static_cast<std::size_t>(row)].clear();
}

void DiffusionNear::Pad(int rows)
{
  // What fills up weighs nothing: far away, and 0 in every row.
  while (x.size() % 4 != 0) {
    x.push_back(1e6f);
    y.push_back(0.0f);
    z.push_back(0.0f);
    for (int row = 0; row < rows; ++row)
      values[static_cast<std::size_t>(row)].push_back(0.0f);
  }
}

void AddNear(const DiffusionExponent& exponent, const DiffusionNear& near, int rows, std::size_t begin, std::size_t end,
             DiffusionBlock& block)
{
  Near(exponent, near, rows, begin, end, block);
}

void AddFar(const DiffusionExponent& exponent, const DiffusionFar& far, int rows, DiffusionBlock& block)
{
  Far(exponent, far, rows, block);
}

} // namespace echorama
