// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <vector>

namespace echorama {

/// A valid region, looked at from far enough that its single voxels do not matter: blocks of voxels, how much of each is
/// valid, and points on the border in between.
struct RegionOutline {
  /// A point on the border of the largest connected piece.
  struct Point {
    Eigen::Vector3d position; ///< mm, world
    bool atGrid = false;      ///< the region ends here because the grid does: it may go on
  };
  std::vector<Point> points;      ///< in the order of the cells
  Volume<float> filled;           ///< per cell: the valid part of its voxels, [0, 1]; 1 in holes and but for the rim
  std::vector<double> centres[3]; ///< index coordinates of the middle of the cells along each axis
  ImageGeometry geometry;         ///< of the voxels
  double cellMm = 0.0;            ///< geometric mean of the cells' edges (of the axes with more than one voxel)
  double validMm = 0.0;           ///< volume (mm^3) of the region with its holes filled; area (mm^2) of a single slice
  double largestPart = 0.0;       ///< how much of the region is the largest connected piece, (0, 1]
  double holesPart = 0.0;         ///< how much of the region, but for its rim, is not valid: holes and what dropped out, [0, 1)
  bool coversGrid = false;        ///< the region is the whole grid

  Eigen::Vector3d CellPosition(int i, int j, int k) const; ///< mm, world
};

/// Outlines a region. Blocks are chosen as cubic (in mm) as voxels allow, for at most \a maxCells cells: 4^3 voxels for 256^3.
/// A cell is inside when half of its voxels or more are valid; the border runs where the valid part, linear between the
/// middles of neighbouring cells, is one half. So speckle that dropped out and ragged edges blur, and a straight edge keeps its
/// place to a small part of a cell. What the outside does not reach through 6-neighbours is a hole and is filled.
/// An axis of one voxel has no border. Cost: one pass over the voxels in parallel, then three over the cells.
/// \throws Error(BadInput) when mask and geometry do not agree or nothing is valid; Error(Cancelled).
RegionOutline OutlineRegion(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, int maxCells,
                            const Progress& progress = {});

} // namespace echorama
