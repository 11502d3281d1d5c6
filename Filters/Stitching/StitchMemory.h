// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Stitch.h"

namespace echorama {

/// What a stitching needs, known before anything is allocated.
struct StitchCost {
  std::size_t volumes = 0;
  ImageGeometry grid; ///< of the output
  int planFactor = 1; ///< of the grid on which what is global is found; 1: the output's own
  /// At most, of regions, scales and membranes, while they are found; what is kept is less. Smooth parts and the coarse grid of
  /// gains and seams are not in it: 8 bytes per block of the volumes' boxes, and some tens of bytes per voxel of that grid.
  double planBytes = 0.0;
  double voxelBytes = 0.0;   ///< of the output, per voxel
  double outputBytes = 0.0;  ///< of the whole output
  double allowedBytes = 0.0; ///< by the parameters
  int slabs = 1;             ///< of the output along z, so many that one of them fits beside the plan; 0: none does

  double WholeBytes() const { return planBytes + outputBytes; }
};

/// What stitching volumes of these geometries (ReachOf) on \a grid costs. The plan is made on the output's grid if it fits into
/// the allowed memory together with the whole output, or else takes at most three quarters of it; otherwise on the finest
/// grid for which it takes at most half. How the output is asked for, whole or in pieces, makes no difference.
StitchCost CostOfStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                        const StitchOutputs& outputs);

/// Checks all that can be known before anything is allocated.
/// \param box what is to be made of the grid
/// \throws Error(InvalidParameter) for a parameter out of range, Error(BadInput) for a bad geometry, Error(TooLarge), with the
/// numbers, a spacing and a number of slabs that would fit, when that needs more memory than is allowed.
void CheckStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                 const StitchOutputs& outputs, const GridBox& box);

} // namespace echorama
