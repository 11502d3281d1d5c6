// SPDX-License-Identifier: BSD-3-Clause
// The whole calibration: as good as the Cramer-Rao bound allows, honest about it, and hard to fool.
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/Benchmarks/HandEyeContestants.h"
#include "Filters/Calibration/HandEyeModel.h"
#include "Filters/Calibration/Testing/HandEyeRecording.h"
#include "Filters/Calibration/Testing/HandEyeSimulation.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Cholesky>
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;

HandEyeParameters ParametersOf(const HandEyeScenario& scenario)
{
  HandEyeParameters parameters;
  parameters.sensorNoise = scenario.sensorNoise;
  parameters.volumeNoise = scenario.volumeNoise;
  parameters.target = scenario.target;
  parameters.estimateNoise = false; // it is known
  return parameters;
}

// The message of the error that a call throws; its kind must be as given.
template <class Function>
std::string Complaint(Error::Kind kind, const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.GetKind()), static_cast<int>(kind)) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

std::string Refusal(const std::vector<HandEyePair>& pairs, const HandEyeParameters& parameters = {})
{
  return Complaint(Error::Kind::NotPossible, [&] { CalibrateHandEye(pairs, parameters); });
}

bool Says(const std::string& text, const std::string& words)
{
  return text.find(words) != std::string::npos;
}

bool Says(const std::vector<std::string>& notes, const std::string& words)
{
  return std::any_of(notes.begin(), notes.end(), [&](const std::string& note) { return Says(note, words); });
}

// Pairs with noise, of a volume that turns as told.
std::vector<HandEyePair> PairsOf(const std::vector<Eigen::Vector3d>& turns, const std::vector<Eigen::Vector3d>& shifts,
                                 bool withNoise = true)
{
  Random random(11);
  Pose C = Pose::Identity(), O = Pose::Identity();
  C.linear() = ExpRotation({0.5, -0.8, 1.2});
  C.translation() << 30.0, -20.0, 140.0;
  O.linear() = ExpRotation({-0.3, 0.4, 2.0});
  O.translation() << 200.0, 50.0, -70.0;
  const auto noise = [&random, withNoise]() {
    Twist twist = Twist::Zero();
    for (int i = 0; i < 6 && withNoise; ++i)
      twist[i] = random.Normal() * (i < 3 ? 0.7 : 0.25 * RadiansPerDegree);
    return Exp(twist);
  };
  std::vector<HandEyePair> pairs;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    HandEyePair pair;
    const Pose M = MotionAbout({0.0, 0.0, 0.0}, turns[i], shifts[i % shifts.size()]);
    pair.volumeToWorld = M * noise();
    pair.sensorToTracker = O * M * C.inverse() * noise();
    pairs.push_back(pair);
  }
  return pairs;
}

const std::vector<Eigen::Vector3d> NoShift{Eigen::Vector3d::Zero()};

TEST(HandEye, ResidualsAreWhatTheySay)
{
  HandEyeScenario scenario;
  scenario.poses = 10;
  scenario.outliers = 1;
  scenario.target << 0.0, 15.0, 40.0;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeResult result = CalibrateHandEye(simulation.pairs, ParametersOf(scenario));
  double mm = 0.0, degrees = 0.0;
  for (std::size_t i = 0; i < 10; ++i) {
    const HandEyePair& pair = simulation.pairs[i];
    const Pose tracked = result.solution.worldToTracker.inverse() * pair.sensorToTracker * result.solution.volumeToSensor;
    const double off = (tracked * scenario.target - pair.volumeToWorld * scenario.target).norm();
    const double turn = RotationAngle(pair.volumeToWorld.inverse() * tracked) / RadiansPerDegree;
    EXPECT_NEAR(result.residuals[i].mm, off, 1e-6);
    EXPECT_NEAR(result.residuals[i].degrees, turn, 1e-6);
    mm += result.residuals[i].inlier ? off * off : 0.0;
    degrees += result.residuals[i].inlier ? turn * turn : 0.0;
  }
  EXPECT_NEAR(result.rmsMm, std::sqrt(mm / result.inliers), 1e-6);
  EXPECT_NEAR(result.rmsDegrees, std::sqrt(degrees / result.inliers), 1e-6);
}

