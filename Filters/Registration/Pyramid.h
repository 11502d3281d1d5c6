// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <cstddef>
#include <vector>

namespace echorama {

/// One resolution of a volume. Voxels that are not real hold NaN, so that the level needs no mask beside it.
struct PyramidLevel {
  Volume<float> intensity;
  ImageGeometry geometry;
  std::ptrdiff_t realVoxels = 0; ///< how many are not NaN
};

/// How far a pyramid goes.
struct PyramidParameters {
  int levels = 16;          ///< at most so many, the volume itself included; >= 1
  int smallestSize = 16;    ///< no level whose longest axis has fewer voxels, voxels; >= 1
  int smallestCount = 1000; ///< no level with fewer real voxels (the volume itself is always kept); >= 0
};

/// The same volume at falling resolution, the finest first.
///
/// From level to level the axes with the smallest spacing are halved: those within a factor of sqrt(2) of the smallest,
/// so that voxels become cubes and stay so. A coarse voxel is the mean of its real children, and is itself real when at
/// least half of its children are; beyond an odd end a missing child counts as one that is not real. Its centre is the
/// middle of its children's centres: the origin moves by half a voxel along each halved axis. Axes of one voxel stay.
/// Cost: one pass over the volume, 4 bytes per voxel and about a seventh more for all coarser levels.
/// \throws Error(InvalidParameter), Error(BadInput) for a geometry that is not one or a view that does not match it,
/// Error(Cancelled).
template <class T>
std::vector<PyramidLevel> BuildPyramid(const PosedVolume<T>& volume, const PyramidParameters& parameters = {},
                                       const Progress& progress = {});

} // namespace echorama
