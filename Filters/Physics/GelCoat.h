// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Filters/Physics/GelSolver.h"
#include "Filters/Physics/ProbeShape.h"
#include <vector>

namespace echorama {

/// How gel is put on, and how the probe brings it to the skin.
struct GelCoatParameters {
  double amountMl = 10.0;
  double coverage = 0.9;
  double cellMm = 2.0;
  double speedMmPerS = 40.0;
  double settleS = 0.1;
};
ParameterList Describe(GelCoatParameters& p);

/// What lies between face and skin on one beam.
struct GelBeam {
  Eigen::Vector3d start = Eigen::Vector3d::Zero(); ///< mm, world: on the face
  double gelMm = 0.0, airMm = 0.0;                 ///< along the beam
  bool meetsSkin = false;                          ///< within reach
  bool couples = false;                            ///< it does, and there is no air before
};

/// Gel at one time of a motion.
struct GelCoat {
  ImageGeometry grid;        ///< along the axes of the probe's first pose, around all gel
  std::vector<float> level;  ///< positive in gel, x fastest; solids that gel touches have a little of it on their inside
  std::vector<GelBeam> face; ///< of the probe, the fan fastest
  int beams = 0;             ///< along the fan, and along the sweep (1 where there is none)
  int planes = 0;
  double coupled = 0.0;   ///< share of the beams that couple
  double volumeMm3 = 0.0; ///< of the gel that is left, as it is compressed
  double putOnMm3 = 0.0;  ///< at first, without pressure
  double leftMm3 = 0.0;   ///< of that: what is left
  double goneMm3 = 0.0;   ///< and what left the space that is computed
  double seconds = 0.0;   ///< simulated
  GelReport report;       ///< of all that
};

/// Gel, solids and a face in the frame of a motion.
struct GelSight {
  const GelSolver& solver;
  const GelShape& skin;
  const ProbeShape& head;
  const ProbeGeometry& geometry;
  Pose headToFrame;
  Eigen::AlignedBox3d reach; ///< of beams, in the probe's frame
};

/// The surface of the gel and what lies before the face; grid and beams in the frame of the motion. The rest is left as it is.
GelCoat CoatOf(const GelSight& sight);

} // namespace echorama