TEST(HandEye, IsExactOnExactData)
{
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    HandEyeScenario scenario;
    scenario.poses = seed % 2 == 0 ? 4 : 9;
    scenario.degrees = seed % 3 == 0 ? 179.0 : 40.0;
    scenario.seed = seed;
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeResult result = CalibrateHandEye(simulation.exactPairs, ParametersOf(scenario));
    EXPECT_LT(Log(result.solution.volumeToSensor.inverse() * simulation.truth.volumeToSensor).norm(), 1e-5) << seed;
    EXPECT_LT(Log(result.solution.worldToTracker.inverse() * simulation.truth.worldToTracker).norm(), 1e-4) << seed;
    EXPECT_EQ(result.inliers, scenario.poses);
    EXPECT_LT(result.rmsMm, 1e-6);
  }
}

struct Trials {
  double errorOverBound = 0.0, inside = 0.0, mahalanobis = 0.0;
};

Trials RunTrials(HandEyeScenario scenario, int trials)
{
  double error = 0.0, bound = 0.0;
  Trials sum;
  const HandEyeParameters parameters = ParametersOf(scenario);
  for (int trial = 0; trial < trials; ++trial) {
    scenario.seed = 5000 + static_cast<std::uint64_t>(trial);
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeResult result = CalibrateHandEye(simulation.pairs, parameters);
    const double off =
        (result.solution.volumeToSensor * scenario.target - simulation.truth.volumeToSensor * scenario.target).norm();
    error += off * off;
    bound += HandEyeBound(scenario, simulation).trace();
    sum.inside += off <= result.targetRadius95Mm ? 1.0 / trials : 0.0;
    Eigen::Matrix<double, 12, 1> twists;
    twists << Log(result.solution.volumeToSensor.inverse() * simulation.truth.volumeToSensor),
        Log(result.solution.worldToTracker.inverse() * simulation.truth.worldToTracker);
    sum.mahalanobis += twists.dot(result.covariance.ldlt().solve(twists)) / trials;
  }
  sum.errorOverBound = std::sqrt(error / bound);
  return sum;
}

TEST(HandEye, ReachesTheBoundAndStatesIt)
{
  ECHORAMA_SKIP_SANITIZED();
  double inside = 0.0;
  for (const int poses : {5, 8, 20})
    for (const bool sensorOnly : {false, true}) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.target << 0.0, 15.0, 40.0;
      if (sensorOnly)
        scenario.volumeNoise = {0.0, 0.0};
      const Trials trials = RunTrials(scenario, 150);
      EXPECT_LT(trials.errorOverBound, 1.15) << poses; // 1.03 at most, and 0.04 by chance
      EXPECT_GT(trials.errorOverBound, 0.85) << poses;
      inside += trials.inside / 6.0;
      EXPECT_NEAR(trials.mahalanobis, 12.0, 1.8) << poses; // all of the covariance
    }
  EXPECT_NEAR(inside, 0.95, 0.02); // of 900, 0.007 by chance
}

TEST(HandEye, EstimatesTheNoise)
{
  ECHORAMA_SKIP_SANITIZED();
  HandEyeScenario scenario;
  scenario.poses = 8;
  scenario.sensorNoise = {0.5, 1.4}; // twice what is stated below
  scenario.volumeNoise = {0.5, 1.4};
  HandEyeParameters parameters;
  parameters.estimateNoise = true;
  double scale = 0.0;
  int inside = 0;
  const int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    scenario.seed = static_cast<std::uint64_t>(trial);
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeResult result = CalibrateHandEye(simulation.pairs, parameters);
    scale += result.noiseScale / trials;
    inside += (result.solution.volumeToSensor.translation() - simulation.truth.volumeToSensor.translation()).norm() <=
                      result.targetRadius95Mm
                  ? 1
                  : 0;
  }
  EXPECT_NEAR(scale, 2.0, 0.1);
  EXPECT_NEAR(inside / static_cast<double>(trials), 0.95, 0.045);

  // Not asked to, it says so.
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  parameters.estimateNoise = false;
  parameters.sensorNoise = parameters.volumeNoise = {0.15, 0.4};
  const HandEyeResult result = CalibrateHandEye(simulation.pairs, parameters);
  EXPECT_TRUE(Says(result.notes, "times what the noise stated explains"));
  EXPECT_EQ(result.noiseScale, 1.0);
}

