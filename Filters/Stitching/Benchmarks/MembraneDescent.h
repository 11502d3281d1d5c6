// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Stitching/Membrane.h"
#include <limits>

namespace echorama {

struct DescentParameters {
  int levels = 6;     ///< 1 (the finest alone) to 8
  double stop = 1e-4; ///< share of the energy below which the fall of one step ends a level, in (0, 1)
  double maximumSeconds = std::numeric_limits<double>::infinity(); ///< after which all levels end
  bool trace = false;                                              ///< whether the report's is filled
};

/// One step of a descent.
struct DescentStep {
  double seconds = 0.0; ///< since the beginning
  double energy =
      0.0;       ///< sum over faces, times r^(d - 2) where voxels are r times larger (dissertation 5.9), of values in [0, 1]
  int level = 0; ///< 0 is the finest
};

struct DescentReport {
  int steps = 0; ///< of all levels
  double seconds = 0.0;
  std::vector<DescentStep> trace;
};

/// Minimises the energy of SolveMembrane by steepest descent from coarse to fine, stopped as in dissertation 5.3.2. It knows no
/// error. \param values known ones are in [0, 1]; receives the unknown ones
DescentReport DescendMembrane(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, RowField<float>& values,
                              const DescentParameters& parameters = {});

} // namespace echorama
