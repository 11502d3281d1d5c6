// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/Transducer.h"
#include <string>
#include <vector>

namespace echorama {

/// A kind of probe, as a user picks it from a list: head, beams and how the array sends. Starting values, to be changed.
struct ProbePreset {
  std::string name;      ///< as in scenes: lower case, no blanks
  std::string label;     ///< for people
  ProbeGeometry probe;   ///< the head, and how deep it looks
  int elements = 128;    ///< beams across the fan
  int sweepSteps = 1;    ///< planes of the sweep; 1: a 2D probe
  int samples = 512;     ///< along each beam, from the first depth to the last
  Transducer transducer; ///< centre frequency, bandwidth, apertures and foci
  std::string source;    ///< where the figures come from
};

/// The presets: curvilinear, linear and phased (single planes), endocavity-3d and mechanical-3d (swept).
const std::vector<ProbePreset>& ProbePresets();

/// The preset of that name. \throws Error(InvalidParameter) that lists the names there are.
const ProbePreset& ProbePresetOf(const std::string& name);

} // namespace echorama
