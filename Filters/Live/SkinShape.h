// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Filters/Tissue/TissueSurface.h"

namespace echorama {

/// How the skin of a volume follows its valid region (vtkUltrasoundSkin).
struct SkinParameters {
  int mostCells = 300000; ///< a finer skin would follow the voxels' steps
  int smoothingSteps = 15;
  double passBand = 0.1;
};
ParameterList Describe(SkinParameters& p);

/// The body that holds the others: the one with the longest diagonal of its bounding box, of equals the first. -1 when no body
/// has a triangle.
int OutermostBody(const TissueSurface& tissue);

} // namespace echorama
