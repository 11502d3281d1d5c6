// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <array>
#include <vector>

namespace echorama {

/// How the grid of a reconstruction lies.
enum class GridDirections {
  Fitted, ///< along the data's own directions, in the smaller of two boxes: that of the mean image (x and y as in the images, z
          ///< along the sweep) and that of the principal directions of all corners; in the latter where images turn so far that
          ///< they have no mean. The order of the frames does not matter
  World,  ///< along the axes of the world
};

/// Where the pixels of a frame are that count: its pose, and the columns and rows (inclusive) that hold them.
struct FramePlace {
  Eigen::Affine3d imageToWorld = Eigen::Affine3d::Identity();
  std::array<int, 4> pixels{0, 0, 0, 0}; ///< first and last column, first and last row
};

/// The grid around all pixels of all frames; the centre of each is in it.
/// \param spacingMm edge of a cubic voxel; 0: the longer edge of a pixel, the mean over all frames
/// \throws Error(BadInput) when there are no frames, or a pose is singular or not finite, Error(InvalidParameter) for a spacing
/// that is negative or not finite, Error(TooLarge) for a grid that no computer holds.
ImageGeometry ReconstructionGrid(const std::vector<FramePlace>& frames, GridDirections directions, double spacingMm = 0.0);

/// The grid around the same box with another spacing.
ImageGeometry WithSpacing(const ImageGeometry& grid, double spacingMm);

/// Refuses a grid that takes too much memory, before any is allocated.
/// \param bytesPerVoxel what a voxel takes \param limitMb in 10^6 bytes; 0: FreeMemory()
/// \throws Error(InvalidParameter) for a negative limit, Error(TooLarge) with the MB needed and allowed and a spacing that would
/// fit.
void CheckMemory(const ImageGeometry& grid, double bytesPerVoxel, double limitMb);

} // namespace echorama
