// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Stitching/CoarseVolume.h"
#include <limits>
#include <vector>

namespace echorama {

/// The label of a voxel where no volume is.
constexpr unsigned short noVolume = std::numeric_limits<unsigned short>::max();

/// Costs are in units of the median difference of overlapping volumes, so nothing here depends on the range of grey levels.
struct SeamParameters {
  double length = 0.5;   ///< what a face of the seam costs beyond what the volumes differ on both of its sides, >= 0
  double ceiling = 16.0; ///< no difference counts more than this, > 0: one outlier is not worth a detour
  double border = 256.0; ///< what a face costs where a shown volume ends, >= 0: seams keep inside of overlaps if they can
  double shadow = 0.5;   ///< a volume is not shown where its trust is below this part of the best there, [0, 1]
  int sweeps = 3;        ///< how often every volume is cut against what is there, >= 1; two volumes need one
  int atOnce = 8192;     ///< overlaps of more voxels are cut from coarse to fine, >= 1
};

/// Which volume is shown at each voxel of a grid, so that what the volumes differ along the seams is least: a minimum cut. The
/// cost of a seam between a and b across the face between voxels p and q is |a(p) - b(p)| + |a(q) - b(q)| and a length (Kwatra
/// 2003). Two volumes with a small overlap are cut exactly, with a large one from coarse to fine, nearly so; of more, each in its
/// turn is cut against all that is there, seams included (the expansion moves of Boykov, Veksler and Zabih 2001), until nothing
/// changes. In the spirit of PURE (Gomez 2016): one source per voxel.
///
/// Where one volume alone is there it is shown, and where one alone has scale 1 (its core); a volume in shadow only where
/// nothing better is there. A value that is not a number differs by the ceiling from everything. Grids of one slice are 2D.
/// Identical volumes: the first. Cost: some 2 to 4 microseconds and 100 bytes per voxel of an overlap.
/// \return label per voxel of the grid, noVolume where nothing is. The same on any number of threads.
/// \throws Error(InvalidParameter) for a parameter out of range, or 65535 volumes and more; Error(Cancelled)
Volume<unsigned short> CutSeams(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions,
                                const SeamParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
