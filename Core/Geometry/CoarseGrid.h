// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"

namespace echorama {

/// The grid of every \a stride -th voxel along each axis, the first among them, as vtkUltrasoundReader's Stride reads it.
ImageGeometry CoarseGrid(ImageGeometry whole, int stride);

/// Whether two grids place the same voxels, or one those of the other at some stride: a pose for one is a pose for the other.
bool AreGridsOfOneVolume(const ImageGeometry& a, const ImageGeometry& b);

} // namespace echorama
