// SPDX-License-Identifier: BSD-3-Clause
//
// Nothing is stored: a number is a function of (seed, beam, ray, dimension), so rays can be followed in any order on any thread.
// Sobol's points are scrambled by a hash that acts on the bits from the top down (nested uniform scrambling after Owen, in the
// form of Laine and Karras, 2011, with the constants of Burley, 2020); scrambling also the order of points makes the
// dimensions of each beam independent of those of others.
#include "RaySamples.h"
#include "Core/Base/Random.h"
#include <array>

namespace echorama {
namespace {

// Primitive polynomials and first direction numbers: Joe and Kuo, SIAM J. Sci. Comput. 30 (2008), file new-joe-kuo-6.
// Their licence is in THIRD_PARTY.md.
struct Polynomial {
  unsigned degree, coefficients;
  std::array<std::uint32_t, 7> m;
};
constexpr std::array<Polynomial, RaySamples::sobolDimensions - 1> polynomials{{
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}},
}};

using Directions = std::array<std::array<std::uint32_t, 32>, RaySamples::sobolDimensions>;

Directions MakeDirections()
{
  Directions directions{};
  for (unsigned bit = 0; bit < 32; ++bit)
    directions[0][bit] = 1u << (31 - bit);
  for (std::size_t d = 1; d < directions.size(); ++d) {
    const Polynomial& p = polynomials[d - 1];
    auto& v = directions[d];
    for (unsigned bit = 0; bit < 32; ++bit) {
      if (bit < p.degree) {
        v[bit] = p.m[bit] << (31 - bit);
        continue;
      }
      v[bit] = v[bit - p.degree] ^ (v[bit - p.degree] >> p.degree);
      for (unsigned k = 1; k < p.degree; ++k)
        if (p.coefficients >> (p.degree - 1 - k) & 1u)
          v[bit] ^= v[bit - k];
    }
  }
  return directions;
}

std::uint32_t Sobol(std::uint32_t index, std::uint32_t dimension)
{
  static const Directions directions = MakeDirections();
  std::uint32_t bits = 0;
  for (unsigned bit = 0; index != 0; index >>= 1, ++bit)
    if (index & 1u)
      bits ^= directions[dimension][bit];
  return bits;
}

std::uint32_t Reversed(std::uint32_t x)
{
  x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
  x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
  x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
  x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
  return x >> 16 | x << 16;
}

// Turns each bit over, or not, by a hash of the bits above it.
std::uint32_t Scrambled(std::uint32_t x, std::uint32_t seed)
{
  x = Reversed(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return Reversed(x);
}

std::uint64_t Hash(std::uint64_t a, std::uint64_t b)
{
  const auto words = Random::Block({static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(b >> 32), 0u, 0u},
                                   {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a >> 32)});
  return static_cast<std::uint64_t>(words[0]) << 32 | words[1];
}

// A permutation of {0 ... count - 1}: a hash on the next power of two that can be undone, again until it is in the range.
std::uint32_t Permuted(std::uint32_t i, std::uint32_t count, std::uint64_t key)
{
  unsigned bits = 1;
  while (bits < 32 && (count - 1) >> bits != 0)
    ++bits;
  const std::uint32_t mask = bits == 32 ? 0xffffffffu : (1u << bits) - 1u;
  const auto odd = static_cast<std::uint32_t>(key >> 32) | 1u;
  const auto shift = static_cast<std::uint32_t>(key);
  const unsigned half = bits / 2 + bits % 2;
  do
    for (int round = 0; round < 4; ++round) {
      i = (i * odd + shift) & mask;
      i ^= i >> half;
      i = i * 0x2c1b3c6du & mask;
      i ^= i >> half;
    }
  while (i >= count);
  return i;
}

double Fraction(std::uint64_t bits)
{
  return static_cast<double>(bits >> 11) * (1.0 / 9007199254740992.0);
}

} // namespace

RaySamples::RaySamples(Sampling sampling, std::uint64_t seed, std::uint64_t beam, std::uint32_t ray, std::uint32_t count)
  : sampling_(sampling), key_(Hash(seed, beam)), ray_(ray), count_(count > 0 ? count : 1)
{
}

double RaySamples::Next()
{
  const std::uint32_t dimension = dimension_++;
  const std::uint64_t keyOfDimension = Hash(key_, dimension);
  if (sampling_ == Sampling::Sobol) {
    // Further dimensions are the same points once more, in another order.
    const std::uint64_t keyOfOrder = Hash(~key_, dimension / sobolDimensions);
    const std::uint32_t order = Scrambled(ray_, static_cast<std::uint32_t>(keyOfOrder)); // keeps blocks of 2^n together
    // 32 bits make a fraction; what lies below is filled at random, so that no two rays are alike in a coordinate.
    const std::uint32_t bits =
        Scrambled(Sobol(order, dimension % sobolDimensions), static_cast<std::uint32_t>(keyOfDimension >> 32));
    return Fraction(static_cast<std::uint64_t>(bits) << 32 | static_cast<std::uint32_t>(Hash(keyOfDimension, ray_)));
  }
  const double within = Fraction(Hash(keyOfDimension, ray_));
  if (sampling_ != Sampling::Stratified)
    return within;
  const double value = (Permuted(ray_ % count_, count_, keyOfDimension) + within) / count_;
  return value < 1.0 ? value : 1.0 - 0x1p-53;
}

} // namespace echorama
