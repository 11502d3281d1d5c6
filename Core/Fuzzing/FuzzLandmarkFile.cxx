// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a list of landmarks: markups, fiducials or CSV.
#include "Core/Geometry/LandmarkFile.h"
#include "Testing/Fuzzing.h"
#include <cstdlib>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    for (const Landmark& landmark : ReadLandmarks(file.Path()))
      if (!landmark.position.allFinite() || landmark.position.cwiseAbs().maxCoeff() > 1e7)
        std::abort();
  });
}
