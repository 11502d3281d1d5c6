// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <memory>

namespace echorama {

/// Every \a stride -th voxel of a volume along each axis, the first among them, in the memory of these alone where the file can
/// be read slice by slice. The voxels between are skipped, not averaged. Beams stay as they are.
std::unique_ptr<VolumeSource> CoarseVolume(std::unique_ptr<VolumeSource> whole, int stride);

} // namespace echorama
