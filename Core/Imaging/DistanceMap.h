// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// The exact squared Euclidean distance (mm^2) from every voxel to the nearest voxel whose \a mask is not 0, between voxel
/// centres; 0 on the mask, +infinity everywhere when the mask is empty. 2D images (one slice) work too.
///
/// With spacing 1 every value below 2^24 is the exact integer. With equal spacings it is that integer times the squared
/// spacing, rounded once. With different spacings it is within 2.5 ulp.
/// Linear time for any mask, in parallel; the memory beyond the result is small. (Meijster, Roerdink and Hesselink 2000;
/// Felzenszwalb and Huttenlocher 2012.)
/// \param spacing mm, > 0; squared spacing and squared diagonal of the volume must fit a float
/// \throws Error(InvalidParameter) for any other spacing or views of different shape, Error(Cancelled).
void SquaredDistanceMap(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, VolumeView<float> squaredDistance,
                        const Progress& progress = {});

/// The exact squared distance (mm^2) from every voxel of \a region (not 0) to the nearest voxel outside it, and 0 outside it.
/// What lies beyond the grid is outside (along axes of one voxel there is no beyond), so the depth of a region that fills its
/// grid is the distance to the rim, and no depth is infinite unless the grid is a single voxel.
/// Cost, precision and errors are those of SquaredDistanceMap; one byte per voxel of memory beyond the result.
void SquaredDepthMap(VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing, VolumeView<float> squaredDepth,
                     const Progress& progress = {});

} // namespace echorama