TEST(HandEye, NoiseOfFewScansIsThatStated)
{
  HandEyeScenario scenario;
  for (const int outliers : {0, 1}) { // too few from the start, and too few that agree
    scenario.poses = 4 + outliers;
    scenario.outliers = outliers;
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    HandEyeParameters parameters;
    parameters.estimateNoise = false;
    const HandEyeResult stated = CalibrateHandEye(simulation.pairs, parameters);
    parameters.estimateNoise = true;
    const HandEyeResult asked = CalibrateHandEye(simulation.pairs, parameters);
    EXPECT_EQ(asked.inliers, 4);
    EXPECT_FALSE(asked.noiseEstimated);
    EXPECT_EQ(asked.noiseScale, 1.0);
    EXPECT_EQ(asked.targetRadius95Mm, stated.targetRadius95Mm);
    EXPECT_TRUE(Says(asked.notes, "The noise was taken as stated"));
    EXPECT_FALSE(Says(stated.notes, "The noise was taken as stated"));
  }
  // A repeat is no fifth scan.
  scenario.poses = 4;
  scenario.outliers = 0;
  std::vector<HandEyePair> twice = SimulateHandEye(scenario).pairs;
  twice.push_back(twice[1]);
  HandEyeParameters parameters;
  parameters.estimateNoise = true;
  EXPECT_FALSE(CalibrateHandEye(twice, parameters).noiseEstimated);
  scenario.poses = 5;
  EXPECT_TRUE(CalibrateHandEye(SimulateHandEye(scenario).pairs, parameters).noiseEstimated);
}

TEST(HandEye, OutliersAreFoundAndNamed)
{
  ECHORAMA_SKIP_SANITIZED();
  double error = 0.0, clean = 0.0;
  for (const int poses : {5, 10, 20})
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.outliers = poses / 5;
      scenario.seed = seed;
      HandEyeSimulation simulation = SimulateHandEye(scenario);
      for (std::size_t i = 0; i < simulation.pairs.size(); ++i)
        simulation.pairs[i].name = "V" + std::to_string(i);
      const HandEyeResult result = CalibrateHandEye(simulation.pairs, ParametersOf(scenario));
      for (int i = 0; i < scenario.outliers; ++i) {
        const HandEyeResidual& residual = result.residuals[static_cast<std::size_t>(i)];
        EXPECT_FALSE(residual.inlier) << poses << " " << seed;
        EXPECT_EQ(residual.name, "V" + std::to_string(i));
        EXPECT_TRUE(Says(residual.reason, "from where the others place it"));
        EXPECT_TRUE(Says(result.notes, residual.name));
      }
      EXPECT_GE(result.inliers, poses - scenario.outliers - 1);
      const std::vector<HandEyePair> right(simulation.pairs.begin() + scenario.outliers, simulation.pairs.end());
      const Eigen::Vector3d truth = simulation.truth.volumeToSensor.translation();
      if (poses > 5) {
        error += (result.solution.volumeToSensor.translation() - truth).squaredNorm();
        clean += (CalibrateHandEye(right, ParametersOf(scenario)).solution.volumeToSensor.translation() - truth).squaredNorm();
      }
    }
  EXPECT_LT(std::sqrt(error / clean), 1.2);
}

TEST(HandEye, ManyOutliersOfOneMind)
{
  // A third of the scans belong to a rig that was pushed: they agree with each other, but the others are more.
  HandEyeScenario scenario;
  scenario.poses = 21;
  HandEyeSimulation simulation = SimulateHandEye(scenario);
  const Pose push = MotionAbout({0.0, 0.0, 0.0}, {0.1, 0.2, 0.0}, {15.0, -10.0, 5.0});
  for (std::size_t i = 0; i < 7; ++i)
    simulation.pairs[3 * i].volumeToWorld = push * simulation.pairs[3 * i].volumeToWorld;
  const HandEyeResult result = CalibrateHandEye(simulation.pairs, ParametersOf(scenario));
  for (std::size_t i = 0; i < 21; ++i)
    EXPECT_EQ(result.residuals[i].inlier, i % 3 != 0) << i;
}

