// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "PlacedVolume.h"
#include <cstdint>

namespace echorama {

/// The share of \a moving 's points that lie in a volume of \a fixed, at their coarsest resolution: of \a points drawn by \a seed
/// in its valid region, those that its own interpolation holds. A point lies in a volume when the voxel nearest to it is real.
double OverlapOf(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving, int points, std::uint64_t seed = 1);

} // namespace echorama
