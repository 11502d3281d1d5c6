// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ShownTools.h"
#include <algorithm>

namespace echorama {

std::vector<ShownTool> ShowTools(const std::vector<std::string>& tools, const LiveTransforms& transforms,
                                 const std::string& world, double time)
{
  std::vector<ShownTool> shown;
  for (const std::string& name : tools) {
    const auto frames = FramesOf(name);
    if (!frames || std::any_of(shown.begin(), shown.end(), [&](const ShownTool& one) { return one.frame == frames->first; }))
      continue; // no transform, or a second one of the same frame
    LiveTransform found = transforms.Find(frames->first, world, time);
    if (frames->first == world) { // its place is known, but not whether it is seen
      found = transforms.Find(frames->first, frames->second, time);
      found.transform.matrix.setIdentity();
    }
    ShownTool tool;
    tool.name = name;
    tool.frame = frames->first;
    tool.status = found.Status();
    if (tool.status != TransformStatus::Missing) {
      tool.time = found.time;
      tool.toWorld = found.transform.matrix;
    }
    shown.push_back(std::move(tool));
  }
  return shown;
}

} // namespace echorama
