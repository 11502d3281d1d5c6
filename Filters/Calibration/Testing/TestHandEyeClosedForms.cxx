// SPDX-License-Identifier: BSD-3-Clause
// Each closed form against exact data, where it must be exact, and against noise, where it must be near the Cramer-Rao bound.
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/Benchmarks/HandEyeContestants.h"
#include "Filters/Calibration/HandEyeClosedForms.h"
#include "Filters/Calibration/Testing/HandEyeSimulation.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// How far two poses carry points of a ball of 100 mm from each other, at most.
double Distance(const Pose& a, const Pose& b)
{
  return (a.translation() - b.translation()).norm() + 100.0 * RotationAngle(a.inverse() * b);
}

// Exact pairs: the volume turned by the rotation vectors given.
HandEyeSimulation Exact(const std::vector<Eigen::Vector3d>& turns, const Pose& C)
{
  Random random(7);
  HandEyeSimulation simulation;
  simulation.truth.volumeToSensor = C;
  simulation.truth.worldToTracker.linear() = ExpRotation({0.4, -1.1, 0.6});
  simulation.truth.worldToTracker.translation() << 120.0, -40.0, 300.0;
  for (const Eigen::Vector3d& turn : turns) {
    HandEyePair pair;
    pair.volumeToWorld.linear() = ExpRotation({0.1, 0.2, -0.3}) * ExpRotation(turn);
    pair.volumeToWorld.translation() = 40.0 * random.Direction();
    pair.sensorToTracker = simulation.truth.worldToTracker * pair.volumeToWorld * C.inverse();
    simulation.pairs.push_back(pair);
  }
  return simulation;
}

Pose SomeC()
{
  Pose C = Pose::Identity();
  C.linear() = ExpRotation({0.5, -0.8, 1.2});
  C.translation() << 30.0, -20.0, 140.0;
  return C;
}

class ClosedForm : public testing::TestWithParam<HandEyeClosedForm> {};

TEST_P(ClosedForm, IsExactOnExactData)
{
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const double degrees : {10.0, 60.0, 170.0}) {
      HandEyeScenario scenario;
      scenario.poses = 6;
      scenario.degrees = degrees;
      scenario.seed = seed;
      const HandEyeSimulation simulation = SimulateHandEye(scenario);
      const HandEyeSolution solution = GetParam().solve(simulation.exactPairs);
      EXPECT_LT(Distance(solution.volumeToSensor, simulation.truth.volumeToSensor), 1e-5) << seed << " " << degrees;
      EXPECT_LT(Distance(solution.worldToTracker, simulation.truth.worldToTracker), 1e-4) << seed << " " << degrees;
    }
}

TEST_P(ClosedForm, IsExactForHalfTurns)
{
  // Half turns from the first to others, and one that is none: half turns about x, y and z alone commute and leave four answers.
  const double pi = EIGEN_PI;
  for (const Pose& C : {SomeC(), Pose(Pose::Identity())}) {
    const HandEyeSimulation simulation = Exact({{0.0, 0.0, 0.0}, {pi, 0.0, 0.0}, {0.0, pi, 0.0}, {0.4, 0.5, -0.3}}, C);
    EXPECT_LT(Distance(GetParam().solve(simulation.pairs).volumeToSensor, C), 1e-5);
  }
  const HandEyeSimulation near =
      Exact({{0.0, 0.0, 0.0}, {3.13, 0.1, 0.0}, {0.0, 3.14, -0.1}, {0.1, 0.0, 3.12}, {1.0, 0.3, 0.2}}, SomeC());
  EXPECT_LT(Distance(GetParam().solve(near.pairs).volumeToSensor, SomeC()), 1e-5);
}

