// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <string>
#include <vector>

namespace echorama {

/// How a probe geometry is fitted to a valid region.
struct ProbeFitParameters {};

/// A probe geometry that was found, and how well it explains the region.
struct ProbeFit {
  ProbeGeometry geometry;
  Pose probeToWorld = Pose::Identity(); ///< the probe frame of ProbeGeometry in the world of the mask
  double residualMm = 0.0;              ///< root mean square distance of the region's outline from the model's
  double overlap = 0.0;                 ///< intersection over union of region and model, [0, 1]
  std::vector<std::string> notes;       ///< what the region leaves open, sentences for people
};

/// Fits the geometry whose fan fills the region: apex, radii, fan and sweep angles, depth range. A mask of one slice
/// (dimensions[2] == 1) is fitted by a single plane (ProbeGeometry::IsPlane).
/// \throws Error(BadInput) when nothing is valid, Error(NotPossible) when no fan explains the region, Error(Cancelled).
ProbeFit FitProbe(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, const ProbeFitParameters& parameters = {},
                  const Progress& progress = {});

} // namespace echorama
