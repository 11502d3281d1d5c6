// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <limits>

namespace echorama {

/// A box of cells.
struct CellBox {
  std::array<int, 3> first{0, 0, 0}, size{0, 0, 0}; ///< size 0: there is none
  double weight = 0.0;                              ///< the sum over its cells
};

/// The box of the greatest weight whose cells all have \a weights > 0 (0 and NaN: not allowed in it). Exact: every box that
/// cannot grow is looked at. Cost: n_x n_y n_z^2 / 2 steps; layers of z are parallel. Of boxes that weigh the same, the one whose
/// last layer comes first, then whose last row does. \throws Error(Cancelled)
CellBox LargestBox(VolumeView<const float> weights, const Progress& progress = {});

/// What cropping would have left of a region.
struct Crop {
  BeamPoint first, last; ///< corners of the box: depth in mm, fan and sweep in wholes
  double share =
      std::numeric_limits<double>::quiet_NaN(); ///< of the region's voxels, those in the box, [0, 1]; NaN: there are none
};

/// The largest box in the beam space of a fan (depth x fan x sweep) that is all region: what is left when a fan without ragged
/// borders is cut from a stitched volume, as against embedding, which keeps all (dissertation figure 6.2).
///
/// Beam space is cut into at most \a resolution cells per axis (one along a sweep that is a plane); a cell is region when the
/// voxel nearest to its middle is. Largest is by volume in mm^3.
/// \param region of the size of \a grid; not 0: region
/// \throws Error(BadInput) when region and grid do not agree, Error(InvalidParameter) for a resolution outside [2, 256] or a fan
/// that is not one, Error(Cancelled)
Crop LargestCrop(VolumeView<const unsigned char> region, const ImageGeometry& grid, const PlacedProbe& fan, int resolution = 80,
                 const Progress& progress = {});

} // namespace echorama
