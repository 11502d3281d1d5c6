// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BlockRows.h"
#include "Core/Base/Progress.h"
#include <memory>

namespace echorama {

/// The local mean and standard deviation of a volume in Gaussian windows, normalised: only voxels of the region count, however
/// few of a window they are. (A blur that takes what is outside as black darkens every border.)
///
/// They are kept on a lattice of blocks of two thirds of a standard deviation, and read with linear interpolation. A constant has
/// that mean, and deviation 0. Cost: one pass over the volume; memory is some bytes per block.
/// Source: dissertation 6.3 and 6.4 (the blur); normalised convolution (Knutsson and Westin 1993).
class LocalStatistics {
public:
  /// \param region where voxels count (not 0); empty: everywhere. Voxels that are not finite never count.
  /// \param sigmaMm standard deviation of the window, mm, >= 0; below a voxel it is the voxel's block alone
  /// \param trendMm 0: deviations are those from the mean of the window; else from local means of the same volume in a smaller
  /// window, of this standard deviation, so that slopes and edges of the scene are no part of them
  /// \param meansAlone deviations are never asked for: two thirds of the work
  /// \param spent statistics that nobody reads any more: their memory is used again where it is enough. The system takes as long
  /// to bring in as much memory as a lattice as fine as the voxels takes to be worked out \param mean of all voxels that count,
  /// where it is known already (nullptr: it is not) \throws Error(BadInput) for views of different shape,
  /// Error(InvalidParameter), Error(Cancelled)
  template <class T>
  LocalStatistics(VolumeView<const T> intensity, VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing,
                  double sigmaMm, const Progress& progress = {}, double trendMm = 0.0, bool meansAlone = false,
                  LocalStatistics* spent = nullptr, const double* mean = nullptr);

  /// Of voxels [first, end) of row (j, k). Where no window reaches (3 standard deviations) they are those of the whole volume; of
  /// an empty region both are 0. \param deviation nullptr: means alone
  void Row(int j, int k, int first, int end, float* mean, float* deviation) const;

private:
  struct Lattice;
  std::shared_ptr<Lattice> lattice_;
};

/// The local mean of data, and the local deviation of their grain: of what a window of half the standard deviation does not
/// follow. So a slope of brightness, or the edge of an organ, is not taken for coarse speckle.
template <class T>
LocalStatistics GrainStatistics(VolumeView<const T> intensity, VolumeView<const unsigned char> region,
                                const Eigen::Vector3d& spacing, double sigmaMm, const Progress& progress = {})
{
  return LocalStatistics(intensity, region, spacing, sigmaMm, progress, 0.5 * sigmaMm);
}

} // namespace echorama
