// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Filters/Tissue/TissueSurface.h"
#include "VesselTree.h"
#include <cstdint>

namespace echorama {

/// An invented abdomen under a probe at the origin that looks along +z: x runs along its fan, y along its sweep.
///
/// The trunk is a block whose skin lies at z = standoffMm, with gel (the background) above. Room for three or four overlapping
/// views of a mechanical 3D probe (65 degrees of fan, 55 degrees of sweep, 100 to 150 mm deep) that slide along x or y.
struct AnatomyParameters {
  std::uint64_t seed = 1;
  double variation = 1.0;
  double detailMm = 1.5; ///< vessels are finer, by their radius
  double organScale = 1.0;

  // The trunk and its wall.
  double trunkWidthMm = 290.0;
  double trunkLengthMm = 240.0;
  double trunkDepthMm = 190.0;
  double standoffMm = 1.0;
  double undulationMm = 1.5;
  double skinMm = 2.0;
  double fatMm = 12.0;
  double muscleMm = 10.0;
  double fasciaMm = 0.7;
  int septa = 600;
  int lumps = 700;

  // Organs.
  bool liver = true;
  bool kidney = true;
  bool gallbladder = true;
  double capsuleMm = 0.8;
  int stones = 1;
  double stoneMm = 4.0;

  // Vessels: aorta and vena cava along the spine; portal vein (walled) and hepatic veins as trees in the liver.
  bool greatVessels = true;
  int generations = 6;
  double vesselRadiusMm = 5.5;
  double smallestVesselMm = 0.9;
  double branchAsymmetry = 0.25;
  double wallShare = 0.22;

  // What is found in the liver: as many as find room; they get smaller to find it. Vessels go around them.
  int cysts = 2;
  int darkLesions = 2;
  int brightLesions = 2;
  double lesionRadiusMm = 7.0;

  // Bone.
  int ribs = 2;
  bool spine = true;

  /// Throws Error(InvalidParameter) that names the number that is out of its range, and the range; also for a trunk that has no
  /// room for the organs.
  void Check() const;
};

ParameterList Describe(AnatomyParameters& p);

/// Makes the abdomen: closed bodies, oriented outward, none of which cuts itself; all lie in the trunk, the first body.
/// Later bodies count (TissueSurface), so that layers are nested solids. One seed makes one anatomy, to the last bit.
/// About a million triangles with the defaults. Materials are standard ones, and some mixed from them.
/// \throws Error(InvalidParameter) as Check(), Error(Cancelled).
TissueSurface MakeAnatomy(const AnatomyParameters& parameters, const Progress& progress = {});

} // namespace echorama
