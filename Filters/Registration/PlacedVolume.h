// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include "Core/Imaging/Pyramid.h"
#include <string>
#include <vector>

namespace echorama {

/// A volume as the aligners see it: its resolutions, and a motion from where its geometry says to where it is taken to be.
struct PlacedVolume {
  const std::vector<PyramidLevel>* pyramid = nullptr; ///< the finest first (BuildPyramid)
  Pose volumeToWorld = Pose::Identity();
  std::string name; ///< for messages
  /// How much each voxel of each level counts, in [0, 1] (the pyramid of its ReliabilityMap); none: all alike. The search of
  /// the dissertation does not look at it.
  const std::vector<PyramidLevel>* reliability = nullptr;
};

} // namespace echorama
