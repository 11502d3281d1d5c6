// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AlignPair.h"
#include "Core/Sharing/SharedWork.h"
#include "PreparedVolumes.h"
#include <functional>

namespace echorama {

/// What aligns two volumes; AlignPair unless another is given. It is called on several threads at once.
using PairAligner = std::function<PairAlignment(
    const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures, const PlacedVolume& moving,
    const std::shared_ptr<const MetricPyramid>& movingFeatures, const AlignPairParameters& parameters, const Progress& progress)>;

/// Which pairs are aligned, and when a pair is voted down.
struct AlignVolumesParameters {
  AlignPairParameters pair; ///< of every pair
  std::vector<int> held;    ///< stay where they are beside the fixed one: the others are aligned with all of them
  int pairsPerVolume = 6;
  int rounds = 2;
  double floorVoxels = 0.3;
  double outlierVoxels = 2.0, outlierSigmas = 6.0;
  std::uint64_t seed = 1; ///< of the pose graph's trees
  AlignResources resources;
  /// The ranks that share the pairs, if there are several: each calls AlignVolumes with the same, within SharedWork::Run, and
  /// gets the result of one rank, to the last bit. The first one keeps the file of finished pairs.
  SharedWork* shared = nullptr;
};

ParameterList Describe(AlignVolumesParameters& p);

/// Where a volume belongs, and how sure that is.
struct VolumeAlignment {
  std::string name;
  Pose volumeToWorld = Pose::Identity(); ///< where it started if it Failed
  Verdict verdict = Verdict::Failed;     ///< the fixed volume and those held are Aligned
  std::string reason;                    ///< why it is not Aligned, for people; else empty
  /// Inverse covariance, relative to the fixed volume, of (translation mm, rotation vector radians) in
  /// MotionAbout(centre, rotation, translation) * volumeToWorld; zero for the fixed volume, those held and those that Failed.
  Information information = Information::Zero();
  Information covariance = Information::Zero();     ///< CovarianceOf() it; zero for the fixed volume
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< world
  /// Predicted root mean square distance of its points from where they belong beside the fixed volume, mm: what the covariance
  /// says, and what the speed of sound may have bent. 0 for the fixed volume, those held and those that Failed.
  double errorMm = 0.0;
  double overlap = 0.0;    ///< of the pair that stands and overlaps most, share of the smaller volume
  double similarity = 0.0; ///< mean of the pairs that stand, by overlap
};

/// What became of a pair.
struct PairOfVolumes {
  int fixed = 0, moving = 0; ///< volumes
  /// What the pair itself found, the volume `fixed` being where it is placed in the end.
  PairAlignment alignment;
  Verdict verdict = Verdict::Failed; ///< with what the other pairs say of it
  std::string reason;                ///< empty when aligned by itself and not disagreed with
  bool votedDown = false;            ///< the other pairs disagreed with what it found at first
  bool contested = false;            ///< voted down, but as many pairs spoke for it as against it
  bool stands = false;               ///< it has a say in where the volumes are
  int attempts = 0;                  ///< how often it was aligned: again from where the other pairs placed the volumes
  double residualMm = 0.0;           ///< how far it disagrees with where the volumes are; if voted down, as it was then
};

struct AlignVolumesResult {
  std::vector<VolumeAlignment> volumes;
  std::vector<PairOfVolumes> pairs; ///< those that were tried, by their numbers
  double consistency = 0.0; ///< how far pairs disagree, in what they claim to be sure of: 1 as claimed; 0: nothing to compare
  double featureSeconds = 0.0, pairSeconds = 0.0, graphSeconds = 0.0;
  int timesPrepared = 0;       ///< how often all that pairs ask of a volume was made: more than once where memory did not last
  double preparedBytes = 0.0;  ///< the most of it that was kept at once
  int pairsFinishedBefore = 0; ///< pairs that were not aligned but known from the file
  /// Where ranks share the work, seconds and bytes are those of the rank that needs most.
  int ranks = 1;
  Traffic traffic; ///< of this rank
};

/// Aligns any number of volumes: every pair that may overlap by itself, then all pairs together as a pose graph.
///
/// Which pairs: those that overlap where the volumes start, and where a volume has few of them also those that would overlap
/// if it were moved as far as the start may be off; all when the start is unknown. From where the first solution places
/// the volumes, pairs that failed, were voted down or were not thought of are tried again. With an automatic start, the search
/// over all rotations is kept for volumes that no pair places otherwise.
/// Pairs that share landmarks are always tried.
/// Two volumes are AlignPair and nothing else. Volumes that cannot be aligned (constant, nearly empty) fail for themselves.
/// \throws Error(InvalidParameter) when \a fixed or one of those held is not a volume, or none is left to be moved,
/// Error(BadInput) for fewer than two volumes or when the fixed one or all others cannot be aligned, Error(Cancelled).
AlignVolumesResult AlignVolumes(const std::vector<PlacedVolume>& volumes, int fixed,
                                const AlignVolumesParameters& parameters = {}, const Progress& progress = {},
                                const PairAligner& aligner = AlignPair);

/// The same for volumes that are more than memory holds: resolutions are made when pairs ask for them and kept within the
/// budget, and pairs are aligned in an order in which few are made twice. The same result, to the last bit.
AlignVolumesResult AlignVolumesOnDemand(const std::vector<VolumeOnDemand>& volumes, int fixed,
                                        const AlignVolumesParameters& parameters = {}, const Progress& progress = {},
                                        const PairAligner& aligner = AlignPair);

/// What an alignment would do.
struct AlignVolumesPlan {
  std::vector<std::pair<int, int>> pairs;        ///< that are tried first
  int pairsFinishedBefore = 0;                   ///< those of them that are in the file
  int timesPrepared = 0;                         ///< how often volumes would be made for the others
  double bytesPerVolume = 0.0, bytesOfAll = 0.0; ///< of what is made
  double budgetBytes = 0.0;
  double secondsPerPair = 0.0, secondsPerVolume = 0.0; ///< of a few that were tried
  double seconds = 0.0; ///< of all of them; pairs that are tried again, and the pose graph, come on top
};

/// Aligns only a few of the pairs, to see how long they take on one rank. \throws as AlignVolumes
AlignVolumesPlan PlanAlignment(const std::vector<VolumeOnDemand>& volumes, int fixed,
                               const AlignVolumesParameters& parameters = {}, const Progress& progress = {},
                               const PairAligner& aligner = AlignPair);

} // namespace echorama
