// SPDX-License-Identifier: BSD-3-Clause
// The statistics: derivatives by differences, covariances by drawing, radii by closed forms.
#include "Core/Base/Random.h"
#include "Filters/Calibration/ConfidenceRadius.h"
#include "Filters/Calibration/HandEyeAdvice.h"
#include "Filters/Calibration/HandEyeModel.h"
#include "Filters/Calibration/HandEyeSearch.h"
#include "Filters/Calibration/Testing/HandEyeSimulation.h"
#include <cmath>
#include <Eigen/Cholesky>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

HandEyeScenario SomeScenario()
{
  HandEyeScenario scenario;
  scenario.poses = 6;
  scenario.target << 10.0, -20.0, 60.0;
  scenario.sensorNoise = {0.4, 0.5};
  scenario.volumeNoise = {0.3, 0.9};
  return scenario;
}

HandEyeModel ModelOf(const HandEyeScenario& scenario, const std::vector<HandEyePair>& pairs)
{
  return HandEyeModel(pairs, scenario.Noise(), scenario.target);
}

TEST(HandEyeModel, JacobianIsTheDerivative)
{
  const HandEyeScenario scenario = SomeScenario();
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeModel model = ModelOf(scenario, simulation.pairs);
  HandEyeStep away; // residuals of some mm and degrees
  away << 3.0, -2.0, 1.0, 0.02, -0.03, 0.01, -1.0, 4.0, 2.0, 0.01, 0.02, -0.02;
  const HandEyeSolution solution = model.Moved(simulation.truth, away);
  for (int scan = 0; scan < model.Count(); ++scan) {
    const Twist residual = model.Residual(scan, solution);
    const Eigen::Matrix<double, 6, 12> jacobian = model.Jacobian(scan, residual);
    for (int k = 0; k < 12; ++k) {
      const double h = 1e-5;
      const HandEyeStep step = h * HandEyeStep::Unit(k);
      const Twist slope =
          (model.Residual(scan, model.Moved(solution, step)) - model.Residual(scan, model.Moved(solution, -step))) / (2.0 * h);
      const double size = std::max(1.0, slope.cwiseAbs().maxCoeff());
      EXPECT_LT((slope - jacobian.col(k)).cwiseAbs().maxCoeff() / size, 1e-4) << scan << " " << k;
    }
  }
}

TEST(HandEyeModel, CovarianceIsThatOfResidualsAtTheTruth)
{
  HandEyeScenario scenario = SomeScenario();
  scenario.poses = 20000;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeModel model = ModelOf(scenario, simulation.pairs);
  Eigen::Matrix<double, 6, 6> drawn = Eigen::Matrix<double, 6, 6>::Zero();
  for (int scan = 0; scan < model.Count(); ++scan) {
    const Twist residual = model.Residual(scan, simulation.truth);
    drawn += residual * residual.transpose() / model.Count();
  }
  const Eigen::Matrix<double, 6, 6> stated = model.Covariance(simulation.truth.volumeToSensor);
  const Eigen::Matrix<double, 6, 1> size = stated.diagonal().cwiseSqrt();
  const Eigen::Matrix<double, 6, 6> difference = (drawn - stated).cwiseQuotient(size * size.transpose());
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.04);
  // The lever makes turns and shifts go together: without that the test above would say little.
  const Eigen::Matrix<double, 6, 6> correlation = stated.cwiseQuotient(size * size.transpose());
  EXPECT_GT((correlation.topRightCorner<3, 3>().cwiseAbs().maxCoeff()), 0.4);
}

