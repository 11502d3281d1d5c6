// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Filters/Physics/GelSolver.h"
#include "Filters/Physics/ProbeShape.h"
#include "Filters/Tissue/TissueSurface.h"
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

/// Gel after all motion.
struct GelCoat {
  ImageGeometry grid;        ///< along the axes of the probe's last pose
  std::vector<float> level;  ///< positive in gel, x fastest; solids that gel touches have a little of it on their inside
  std::vector<GelBeam> face; ///< of the probe, the fan fastest
  int beams = 0;             ///< along the fan, and along the sweep (1 where there is none)
  int planes = 0;
  double coupled = 0.0;   ///< share of the beams that couple
  double volumeMm3 = 0.0; ///< of the gel that is left
  GelReport report;
};

/// Puts a cap of gel on the face of a probe that is clear of tissue, moves it along its axis to the first pose and on from each
/// to the next, and lets the gel flow. \param rest tissue before the probe came \param pressed the same with the probe at its
/// last pose; none: it does not yield. On the way it yields evenly from when the probe first meets it. \throws
/// Error(InvalidParameter), Error(BadInput) for tissue that is none, Error(NotPossible) where the gel gets unstable
/// and where the probe has no clear way to its first pose,
/// Error(TooLarge), Error(Cancelled)
GelCoat SpreadGel(const TissueSurface& rest, const TissueSurface* pressed, const std::vector<PlacedProbe>& probes,
                  const ProbeHead& head, const GelMaterial& material, const GelCoatParameters& parameters,
                  const Progress& progress = {});

} // namespace echorama
