// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a pose file; what is accepted is looked up again.
#include "Core/Geometry/PoseFile.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const std::vector<VolumePose> poses = ReadPoses(file.Path());
    for (const VolumePose& pose : poses)
      if (pose.geometry)
        PoseFor(poses, pose.file, *pose.geometry);
  });
}
