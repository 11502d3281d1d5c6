// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <functional>
#include <vector>

namespace echorama {

/// How far a place in a volume is from where other volumes have data and it has none: mm on coarse nodes, linear between. Divided
/// by the sum over volumes it is the weight of stitching by distance (BlendScale). It is 0 all over a block of blockEdge^3 cells
/// that others take over, so that it falls to 0 towards such a border without a step; a border that all volumes share, as skin,
/// counts for nothing.
class BorderDistance {
public:
  static constexpr int blockEdge = 4;       ///< cells
  static constexpr float farthestMm = 1e6f; ///< where no other volume takes over

  BorderDistance() = default;
  /// \param isTaken whether a block is not data throughout, and others have data there. From -1 on, up to the number of blocks:
  /// one layer around the volume. The last block may reach beyond it, and is then not data throughout. Called from several
  /// threads.
  BorderDistance(const ImageGeometry& geometry, const std::function<bool(int, int, int)>& isTaken);

  /// At index coordinates of the volume; beyond it as at its end.
  float At(float x, float y, float z) const;

private:
  int nodes_[3] = {0, 0, 0};
  std::vector<float> mm_;
};

} // namespace echorama
