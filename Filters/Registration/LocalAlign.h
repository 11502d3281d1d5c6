// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "LandmarkTerm.h"
#include "PlacedVolume.h"
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// The metrics by name, the default first: "local-ncc", "ncc", "mad", "mind-ssc", "lc2".
std::vector<std::string> MetricNames();

/// What a metric sees of one volume at each of its resolutions. It owns all it needs: the pyramid that it was built from
/// may go. Built once per volume and shared by all of the volume's pairs.
class MetricPyramid;

/// Levels with fewer than 200 real voxels are left out, except the finest; for mind-ssc also those with more than 2^22 voxels.
/// \param metric one of MetricNames()
/// \throws Error(InvalidParameter) for a metric of another name; Error(BadInput) when the volume is constant, is not
/// three-dimensional, has fewer than 100 real voxels, or when its reliability has other dimensions than itself;
/// Error(TooLarge) beyond 2^29 voxels; Error(Cancelled).
std::shared_ptr<const MetricPyramid> BuildMetricPyramid(const PlacedVolume& volume, const std::string& metric,
                                                        const Progress& progress = {});

/// How many random points of a volume can be compared.
inline constexpr ParameterRange ComparedPoints{100, 1e7};

/// How the local alignment goes. The defaults serve volumes within some 10 degrees and 15 voxels of where they belong.
struct LocalAlignParameters {
  double coarsestMm = 0.0, finestMm = 0.0;
  int iterations = 30;
  int points = 200000;
  double minimumOverlap = 0.05;
  double stopVoxels = 0.002;
  int part = 0;
  std::uint64_t seed = 1;      ///< of the points
  bool withInformation = true; ///< whether the covariance is measured, which costs as much as a dozen steps on the last level
  LandmarkTerm landmarks;      ///< of the same fixedToWorld; none: the images decide alone
};

ParameterList Describe(LocalAlignParameters& p);

/// Of (translation in mm, rotation vector in radians).
using Information = Eigen::Matrix<double, 6, 6>;

struct LocalAlignResult {
  Pose volumeToWorld = Pose::Identity(); ///< of the moving volume; the fixed one stays where it was placed
  double similarity = 0.0;               ///< mean over the overlap: 1 identical, 0 chance, for every metric; <= 1
  double overlap = 0.0;                  ///< share of the smaller volume (by weight) that lies in the other, [0, 1]
  double score = 0.0;   ///< similarity summed over the overlap, by weight, over the weight of the smaller volume; symmetric
  double voxelMm = 0.0; ///< of the last level: the geometric mean of the spacing, the larger of both volumes
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< world, mm: the centroid of the overlap, about which the twist acts
  /// Inverse covariance of the twist that acts as MotionAbout(centre, rotation, translation) * volumeToWorld. Zero where
  /// nothing is known (no overlap) or nobody asked. Speckle is correlated, so it counts independent blocks of tissue, not voxels.
  /// With what the landmarks tell.
  Information information = Information::Zero();
  double independentVoxels = 0.0; ///< how many voxels with independent residuals would tell as much
  bool converged = false;         ///< the last step of the last level was below 0.002 voxels, and the volumes overlap
};

/// Aligns the moving volume with the fixed one from \a movingToWorld, coarse to fine, by Levenberg-Marquardt over rigid
/// motions about the centroid of the overlap. Finds its way home from about 10 degrees and 15 voxels of the finest level.
///
/// The measure is symmetric: points of the fixed volume are read in the moving one and the reverse. Swapped volumes give the
/// inverse motion to a small part of a voxel. The result does not depend on the number of threads. Volumes that do not overlap
/// at the start stay where they are: overlap 0, not converged.
/// \throws Error(InvalidParameter); Error(BadInput) for pyramids of different metrics; Error(Cancelled).
LocalAlignResult LocalAlign(const MetricPyramid& fixed, const Pose& fixedToWorld, const MetricPyramid& moving,
                            const Pose& movingToWorld, const LocalAlignParameters& parameters = {},
                            const Progress& progress = {});

/// The measure where the volumes lie, on the level that finestMm names; nothing moves. converged tells whether they overlap.
/// \throws as LocalAlign.
LocalAlignResult Evaluate(const MetricPyramid& fixed, const Pose& fixedToWorld, const MetricPyramid& moving,
                          const Pose& movingToWorld, const LocalAlignParameters& parameters = {});

} // namespace echorama
