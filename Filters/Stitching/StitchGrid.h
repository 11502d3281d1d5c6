// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <vector>

namespace echorama {

/// The grid onto which posed volumes are stitched: it covers every voxel centre of all of them.
///
/// * Volumes that share one direction matrix: aligned with it, and in phase with the first volume, so that volumes on one
///   common lattice are copied, not interpolated.
/// * Images (one slice each) in one common plane, turned in it or not: a 2D grid in that plane, along the axes of the world
///   where the plane is square to z, else along the first image's.
/// * All others: along the axes of the world.
///
/// \param spacingMm cubic voxels of this size; 0 (the default): the smallest spacing that comes in, axis by axis where the
/// directions are shared. A 2D grid keeps the slice thickness of the first image.
/// \throws Error(BadInput) for fewer than two volumes or a geometry that is not one, Error(InvalidParameter) for a spacing
/// that is negative or not finite, Error(TooLarge) for a grid that no computer holds.
ImageGeometry StitchGrid(const std::vector<ImageGeometry>& volumes, double spacingMm = 0.0);

} // namespace echorama