TEST(HandEyeModel, CovarianceOfPosesIsThatOfTheTwistsBehindThem)
{
  const HandEyeScenario scenario = SomeScenario();
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeModel model = ModelOf(scenario, simulation.pairs);
  // A step's poses, as twists behind the truth: linear, so its 12 unit steps tell all.
  HandEyeMatrix map;
  for (int k = 0; k < 12; ++k) {
    const double h = 1e-6;
    const HandEyeSolution moved = model.Moved(simulation.truth, h * HandEyeStep::Unit(k));
    map.col(k) << Log(simulation.truth.volumeToSensor.inverse() * moved.volumeToSensor) / h,
        Log(simulation.truth.worldToTracker.inverse() * moved.worldToTracker) / h;
  }
  const HandEyeMatrix covariance = model.CovarianceOfStep(simulation.truth, std::vector<char>(6, 1));
  const HandEyeMatrix expected = map * covariance * map.transpose(), stated = model.CovarianceOfPoses(covariance);
  const HandEyeStep size = expected.diagonal().cwiseSqrt();
  EXPECT_LT((stated - expected).cwiseQuotient(size * size.transpose()).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(HandEyeModel, RefineFindsTheTruthFromAfar)
{
  const HandEyeScenario scenario = SomeScenario();
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeModel model = ModelOf(scenario, simulation.exactPairs);
  HandEyeStep away;
  away << 40.0, -30.0, 50.0, 0.3, -0.4, 0.2, 20.0, 60.0, -30.0, 0.3, 0.2, -0.3;
  const HandEyeModel::Fit fit = model.Refine(model.Moved(simulation.truth, away), std::vector<char>(6, 1));
  EXPECT_LT(Log(fit.solution.volumeToSensor.inverse() * simulation.truth.volumeToSensor).norm(), 1e-6);
  EXPECT_LT(fit.cost, 1e-10);
}

TEST(HandEyeModel, PredictedChiSquareHasSixDegreesOfFreedom)
{
  // In the mean over trials: 6 for scans in the fit and for scans outside it, though there are few.
  double inside = 0.0, outside = 0.0;
  const int trials = 300;
  HandEyeScenario scenario = SomeScenario();
  for (int trial = 0; trial < trials; ++trial) {
    scenario.seed = 100 + static_cast<std::uint64_t>(trial);
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeModel model = ModelOf(scenario, simulation.pairs);
    std::vector<char> use(6, 1);
    use[5] = 0;
    const HandEyeModel::Fit fit = model.Refine(simulation.truth, use);
    const HandEyeMatrix covariance = model.CovarianceOfStep(fit.solution, use);
    inside += model.PredictedChiSquare(2, fit.solution, covariance, true) / trials;
    outside += model.PredictedChiSquare(5, fit.solution, covariance, false) / trials;
  }
  EXPECT_NEAR(inside, 6.0, 0.8);
  EXPECT_NEAR(outside, 6.0, 0.8);
}

TEST(HandEyeModel, SpreadOfTurns)
{
  const auto posesOf = [](const std::vector<Eigen::Vector3d>& turns) {
    std::vector<Pose> poses;
    for (const Eigen::Vector3d& turn : turns)
      poses.push_back(MotionAbout({5.0, 6.0, 7.0}, turn, {1.0, 2.0, 3.0}));
    return poses;
  };
  // Small turns by +-a about x and +-b about y: variances a^2 / 2, b^2 / 2 and 0; each spread sums two of the three.
  const double a = 0.02, b = 0.01;
  const HandEyeSpread spread = SpreadOf(posesOf({{a, 0, 0}, {-a, 0, 0}, {0, b, 0}, {0, -b, 0}}));
  EXPECT_NEAR(spread.turns[0], b / std::sqrt(2.0), 1e-5);
  EXPECT_NEAR(spread.turns[1], a / std::sqrt(2.0), 1e-5);
  EXPECT_NEAR(spread.turns[2], std::sqrt((a * a + b * b) / 2.0), 1e-5);
  const HandEyeSpread parallel = SpreadOf(posesOf({{0, 0, 0}, {0, 0.6, 0.8}, {0, -1.2, -1.6}}));
  EXPECT_LT(parallel.turns[0], 1e-7);
  EXPECT_NEAR(std::abs(parallel.axis.dot(Eigen::Vector3d(0, 0.6, 0.8))), 1.0, 1e-9);
}

TEST(ConfidenceRadius, ClosedForms)
{
  // Quantiles of |z| for one, two and three normal numbers.
  EXPECT_NEAR(ConfidenceRadius(Eigen::Vector3d(0.0, 9.0, 0.0).asDiagonal()), 3.0 * 1.959964, 0.02);
  EXPECT_NEAR(ConfidenceRadius(Eigen::Vector3d(4.0, 0.0, 4.0).asDiagonal()), 2.0 * 2.447747, 0.02);
  EXPECT_NEAR(ConfidenceRadius(Eigen::Matrix3d::Identity()), 2.795483, 1e-5);
  EXPECT_NEAR(ConfidenceRadius(Eigen::Matrix3d::Identity(), 0, 0.5), 1.538172, 1e-5);
  // sqrt(3 F) for three numbers over a scale with 18, 36 and 7 degrees of freedom: F(3, n) at 95% is 3.1599, 2.8663, 4.3468.
  EXPECT_NEAR(ConfidenceRadius(Eigen::Matrix3d::Identity(), 18), std::sqrt(3.0 * 3.15991), 1e-4);
  EXPECT_NEAR(ConfidenceRadius(Eigen::Matrix3d::Identity(), 36), std::sqrt(3.0 * 2.86627), 1e-4);
  EXPECT_NEAR(ConfidenceRadius(Eigen::Matrix3d::Identity(), 7), std::sqrt(3.0 * 4.34683), 1e-4);
  EXPECT_EQ(ConfidenceRadius(Eigen::Matrix3d::Zero()), 0.0);
}

TEST(ConfidenceRadius, HoldsWhatItSays)
{
  Eigen::Matrix3d shape;
  shape << 3.0, 0.0, 0.0, 1.0, 1.0, 0.0, -0.5, 0.3, 0.4;
  for (const int degrees : {0, 6}) {
    const double radius = ConfidenceRadius(shape * shape.transpose(), degrees);
    Random random(3);
    const int draws = 100000;
    int inside = 0;
    for (int i = 0; i < draws; ++i) {
      double squares = 0.0;
      for (int k = 0; k < degrees; ++k)
        squares += std::pow(random.Normal(), 2);
      const double scale = degrees > 0 ? std::sqrt(squares / degrees) : 1.0;
      inside += (shape * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal())).norm() <= radius * scale ? 1 : 0;
    }
    EXPECT_NEAR(static_cast<double>(inside) / draws, 0.95, 0.004) << degrees;
  }
}

} // namespace
