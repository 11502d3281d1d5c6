// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/FanModel.h"
#include "Core/Imaging/VolumeView.h"
#include <optional>

namespace echorama {

/// The kinds of outlines that are looked for, the simpler first.
enum class OutlineFamily {
  Automatic, ///< the one that leaves least empty, or nearly so
  Linear,    ///< parallel beams from a flat face: a box
  Phased,    ///< all beams from one point, which is depth 0: the tip is part of it
  Curved,    ///< an array and a sweep that bend as much as it takes
};

struct EnclosingFanParameters {
  double marginMm = 0.0; ///< negative: a fortieth of the longest side of the region, at most 5 mm
  OutlineFamily outline = OutlineFamily::Automatic;
  /// The fan to enlarge, that of the machine which acquired the volumes; none: one is found from the region.
  std::optional<PlacedProbe> shape;
};
ParameterList Describe(EnclosingFanParameters& p);

/// The fan of a machine that would have seen the whole region: the outline for a volume that is put together from many.
///
/// It is small, but not the smallest there is: a search for the least volume over where the probe is, where it looks and how
/// much its array and its sweep bend. The search starts from FitProbe of the region, however badly that fits, or from a box
/// along the grid's axes where it finds nothing (a single voxel, islands). Every real voxel is inside by BeamPointAt, with
/// half a voxel around it. No beam is turned by more than 85 degrees, unless the start had such beams.
///
/// No outline cuts data, so the families (OutlineFamily) are weighed by what they would leave to invent: the simplest counts that
/// is at most 5% larger than the least; phased beams are simpler than curved ones only where the data begin at a point. A fan
/// whose beams are nearly parallel so becomes a box, and a box does not depend on what a ragged border makes of the angle.
///
/// With a shape: where that holds every voxel (to a hundredth of one), with the margin, it is returned as it is. Else the search
/// starts from it, and what comes out is nowhere less than it: the depths reach from its first to its last or further, fan and
/// sweep are as wide or wider at its face and at its last depth, and its array and its sweep do not bend more (the radii are as
/// large or larger). The pose is free. Its face stays depth 0; without a shape that is the near edge of the region, as in a
/// ProbeFit, or the common start of phased beams. The family is not asked for then: it is that of the shape.
///
/// A mask of one slice (dimensions[2] == 1) gets a single plane, unless the shape sweeps. An empty mask means that every voxel is
/// valid. The result does not depend on the number of threads. Cost: three passes over the voxels, and searches whose time does
/// not depend on their number.
/// \throws Error(BadInput) when nothing is valid, mask and geometry do not agree or the shape's pose is not rigid,
/// Error(InvalidParameter) for a margin that is negative or not finite or a shape that does not pass Check(), Error(Cancelled).
PlacedProbe EncloseRegion(VolumeView<const unsigned char> valid, const ImageGeometry& geometry,
                          const EnclosingFanParameters& parameters = {}, const Progress& progress = {});

/// The family of a probe's outline.
OutlineFamily FamilyOf(const ProbeGeometry& geometry);

} // namespace echorama