TEST(HandEye, WithoutRejectionOutliersCount)
{
  HandEyeScenario scenario;
  scenario.poses = 10;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  std::vector<HandEyePair> pairs = simulation.pairs;
  pairs[4].volumeToWorld.translation().x() += 8.0;
  HandEyeParameters parameters = ParametersOf(scenario);
  EXPECT_FALSE(CalibrateHandEye(pairs, parameters).residuals[4].inlier);
  parameters.rejectOutliers = false;
  EXPECT_EQ(CalibrateHandEye(pairs, parameters).inliers, 10);
}

TEST(HandEye, RefusesWhatIsTooLittle)
{
  const std::vector<Eigen::Vector3d> shifts{{0, 0, 0}, {30, 0, 0}, {0, 40, 0}, {0, 10, 50}};
  for (const bool noise : {false, true}) {
    // none, one, two
    EXPECT_TRUE(Says(Refusal({}), "three different scans")) << noise;
    EXPECT_TRUE(Says(Refusal(PairsOf({{0.3, 0, 0}}, shifts, noise)), "there is 1")) << noise;
    EXPECT_TRUE(Says(Refusal(PairsOf({{0.3, 0, 0}, {0, 0.8, 0}}, shifts, noise)), "there are 2")) << noise;
    // identical poses, up to the noise
    EXPECT_TRUE(Says(Refusal(PairsOf({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, NoShift, noise)),
                     noise ? "all the same" : "three different scans"))
        << noise;
    // pure translation
    EXPECT_TRUE(Says(Refusal(PairsOf({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, shifts, noise)), "translations alone"))
        << noise;
    // less than a degree
    EXPECT_TRUE(Says(Refusal(PairsOf({{0, 0, 0}, {0.016, 0, 0}, {0, 0.016, 0}, {0, 0, 0.016}, {-0.016, 0, 0}}, shifts, noise)),
                     "no more than the noise"))
        << noise;
    // about one axis, whatever the shifts
    const std::string parallel =
        Refusal(PairsOf({{0, 0, 0}, {0, 0.3, 0.4}, {0, -0.6, -0.8}, {0, 0.15, 0.2}, {0, 0.6, 0.8}}, shifts, noise));
    EXPECT_TRUE(Says(parallel, "about one axis")) << parallel;
    EXPECT_TRUE(Says(parallel, "0.6") && Says(parallel, "0.8")) << parallel; // which one
  }
  // A scan that is entered twice is one.
  std::vector<HandEyePair> twice = PairsOf({{0.3, 0, 0}, {0, 0.8, 0}}, shifts);
  twice.push_back(twice[0]);
  EXPECT_TRUE(Says(Refusal(twice), "scan 3 repeats scan 1"));
}

TEST(HandEye, TwoAnswersAreRefused)
{
  const double pi = EIGEN_PI;
  for (const bool noise : {false, true}) {
    // Half turns that commute.
    const std::string klein = Refusal(PairsOf({{0, 0, 0}, {pi, 0, 0}, {0, pi, 0}, {0, 0, pi}}, NoShift, noise));
    EXPECT_TRUE(Says(klein, "several answers fit alike")) << klein;
    // About z by any angle, and half turns about axes across it.
    std::vector<Eigen::Vector3d> turns{{0, 0, 0}, {0, 0, 0.7}, {0, 0, -1.2}, {pi, 0, 0}, {0, pi, 0}, {pi * 0.6, pi * 0.8, 0}};
    const std::vector<Eigen::Vector3d> shifts{{0, 0, 0}, {0, 0, 30}, {0, 0, -20}, {0, 0, 10}};
    const std::string aboutZ = Refusal(PairsOf(turns, shifts, noise));
    EXPECT_TRUE(Says(aboutZ, "two answers fit alike") && Says(aboutZ, "turned by 30 to 90 degrees about (")) << aboutZ;
    // What it asks for decides.
    turns.emplace_back(0.9, 0.0, 0.0);
    EXPECT_EQ(CalibrateHandEye(PairsOf(turns, shifts, noise)).inliers, 7);
  }
}

TEST(HandEye, HalfTurnsThatDetermineWork)
{
  const double pi = EIGEN_PI, root = std::sqrt(0.5), third = std::sqrt(1.0 / 3.0);
  const Eigen::Vector3d truth(30.0, -20.0, 140.0);
  // Axes at angles that leave no half turn which commutes with all.
  const std::vector<Eigen::Vector3d> oblique{
      {0, 0, 0}, {pi, 0, 0}, {pi * root, pi * root, 0}, {pi * third, pi * third, pi * third}};
  // Half turns about axes at right angles, told apart by shifts.
  const std::vector<Eigen::Vector3d> klein{{0, 0, 0}, {pi, 0, 0}, {0, pi, 0}, {0, 0, pi}};
  for (const bool noise : {false, true})
    for (const bool shifted : {false, true}) {
      const HandEyeResult result = CalibrateHandEye(
          PairsOf(shifted ? klein : oblique,
                  shifted ? std::vector<Eigen::Vector3d>{{0, 0, 0}, {30, 0, 0}, {0, 40, 0}, {0, 10, 50}} : NoShift, noise));
      const double off = (result.solution.volumeToSensor.translation() - truth).norm();
      EXPECT_LT(off, noise ? 1.5 * result.targetRadius95Mm : 1e-5) << noise << shifted;
      EXPECT_EQ(result.inliers, 4) << noise << shifted;
    }
}

TEST(HandEye, HalfTurnsWork)
{
  const double pi = EIGEN_PI;
  const std::vector<HandEyePair> pairs = PairsOf({{0, 0, 0}, {pi, 0, 0}, {0, pi, 0}, {0, 0, pi}, {3.0, 0.5, 0}, {0, 2.9, 0.4}},
                                                 {{0, 0, 0}, {30, 0, 0}, {0, 10, 50}});
  const HandEyeResult result = CalibrateHandEye(pairs);
  EXPECT_LT((result.solution.volumeToSensor.translation() - Eigen::Vector3d(30.0, -20.0, 140.0)).norm(),
            result.targetRadius95Mm * 1.5);
  EXPECT_EQ(result.inliers, 6);
}

TEST(HandEye, BadPosesAreNamed)
{
  HandEyeScenario scenario;
  scenario.poses = 6;
  const std::vector<HandEyePair> good = SimulateHandEye(scenario).pairs;
  const auto complaint = [&good](const std::function<void(HandEyePair&)>& spoil) {
    std::vector<HandEyePair> pairs = good;
    spoil(pairs[3]);
    return Complaint(Error::Kind::BadInput, [&] { CalibrateHandEye(pairs); });
  };
  const std::string nan = complaint([](HandEyePair& pair) { pair.sensorToTracker(1, 3) = std::nan(""); });
  EXPECT_TRUE(Says(nan, "sensor pose of scan 4") && Says(nan, "not finite")) << nan;
  const std::string infinite = complaint([](HandEyePair& pair) {
    pair.name = "V7.mha";
    pair.volumeToWorld(0, 0) = INFINITY;
  });
  EXPECT_TRUE(Says(infinite, "alignment of V7.mha")) << infinite;
  const std::string scaled = complaint([](HandEyePair& pair) { pair.volumeToWorld.linear() *= 1.1; });
  EXPECT_TRUE(Says(scaled, "not rigid") && Says(scaled, "1.1")) << scaled;
  const std::string mirrored = complaint([](HandEyePair& pair) { pair.volumeToWorld.linear().col(1) *= -1.0; });
  EXPECT_TRUE(Says(mirrored, "reflection")) << mirrored;
}

TEST(HandEye, WrongUnitsAndConventionsAreSaid)
{
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    HandEyeScenario scenario;
    scenario.poses = 8;
    scenario.seed = seed;
    const std::vector<HandEyePair> good = SimulateHandEye(scenario).pairs;
    const auto refusal = [&good](const std::function<void(HandEyePair&)>& spoil) {
      std::vector<HandEyePair> pairs = good;
      for (HandEyePair& pair : pairs)
        spoil(pair);
      return Refusal(pairs);
    };
    const std::string sensorMetres = refusal([](HandEyePair& pair) { pair.sensorToTracker.translation() *= 0.001; });
    EXPECT_TRUE(Says(sensorMetres, "sensor poses are in metres")) << sensorMetres;
    const std::string volumeMetres = refusal([](HandEyePair& pair) { pair.volumeToWorld.translation() *= 0.001; });
    EXPECT_TRUE(Says(volumeMetres, "alignments are in metres")) << volumeMetres;
    const std::string centimetres = refusal([](HandEyePair& pair) { pair.sensorToTracker.translation() *= 0.1; });
    EXPECT_TRUE(Says(centimetres, "sensor poses are in centimetres")) << centimetres;
    // Which side is inverted, residuals cannot tell; the lever that each leads to is said, and the right one is 150 mm.
    const std::string sensorInverted = refusal([](HandEyePair& pair) { pair.sensorToTracker = pair.sensorToTracker.inverse(); });
    EXPECT_TRUE(Says(sensorInverted, "wrong way round") && Says(sensorInverted, "TrackerToSensor (the target then lies 1"))
        << sensorInverted;
    const std::string volumeInverted = refusal([](HandEyePair& pair) { pair.volumeToWorld = pair.volumeToWorld.inverse(); });
    EXPECT_TRUE(Says(volumeInverted, "wrong way round") && Says(volumeInverted, "WorldToVolume (1")) << volumeInverted;
    const std::string both = refusal([](HandEyePair& pair) {
      pair.sensorToTracker = pair.sensorToTracker.inverse();
      pair.sensorToTracker.translation() *= 0.001;
    });
    EXPECT_TRUE(Says(both, "wrong way round") && Says(both, "sensor poses are in metres")) << both;
  }
}

TEST(HandEye, FewScansAreNotFooled)
{
  // With four or five scans, three of them fit almost anything: a side that is inverted must not pass as outliers.
  for (const int poses : {4, 5})
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.seed = seed;
      std::vector<HandEyePair> pairs = SimulateHandEye(scenario).pairs;
      EXPECT_GE(CalibrateHandEye(pairs).inliers, 4);
      for (HandEyePair& pair : pairs)
        pair.sensorToTracker = pair.sensorToTracker.inverse();
      EXPECT_TRUE(Says(Refusal(pairs), "wrong way round")) << poses << " " << seed;
    }
  // And of four scans, three do not outvote the fourth.
  HandEyeScenario scenario;
  scenario.poses = 4;
  scenario.outliers = 1;
  EXPECT_TRUE(Says(Refusal(SimulateHandEye(scenario).pairs), "3 of 4 scans agree"));
}

