// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BlockRows.h"
#include "Core/Base/Progress.h"
#include <deque>
#include <memory>

namespace echorama {

/// Sums of 1, v and v^2 over the blocks of a grid, for volumes that are never in the memory as a whole: slices of blocks come and
/// go. Sums of a slice that is not there are 0.
class BlockSums {
public:
  BlockSums() = default;
  BlockSums(const Blocks& grid, int first) : grid_(grid), first_(first) {}

  const Blocks& Grid() const { return grid_; }
  ///@{ Slices of blocks that are there: [First(), End()).
  int First() const { return first_; }
  int End() const { return first_ + static_cast<int>(slices_.size()); }
  void Grow(int end); ///< by slices of zeros
  void Append(BlockSums&& next);
  void Forget(int before);
  ///@}

  /// Adds \a count voxels of row (j, k) of the grid, from voxel \a first on; their slice of blocks must be there. At the same
  /// time only rows of other blocks may be added. \param region as in LocalStatistics; nullptr: everywhere
  template <class T>
  void AddRow(int first, int j, int k, const T* voxels, const unsigned char* region, int count);
  /// Of a row of blocks that is there. \param channel 0: of 1, 1: of v, 2: of v^2
  double* Row(std::size_t channel, int J, int K);
  const double* Row(std::size_t channel, int J, int K) const;

private:
  Blocks grid_;
  int first_ = 0;
  std::deque<std::vector<double>> slices_;
};

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

  /// From slices of blocks [\a first, \a end) of sums that are there already, to be read within these alone, and at voxels of the
  /// whole grid. Nearer than Reach() to the ends they are right where the grid ends there too.
  LocalStatistics(const BlockSums& sums, int first, int end, const Eigen::Vector3d& spacing, double sigmaMm);
  /// How many slices of blocks a window reaches.
  static int Reach(const Blocks& blocks, const Eigen::Vector3d& spacing, double sigmaMm);
  /// Means that are known, at the middles of blocks; deviations are 0.
  LocalStatistics(const Blocks& blocks, VolumeView<const double> means);
  /// The same for a part of the grid that begins at this voxel.
  LocalStatistics From(const std::array<int, 3>& voxel) const;

  /// Of voxels [first, end) of row (j, k). Where no window reaches (3 standard deviations) they are those of the whole volume; of
  /// an empty region both are 0. \param deviation nullptr: means alone
  void Row(int j, int k, int first, int end, float* mean, float* deviation) const;
  /// Of a row of blocks: what Row says at their middles.
  void RowOfBlocks(int J, int K, float* mean, float* deviation) const;

private:
  struct Lattice;
  std::array<int, 3> origin_{0, 0, 0}; // where voxels are counted from, in those of the lattice
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
