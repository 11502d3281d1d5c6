// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/HandEyeModel.h"
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
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< from the target: about where volumes are turned, and alignments err
  int outliers = 0; ///< so many of the scans have an alignment that is wrong by 10 to 40 degrees and 20 to 60 mm
  std::uint64_t seed = 1;

  HandEyeNoise Noise() const { return {sensorNoise, volumeNoise, target + centre}; }
};

/// A camera near the sensor that looks at a board 1.3 m away, and errs by turning about it by 0.05 degrees. All noise is smaller
/// than HandEyeParameters state, and in another ratio.
inline HandEyeScenario BoardScenario(int poses, std::uint64_t seed)
{
  HandEyeScenario scenario;
  scenario.poses = poses;
  scenario.leverMm = 100.0;
  scenario.centre << 0.0, 0.0, 1300.0;
  scenario.sensorNoise = {0.02, 0.1};
  scenario.volumeNoise = {0.05, 0.1};
  scenario.seed = seed;
  return scenario;
}

struct HandEyeSimulation {
  HandEyeSolution truth;
  std::vector<HandEyePair> pairs;      ///< as measured
  std::vector<HandEyePair> exactPairs; ///< the same without noise and outliers
  std::vector<char> isOutlier;
};

// In any direction, of a length in [low, high]. In two statements: compilers may call the functions of one in any order.
inline Eigen::Vector3d Someway(Random& random, double low, double high)
{
  const Eigen::Vector3d direction = random.Direction();
  return direction * random.Uniform(low, high);
}

inline Twist NoiseTwist(const PoseNoise& noise, Random& random)
{
  Twist twist;
  for (int i = 0; i < 6; ++i)
    twist[i] = random.Normal() * (i < 3 ? noise.mm : noise.degrees * RadiansPerDegree);
  return twist;
}

inline Pose RandomPose(Random& random)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(Someway(random, 0.0, 3.0));
  pose.translation() = Someway(random, 100.0, 300.0);
  return pose;
}

/// True poses come from turning the volume about its target and moving it, which is what an examiner does with a probe over a
/// rig; the sensor follows by S = O M C^-1. Noise is drawn as the model of HandEyeModel.h says, not linearised.
inline HandEyeSimulation SimulateHandEye(const HandEyeScenario& scenario)
{
  Random random(scenario.seed);
  HandEyeSimulation simulation;
  Pose &C = simulation.truth.volumeToSensor, &O = simulation.truth.worldToTracker;
  C.linear() = ExpRotation(Someway(random, 0.0, 3.0));
  C.translation() = random.Direction() * scenario.leverMm - C.linear() * scenario.target;
  O = RandomPose(random);
  const Pose middle = RandomPose(random); // of the volume in the world
  const Eigen::Vector3d about = scenario.target + scenario.centre;
  const Eigen::Translation3d toCentre(about), fromCentre(-about);
  for (int i = 0; i < scenario.poses; ++i) {
    HandEyePair exact;
    Pose turn = Pose::Identity();
    turn.linear() = ExpRotation(Someway(random, 0.0, scenario.degrees * RadiansPerDegree));
    for (int axis = 0; axis < 3; ++axis)
      turn.translation()[axis] = random.Uniform(-scenario.travelMm, scenario.travelMm);
    exact.volumeToWorld = middle * turn * fromCentre;
    exact.sensorToTracker = O * exact.volumeToWorld * C.inverse();
    HandEyePair measured = exact;
    measured.sensorToTracker = exact.sensorToTracker * Exp(NoiseTwist(scenario.sensorNoise, random));
    measured.volumeToWorld = exact.volumeToWorld * toCentre * Exp(NoiseTwist(scenario.volumeNoise, random)) * fromCentre;
    const bool isOutlier = i < scenario.outliers;
    if (isOutlier) {
      const Eigen::Vector3d turned = Someway(random, 10.0, 40.0) * RadiansPerDegree, moved = Someway(random, 20.0, 60.0);
      measured.volumeToWorld = measured.volumeToWorld * MotionAbout(scenario.target, turned, moved);
    }
    simulation.isOutlier.push_back(isOutlier ? 1 : 0);
    simulation.exactPairs.push_back(exact);
    simulation.pairs.push_back(measured);
  }
  return simulation;
}

/// The Cramer-Rao bound on the covariance of C target, mm^2: no unbiased estimate is better. It holds for the noise of the
/// scenario on all scans that are no outliers.
inline Eigen::Matrix3d HandEyeBound(const HandEyeScenario& scenario, const HandEyeSimulation& simulation)
{
  const HandEyeModel model(simulation.exactPairs, scenario.Noise(), scenario.target);
  std::vector<char> use;
  for (const char isOutlier : simulation.isOutlier)
    use.push_back(isOutlier ? 0 : 1);
  const HandEyeMatrix covariance = model.CovarianceOfStep(simulation.truth, use);
  const Eigen::Matrix3d& R = simulation.truth.volumeToSensor.linear();
  return R * covariance.topLeftCorner<3, 3>() * R.transpose();
}

} // namespace echorama
