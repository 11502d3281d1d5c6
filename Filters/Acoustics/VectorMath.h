// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Functions of single numbers without branches and calls, so that loops over them become vectors.
#include <cmath>
#include <cstdint>
#include <cstring>

namespace echorama {

/// e^x for x in [-80, 80], to 1e-7.
inline float Exponential(float x)
{
  const float y = x * 1.44269504f;
  const float whole = std::floor(y);
  const float f = y - whole;
  const float power =
      1.0f + f * (0.693147577f + f * (0.240206874f + f * (0.0556586641f + f * (0.0091968022f + f * 0.00178966497f))));
  const int bits = (static_cast<int>(whole) + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return power * scale;
}

/// Cosine and sine of an angle in whole turns, to 1e-6.
inline void CosineAndSine(float turn, float& cosine, float& sine)
{
  // Of half the angle, then of the whole.
  const float half = turn - std::floor(turn + 0.5f);
  const float q = half * half;
  const float s = half * (3.14159264f + q * (-5.16771008f + q * (2.55007752f + q * (-0.598291286f + q * 0.0776576603f))));
  const float c = 1.0f + q * (-4.9348022f + q * (4.05871142f + q * (-1.33523998f + q * (0.235074509f + q * -0.0246274055f))));
  cosine = c * c - s * s;
  sine = 2.0f * s * c;
}

/// -ln(1 - u) for u in [0, 1), to 3e-7 of itself; \a u must keep its precision where 1 - u is small.
inline float MinusLogOfRest(double u)
{
  // 1 - u = 2^exponent (1 + f) with f in [-0.3, 0.42); near u = 0 the exponent is 0, and f is -u to the last bit.
  const auto rest = static_cast<float>(1.0 - u);
  std::int32_t bits;
  std::memcpy(&bits, &rest, sizeof bits);
  constexpr std::int32_t one = 0x3f800000, middle = 0x3f3504f3; // of 1 and the root of a half
  const std::int32_t shifted = bits + (one - middle), exponent = (shifted >> 23) - 127;
  const std::int32_t mantissa = (shifted & 0x007fffff) + middle;
  float m;
  std::memcpy(&m, &mantissa, sizeof m);
  const float f = exponent == 0 ? -static_cast<float>(u) : m - 1.0f;
  // ln(1 + f) = 2 artanh(s)
  const float s = f / (2.0f + f), z = s * s;
  const float artanh = s * (1.0f + z * (0.333333333f + z * (0.2f + z * (0.142857143f + z * 0.111111111f))));
  return -0.693147181f * static_cast<float>(exponent) - 2.0f * artanh;
}

} // namespace echorama
