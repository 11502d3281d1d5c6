// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <vector>

namespace echorama {

/// The voxels of a region with a neighbour outside of it (one of 26; of 8 in a single slice), in the order of memory. What lies
/// beyond the grid is outside (along an axis of one voxel there is no beyond), so a region that fills its grid has its rim as
/// surface. Islands and the walls of holes are surface too.
/// Source: dissertation eq. 6.1, by the valid region in place of "intensity is not zero".
std::vector<std::array<int, 3>> SurfaceOf(VolumeView<const unsigned char> region, const Progress& progress = {});

} // namespace echorama
