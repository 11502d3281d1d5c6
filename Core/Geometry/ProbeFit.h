// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <string>
#include <vector>

namespace echorama {

/// How a probe geometry is fitted to a valid region, and what is refused.
struct ProbeFitParameters {
  double minimumOverlap = 0.75;
  /// A part of the region's size, which is the cube root of its volume (the square root of the area of a single slice). A ball
  /// has 0.05, a cylinder 0.03, a fan without a fifth of its far end 0.02, a freehand sweep 0.01, a whole fan 0.003.
  double maximumDistance = 0.026;
  int outlinePoints = 4000;
};
ParameterList Describe(ProbeFitParameters& p);

/// A probe geometry that was found, and how well it explains the region.
struct ProbeFit {
  ProbeGeometry geometry;               ///< depthMin is 0: the face is put at the region's near edge
  Pose probeToWorld = Pose::Identity(); ///< the probe frame of ProbeGeometry in the world of the mask
  /// Root mean square distance of the region's outline from the model's surface, mm. The ends of the grid are no outline
  /// (unless there is no other); all else counts in full, also corners that are missing and ragged edges.
  double residualMm = 0.0;
  double meanDistance = 0.0;      ///< mean distance of the same points, as a part of the region's size
  double overlap = 0.0;           ///< intersection over union of region (holes filled) and model within the grid, [0, 1]
  std::vector<std::string> notes; ///< what the region leaves open, sentences for people
};

/// Fits the geometry whose fan fills the region: apex, radii, fan and sweep angles, depth range. A mask of one slice
/// (dimensions[2] == 1) is fitted by a single plane (ProbeGeometry::IsPlane). An empty mask means that every voxel is valid.
///
/// Nothing is assumed about where the probe is: its end is the narrow one. Where the grid cuts the region (its bottom is often
/// cut flat) the model may go on beyond. Holes, ragged edges and missing corners cost accuracy, but are outvoted.
///
/// What a region cannot tell: where along the beams the face lies. By convention depth 0 is the near edge of the region, so
/// that fanWidth and sweepWidth are what the first samples span, and the distances from there to the centres of fan and sweep
/// are fanWidth / fanAngle and sweepWidth / sweepAngle. Where a region is the fan of several probes (a box), depth runs along the
/// last index axis (of a single slice: the second) and the array along the first, as in a grid made by ScanConversionGrid;
/// the notes say so. A fan that is not centred (ProbeGeometry::fanOffset) is found where that explains clearly more. Of a thin
/// slab the thin side is the sweep. +x of the probe is the side towards which the indices grow. Fans whose sweep axis lies within
/// the region are not found.
///
/// The result does not depend on the number of threads. Cost: one pass over the voxels, then a search whose time does not
/// depend on their number: together half a second of one core for 256^3 voxels, and the search runs in parallel.
/// \throws Error(BadInput) when nothing is valid or mask and geometry do not agree, Error(InvalidParameter),
/// Error(NotPossible) when no fan explains the region (the message says how far the best one is off), Error(Cancelled).
ProbeFit FitProbe(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, const ProbeFitParameters& parameters = {},
                  const Progress& progress = {});

} // namespace echorama
