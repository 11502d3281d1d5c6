// SPDX-License-Identifier: BSD-3-Clause
// The parts of the noise: found where they are not as stated, left alone where they are, and never worse than closed forms.
#include "Filters/Calibration/Benchmarks/HandEyeContestants.h"
#include "Filters/Calibration/Testing/HandEyeRecording.h"
#include "Filters/Calibration/Testing/HandEyeSimulation.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <map>

using namespace echorama;

namespace {

HandEyeParameters Stated()
{
  HandEyeParameters parameters;
  parameters.estimateNoise = false;
  return parameters;
}

double OffAtTarget(const HandEyeScenario& scenario, const HandEyeSimulation& simulation, const HandEyeResult& result)
{
  return (result.solution.volumeToSensor * scenario.target - simulation.truth.volumeToSensor * scenario.target).norm();
}

bool Says(const std::vector<std::string>& notes, const std::string& words)
{
  return std::any_of(notes.begin(), notes.end(), [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

TEST(HandEyeComponents, FindsTheNoiseThatIsThere)
{
  const HandEyeScenario scenario = BoardScenario(150, 1);
  const HandEyeResult result = CalibrateHandEye(SimulateHandEye(scenario).pairs);
  ASSERT_TRUE(result.ratioEstimated && result.centreEstimated);
  EXPECT_NEAR(result.noise.sensor.degrees / scenario.sensorNoise.degrees, 1.0, 0.2);
  EXPECT_NEAR(result.noise.volume.degrees / scenario.volumeNoise.degrees, 1.0, 0.1);
  const auto shift = [](const HandEyeNoise& noise) { return std::hypot(noise.sensor.mm, noise.volume.mm); };
  EXPECT_NEAR(shift(result.noise) / shift(scenario.Noise()), 1.0, 0.1);
  EXPECT_LT((result.noise.centre - scenario.Noise().centre).norm(), 60.0); // 20 by chance
  EXPECT_EQ(result.noiseScale, 1.0);
  EXPECT_TRUE(Says(result.notes, "contradict the ratio of the noises stated"));
  EXPECT_TRUE(Says(result.notes, "mm from the target"));
}

TEST(HandEyeComponents, TheTargetDoesNotDecideWhereNoiseTurns)
{
  // The same scans with the error asked for at the camera, and at the board.
  const HandEyeScenario scenario = BoardScenario(20, 3);
  const std::vector<HandEyePair> pairs = SimulateHandEye(scenario).pairs;
  HandEyeParameters atBoard;
  atBoard.target = scenario.Noise().centre;
  const HandEyeResult one = CalibrateHandEye(pairs), other = CalibrateHandEye(pairs, atBoard);
  EXPECT_LT((one.solution.volumeToSensor.translation() - other.solution.volumeToSensor.translation()).norm(),
            0.2 * one.targetRadius95Mm);
}

TEST(HandEyeComponents, ARightRatioStays)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const int poses : {8, 20})
    for (const double size : {0.3, 1.0}) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.sensorNoise = scenario.volumeNoise = {0.25 * size, 0.7 * size};
      double estimated = 0.0, stated = 0.0;
      int doubted = 0;
      for (int trial = 0; trial < 100; ++trial) {
        scenario.seed = 7000 + static_cast<std::uint64_t>(trial);
        const HandEyeSimulation simulation = SimulateHandEye(scenario);
        const HandEyeResult result = CalibrateHandEye(simulation.pairs);
        EXPECT_TRUE(result.noiseEstimated);
        doubted += result.ratioEstimated ? 1 : 0;
        estimated += std::pow(OffAtTarget(scenario, simulation, result), 2);
        stated += std::pow(OffAtTarget(scenario, simulation, CalibrateHandEye(simulation.pairs, Stated())), 2);
      }
      EXPECT_LE(doubted, 2) << poses;
      EXPECT_LT(std::sqrt(estimated / stated), 1.02) << poses;
    }
}

// Root mean square repeats in views held out, by method; "stated" is ours with a fixed ratio.
std::map<std::string, double> Repeats(int trials, const std::function<HandEyeHalves(int, Eigen::Vector3d&)>& draw)
{
  std::map<std::string, double> squares;
  for (int trial = 0; trial < trials; ++trial) {
    Eigen::Vector3d point(0.0, 0.0, 0.0);
    const HandEyeHalves halves = draw(trial, point);
    const auto add = [&](const std::string& name, const HandEyeSolution& solution) {
      squares[name] += std::pow(HandEyeRepeat(halves.heldOut, solution.volumeToSensor, point), 2) / trials;
    };
    const HandEyeResult result = CalibrateHandEye(halves.used);
    EXPECT_TRUE(result.ratioEstimated);
    add("ours", result.solution);
    for (const HandEyeClosedForm& form : HandEyeClosedForms())
      add(form.name, form.solve(halves.used));
    try {
      add("stated", CalibrateHandEye(halves.used, Stated()).solution);
    } catch (const std::exception&) { // noise ten times that stated is refused
      squares["stated"] += 1e6;
    }
  }
  for (auto& one : squares)
    one.second = std::sqrt(one.second);
  return squares;
}

// Within a \a part of the best closed form; better than a fixed ratio, and than plain least squares.
void ExpectBest(std::map<std::string, double> repeats, double part)
{
  const double ours = repeats["ours"];
  EXPECT_LT(ours, 0.97 * repeats["stated"]);
  EXPECT_LT(ours, 0.97 * repeats["park-martin"]);
  for (const HandEyeClosedForm& form : HandEyeClosedForms())
    EXPECT_LT(ours, part * repeats[form.name]) << form.name;
}

TEST(HandEyeComponents, NoiseAboutABoardIsNoWorseThanByClosedForms)
{
  ECHORAMA_SKIP_SANITIZED();
  const auto repeats = Repeats(40, [](int trial, Eigen::Vector3d& point) {
    const HandEyeScenario scenario = BoardScenario(30, 900 + static_cast<std::uint64_t>(trial));
    const std::vector<HandEyePair> views = SimulateHandEye(scenario).pairs;
    for (const HandEyePair& view : views)
      point += view.volumeToWorld * scenario.Noise().centre / 30.0;
    return SplitAtRandom(views, static_cast<std::uint64_t>(trial));
  });
  ExpectBest(repeats, 0.96);
}

TEST(HandEyeComponents, RecordingsNeedNoChoice)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const char* name : {"robot_arm_sim", "vicon_1", "vicon_2"}) {
    const std::vector<HandEyePair> recording = HandEyeRecording(name);
    if (recording.empty())
      GTEST_SKIP() << "../shared/data/handeye_ethz is not there";
    const std::vector<HandEyePair> views = EvenlyChosen(recording, 30);
    // Of six closed forms, dual quaternions are as good as ours on the robot's arm, and the worst by far on the others.
    ExpectBest(Repeats(30, [&](int trial, Eigen::Vector3d&) { return SplitAtRandom(views, static_cast<std::uint64_t>(trial)); }),
               1.02);
  }
}

