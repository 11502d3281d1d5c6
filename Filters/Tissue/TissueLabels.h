// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "TissueSurface.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// Which body holds each point of a grid: of several the last, -1 where there is none; x fastest. A body's surface may be inside
/// out; where it is open, or touches a point within rounding, either answer is given.
/// \throws Error(BadInput) as TissueSurface::Check() and ImageGeometry::Check(), Error(Cancelled)
std::vector<std::int32_t> BodiesOn(const TissueSurface& surface, const ImageGeometry& grid, const Progress& progress = {});

} // namespace echorama
