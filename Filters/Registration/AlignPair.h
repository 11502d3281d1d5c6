// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "GlobalSearch.h"
#include "LocalAlign.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// What is known about where the moving volume belongs.
enum class AlignStart {
  Automatic, ///< nothing for sure: as Tracked first, then as HandMade and as Unknown while there is no clear answer
  Tracked,   ///< within some 12 degrees and 20 mm of the start: a calibrated tracker. An answer half as far again is none
  HandMade,  ///< within some 35 degrees and a third of the volume's size: placed by eye. The same holds
  Unknown,   ///< any rotation and any translation
};

/// "automatic", "tracked", "hand-made", "unknown".
std::vector<std::string> AlignStartNames();

/// What an alignment is worth.
enum class Verdict {
  Aligned,   ///< every check was passed
  Ambiguous, ///< there is a best pose, but another would do as well or part of the pose is undetermined
  Failed,    ///< no pose explains both volumes
};

/// "aligned", "ambiguous", "failed".
const char* NameOf(Verdict);

/// How a pair is aligned, and from when on the answer is trusted.
struct AlignPairParameters {
  AlignStart start = AlignStart::Automatic;
  std::string metric = "local-ncc"; ///< of the local stage, one of MetricNames()
  double minimumOverlap = 0.1;
  int candidates = 16;
  double finestMm = 0.0;
  int points = 200000;

  double minimumSimilarity = 0.06; ///< less is Failed
  double minimumPeakRatio = 1.25;  ///< less is Ambiguous
  double maximumErrorVoxels = 1.0; ///< more is Ambiguous
  double maximumErrorMm = 2.5;     ///< more is Ambiguous
  double soundSpeedError = 0.025;  ///< of tissue, as a share of what the scanner assumes
  double maximumSplitVoxels = 2.0; ///< more is Failed
  double landmarkSigmaMm = 2.0;
  std::uint64_t seed = 1;
};

ParameterList Describe(AlignPairParameters& p);

/// Where the moving volume belongs beside the fixed one, and how sure that is.
struct PairAlignment {
  Pose volumeToWorld = Pose::Identity(); ///< of the moving volume, the fixed one being where it was placed
  Verdict verdict = Verdict::Failed;
  std::string reason;      ///< why it is not Aligned, for people; else empty
  double similarity = 0.0; ///< mean over the overlap: 1 identical, 0 chance
  double overlap = 0.0;    ///< share of the smaller volume, [0, 1]
  double score = 0.0;      ///< of both, see LocalAlignResult
  double peakRatio = 0.0;  ///< best score : that of the next different pose, where all are compared; 99: none above chance
  double splitMm = 0.0;    ///< how far the poses that two halves of the voxels find lie apart, in the mean over the moving volume
  double errorMm = 0.0;    ///< predicted root mean square error over the moving volume
  double voxelMm = 0.0;    ///< of the last level
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< world: the twist below acts about it
  /// Inverse covariance of (translation mm, rotation vector radians) in MotionAbout(centre, rotation, translation) *
  /// volumeToWorld.
  Information information = Information::Zero();
  bool anywhere = false; ///< whether every rotation was tried
  double globalSeconds = 0.0, localSeconds = 0.0, confidenceSeconds = 0.0;
};

/// The 6 x 6 covariance; in directions that are not determined the standard deviation is 1 km at \a radiusMm mm from the centre.
Information CovarianceOf(const Information& information, double radiusMm);

/// Sets the verdict and the reason by what is known of an alignment: its overlap, similarity, errorMm, splitMm, peakRatio and
/// voxelMm. \param covariance of its twist \param radiusMm where a rotation is felt, both for the words of the reason
void Judge(const AlignPairParameters& parameters, const Information& covariance, double radiusMm, PairAlignment& alignment);

/// Aligns two volumes: global search, local refinement of its candidates, and a verdict on the best.
///
/// Landmarks that both volumes have (PlacedVolume) say where to begin, pull poses towards where they agree with them, and add to
/// what is known of the answer. A pose that contradicts them is no answer, and none else is when they contradict each other.
///
/// The start is always one of the candidates. All are refined at a middle level, the best down to the finest. Four checks
/// decide: enough overlap and more similarity than chance; no different pose that does nearly as well; the covariance; and the
/// poses that two disjoint halves of the voxels find, each for itself: where nothing real is matched they drift apart.
/// \throws Error(InvalidParameter), Error(BadInput) for volumes that cannot be aligned at all (constant, nearly empty, flat),
/// Error(Cancelled). An alignment that is not found is no error: it is the verdict.
PairAlignment AlignPair(const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures,
                        const PlacedVolume& moving, const std::shared_ptr<const MetricPyramid>& movingFeatures,
                        const AlignPairParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
