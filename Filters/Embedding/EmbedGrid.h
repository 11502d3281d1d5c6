// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// The grid of an embedded volume, and where the voxels of the data lie in it.
struct EmbedGrid {
  ImageGeometry geometry;
  /// Voxel I of the grid is voxel factor * (I - offset) + start of the data, along each axis.
  std::array<int, 3> offset{}, start{};
  int factor = 1;

  /// The voxel of the data at a voxel of the grid, along one axis; it may lie beyond them.
  int DataIndex(int voxel, std::size_t axis) const { return factor * (voxel - offset[axis]) + start[axis]; }
};

/// The lattice of \a data, grown by whole voxels (or cut) to just hold \a form and, where they reach further, the voxels
/// [\a first, \a last] of the data. So data are never resampled. With a \a factor above 1 it is every factor-th voxel.
/// \throws Error(InvalidParameter) for a factor below 1, Error(TooLarge) when an axis has more than 100,000 voxels
EmbedGrid EmbedGridOf(const ImageGeometry& data, const std::array<int, 3>& first, const std::array<int, 3>& last,
                      const PlacedProbe& form, int factor = 1);

/// The same to hold the voxels of a region (not 0) of the data. Of an empty region there are none to hold.
EmbedGrid EmbedGridOf(const ImageGeometry& data, VolumeView<const unsigned char> region, const PlacedProbe& form, int factor = 1);

/// Copies voxels of \a bytes bytes each from the data, of \a size voxels, to their places on the grid; all others become 0.
void CopyToGrid(const EmbedGrid& grid, const std::array<int, 3>& size, std::size_t bytes, const void* data, void* onGrid);

} // namespace echorama
