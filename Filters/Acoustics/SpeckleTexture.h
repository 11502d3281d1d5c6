// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <complex>
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// Noise that fills the world without an end and stays where it is: the precomputed volume of noise of dissertation 7.7.
///
/// Complex Gaussian numbers of mean power 1, so that their size is speckle; what is a distance d apart correlates by about
/// exp(-d^2 / (4 grain^2)). One block is made and repeats itself in all three directions, without a seam; it lies askew to the
/// axes of the world, so that hardly a plane shows the same twice.
class SpeckleTexture {
public:
  /// \param grainMm standard deviation of the grains (amplitudes), mm, in [0.001, 100]
  /// \throws Error(InvalidParameter)
  SpeckleTexture(std::uint64_t seed, double grainMm);

  double GrainMm() const { return grain_; }
  /// After how many mm it repeats itself, along the axes of the block (columns of Axes()).
  double PeriodMm() const;
  static Eigen::Matrix3d Axes();

  /// The numbers at points origin + along[i] * direction (mm, world; at most 1e7 mm away). Thread safe.
  void Along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const std::vector<double>& along,
             std::complex<float>* numbers) const;
  /// The same at points as they come.
  void At(const std::vector<Eigen::Vector3d>& points, std::complex<float>* numbers) const;

  std::size_t MemoryBytes() const { return numbers_.capacity() * sizeof(numbers_[0]); }

private:
  std::complex<float> NumberAt(const Eigen::Vector3d& voxel) const;

  double grain_;
  std::vector<std::complex<float>> numbers_;
};

} // namespace echorama
