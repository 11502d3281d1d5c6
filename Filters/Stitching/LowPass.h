// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "CoverageMap.h"
#include "StitchSampler.h"

namespace echorama {

/// The lattice of blocks on which the smooth parts of volumes live: block (I, J, K) is the voxels from \a size times (I, J, K)
/// on. All volumes share it, so that equal volumes have equal smooth parts.
struct BlockLattice {
  ImageGeometry geometry;    ///< its voxels are the blocks
  std::array<int, 3> size{}; ///< voxels of the grid along each axis
};

/// Blocks of about \a scale voxels (of the smallest spacing) of a grid in each direction.
BlockLattice BlocksOf(const ImageGeometry& grid, double scale);

/// The smooth part of a volume where it meets others, and how strong the rest is; boxes are those of the blocks the volume
/// reaches.
struct SmoothPart {
  Boxed<float> low;       ///< NaN where a block and its neighbours hold no overlap voxel of the volume
  Boxed<float> deviation; ///< of the volume around it, over some blocks; NaN likewise
};

/// Means over the blocks and a binomial filter over them, of the overlap alone, so that where two volumes agree so do their
/// smooth parts, up to the border. Read with linear interpolation it is what is left after a Gaussian with a standard deviation
/// of about the size of a block. A constant stays that constant, and has no deviation. Cost: the volume is sampled once in the
/// overlap. \param coverage how many volumes cover every step-th voxel of the grid (Coarsened)
/// \param mask where the volume is (bit 0), in its box, if that is known already
SmoothPart LowPass(const StitchSampler& volume, const BlockLattice& blocks, const CoverageMap& coverage, int step,
                   const Progress& progress = {}, const Boxed<unsigned char>* mask = nullptr);

} // namespace echorama