TEST(HandEyeComponents, TheRegionHoldsWhatItSays)
{
  ECHORAMA_SKIP_SANITIZED();
  const int trials = 300;
  for (const int poses : {8, 20}) {
    int inside = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const HandEyeScenario scenario = BoardScenario(poses, 2000 + static_cast<std::uint64_t>(trial));
      const HandEyeSimulation simulation = SimulateHandEye(scenario);
      const HandEyeResult result = CalibrateHandEye(simulation.pairs);
      inside += OffAtTarget(scenario, simulation, result) <= result.targetRadius95Mm ? 1 : 0;
    }
    EXPECT_GT(static_cast<double>(inside) / trials, poses < 20 ? 0.85 : 0.91) << poses; // 0.89 with eight scans; 0.013 by chance
    EXPECT_LT(static_cast<double>(inside) / trials, 0.99) << poses;
  }
}

TEST(HandEyeComponents, OutliersAreFoundByTheNoiseThatIsThere)
{
  ECHORAMA_SKIP_SANITIZED();
  int kept = 0, left = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    HandEyeScenario scenario = BoardScenario(20, seed);
    HandEyeSimulation simulation = SimulateHandEye(scenario);
    for (std::size_t i = 0; i < 3; ++i) // small beside the noise stated: 0.5 degrees about the camera
      simulation.pairs[i].volumeToWorld =
          simulation.pairs[i].volumeToWorld *
          MotionAbout({0.0, 0.0, 0.0}, (i == 0 ? 0.01 : -0.01) * Eigen::Vector3d::UnitX(), {0.0, 0.0, 3.0});
    const HandEyeResult result = CalibrateHandEye(simulation.pairs);
    for (std::size_t i = 0; i < 20; ++i) {
      kept += i < 3 && result.residuals[i].inlier ? 1 : 0;
      left += i >= 3 && !result.residuals[i].inlier ? 1 : 0;
    }
  }
  EXPECT_EQ(kept, 0);
  EXPECT_LE(left, 6); // of 510
}

