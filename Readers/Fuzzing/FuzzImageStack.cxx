// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as one image: PNG, JPEG, or TIFF of any number of pages.
#include "Readers/ImageStackFile.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const auto source = OpenImageStack(file.Path());
    const VolumeContent& content = source->Content();
    if (content.geometry.VoxelCount() > (1u << 20)) // more would only cost time
      return;
    std::vector<double> voxels(content.geometry.VoxelCount()); // wide and aligned enough for every type
    std::vector<unsigned char> valid(voxels.size());
    source->Read(content.Volumes() - 1, voxels.data(), valid.data());
  });
}
