// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "TissueSurface.h"
#include <Eigen/Geometry>

namespace echorama {

/// Divides triangles until no edge in a region is longer than \a longestMm: a surface that is to be bent has points as dense as
/// what bends it. Its shape stays what it is, and a closed surface stays closed: whether and where an edge is divided follows
/// from its two ends alone. \param region edges whose box does not touch it are left as they are; an empty one stands for
/// everywhere \throws Error(InvalidParameter) for a length that is not above 0, Error(TooLarge) beyond 2^31 points or triangles
void RefineSurface(TissueSurface& surface, double longestMm, const Eigen::AlignedBox3d& region = {});

} // namespace echorama