TEST(HandEye, WhatLeavesNoResidualIsSuspected)
{
  HandEyeScenario scenario;
  scenario.poses = 8;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  EXPECT_TRUE(CalibrateHandEye(simulation.pairs).notes.empty());
  // Both sides in metres.
  std::vector<HandEyePair> metres = simulation.pairs;
  for (HandEyePair& pair : metres) {
    pair.sensorToTracker.translation() *= 0.001;
    pair.volumeToWorld.translation() *= 0.001;
  }
  EXPECT_TRUE(Says(CalibrateHandEye(metres).notes, "metres"));
  // Both sides inverted: C and O change places, and the lever is that from the tracker to the world.
  std::vector<HandEyePair> inverted = simulation.pairs;
  for (HandEyePair& pair : inverted) {
    pair.sensorToTracker = (Eigen::Translation3d(800.0, 0.0, 0.0) * pair.sensorToTracker).inverse();
    pair.volumeToWorld = pair.volumeToWorld.inverse();
  }
  EXPECT_TRUE(Says(CalibrateHandEye(inverted).notes, "changed places"));
}

TEST(HandEye, NonsenseIsRefused)
{
  // Sensor poses that have nothing to do with their volumes.
  HandEyeScenario scenario;
  scenario.poses = 9;
  std::vector<HandEyePair> pairs = SimulateHandEye(scenario).pairs;
  for (std::size_t i = 0; i < 4; ++i)
    std::swap(pairs[i].sensorToTracker, pairs[8 - i].sensorToTracker);
  EXPECT_TRUE(Says(Refusal(pairs), "belongs to its volume"));
}

