// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as named transforms, of Plus (XML) or ours (JSON); what is accepted is composed in every way.
#include "Core/Geometry/TransformFile.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  LooksLikeTransforms({reinterpret_cast<const char*>(data), size});
  return Survives([&] {
    const TransformGraph graph(ReadTransforms(file.Path()));
    const std::vector<std::string> frames = graph.Frames();
    if (frames.size() > 30) // more would only cost time
      return;
    for (const std::string& from : frames)
      for (const std::string& to : graph.ReachableFrom(from)) {
        const ComposedTransform found = graph.Find(from, to);
        FramesOf(found.path.front() + "To" + found.PathText());
      }
  });
}
