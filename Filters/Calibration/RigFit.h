// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <string>
#include <vector>

namespace echorama {

/// A ball of a calibration rig.
struct RigBall {
  std::string name;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< mm, in the rig's frame
  double radius = 4.0;                              ///< mm, > 0
};

struct RigFitParameters {
  double depthScale = 0.0;
  double toleranceMm = 3.0;
  double largestRmsMm = 1.0; ///< a chance likeness fits worse
  int fewestBalls = 4;
  int candidates = 80;

  /// \throws Error(InvalidParameter)
  void Check() const;
};

ParameterList Describe(RigFitParameters& p);

/// Where a rig is, as a volume shows it.
struct RigFit {
  struct Ball {
    std::string name;
    bool found = false;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< mm, in the probe's frame, true depth; where it should be if not found
    double residualMm = 0.0;                          ///< from where the pose puts it; 0 if not found
  };

  Pose rigToProbe = Pose::Identity(); ///< to the probe's frame (ProbeGeometry), true depths
  double depthScale = 1.0;            ///< that was used or found
  double depthScaleError = 0.0;       ///< its standard deviation; 0 when it was given
  int found = 0;
  double rmsMm = 0.0; ///< of the residuals
  std::vector<Ball> balls;
};

/// Finds a rig of balls in a volume, wherever it is (dissertation 4.1.2: there, a person aligns the volumes).
///
/// A ball in water is seen as a bright cap towards the probe. Echoes that are bright, with dark water in front and beside them,
/// are taken for the tops of caps; sets of three whose distances are those of three balls give poses; the one that explains most
/// balls is refined by fitting a sphere of the known radius to each cap. Distances between centres fix the depth scale.
///
/// \param intensity of a volume that lies at \a geometry, real where \a valid (may be empty) is not 0
/// \param probe what imaged it, at \a probeToWorld in the same space as \a geometry
/// \throws Error(InvalidParameter), Error(BadInput) for balls without radius; Error(NotPossible) that says how many balls were
/// found when these are too few, or when two poses explain equally many; Error(Cancelled).
RigFit FitRig(const VolumeView<const float>& intensity, const VolumeView<const unsigned char>& valid,
              const ImageGeometry& geometry, const PlacedProbe& probe, const std::vector<RigBall>& balls,
              const RigFitParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
