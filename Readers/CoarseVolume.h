// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <memory>

namespace echorama {

/// Every \a stride -th voxel of a volume along each axis, the first among them, in the memory of these alone where the file can
/// be read slice by slice. The voxels between are skipped, not averaged. Beams stay as they are. 0: the smallest stride that
/// leaves at most 128 million voxels, and 1 where the file cannot be read slice by slice. \throws Error(NotPossible) where it
/// cannot.
std::unique_ptr<VolumeSource> CoarseVolume(std::unique_ptr<VolumeSource> whole, int stride);

} // namespace echorama
