// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BeamNoise.h"
#include "Core/Geometry/ProbeGeometry.h"

namespace echorama {

/// The parameters with this seed, for a fan on a grid: with as many samples as the lengths need, but no more than 16 million or
/// there are voxels, and no longer along the depth than a fan allows.
BeamNoiseParameters ForGrid(BeamNoiseParameters parameters, const PlacedProbe& fan, const ImageGeometry& grid,
                            std::uint64_t seed);

/// Noise along the beams of a fan (MakeBeamNoise), scan converted to any grid, a part of the fan for instance. Where the beams
/// that the grid lies between have more samples together than \a most, or are few of all, the grid is filled in parts, each from
/// its own: the noise is the same then, to what ScanConvert rounds. \param noise, inside views of the size of \a grid,
/// overwritten: 0 in both outside of the fan \throws as MakeBeamNoise and ScanConvert, but for the number of samples
void FillFanWithNoise(const BeamNoiseParameters& parameters, const PlacedProbe& fan, const ImageGeometry& grid,
                      VolumeView<float> noise, VolumeView<unsigned char> inside, const Progress& progress = {},
                      double most = 16e6);

} // namespace echorama
