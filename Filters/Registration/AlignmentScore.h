// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ImageGeometry.h"
#include <string>
#include <vector>

namespace echorama {

/// What is scored: the same seed draws the same points of a volume (ValidPoints), so that scores are comparable.
struct ScoreParameters {
  int fixedVolume = 0;
  int points = 2000;
  std::uint64_t seed = 1;
};

ParameterList Describe(ScoreParameters& p);

/// A volume to be scored: where an alignment put it, where it belongs, and the points that speak for it.
struct ScoredVolume {
  ImageGeometry aligned;
  ImageGeometry truth;                      ///< same dimensions and spacing
  std::vector<Eigen::Vector3d> indexPoints; ///< in its valid region, continuous index coordinates (ValidPoints)
  std::string name;                         ///< for messages
};

/// How far the points of one volume are from where they belong, mm.
struct VolumeScore {
  std::vector<Eigen::Vector3d> points; ///< in the world, where the alignment put them
  std::vector<Eigen::Vector3d> errors; ///< from where they belong to where they are
  double mean = 0.0;                   ///< the score of dissertation 4.4.2
  double rms = 0.0, median = 0.0, percentile95 = 0.0, max = 0.0;
};

struct AlignmentScore {
  std::vector<VolumeScore> volumes;
  double mean = 0.0; ///< of the scores of all volumes but the fixed one: every volume counts the same
};

/// Scores an alignment against the truth: the mean distance between corresponding points of the valid region.
///
/// Only how volumes lie relative to each other can be right or wrong. So the truth is moved as a whole until the volume
/// number \a fixed lies where the alignment has it; what is left are the errors. A translation by d scores exactly |d|.
/// Source: dissertation 4.4.2. Cost: a few operations per point.
/// \throws Error(InvalidParameter) when \a fixed is not a volume, Error(BadInput) for fewer than two volumes, when
/// dimensions or spacing differ between a volume and its truth, or a volume has no points.
AlignmentScore ScoreAlignment(const std::vector<ScoredVolume>& volumes, int fixed = 0);

} // namespace echorama