TEST(HandEye, RepeatsAreNamedAndCountedOnce)
{
  HandEyeScenario scenario;
  scenario.poses = 7;
  const std::vector<HandEyePair> once = SimulateHandEye(scenario).pairs;
  std::vector<HandEyePair> pairs = once;
  pairs.insert(pairs.begin() + 4, pairs[1]);
  HandEyePair stale = once[6];
  stale.sensorToTracker = once[0].sensorToTracker; // the tracker stood still, the volume did not
  const HandEyeResult result = CalibrateHandEye(pairs), expected = CalibrateHandEye(once);
  EXPECT_FALSE(result.residuals[4].inlier);
  EXPECT_EQ(result.residuals[4].reason, "repeats scan 2");
  EXPECT_TRUE(Says(result.notes, "scan 5 repeats scan 2"));
  EXPECT_EQ(result.inliers, 7);
  EXPECT_NEAR(result.targetRadius95Mm, expected.targetRadius95Mm, 1e-9);
  pairs = once;
  pairs.push_back(stale);
  EXPECT_TRUE(Says(CalibrateHandEye(pairs).notes, "The sensor poses of scan 1 and scan 8 are the same"));
}

TEST(HandEye, AdviceComesTrue)
{
  // Much turning about x, little about the others.
  std::vector<Eigen::Vector3d> turns;
  for (int i = 0; i < 8; ++i)
    turns.emplace_back(-0.7 + 0.2 * i, i % 2 == 0 ? 0.05 : -0.05, i % 3 == 0 ? 0.04 : -0.02);
  const std::vector<HandEyePair> pairs = PairsOf(turns, NoShift);
  const HandEyeResult before = CalibrateHandEye(pairs);
  ASSERT_EQ(before.advice.size(), 3u);
  const HandEyeAdvice& best = before.advice.front();
  EXPECT_LT(std::abs(best.axis.x()), 0.8) << best.text;
  EXPECT_LT(best.radiusMm, 0.8 * before.targetRadius95Mm) << best.text;
  for (const HandEyeAdvice& other : before.advice)
    EXPECT_GE(other.radiusMm, best.radiusMm * 0.98);
  EXPECT_TRUE(Says(best.text, "Turn the volume by")) << best.text;
  // The scan it asks for, taken: the region becomes what was foretold, to what noise moves.
  turns.emplace_back(best.axis * best.degrees * RadiansPerDegree);
  const HandEyeResult after = CalibrateHandEye(PairsOf(turns, NoShift));
  EXPECT_NEAR(after.targetRadius95Mm / best.radiusMm, 1.0, 0.15) << best.text;
}

