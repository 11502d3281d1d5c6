// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <cstdlib>
#include <cstring>
#include <vector>

namespace echorama {

/// Reads the last volume of \a source, unless it is so large that it would only cost time; and again by slices, which must be the
/// same.
inline void ReadLast(VolumeSource& source)
{
  const VolumeContent& content = source.Content();
  const std::size_t count = content.geometry.VoxelCount();
  if (count > (1u << 20))
    return;
  std::vector<double> voxels(count), parts(count); // wide and aligned enough for every type
  std::vector<unsigned char> valid(count);
  const std::size_t last = content.Volumes() - 1;
  source.Read(last, voxels.data(), valid.data());
  if (!source.ReadsSlices())
    return;
  const int slices = content.geometry.dimensions[2], middle = slices / 2;
  const std::size_t bytes = count * SizeOf(content.type);
  source.ReadSlices(last, middle, slices - middle, reinterpret_cast<char*>(parts.data()) + bytes / slices * middle);
  if (middle > 0) // goes back
    source.ReadSlices(last, 0, middle, parts.data());
  if (std::memcmp(voxels.data(), parts.data(), bytes) != 0)
    std::abort();
}

} // namespace echorama
