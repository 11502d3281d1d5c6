// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// SquaredDistanceMap() where it is at most the square of \a radiusMm, to the last bit; elsewhere a larger number, or infinity.
/// It takes a third of the time where the radius is a few voxels, and grows with the radius. \throws Error(InvalidParameter) for
/// views of different shape, or a spacing that is not positive, Error(Cancelled)
void NearSquaredDistances(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, double radiusMm,
                          VolumeView<float> squaredDistance, const Progress& progress = {});

} // namespace echorama
