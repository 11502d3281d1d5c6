// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/MotionPath.h"
#include "SynthesisScene.h"
#include <vector>

namespace echorama {

/// A part of a sweep, and the moment whose tissue and gel its planes see.
struct SceneState {
  TimedPose probe;                 ///< in the middle of the part
  int firstStep = 0, lastStep = 0; ///< of the sweep
};

/// A view of a scene: where the probe is, at each step of its sweep if it moves meanwhile, and how it came there.
struct SceneView {
  Pose probeToWorld = Pose::Identity();
  std::vector<Pose> steps;        ///< none: it rests
  std::vector<SceneState> states; ///< one at least, in the order of time
  /// On a path with gel or friction, where tissue and gel go on from view to view: the moments from the view before (the first
  /// view: from the path's begin) up to the last state, which are among them; no part of the head goes farther than stepMm
  /// between two. Else none.
  std::vector<TimedPose> way;
};

/// The views of a scene, in their order. A recording is read. \throws Error as ScenePath; Error(TooLarge) for a path of more
/// than 100,000 moments
std::vector<SceneView> ViewsOf(const SynthesisScene& scene);

} // namespace echorama
