// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// How the numbers in [0, 1) are chosen that drive a set of rays.
enum class Sampling {
  Random,     ///< independent (Philox)
  Stratified, ///< of n rays each takes another n-th of the range, in every dimension (Latin hypercube)
  Sobol,      ///< Sobol sequence, scrambled (Owen), evenly spread in several dimensions at once
};

inline const std::vector<std::string> SamplingNames{"random", "stratified", "sobol"};

/// The random numbers of one ray among several of a beam: dimension after dimension. The same for the same seed, beam and ray,
/// whoever asks.
class RaySamples {
public:
  /// Ray \a ray of \a count of the beam \a beam.
  RaySamples(Sampling sampling, std::uint64_t seed, std::uint64_t beam, std::uint32_t ray, std::uint32_t count);

  /// The number of the next dimension, in [0, 1). Sobol's evenness holds among each sobolDimensions in a row.
  double Next();

  static constexpr int sobolDimensions = 21;

private:
  Sampling sampling_;
  std::uint64_t key_; ///< of the beam
  std::uint32_t ray_, count_;
  std::uint32_t dimension_ = 0;
};

} // namespace echorama
