// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEyeModel.h"
#include <vector>

namespace echorama {

/// What many scans, some of them wrong, agree on.
struct HandEyeConsensus {
  HandEyeModel::Fit fit;      ///< maximum likelihood of the inliers
  std::vector<char> inlier;   ///< one per scan
  std::vector<double> square; ///< chi^2 of every scan by PredictedChiSquare, six degrees of freedom
  double scale = 1.0;         ///< what the noise is multiplied with by the median residual; robust, and rough for few scans
};

/// Finds the solution and the scans that agree with it. \a pairs: at least three, all different. \a rejectOutliers false: all are
/// inliers. A scan is an outlier when its chi^2 is one in a thousand by chance, after the noise was scaled to the
/// median residual (never down, unless \a estimateNoise). At least three stay.
HandEyeConsensus FindHandEyeConsensus(const std::vector<HandEyePair>& pairs, const HandEyeModel& model, bool rejectOutliers,
                                      const Eigen::Vector3d& target, bool estimateNoise, std::uint64_t seed,
                                      const Progress& progress = {});

/// The same from a solution that is near, without a search: for a model whose noise has changed. \a scale: as above, of the
/// start.
HandEyeConsensus HandEyeConsensusNear(const HandEyeSolution& start, double scale, const HandEyeModel& model, bool rejectOutliers,
                                      bool estimateNoise, const Progress& progress = {});

/// How far the poses of one side are turned from each other: the root of 1 - s^2 for the singular values s of their mean
/// rotation, radians, least first. The least is what the calibration lives on: of small turns, the root mean square over
/// the two lesser axes; 0 when all turns have one axis, which is \a axis then, in the frame of the sensor or the volume.
struct HandEyeSpread {
  Eigen::Vector3d turns = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
};
HandEyeSpread SpreadOf(const std::vector<Pose>& poses);

/// Axes of the volume that every turn among the scans with use[scan] != 0 keeps or reverses, root mean square to within ten times
/// the model's noise, \a scale times larger, and two degrees, but 20 degrees at most. Turns commute with the half turn about such
/// an axis, so that the calibration may be turned by it: about z, when all turns are about z or half turns about axes across it;
/// about x, y and z, when all are half turns about these. None for turns in general.
std::vector<Eigen::Vector3d> HandEyeRivalAxes(const std::vector<HandEyePair>& pairs, const std::vector<char>& use,
                                              const HandEyeModel& model, const HandEyeSolution& solution, double scale);

/// The solution turned by half a turn about an axis of the volume through \a target, with O by the first scan that is used.
HandEyeSolution HandEyeRival(const std::vector<HandEyePair>& pairs, const std::vector<char>& use, const HandEyeSolution& solution,
                             const Eigen::Vector3d& axis, const Eigen::Vector3d& target);

} // namespace echorama
