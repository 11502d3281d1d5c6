// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/RigidTransform.h"
#include <string>
#include <vector>

namespace echorama {

/// One scan: where the sensor was, and where the volume belongs. S C = O M (dissertation eq. 4.1).
struct HandEyePair {
  Pose sensorToTracker = Pose::Identity(); ///< S, mm, by the tracker
  Pose volumeToWorld = Pose::Identity();   ///< M, mm, by the aligner or a person
  std::string name;                        ///< of the scan, for messages; empty: its number, from 1
};

/// C and O.
struct HandEyeSolution {
  Pose volumeToSensor = Pose::Identity(); ///< C, the calibration: of the volume as it was acquired, fixed to the probe
  Pose worldToTracker = Pose::Identity(); ///< O
};

/// The standard deviation of a pose's noise, per axis.
struct PoseNoise {
  double degrees = 0.25, mm = 0.7;
};

/// The noise of both sides.
struct HandEyeNoise {
  PoseNoise sensor;                                 ///< of S, in the sensor's own axes
  PoseNoise volume;                                 ///< of M, in the volume's axes about the centre
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< in the volume's frame, mm
};

struct HandEyeParameters {
  PoseNoise sensorNoise; ///< of S, in the sensor's own axes
  PoseNoise volumeNoise; ///< of M, in the volume's axes about \a target
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  bool rejectOutliers = true;
  bool estimateNoise = true;
  std::uint64_t seed = 1;

  HandEyeNoise Noise() const { return {sensorNoise, volumeNoise, target}; }
  HandEyeParameters With(const HandEyeNoise& noise) const; ///< but for its centre
  void Check() const; ///< Throws Error(InvalidParameter): ranges, and that not both sides are without noise.
};
ParameterList Describe(HandEyeParameters& p);

/// How one scan fits.
struct HandEyeResidual {
  std::string name;
  bool inlier = true;
  double mm = 0.0;      ///< distance of the target by the tracker and by the alignment
  double degrees = 0.0; ///< angle between the two
  std::string reason;   ///< why it is an outlier, empty for inliers
};

/// A pose that would help most.
struct HandEyeAdvice {
  std::string text;                                ///< a sentence
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX(); ///< in the volume's frame, to turn about
  double degrees = 0.0;                            ///< from the mean of the poses there are
  double radiusMm = 0.0;                           ///< of the 95% region with it
};

struct HandEyeResult {
  HandEyeSolution solution;
  int inliers = 0;
  std::vector<HandEyeResidual> residuals; ///< one per pair, in their order
  /// Of the twist (mm, radians) by which the estimate of C may be wrong: C_true = C Exp(twist), and likewise O.
  Eigen::Matrix<double, 12, 12> covariance = Eigen::Matrix<double, 12, 12>::Zero();
  /// Of the target as the calibration places it in the sensor's frame: C target. mm^2.
  Eigen::Matrix3d targetCovariance = Eigen::Matrix3d::Zero();
  double targetRmsMm = 0.0;             ///< root of its trace
  double targetRadius95Mm = 0.0;        ///< of the sphere that holds the true place with 95%, computed from all three axes
  double rmsMm = 0.0, rmsDegrees = 0.0; ///< of the inliers' residuals
  bool noiseEstimated = false;          ///< whether it was asked for, and the inliers are enough
  bool ratioEstimated = false;          ///< whether the ratio of its parts was, too,
  bool centreEstimated = false;         ///< and where alignments turn
  HandEyeNoise noise;                   ///< as stated or, where its ratio was estimated, as estimated
  double noiseScale = 1.0;              ///< what it was multiplied with, where its size alone was estimated; else 1
  std::vector<HandEyeAdvice> advice;    ///< the best first
  std::vector<std::string> notes;       ///< what was noticed: units, conventions, outliers; sentences for people
};

/// From scans to the calibration.
///
/// \throws Error(InvalidParameter) as Check(); Error(BadInput) that names the pair when a pose is not finite or not rigid;
/// Error(NotPossible) with the reason when the answer is not determined: fewer than three scans, turns that are too small
/// or all about parallel axes, identical poses, pure translation; when the sides disagree in a way that units (metres against mm)
/// or an exchanged convention (S or M inverted) explain, the message says so. Where scans disagree, four must agree, and half of
/// all: three do by chance too easily, and for the same reason three scans with a side inverted are not found out.
/// Error(Cancelled). Cost: 2.5 ms for 20 scans with the noise as stated; linear in their number, but for one pass over all pairs
/// that looks for repeats.
HandEyeResult CalibrateHandEye(const std::vector<HandEyePair>& pairs, const HandEyeParameters& parameters = {},
                               const Progress& progress = {});

} // namespace echorama
