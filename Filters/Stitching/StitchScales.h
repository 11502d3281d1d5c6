// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Membrane.h"
#include "OverlapComponents.h"
#include "RegionMap.h"
#include "RowField.h"
#include "Stitch.h"

namespace echorama {

/// The scale s of every volume at the voxels of its overlap, in spans that hold them: by distances (dissertation 5.3), by a
/// membrane (5.6, 5.7), or the depth (mm) inside the own border (Szeliski 1996). Methods that need none give empty fields.
///
/// A membrane is 1 where the volume is alone and in its core, 0 where only others are and in the cores of others; where two
/// volumes alone meet, one membrane is solved and the other is the rest to 1. Pieces that touch neither get 0.5 throughout.
/// \param worst receives the largest certified bound of the membranes
std::vector<RowField<float>> StitchScales(const StitchParameters& parameters, const RegionMap& regions,
                                          const Eigen::Vector3d& spacing, double& worst, const Progress& progress = {});

} // namespace echorama