TEST_P(ClosedForm, FindsCalibrationsThatAreHalfTurns)
{
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.6, 0.8), Eigen::Vector3d(0.0, 0.0, 1.0)}) {
    Pose C = SomeC();
    C.linear() = ExpRotation(EIGEN_PI * axis);
    const HandEyeSimulation simulation = Exact({{0.0, 0.0, 0.0}, {0.5, 0.1, 0.0}, {0.0, -0.7, 0.3}, {0.2, 0.2, 0.9}}, C);
    EXPECT_LT(Distance(GetParam().solve(simulation.pairs).volumeToSensor, C), 1e-5);
  }
}

TEST_P(ClosedForm, IsNearTheBoundWithNoise)
{
  double error = 0.0, bound = 0.0;
  HandEyeScenario scenario;
  for (scenario.seed = 1; scenario.seed <= 100; ++scenario.seed) {
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeSolution solution = GetParam().solve(simulation.pairs);
    error += (solution.volumeToSensor * scenario.target - simulation.truth.volumeToSensor * scenario.target).squaredNorm();
    bound += HandEyeBound(scenario, simulation).trace();
  }
  EXPECT_LT(std::sqrt(error / bound), 1.2);
  EXPECT_GT(std::sqrt(error / bound), 0.85);
}

TEST_P(ClosedForm, IsNotFooledByNoiseNearHalfTurns)
{
  // Half of the poses are turned by about 180 degrees from the other half, so that noise flips axes.
  double error = 0.0, bound = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    HandEyeScenario scenario;
    scenario.poses = 10;
    scenario.seed = seed;
    HandEyeSimulation simulation = SimulateHandEye(scenario);
    for (std::size_t i = 0; i < simulation.pairs.size(); i += 2) {
      const Pose half = MotionAbout({0.0, 0.0, 0.0}, {0.0, EIGEN_PI, 0.0}, {0.0, 0.0, 0.0});
      const Pose& C = simulation.truth.volumeToSensor;
      for (auto* pairs : {&simulation.pairs, &simulation.exactPairs}) {
        HandEyePair& pair = (*pairs)[i];
        pair.volumeToWorld = pair.volumeToWorld * half;
        pair.sensorToTracker = pair.sensorToTracker * C * half * C.inverse();
      }
    }
    const HandEyeSolution solution = GetParam().solve(simulation.pairs);
    error += (solution.volumeToSensor * scenario.target - simulation.truth.volumeToSensor * scenario.target).squaredNorm();
    bound += HandEyeBound(scenario, simulation).trace();
  }
  EXPECT_LT(std::sqrt(error / bound), 1.6);
}

INSTANTIATE_TEST_SUITE_P(All, ClosedForm, testing::ValuesIn(HandEyeClosedForms()), [](const auto& one) {
  std::string name = one.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(HandEyeClosedForms, KroneckerIsExactAlsoForHalfTurns)
{
  const double pi = EIGEN_PI;
  const HandEyeSimulation simulation = Exact({{0.0, 0.0, 0.0}, {pi, 0.0, 0.0}, {0.0, pi, 0.0}, {0.3, 0.0, 0.1}}, SomeC());
  const HandEyeSolution solution = SolveHandEyeByKronecker(simulation.pairs);
  EXPECT_LT(Distance(solution.volumeToSensor, SomeC()), 1e-6);
  EXPECT_LT(Distance(solution.worldToTracker, simulation.truth.worldToTracker), 1e-6);
}

TEST(HandEyeClosedForms, AllPairsOfScansAreMotions)
{
  HandEyeScenario scenario;
  scenario.poses = 7;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const std::vector<HandEyeMotion> motions = HandEyeMotions(simulation.exactPairs);
  ASSERT_EQ(motions.size(), 21u);
  for (const HandEyeMotion& motion : motions) // A C = C B
    EXPECT_LT(Distance(motion.sensor * simulation.truth.volumeToSensor, simulation.truth.volumeToSensor * motion.volume), 1e-8);
}

TEST(HandEyeClosedForms, Refuse)
{
  for (const HandEyeClosedForm& form : HandEyeClosedForms())
    EXPECT_THROW(form.solve({HandEyePair()}), Error) << form.name;
  EXPECT_THROW(SolveHandEyeByKronecker({}), Error);
}

} // namespace
