// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a DICOM file. Compressed pixels are read, but not decoded: gdcm's codecs are not ours, and run in a process of
// their own.
#include "Readers/DicomFile.h"
#include "Readers/DicomHeader.h"
#include "Readers/DicomPixels.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const DicomHeader header = ReadDicomHeader(file.Path());
    if (header.storage == DicomStorage::Encapsulated) {
      ReadDicomFragments(header);
      return;
    }
    const auto source = OpenDicom(file.Path());
    const VolumeContent& content = source->Content();
    if (content.geometry.VoxelCount() > (1u << 20)) // more would only cost time
      return;
    std::vector<char> voxels(content.geometry.VoxelCount() * SizeOf(content.type));
    std::vector<unsigned char> valid(content.holdsValidRegion ? content.geometry.VoxelCount() : 0);
    source->Read(content.Volumes() - 1, voxels.data(), valid.empty() ? nullptr : valid.data());
  });
}
