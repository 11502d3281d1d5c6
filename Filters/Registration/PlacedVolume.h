// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Registration/Pyramid.h"
#include <string>
#include <vector>

namespace echorama {

/// A volume as the aligners see it: its resolutions, and a motion from where its geometry says to where it is taken to be.
struct PlacedVolume {
  const std::vector<PyramidLevel>* pyramid = nullptr; ///< the finest first (BuildPyramid)
  Pose volumeToWorld = Pose::Identity();
  std::string name; ///< for messages
  /// How much each voxel of each level counts, in [0, 1] (the pyramid of its ReliabilityMap); none: all alike
  const std::vector<PyramidLevel>* reliability = nullptr;
  /// Places that were found in it, where its geometry has them: those with one label in two volumes belong together.
  std::vector<Landmark> landmarks = {};
};

/// \throws Error(BadInput) that names a volume without voxels, one voxel thick, constant, or with fewer than 100 real voxels.
void CheckPlacedVolume(const PlacedVolume& volume);

/// \throws Error(InvalidParameter) when \a fixed is not the number of one of \a count volumes, counted from 0.
void CheckFixedVolume(int fixed, std::size_t count);

} // namespace echorama
