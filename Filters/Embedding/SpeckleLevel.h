// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <limits>

namespace echorama {

/// The mean and the deviation of a window without single bright echoes (walls, wires); NaN where there is nothing to tell it by.
struct SpeckleLevel {
  double mean = std::numeric_limits<double>::quiet_NaN(), deviation = mean;
};

/// Left out is what is brighter than three times the median, of whole numbers by a grey level more: of speckle 0.2% of the voxels
/// are, and half a per cent of its mean. A bright echo that fills half of the window or more is no single one, and stays.
/// \param region where voxels count (not 0) \param middle, reach voxels: the window is a box; some hundred voxels on a lattice
/// stand for all of it
template <class T>
SpeckleLevel SpeckleLevelAt(VolumeView<const T> intensity, VolumeView<const unsigned char> region,
                            const std::array<int, 3>& middle, const std::array<int, 3>& reach);

} // namespace echorama
