// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama
{

/// The exact squared Euclidean distance (mm^2) from every voxel to the nearest voxel whose \a mask is not 0, between voxel
/// centres; 0 on the mask, +infinity everywhere when the mask is empty. 2D images (one slice) work too.
///
/// With spacing 1 every value below 2^24 is the exact integer. With equal spacings it is that integer times the squared
/// spacing, rounded once. With different spacings it is within 2 ulp.
/// Linear time for any mask, in parallel; the memory beyond the result is small. (Meijster, Roerdink and Hesselink 2000;
/// Felzenszwalb and Huttenlocher 2012.)
/// \param spacing mm, > 0; squared spacing and squared diagonal of the volume must fit a float
/// \throws Error(InvalidParameter) for any other spacing or views of different shape, Error(Cancelled).
void SquaredDistanceMap(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, VolumeView<float> squaredDistance,
                        const Progress& progress = {});

} // namespace echorama
