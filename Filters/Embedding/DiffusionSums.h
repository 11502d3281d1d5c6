// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <vector>

namespace echorama {

/// The exponent d, as the loops want it.
struct DiffusionExponent {
  explicit DiffusionExponent(double exponent);
  double d;
  float half;     ///< d / 2: weights are powers of squared distances
  int whole = 0;  ///< d / 2 where there is a loop for it (1, 2, 3, 4, 8, 16, 32); else 0
  float farthest; ///< squared ratios of distances are cut here, where a weight is about 2^-100: no underflow

  /// ratio^(d / 2) for one squared ratio of distances in (0, 1].
  float Weight(float squaredRatio) const;
};

/// Row 0 sums the weights alone (every value is 1), the others are channels.
constexpr int DiffusionRows = 5;

/// Some points at which sums are taken, and the sums.
struct DiffusionBlock {
  static constexpr int Most = 128;
  int count = 0;                               ///< filled up to a multiple of 16 by Pad
  alignas(64) float x[Most], y[Most], z[Most]; ///< mm
  alignas(64) float nearest[Most];             ///< squared distance to the nearest source, mm^2, > 0
  alignas(64) float sums[DiffusionRows][Most];

  /// Sets the sums to zero; what is beyond the count becomes a copy of the first point.
  void Start();
  int Padded() const { return (count + 15) / 16 * 16; }
};

/// Sources near a block: one by one. Rows of numbers, a multiple of four long (Pad).
struct DiffusionNear {
  std::vector<float> x, y, z;
  std::array<std::vector<float>, DiffusionRows> values;
  void Clear(int rows);
  void Pad(int rows);
};

/// Sources far from a block, in clusters: the expansion of |x - s|^-d about the cluster's centre, to second order.
struct DiffusionFar {
  static constexpr int Terms = 11; ///< sum, three first moments, six second ones (xx xy xz yy yz zz), trace
  std::vector<float> x, y, z;
  std::vector<float> moments; ///< Terms * rows per cluster
};

/// block.sums[row] += sum_s (nearest / |x - s|^2)^(d / 2) values[row][s], for sources [begin, end), multiples of four.
void AddNear(const DiffusionExponent& exponent, const DiffusionNear& near, int rows, std::size_t begin, std::size_t end,
             DiffusionBlock& block);

/// The same for clusters.
void AddFar(const DiffusionExponent& exponent, const DiffusionFar& far, int rows, DiffusionBlock& block);

} // namespace echorama
