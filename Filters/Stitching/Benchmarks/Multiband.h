// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Stitching/GridBox.h"
#include <vector>

namespace echorama {

/// A volume resampled onto the output grid, for methods that need whole neighbourhoods.
struct ResampledVolume {
  Boxed<float> values;
  Boxed<unsigned char> inside; ///< bit 0: the volume is there; values that are not finite are not there
  Boxed<float> share;          ///< how far it is shown there, [0, 1], only where inside; they sum to 1 where any volume is
};

/// Blends each octave over a transition as wide as its features (Burt and Adelson 1983), in 2D and 3D: Laplacian pyramids of the
/// volumes are mixed by Gaussian pyramids of their shares. It needs all volumes resampled at once.
/// Pyramids are normalised, so voxels outside of a volume are never mixed in, and no border bleeds (as zeros there would).
/// Constants stay constant; a volume is itself where no other is shown within 2^(levels + 2) voxels. All boxes of a volume are
/// the same. Cost: one pyramid at a time, and two of the output's size. \param levels octaves that are parted from the rest, [0,
/// 16]; 0 mixes by shares alone \return 0 where no volume is \throws Error(InvalidParameter) for levels or boxes out of range;
/// Error(Cancelled)
Volume<float> BlendMultiband(const std::vector<ResampledVolume>& volumes, const std::array<int, 3>& dimensions, int levels = 5,
                             const Progress& progress = {});

} // namespace echorama
