// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a NIfTI file.
#include "Readers/Fuzzing/ReadLast.h"
#include "Readers/NiftiFile.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] { ReadLast(*OpenNifti(file.Path())); });
}
