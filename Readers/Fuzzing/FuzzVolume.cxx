// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as MetaImage or as NRRD. The other formats have fuzzers of their own.
#include "Readers/VolumeSource.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const FileFormat format = FormatOfContent(file.Path());
    if (format != FileFormat::MetaImage && format != FileFormat::Nrrd)
      return;
    const auto source = OpenVolume(file.Path());
    const VolumeContent& content = source->Content();
    if (content.geometry.VoxelCount() > (1u << 24)) // more would only cost time
      return;
    std::vector<char> voxels(content.geometry.VoxelCount() * SizeOf(content.type));
    std::vector<unsigned char> valid(content.holdsValidRegion ? content.geometry.VoxelCount() : 0);
    source->Read(0, voxels.data(), valid.empty() ? nullptr : valid.data());
  });
}
