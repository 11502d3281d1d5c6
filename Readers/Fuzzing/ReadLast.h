// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <vector>

namespace echorama {

/// Reads the last volume of \a source, unless it is so large that it would only cost time.
inline void ReadLast(VolumeSource& source)
{
  const VolumeContent& content = source.Content();
  if (content.geometry.VoxelCount() > (1u << 20))
    return;
  std::vector<double> voxels(content.geometry.VoxelCount()); // wide and aligned enough for every type
  std::vector<unsigned char> valid(voxels.size());
  source.Read(content.Volumes() - 1, voxels.data(), valid.data());
}

} // namespace echorama
