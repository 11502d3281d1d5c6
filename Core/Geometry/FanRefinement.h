// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/FanModel.h"
#include "Core/Imaging/RegionOutline.h"
#include <vector>

namespace echorama {

using OutlinePoints = std::vector<RegionOutline::Point>;

/// Which of the unknowns a fit may change.
enum class FanFreedom { Plane, Centred, Offset };

/// How much a point at the end of the grid weighs that lies inside the model: such a model goes on beyond the grid, which costs
/// next to nothing.
constexpr double leastFanWeight = 0.01;

/// Fits a fan to points of an outline by Levenberg-Marquardt with Tukey's weights, whose reach shrinks from \a from to \a to, mm:
/// what no model explains is outvoted. \param steps at most, at the last reach
void RefineFan(FanModel& model, const OutlinePoints& points, FanFreedom freedom, double from, double to, int steps);

} // namespace echorama
