// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a tracked sequence; what is accepted is read forwards and backwards.
#include "Readers/SequenceFile.h"
#include "Readers/SequencePoses.h"
#include "Testing/Fuzzing.h"
#include <vector>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile memory(data, size);
  LooksLikeSequence(memory.Path());
  return Survives([&] {
    SequenceFile file(memory.Path());
    const SequenceContent& content = file.Content();
    const int last = content.frames - 1;
    for (const int index : {last, 0, last / 2})
      file.Frame(index);
    if (content.HasImages() && content.FrameBytes() <= (1u << 22)) { // more would only cost time
      std::vector<char> pixels(content.FrameBytes());
      for (const int index : {0, last, last / 2}) // the last one may be far away
        if (static_cast<double>(index) * static_cast<double>(pixels.size()) < 1e7)
          file.ReadFrame(index, pixels.data());
    }
    if (content.transforms.size() < 30) {
      SequencePoses poses(content, {});
      poses.MoveTo(file.Frame(last));
      for (const std::string& tool : poses.Tools())
        poses.Find(tool);
    }
  });
}
