// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Synthesis/SynthesisScene.h"
#include <string>
#include <vector>

namespace echorama {
class RecordedMotion {
public:
  RecordedMotion(const std::string& path, const SceneRecording& recording) { (void)path; (void)recording; }
  std::vector<double> Times(int) const { return {}; }
  Pose At(double) const { return Pose::Identity(); }
  std::vector<Pose> Around(double, double, int) const { return {}; }
};
} // namespace echorama
