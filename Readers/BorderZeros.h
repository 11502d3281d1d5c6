// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <cstdint>

namespace echorama {

/// The valid region of a volume of which nothing better is known: 1 everywhere but in the zeros that are connected to the
/// border of the grid (through faces of voxels) and in voxels that are not numbers, which are 0. Zeros inside stay valid:
/// fluid without echoes is real data.
/// Linear time. Instantiated for every type of number. Both views have the same shape.
/// \returns the number of voxels that are not valid
template <class T>
std::int64_t ValidFromBorderZeros(VolumeView<const T> voxels, VolumeView<unsigned char> valid);

/// Whether ValidFromBorderZeros would find every voxel valid, asked slab by slab: \a slab holds slices \a first ... of a volume
/// of \a slices, and it would when this says so of every slab.
template <class T>
bool LooksValidEverywhere(VolumeView<const T> slab, int first, int slices);

} // namespace echorama
