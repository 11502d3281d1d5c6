// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a transform of ITK or elastix; what is accepted is a pose.
#include "Filters/Calibration/ItkTransform.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const Pose pose = ReadItkTransform(file.Path());
    if (!pose.matrix().allFinite() || !IsRotation(pose.linear(), 1e-9))
      std::abort();
  });
}
