// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeFit.h"
#include "Pyramid.h"
#include <optional>
#include <vector>

namespace echorama {

/// A volume at falling resolution, and how much its voxels count there (empty: all alike).
struct PreparedVolume {
  std::vector<PyramidLevel> pyramid, reliability;
};

/// What an alignment needs of a volume. Reliability (ReliabilityMap) follows the beams of \a probe; without one, of the probe
/// that explains where the volume is real, fitted as exactly as shadows need it. \throws as BuildPyramid and ReliabilityMap.
template <class T>
PreparedVolume PrepareVolume(const PosedVolume<T>& volume, bool withReliability, const std::optional<PlacedProbe>& probe = {},
                             const Progress& progress = {});

} // namespace echorama
