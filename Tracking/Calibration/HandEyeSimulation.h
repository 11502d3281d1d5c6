// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Calibration/HandEye.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// A calibration session with a known truth.
struct HandEyeScenario {
  int poses = 20;
  double degrees = 60.0;              ///< turns from the middle pose: about directions drawn at random, by up to this
  double travelMm = 40.0;             ///< the target moves by up to this along each axis of the world
  double leverMm = 150.0;             ///< from the sensor to the target
  PoseNoise sensorNoise, volumeNoise; ///< as HandEyeParameters
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  int outliers = 0; ///< so many of the scans have an alignment that is wrong by 10 to 40 degrees and 20 to 60 mm
  std::uint64_t seed = 1;
};

struct HandEyeSimulation {
  HandEyeSolution truth;
  std::vector<HandEyePair> pairs;      ///< as measured
  std::vector<HandEyePair> exactPairs; ///< the same without noise and outliers
  std::vector<char> isOutlier;
};

HandEyeSimulation SimulateHandEye(const HandEyeScenario& scenario);

/// The Cramer-Rao bound on the covariance of C target, mm^2: no unbiased estimate is better. It holds for the noise of the
/// scenario on all scans that are no outliers.
Eigen::Matrix3d HandEyeBound(const HandEyeScenario& scenario, const HandEyeSimulation& simulation);

} // namespace echorama
