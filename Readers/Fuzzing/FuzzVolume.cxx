// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as MetaImage or as NRRD. The other formats have fuzzers of their own.
#include "Readers/Fuzzing/ReadLast.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const FileFormat format = FormatOfContent(file.Path());
    if (format == FileFormat::MetaImage || format == FileFormat::Nrrd)
      ReadLast(*OpenVolume(file.Path()));
  });
}
