// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <cstdint>

namespace echorama {

/// Noise that is made on the voxels of a grid: to compare with. It looks the same in all places and directions, which
/// ultrasound never does (dissertation 6.2); MakeBeamNoise is the one to use.
struct LatticeNoiseParameters {
  double mean = 40.0;
  double deviation = 20.0;
  double cellMm = 4.0; ///< (Perlin) at least the greatest spacing of the grid
  int octaves = 3;     ///< (Perlin)
  std::uint64_t seed = 1;
};

/// All but mean and seed, which are those of BeamNoiseParameters.
ParameterList Describe(LatticeNoiseParameters& p);

/// Independent normal deviates. \throws Error(InvalidParameter), Error(BadInput) for dimensions that are not positive,
/// Error(Cancelled).
Volume<float> MakeWhiteNoise(const LatticeNoiseParameters& parameters, const std::array<int, 3>& dimensions,
                             const Progress& progress = {});

/// Gradient noise: random directions at the corners of cubic cells, their ramps blended by a curve of fifth degree. The first
/// voxel is a corner of cells. Octaves whose cells are smaller than a voxel are left out. The deviation is exact in the mean over
/// seeds and places. \throws as MakeWhiteNoise, and what ImageGeometry::Check throws
/// Source: Perlin, SIGGRAPH 1985, with the blending curve of Perlin, SIGGRAPH 2002.
Volume<float> MakePerlinNoise(const LatticeNoiseParameters& parameters, const ImageGeometry& grid, const Progress& progress = {});

} // namespace echorama
