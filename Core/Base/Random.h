// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <Eigen/Geometry>

namespace echorama {

/// Counter-based random numbers: Philox 4x32-10 (Salmon, Moraes, Dror, Shaw, SC 2011).
///
/// A stream is named by (seed, item): any item's numbers can be made again, in any order, on any thread. There is no
/// other source of randomness in the project.
class Random {
public:
  explicit Random(std::uint64_t seed, std::uint64_t item = 0)
    : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}, counter_{
                                                                                          0u, 0u,
                                                                                          static_cast<std::uint32_t>(item),
                                                                                          static_cast<std::uint32_t>(item >> 32)}
  {
  }

  /// 32 uniform random bits.
  std::uint32_t Bits()
  {
    if (used_ == 4) {
      block_ = Block(counter_, key_);
      if (++counter_[0] == 0)
        ++counter_[1];
      used_ = 0;
    }
    return block_[used_++];
  }

  /// Uniform in [0, 1), 53 bits.
  double Uniform()
  {
    const std::uint64_t high = Bits() >> 5, low = Bits() >> 6;
    return static_cast<double>(high * 67108864u + low) * (1.0 / 9007199254740992.0);
  }
  double Uniform(double from, double to) { return from + (to - from) * Uniform(); }

  /// Uniform in {0 ... count - 1}; count > 0. (The bias is below count / 2^64.)
  std::uint64_t Below(std::uint64_t count)
  {
    const std::uint64_t high = Bits();
    const std::uint64_t bits = high << 32 | Bits();
    return static_cast<std::uint64_t>(static_cast<unsigned __int128>(bits) * count >> 64);
  }

  /// Standard normal (Box-Muller, one of the pair).
  double Normal()
  {
    const double radius = std::sqrt(-2.0 * std::log1p(-Uniform()));
    return radius * std::cos(6.283185307179586 * Uniform());
  }

  /// A direction, uniform on the sphere.
  Eigen::Vector3d Direction()
  {
    const double z = Uniform(-1.0, 1.0), angle = Uniform(0.0, 6.283185307179586);
    const double radius = std::sqrt(std::fmax(0.0, 1.0 - z * z));
    return {radius * std::cos(angle), radius * std::sin(angle), z};
  }

  /// The bare generator: four words from a counter and a key.
  static std::array<std::uint32_t, 4> Block(std::array<std::uint32_t, 4> c, std::array<std::uint32_t, 2> k)
  {
    for (int round = 0; round < 10; ++round) {
      const std::uint64_t a = std::uint64_t{0xD2511F53u} * c[0], b = std::uint64_t{0xCD9E8D57u} * c[2];
      c = {static_cast<std::uint32_t>(b >> 32) ^ c[1] ^ k[0], static_cast<std::uint32_t>(b),
           static_cast<std::uint32_t>(a >> 32) ^ c[3] ^ k[1], static_cast<std::uint32_t>(a)};
      k[0] += 0x9E3779B9u;
      k[1] += 0xBB67AE85u;
    }
    return c;
  }

private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
};

} // namespace echorama
