// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as an OpenVDB file. What OpenVDB itself does not survive is found here too.
#include "Readers/VdbFile.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

// OpenVDB leaks the node that it is reading when the values in it turn out to be damaged.
extern "C" const char* __asan_default_options()
{
  return "detect_leaks=0";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const auto source = OpenVdb(file.Path());
    const VolumeContent& content = source->Content();
    if (content.geometry.VoxelCount() > (1u << 20)) // more would only cost time
      return;
    std::vector<double> voxels(content.geometry.VoxelCount()); // wide and aligned enough for every type
    std::vector<unsigned char> valid(voxels.size());
    source->Read(content.Volumes() - 1, voxels.data(), valid.data());
  });
}
