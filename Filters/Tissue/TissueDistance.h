// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "TissueSurface.h"
#include <vector>

namespace echorama {

/// How far each point of a grid lies from all bodies together, mm, x fastest: negative inside, and no further than \a band
/// either way. Outside of them distances are exact. Inside, surfaces between two bodies do not count, however near the outermost
/// they run.
/// \param nearest becomes the triangle that each point is nearest to, -1 beyond the band
/// \throws Error(InvalidParameter) for a band that is not positive, and as BodiesOn
std::vector<float> DistancesOn(const TissueSurface& surface, const ImageGeometry& grid, double band,
                               const Progress& progress = {}, std::vector<std::int32_t>* nearest = nullptr);

} // namespace echorama
