// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a GE Kretz file.
#include "Readers/KretzFile.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const auto source = OpenKretz(file.Path());
    const VolumeContent& content = source->Content();
    const std::size_t last = content.Volumes() - 1;
    if (content.beams) {
      const auto& n = content.beams->dimensions;
      std::vector<unsigned char> samples(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
      source->ReadBeams(last, samples.data());
    }
    if (content.geometry.VoxelCount() > (1u << 20)) // more would only cost time
      return;
    std::vector<unsigned char> voxels(content.geometry.VoxelCount()), valid(voxels.size());
    source->Read(last, voxels.data(), valid.data());
  });
}
