// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Pictures/SlicePicture.h"
#include <vector>

namespace echorama {

/// Grey levels of a volume at \a count places from one point of the world to another, both ends included, trilinear through the
/// valid region; NaN where the volume has no data.
/// \throws Error(InvalidParameter) for fewer than two places or ends that are not finite; Error(BadInput) for a geometry that is
/// none.
std::vector<double> LineProfile(const AnyPosedVolume& volume, const Eigen::Vector3d& from, const Eigen::Vector3d& to, int count);

} // namespace echorama
