// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as one image: PNG, JPEG, or TIFF of any number of pages.
#include "Readers/Fuzzing/ReadLast.h"
#include "Readers/ImageStackFile.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] { ReadLast(*OpenImageStack(file.Path())); });
}
