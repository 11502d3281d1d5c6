// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Tissue/TissueSurface.h"
#include "VesselTree.h"
#include <cstdint>
#include <variant>
#include <vector>

namespace echorama {

/// An invented abdomen under a probe at the origin that looks along +z: x runs along its fan, y along its sweep.
///
/// The trunk is a block whose skin lies at z = standoffMm, with gel (the background) above. Room for three or four overlapping
/// views of a mechanical 3D probe (65 degrees of fan, 55 degrees of sweep, 100 to 150 mm deep) that slide along x or y.
struct AnatomyParameters {
  std::uint64_t seed = 1;  ///< of the individual: shapes, places, vessels
  double variation = 1.0;  ///< how far individuals differ, in [0, 2]; 0: all are alike but for their vessels
  double detailMm = 1.5;   ///< edge of the triangles of large bodies, in [0.5, 10]; vessels are finer, by their radius
  double organScale = 1.0; ///< size of all organs and of the spine beside an adult's, in [0.5, 1.2]

  // The trunk and its wall.
  double trunkWidthMm = 290.0;  ///< along x, in [150, 600]
  double trunkLengthMm = 240.0; ///< along y, in [120, 600]
  double trunkDepthMm = 190.0;  ///< along z, in [60, 400]
  double standoffMm = 1.0;      ///< gel between the middle of the probe's face and the skin, in [-10, 20]; below 0: the face lies
                                ///< inside the body, undeformed
  double undulationMm = 1.5;    ///< how far a layer's thickness deviates from its mean, in [0, 4]; never by more than half of it
  double skinMm = 2.0;          ///< in [0.5, 5]
  double fatMm = 12.0;          ///< in [2, 60]
  double muscleMm = 10.0;       ///< in [2, 30]
  double fasciaMm = 0.7;        ///< bright sheets on both sides of the muscle, in [0, 2]; 0: none
  int septa = 600;              ///< thin bright leaves in fat and muscle, in [0, 2000]
  int lumps = 700;              ///< lobules of fat and loops of bowel around the organs, in [0, 1000]

  // Organs.
  bool liver = true;
  bool kidney = true;
  bool gallbladder = true;
  double capsuleMm = 0.8; ///< shell around liver and kidney, wall of the gallbladder, in [0, 3]; 0: none
  int stones = 1;         ///< in the gallbladder, in [0, 5]
  double stoneMm = 4.0;   ///< radius of the largest of them, in [1, 7]

  // Vessels: aorta and vena cava along the spine; portal vein (walled) and hepatic veins as trees in the liver.
  bool greatVessels = true;
  int generations = 6;           ///< branchings from the root to a tip at most, in [0, 9]; 0: no trees
  double vesselRadiusMm = 5.5;   ///< of the lumen at the root, in [1, 8]
  double smallestVesselMm = 0.9; ///< lumen radius below which nothing branches off, in [0.4, 8]
  double branchAsymmetry = 0.25; ///< in [0, 0.6]: of two children the smaller is narrower by this share, on average
  double wallShare = 0.22;       ///< thickness of walls beside the radius of the lumen, in [0.02, 0.5]

  // What is found in the liver: as many as find room; they get smaller to find it. Vessels go around them.
  int cysts = 2;               ///< clear, in [0, 20]
  int darkLesions = 2;         ///< in [0, 20]
  int brightLesions = 2;       ///< in [0, 20]
  double lesionRadiusMm = 7.0; ///< of the largest; the others down to half of it; in [1, 20]

  // Bone.
  int ribs = 2;      ///< across the muscle on the -x side, in [0, 6]
  bool spine = true; ///< vertebrae behind the great vessels

  /// Throws Error(InvalidParameter) that names the number that is out of its range, and the range; also for a trunk that has no
  /// room for the organs.
  void Check() const;
};

/// One of the numbers of AnatomyParameters but the seed, for those who read them from a file or show them.
struct AnatomyParameter {
  const char* name;
  std::variant<double AnatomyParameters::*, int AnatomyParameters::*, bool AnatomyParameters::*> member;
  double from, to; ///< its range; of a bool 0 and 1
};

/// All of them, in the order of the struct.
const std::vector<AnatomyParameter>& AnatomyParameterTable();

/// Makes the abdomen: closed bodies, oriented outward, none of which cuts itself; all lie in the trunk, the first body.
/// Later bodies count (TissueSurface), so that layers are nested solids. One seed makes one anatomy, to the last bit.
/// About a million triangles with the defaults. Materials are standard ones, and some mixed from them.
/// \throws Error(InvalidParameter) as Check(), Error(Cancelled).
TissueSurface MakeAnatomy(const AnatomyParameters& parameters, const Progress& progress = {});

} // namespace echorama
