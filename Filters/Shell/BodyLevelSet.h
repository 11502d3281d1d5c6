// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySurface.h"
#include "LevelSetMesh.h"
#include <memory>

namespace echorama {

/// The distances from a body at the points of a lattice, in a band about its surface: a level set of OpenVDB, true to half a
/// cell.
class BodyLevelSet {
public:
  /// Distances are known from \a insideMm within to \a outsideMm beyond the surface; further off they are these.
  BodyLevelSet(const BodySurface& body, const Eigen::Vector3d& origin, double cellMm, double insideMm, double outsideMm);
  ~BodyLevelSet();

  /// Whether a block, or one that begins where it ends, holds anything of the band.
  bool Touches(const Eigen::Array3i& first) const;

  bool IsOutside(const Eigen::Array3i& node) const;

  /// The values at the nodes of a block.
  void Fill(const Eigen::Array3i& first, LevelSet::Values& values) const;

private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

} // namespace echorama
