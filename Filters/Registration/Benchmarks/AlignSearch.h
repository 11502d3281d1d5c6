// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Filters/Registration/PlacedVolume.h"
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// How the search goes. The defaults are for neighbouring volumes of a sweep, some 10 mm and 10 degrees out of place.
struct AlignSearchParameters {
  double minimumOverlap = 0.4; ///< t of eq. 4.13
  int samples = 3;             ///< n: n^6 poses per level
  int levels = 8;
  double firstStepMm = 8.0, firstStepDegrees = 6.0;
  int repeats = 3;
  int points = 20000;
  std::uint64_t seed = 1; ///< of these points
  bool pyramid = true;

  /// \throws Error(InvalidParameter)
  void Check() const;
};

ParameterList Describe(AlignSearchParameters& p);

/// One level of the search, the way it went.
struct AlignSearchLevel {
  double stepMm = 0.0, stepDegrees = 0.0;
  double voxelMm = 0.0; ///< of the first fixed volume, as compared
  int rounds = 0;       ///< of n^6 poses each
  int allowed = 0;      ///< poses of the last round with enough overlap
  double error = 0.0;   ///< of the best pose, grey levels
  double overlap = 0.0; ///< of the best pose
};

struct AlignSearchResult {
  Pose volumeToWorld = Pose::Identity();            ///< of the moving volume
  double error = 0.0;                               ///< eq. 4.13: mean absolute difference over the overlap, grey levels
  double overlap = 0.0;                             ///< share of the moving volume's points that lie in a fixed volume, [0, 1]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< the centroid of the moving volume's valid region where it started, mm
  std::int64_t evaluations = 0;                     ///< poses tried
  std::vector<AlignSearchLevel> trace;
};

/// Aligns \a moving with \a fixed by the six-dimensional search of dissertation 4.2, coarse to fine.
///
/// Each level tries n^6 poses around the best so far: it turns the volume by rotation vectors about the centroid of its
/// valid region and moves it, in steps that are halved from level to level. A level whose best pose is not the one it
/// started from may start again from there, so that a wrong turn on a coarse level is not final. The measure is eq. 4.13, the
/// mean absolute difference where the volumes overlap, not counting poses whose overlap is less than t. It is not symmetric:
/// points are drawn in the moving volume. With several fixed volumes a point is compared with each that holds it. Ties go to the
/// pose so far, then to the first in order; the result does not depend on the threads. \throws Error(InvalidParameter);
/// Error(BadInput) when a volume is constant, has fewer than 100 real voxels, or is not three-dimensional; Error(NotPossible)
/// when the volumes overlap in no pose of the first level, when no pose reaches t, and when the best pose is held back by t alone
/// (less overlap would fit better still: the volumes overlap less than t, or not at all); Error(Cancelled).
AlignSearchResult AlignSearch(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving,
                              const AlignSearchParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
