// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as an OpenVDB file. What OpenVDB itself does not survive is found here too.
#include "Readers/Fuzzing/ReadLast.h"
#include "Readers/VdbFile.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

// OpenVDB leaks the node that it is reading when the values in it turn out to be damaged.
extern "C" const char* __asan_default_options()
{
  return "detect_leaks=0";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] { ReadLast(*OpenVdb(file.Path())); });
}
