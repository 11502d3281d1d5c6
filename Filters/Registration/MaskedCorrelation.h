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

/// Correlates one fixed volume with many moving ones over all translations at once, through Fourier space, each voxel
/// counting by its weight (Padfield, IEEE TIP 21(5), 2012, with weights in place of masks).
///
/// The fixed volume is transformed once. Both volumes are real pairs, so that a pair makes one complex transform. Wrap-around
/// is kept out of the range of shifts alone; the transforms are no larger than that needs. Thread-safe after construction:
/// each thread brings its own Work.
class MaskedCorrelator {
public:
  /// \param fixed (weight, weight * value)
  /// \param movingDimensions of every moving volume
  MaskedCorrelator(VolumeView<const std::complex<float>> fixed, const std::array<int, 3>& movingDimensions,
                   const ShiftRange& shifts);

  /// Room for one correlation.
  struct Work {
    std::vector<std::complex<float>> moving, squares, sums[3];
  };

  /// At each shift the sum of weights w_f w_m (real part) and of products w_f f w_m m (imaginary part).
  /// \a moving: (weight, weight * value), of the dimensions promised. \a out: of the shifts' counts.
  void Products(VolumeView<const std::complex<float>> moving, VolumeView<std::complex<float>> out, Work& work) const;

  /// At each shift the sum of weights (real part) and the weighted normalised cross-correlation in [-1, 1] (imaginary part);
  /// 0 where the weights sum to less than \a leastWeight or a volume is constant there.
  void Normalised(VolumeView<const std::complex<float>> moving, double leastWeight, VolumeView<std::complex<float>> out,
                  Work& work) const;

  const std::array<int, 3>& TransformSize() const { return size_; }

private:
  using Spectrum = std::vector<std::complex<float>>;
  void Forward(VolumeView<const std::complex<float>> voxels, const std::array<int, 3>& at, Spectrum& spectrum) const;
  void Backward(Spectrum& spectrum) const;
  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(size_[0]) * size_[1] * size_[2]; }

  ShiftRange shifts_;
  std::array<int, 3> movingDimensions_, size_;
  Spectrum weights_, values_, squares_; // of the fixed volume; Hermitian each
};

} // namespace echorama
