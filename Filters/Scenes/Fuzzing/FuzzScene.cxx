// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a scene; what is accepted comes back from its own text, and its parameters can be had.
#include "Filters/Scenes/SynthesisScene.h"
#include "Testing/Fuzzing.h"
#include <string>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  return Survives([&] {
    const SynthesisScene scene = SceneFromJson(std::string(reinterpret_cast<const char*>(data), size), "fuzz.json");
    scene.Parameters();
    for (const SceneItem& item : scene.tissue)
      if (const auto* packing = std::get_if<ScenePacking>(&item.what))
        scene.ParametersOf(*packing);
    const std::string text = SceneToJson(scene);
    if (SceneToJson(SceneFromJson(text, "again.json")) != text)
      std::abort(); // a finding
  });
}