TEST(HandEyeComponents, WhatIsStatedAsZeroStaysZero)
{
  const std::vector<HandEyePair> pairs = SimulateHandEye(BoardScenario(20, 5)).pairs;
  for (const bool sensor : {true, false}) {
    HandEyeParameters parameters;
    (sensor ? parameters.sensorNoise : parameters.volumeNoise) = {0.0, 0.0};
    const HandEyeResult result = CalibrateHandEye(pairs, parameters);
    const PoseNoise& zero = sensor ? result.noise.sensor : result.noise.volume;
    EXPECT_EQ(zero.degrees, 0.0);
    EXPECT_EQ(zero.mm, 0.0);
    EXPECT_TRUE(result.ratioEstimated);
    EXPECT_EQ(result.centreEstimated, sensor); // alignments without turns have none
    EXPECT_TRUE(std::isfinite(result.targetRadius95Mm));
  }
}

TEST(HandEyeComponents, NoiseOfOneKindIsNoTrouble)
{
  for (const int kind : {0, 1, 2, 3}) {
    HandEyeScenario scenario = BoardScenario(15, 6);
    scenario.sensorNoise = scenario.volumeNoise = {0.0, 0.0};
    (kind == 0   ? scenario.sensorNoise.mm
     : kind == 1 ? scenario.sensorNoise.degrees
     : kind == 2 ? scenario.volumeNoise.mm
                 : scenario.volumeNoise.degrees) = 0.1;
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const HandEyeResult result = CalibrateHandEye(simulation.pairs);
    EXPECT_TRUE(result.ratioEstimated) << kind;
    EXPECT_LT(OffAtTarget(scenario, simulation, result), 1.5 * result.targetRadius95Mm) << kind;
    EXPECT_LT(result.targetRadius95Mm, CalibrateHandEye(simulation.pairs, Stated()).targetRadius95Mm) << kind;
  }
  // None at all: rounding has no ratio.
  const HandEyeResult exact = CalibrateHandEye(SimulateHandEye(BoardScenario(15, 6)).exactPairs);
  EXPECT_FALSE(exact.ratioEstimated);
  EXPECT_LT(exact.targetRadius95Mm, 1e-3);
}

TEST(HandEyeComponents, FewScansKeepTheRatio)
{
  for (const int poses : {4, 5, 7, 8}) {
    const HandEyeResult result = CalibrateHandEye(SimulateHandEye(BoardScenario(poses, 8)).pairs);
    EXPECT_EQ(result.noiseEstimated, poses >= 5) << poses;
    EXPECT_EQ(result.ratioEstimated, poses >= 8) << poses;
    EXPECT_EQ(Says(result.notes, "contradict the ratio"), poses >= 8) << poses;
  }
}

} // namespace
