// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a recording of a tracker.
#include "Readers/PoseLog.h"
#include "Testing/Fuzzing.h"
#include <cstdlib>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    for (const ToolPose& pose : ReadPoseLog(file.Path()).poses)
      if (!pose.pose.matrix().allFinite() || !IsRotation(pose.pose.linear(), 1e-9))
        std::abort();
  });
}
