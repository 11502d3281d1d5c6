// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// The exact squared Euclidean distance (mm^2) from every voxel to the nearest voxel whose \a mask is not 0, between voxel
/// centres; 0 on the mask, +infinity everywhere when the mask is empty. 2D images (one slice) work too.
/// With spacing 1 every value is the exact integer (below 2^24). Linear time: one lower envelope of parabolas per line and
/// axis (Meijster, Roerdink and Hesselink 2000; Felzenszwalb and Huttenlocher 2012).
/// \param spacing mm, > 0
/// \throws Error(InvalidParameter) for a spacing that is not positive or views of different shape, Error(Cancelled).
void SquaredDistanceMap(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, VolumeView<float> squaredDistance,
                        const Progress& progress = {});

} // namespace echorama
