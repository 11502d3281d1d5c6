// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// \a count points of the valid region of a volume, drawn at random and uniform over its voxels' cells, in continuous
/// index coordinates. The nearest voxel of each is real. Along an axis of one voxel they lie in the plane.
/// The same seed and valid region give the same points, whatever the pose: scores and errors stay comparable.
/// Points come in the order of their voxels (x fastest), so that reading volumes at them walks through memory.
/// \returns nothing when no voxel is real.
template <class T>
std::vector<Eigen::Vector3d> ValidPoints(VolumeView<const T> intensity, VolumeView<const unsigned char> valid, int count,
                                         std::uint64_t seed);

/// The centroid of the real voxels, in continuous index coordinates; \a count receives how many they are.
/// \returns zero when no voxel is real.
template <class T>
Eigen::Vector3d ValidCentroid(VolumeView<const T> intensity, VolumeView<const unsigned char> valid, std::ptrdiff_t& count);

} // namespace echorama