TEST(HandEye, AdviceStartsFromTheRadiusStated)
{
  HandEyeScenario scenario;
  scenario.poses = 5;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  for (const bool estimate : {false, true}) {
    HandEyeParameters parameters;
    parameters.estimateNoise = estimate;
    const HandEyeResult result = CalibrateHandEye(simulation.pairs, parameters);
    EXPECT_EQ(result.noiseEstimated, estimate);
    char before[40];
    std::snprintf(before, sizeof before, "falls from %.2f to", result.targetRadius95Mm);
    for (const HandEyeAdvice& one : result.advice)
      EXPECT_TRUE(Says(one.text, before)) << one.text << " " << result.targetRadius95Mm;
  }
}

TEST(HandEye, ParametersAreChecked)
{
  const auto complaint = [](const std::function<void(HandEyeParameters&)>& spoil) {
    HandEyeParameters parameters;
    spoil(parameters);
    return Complaint(Error::Kind::InvalidParameter, [&] { CalibrateHandEye({}, parameters); });
  };
  EXPECT_TRUE(Says(complaint([](HandEyeParameters& p) { p.sensorNoise.degrees = -1.0; }),
                   "SensorNoiseDegrees is -1 degrees; it must be in [0, 45]"));
  EXPECT_TRUE(Says(complaint([](HandEyeParameters& p) { p.volumeNoise.mm = std::nan(""); }),
                   "VolumeNoiseMm is nan mm; it must be in [0, 100]"));
  EXPECT_TRUE(Says(complaint([](HandEyeParameters& p) { p.sensorNoise = p.volumeNoise = {0.0, 0.0}; }), "must not be zero"));
  EXPECT_TRUE(Says(complaint([](HandEyeParameters& p) { p.target.x() = std::nan(""); }), "Target"));
}

