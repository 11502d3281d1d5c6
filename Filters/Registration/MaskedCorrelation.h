// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <complex>
#include <cstddef>
#include <vector>

namespace echorama {

/// The translations that a correlation looks at, in voxels: moving voxel i lies on fixed voxel i + shift, first <= shift <= last.
struct ShiftRange {
  std::array<int, 3> first{0, 0, 0}, last{0, 0, 0};
  std::array<int, 3> Counts() const { return {last[0] - first[0] + 1, last[1] - first[1] + 1, last[2] - first[2] + 1}; }
};

/// Correlates one fixed volume with many moving ones over all translations at once, through Fourier space (Padfield, IEEE
/// TIP 21(5), 2012, with weights in place of masks).
///
/// A voxel is a pair: its weight (0: not real, and up to 1), and its value times the weight. Single precision: bring values of
/// mean 0 and variance 1 or so. The fixed volume is transformed once. Wrap-around is kept out of the range of shifts alone, so
/// the transforms are no larger than that needs. Safe for threads; each brings its own Work.
class MaskedCorrelator {
public:
  using Complex = std::complex<float>;

  /// \param movingDimensions of every moving volume that will come
  MaskedCorrelator(VolumeView<const Complex> fixed, const std::array<int, 3>& movingDimensions, const ShiftRange& shifts);

  /// Room for one correlation; it may be used again.
  struct Work {
    std::vector<Complex> moving, squares, sums[3];
  };

  /// The sums of w_f w_m (real part) and of w_f f w_m m (imaginary part) at each shift: one transform there, one back.
  /// \a out has as many voxels as there are shifts.
  void Products(VolumeView<const Complex> moving, VolumeView<Complex> out, Work& work) const;

  /// The sum of w_f w_m (real part) and the normalised cross-correlation where both are real, weighted so, in [-1, 1]
  /// (imaginary part): two transforms there, three back. The correlation is 0 where the weights sum to less than
  /// \a leastWeight, and where one of the two is constant. Never NaN.
  void Normalised(VolumeView<const Complex> moving, double leastWeight, VolumeView<Complex> out, Work& work) const;

  /// Of the transforms, voxels.
  const std::array<int, 3>& TransformSize() const { return size_; }

private:
  using Spectrum = std::vector<Complex>;
  void Forward(VolumeView<const Complex> voxels, const std::array<int, 3>& at, Spectrum& spectrum) const;
  void Backward(Spectrum& spectrum) const;
  template <class RowBody>
  void ForEachRow(const RowBody& body) const;

  ShiftRange shifts_;
  std::array<int, 3> size_;
  // Of the fixed volume: half of weights minus and plus values, and the squares of the values. All times 1 / voxels, which the
  // way back leaves out.
  Spectrum halfDifference_, halfSum_, squares_;
};

} // namespace echorama
