// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/DisplacementField.h"
#include "Core/Imaging/Sampling.h"
#include "RegionMap.h"
#include <type_traits>

namespace echorama {

/// Where in a grid the voxels of a volume can be, when they may also lie \a marginMm beside where its geometry says.
GridBox BoxOf(const ImageGeometry& volume, const ImageGeometry& grid, double marginMm = 0.0);

/// Reads a posed volume at the voxels of a grid, one row of the grid at a time. It gives what Sampler gives (Core), and is
/// several times faster, because neighbours in a row share their work. Through a displacement it reads at x + u(x), a voxel at a
/// time.
template <class T>
class RowSampler {
public:
  /// \param displacement none: the volume lies as its geometry says; must outlive the sampler
  RowSampler(const PosedVolume<T>& volume, const ImageGeometry& grid, const DisplacementField* displacement = nullptr);

  /// BoxOf the volume, with the longest displacement as margin.
  const GridBox& Box() const { return box_; }

  /// Writes 1 where a voxel of the grid lies in the volume (Sampler::NearestIndex) and 0 elsewhere, for the row (j, k) of
  /// Box(). The grid is indexed as a whole.
  void Inside(int j, int k, unsigned char* inside) const;

  /// Writes the trilinear value (Sampler::Linear) where bit 0 of \a inside is set, for the same row, and anything
  /// elsewhere. A is float or, for volumes of doubles, double.
  template <class A>
  void Values(int j, int k, const unsigned char* inside, A* values) const;

  /// Inside and Values in one go, which costs hardly more than the latter.
  template <class A>
  void Read(int j, int k, unsigned char* inside, A* values) const;

private:
  struct Line;
  Line LineAt(int j, int k) const;
  void Narrow(double margin, Line& line) const;
  template <bool Finds, class A>
  void Row(int j, int k, std::conditional_t<Finds, unsigned char, const unsigned char>* inside, A* values) const;
  template <class A>
  void Chunk(const Line& line, int first, int count, A* values, unsigned char* real) const;
  std::vector<Eigen::Vector3d> DisplacedRow(int j, int k) const;

  VolumeView<const T> intensity_;
  VolumeView<const unsigned char> valid_; ///< empty when it masks nothing
  Sampler<T> sampler_;
  const DisplacementField* displacement_; ///< nullptr: none, or zero everywhere
  Eigen::Affine3d gridToWorld_, worldToIndex_, gridToIndex_;
  bool shifted_; ///< the grid steps along x exactly as the volume does
  GridBox box_;
};

} // namespace echorama