TEST(HandEye, StopsAndRepeats)
{
  HandEyeScenario scenario;
  scenario.outliers = 4;
  const HandEyeSimulation simulation = SimulateHandEye(scenario);
  EXPECT_THROW(CalibrateHandEye(simulation.pairs, {}, Progress([](double fraction) { return fraction < 0.5; })), Error);
  const HandEyeResult a = CalibrateHandEye(simulation.pairs), b = CalibrateHandEye(simulation.pairs);
  EXPECT_EQ((a.solution.volumeToSensor.matrix() - b.solution.volumeToSensor.matrix()).norm(), 0.0);
}

TEST(HandEye, ManyScansLeaveTogether)
{
  ECHORAMA_SKIP_SANITIZED();
  // Every third scan is three times as noisy: most of these are wrong, none by far, so that rounds must find them.
  HandEyeScenario scenario, noisy;
  scenario.poses = noisy.poses = 240;
  noisy.sensorNoise = noisy.volumeNoise = {0.75, 2.1};
  HandEyeSimulation simulation = SimulateHandEye(scenario);
  const HandEyeSimulation worse = SimulateHandEye(noisy);
  ASSERT_TRUE(simulation.truth.volumeToSensor.isApprox(worse.truth.volumeToSensor, 1e-12));
  for (std::size_t i = 0; i < 240; i += 3)
    simulation.pairs[i] = worse.pairs[i];
  int calls = 0;
  const HandEyeResult result = CalibrateHandEye(simulation.pairs, {}, Progress([&calls](double) { return ++calls > 0; }));
  EXPECT_GT(240 - result.inliers, 40);
  EXPECT_GT(calls, 15); // every round can be stopped
  EXPECT_LT(calls, 70);
  int rightLeft = 0;
  for (std::size_t i = 0; i < 240; ++i)
    rightLeft += i % 3 != 0 && !result.residuals[i].inlier ? 1 : 0;
  EXPECT_LE(rightLeft, 3);
  // A mistake that all have in common is told, and can be stopped.
  for (HandEyePair& pair : simulation.pairs)
    pair.sensorToTracker.translation() *= 0.001;
  EXPECT_TRUE(Says(Refusal(simulation.pairs), "sensor poses are in metres"));
  EXPECT_THROW(CalibrateHandEye(simulation.pairs, {}, Progress([](double fraction) { return fraction < 0.85; })), Error);
}

TEST(HandEye, TwoRecordingsOfOneRigAgree)
{
  ECHORAMA_SKIP_SANITIZED();
  Pose likely[2], plain[2];
  for (int k = 0; k < 2; ++k) {
    const std::vector<HandEyePair> pairs = HandEyeRecording("vicon_" + std::to_string(k + 1));
    if (pairs.empty())
      GTEST_SKIP() << "../shared/data/handeye_ethz is not there";
    const HandEyeResult result = CalibrateHandEye(pairs); // nothing is chosen
    EXPECT_GT(result.inliers, 400);
    likely[k] = result.solution.volumeToSensor;
    plain[k] = HandEyeClosedForms()[2].solve(pairs).volumeToSensor; // Park-Martin
  }
  EXPECT_NEAR((plain[0].translation() - plain[1].translation()).norm(), 11.0, 1.0);
  EXPECT_LT((likely[0].translation() - likely[1].translation()).norm(), 5.0);
}

} // namespace
