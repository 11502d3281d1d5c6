// SPDX-License-Identifier: BSD-3-Clause
// Hand-eye calibration: how far C places the centre of the volume from its true place, root mean square over trials, beside the
// Cramer-Rao bound of the same trials, and how often the stated 95% sphere holds the truth. Poses are drawn anew for each trial
// (HandEyeSimulation.h): turns about directions at random by up to 60 or 15 degrees, lever 150 mm, noise of 0.25 degrees and 0.7
// mm per axis on both sides or on the sensor's alone.
//
// Peers: the closed forms, and OpenCV's calibrateHandEye where it is installed. All get the data of all trials. A trial has no
// answer from one that refuses it (ours does where poses turn too little, or another calibration fits nearly as well), throws, or
// gives no number; the error and the bound of a line are over the trials that its method answers. So that the peers can be
// compared with ours where it refuses some, error_where_ours_answers is theirs over the others alone.
//
// The case held-out: calibrated on one half of the views and tested on the other; recordings, and simulated noise about a board.
// The case ethz: two recordings of one rig with a motion-capture system and a camera. Error: how far apart the two calibrations
// put the camera's centre.
//
//   BenchmarkHandEye [TRIALS [CASE...]]     default: 500, all cases: both sensor outliers estimated held-out ethz
#include "Core/Base/Angles.h"
#include "Filters/Calibration/Benchmarks/HandEyeContestants.h"
#include "Filters/Calibration/Testing/HandEyeRecording.h"
#include "Filters/Calibration/Testing/HandEyeSimulation.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#ifdef ECHORAMA_WITH_OPENCV
#include <opencv2/calib3d.hpp>
#endif

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

using Solver = std::function<Pose(const std::vector<HandEyePair>&)>;

#ifdef ECHORAMA_WITH_OPENCV
Pose SolveByOpenCV(cv::HandEyeCalibrationMethod method, const std::vector<HandEyePair>& pairs)
{
  std::vector<cv::Mat> turnsA, shiftsA, turnsB, shiftsB;
  const auto add = [](const Pose& pose, std::vector<cv::Mat>& turns, std::vector<cv::Mat>& shifts) {
    cv::Mat turn(3, 3, CV_64F), shift(3, 1, CV_64F);
    for (int i = 0; i < 3; ++i) {
      shift.at<double>(i) = pose.translation()[i];
      for (int j = 0; j < 3; ++j)
        turn.at<double>(i, j) = pose.linear()(i, j);
    }
    turns.push_back(turn);
    shifts.push_back(shift);
  };
  for (const HandEyePair& pair : pairs) {
    add(pair.sensorToTracker, turnsA, shiftsA);         // "gripper to base"
    add(pair.volumeToWorld.inverse(), turnsB, shiftsB); // "target to camera": the world, seen from the volume
  }
  cv::Mat turn, shift;
  Pose pose = Pose::Identity();
  cv::calibrateHandEye(turnsA, shiftsA, turnsB, shiftsB, turn, shift, method);
  for (int i = 0; i < 3; ++i) {
    pose.translation()[i] = shift.at<double>(i);
    for (int j = 0; j < 3; ++j)
      pose.linear()(i, j) = turn.at<double>(i, j);
  }
  return pose;
}
#endif

std::vector<std::pair<std::string, Solver>> Contestants()
{
  std::vector<std::pair<std::string, Solver>> contestants;
  for (const HandEyeClosedForm& form : HandEyeClosedForms())
    contestants.emplace_back(form.name,
                             [&form](const std::vector<HandEyePair>& pairs) { return form.solve(pairs).volumeToSensor; });
#ifdef ECHORAMA_WITH_OPENCV
  const std::pair<const char*, cv::HandEyeCalibrationMethod> methods[] = {{"opencv tsai", cv::CALIB_HAND_EYE_TSAI},
                                                                          {"opencv park", cv::CALIB_HAND_EYE_PARK},
                                                                          {"opencv horaud", cv::CALIB_HAND_EYE_HORAUD},
                                                                          {"opencv andreff", cv::CALIB_HAND_EYE_ANDREFF},
                                                                          {"opencv daniilidis", cv::CALIB_HAND_EYE_DANIILIDIS}};
  for (const auto& method : methods)
    contestants.emplace_back(method.first,
                             [method](const std::vector<HandEyePair>& pairs) { return SolveByOpenCV(method.second, pairs); });
#endif
  return contestants;
}

// \returns false where the solver fails
bool Solved(const Solver& solver, const std::vector<HandEyePair>& pairs, Pose& pose)
{
  try {
    pose = solver(pairs);
  } catch (const std::exception&) {
    return false;
  }
  return pose.matrix().allFinite();
}

struct Tally {
  double squares = 0.0, bounds = 0.0;
  std::vector<double> errors, seconds;
  void Add(double error, double time, double bound = NaN)
  {
    squares += error * error;
    bounds += bound;
    errors.push_back(error);
    seconds.push_back(time);
  }
  int Answers() const { return static_cast<int>(errors.size()); }
  double Rms() const { return errors.empty() ? NaN : std::sqrt(squares / Answers()); }
  double Bound() const { return errors.empty() ? NaN : std::sqrt(bounds / Answers()); }
  static double Median(std::vector<double> values)
  {
    if (values.empty())
      return NaN;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  }
  double MedianError() const { return Median(errors); }
  double MedianSeconds() const { return Median(seconds); }
};

HandEyeParameters ParametersOf(const HandEyeScenario& scenario)
{
  HandEyeParameters parameters;
  parameters.sensorNoise = scenario.sensorNoise;
  parameters.volumeNoise = scenario.volumeNoise;
  parameters.target = scenario.target;
  return parameters;
}

void Simulate(const std::string& name, HandEyeScenario scenario, int trials, bool estimateNoise, bool withPeers)
{
  HandEyeParameters parameters = ParametersOf(scenario);
  parameters.estimateNoise = estimateNoise;
  const auto peers = withPeers ? Contestants() : std::vector<std::pair<std::string, Solver>>();
  Tally ours, clean, oursBesideClean;
  std::map<std::string, Tally> theirs, beside; // beside: over what ours answers
  double radius = 0.0;
  int inside = 0, wronglyKept = 0, wronglyLeft = 0, cleanRefused = 0;
  for (int trial = 0; trial < trials; ++trial) {
    scenario.seed = 1000 + static_cast<std::uint64_t>(trial);
    const HandEyeSimulation simulation = SimulateHandEye(scenario);
    const Eigen::Vector3d truth = simulation.truth.volumeToSensor * scenario.target;
    const double bound = HandEyeBound(scenario, simulation).trace();
    const auto errorOf = [&scenario, &truth](const Pose& C) { return (C * scenario.target - truth).norm(); };
    HandEyeResult result;
    const auto calibrate = [&parameters, &result](const std::vector<HandEyePair>& pairs) {
      result = CalibrateHandEye(pairs, parameters);
      return result.solution.volumeToSensor;
    };
    Pose C = Pose::Identity();
    bool answered = false;
    const double seconds = benchmark::Seconds([&] { answered = Solved(calibrate, simulation.pairs, C); });
    if (answered) {
      const double error = errorOf(C);
      ours.Add(error, seconds, bound);
      inside += error <= result.targetRadius95Mm ? 1 : 0;
      radius += result.targetRadius95Mm;
      for (std::size_t i = 0; i < result.residuals.size(); ++i) {
        wronglyKept += result.residuals[i].inlier && simulation.isOutlier[i] ? 1 : 0;
        wronglyLeft += !result.residuals[i].inlier && !simulation.isOutlier[i] ? 1 : 0;
      }
      if (scenario.outliers > 0) { // the scans that are right, alone
        if (Solved(calibrate, {simulation.pairs.begin() + scenario.outliers, simulation.pairs.end()}, C)) {
          clean.Add(errorOf(C), 0.0);
          oursBesideClean.Add(error, 0.0);
        } else
          ++cleanRefused;
      }
    }
    for (const auto& peer : peers) {
      bool solved = false;
      const double time = benchmark::Seconds([&] { solved = Solved(peer.second, simulation.pairs, C); });
      if (!solved)
        continue;
      theirs[peer.first].Add(errorOf(C), time, bound);
      if (answered)
        beside[peer.first].Add(errorOf(C), time);
    }
  }
  const std::string testCase =
      name + ", " + std::to_string(scenario.poses) + " poses, " + std::to_string(static_cast<int>(scenario.degrees)) + " degrees";
  const auto of = [trials](const Tally& tally) {
    return nlohmann::ordered_json{{"bound", tally.Bound()},
                                  {"error_over_bound", tally.Rms() / tally.Bound()},
                                  {"median", tally.MedianError()},
                                  {"trials", trials},
                                  {"no_answer", trials - tally.Answers()}};
  };
  nlohmann::ordered_json more = of(ours);
  more.update({{"inside_95", static_cast<double>(inside) / ours.Answers()},
               {"radius_95", radius / ours.Answers()},
               {"wrongly_left_out", wronglyLeft},
               {"wrongly_kept", wronglyKept}});
  if (scenario.outliers > 0)
    more.update({{"without_outliers", clean.Rms()},
                 {"without_outliers_no_answer", cleanRefused},
                 {"ratio_to_clean", oursBesideClean.Rms() / clean.Rms()}});
  benchmark::Report("handeye", testCase, "maximum-likelihood", ours.MedianSeconds(), ours.Rms(), "mm", more);
  for (const auto& peer : peers) {
    const Tally& tally = theirs[peer.first];
    nlohmann::ordered_json told = of(tally);
    told["error_where_ours_answers"] = beside[peer.first].Rms();
    benchmark::Report("handeye", testCase, peer.first, tally.MedianSeconds(), tally.Rms(), "mm", told);
  }
}

// Calibrated on one half of some views and tested on the other. Error: how well a fixed point of the world, the board, repeats in
// the views held out, root mean square over the trials. Nothing is chosen for ours: the target is the volume's origin, a camera's
// centre, and the noise stated that of a probe.
struct HeldOut {
  std::vector<HandEyePair> views;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
};
void TestOnOthers(const std::string& testCase, int trials, const std::function<HeldOut(int)>& draw)
{
  auto contestants = Contestants();
  for (const bool estimate : {true, false})
    contestants.emplace_back(estimate ? "maximum-likelihood" : "stated noise", [estimate](const std::vector<HandEyePair>& pairs) {
      HandEyeParameters parameters;
      parameters.estimateNoise = estimate;
      return CalibrateHandEye(pairs, parameters).solution.volumeToSensor;
    });
  std::map<std::string, Tally> tallies;
  for (int trial = 0; trial < trials; ++trial) {
    const HeldOut drawn = draw(trial);
    const HandEyeHalves halves = SplitAtRandom(drawn.views, static_cast<std::uint64_t>(trial));
    for (const auto& contestant : contestants) {
      Pose C = Pose::Identity();
      bool solved = false;
      const double seconds = benchmark::Seconds([&] { solved = Solved(contestant.second, halves.used, C); });
      if (solved)
        tallies[contestant.first].Add(HandEyeRepeat(halves.heldOut, C, drawn.point), seconds);
    }
  }
  for (const auto& contestant : contestants) {
    const Tally& tally = tallies[contestant.first];
    benchmark::Report("handeye", "held-out views, " + testCase, contestant.first, tally.MedianSeconds(), tally.Rms(), "mm",
                      {{"median", tally.MedianError()}, {"trials", trials}, {"no_answer", trials - tally.Answers()}});
  }
}

void TestOnOthers(int trials)
{
  constexpr std::size_t Views = 30;
  for (const char* name : {"robot_arm_sim", "vicon_1", "vicon_2"}) {
    const std::vector<HandEyePair> recording = HandEyeRecording(name);
    if (recording.empty())
      std::cerr << "the recording " << name << " is left out: ../shared/data is not there\n";
    else
      TestOnOthers(name, std::min(trials, 30), [views = EvenlyChosen(recording, Views)](int) {
        return HeldOut{views, Eigen::Vector3d::Zero()};
      });
  }
  TestOnOthers("noise about a board", std::min(trials, 200), [](int trial) {
    const HandEyeScenario scenario = BoardScenario(Views, 4000 + static_cast<std::uint64_t>(trial));
    HeldOut drawn;
    drawn.views = SimulateHandEye(scenario).pairs;
    for (const HandEyePair& view : drawn.views)
      drawn.point += view.volumeToWorld * scenario.Noise().centre / static_cast<double>(Views);
    return drawn;
  });
}

// Two recordings of one rig: a camera on a hand that a motion-capture system follows, over a board. Nothing is chosen here,
// either.
void CompareRecordings()
{
  std::vector<HandEyePair> recordings[2];
  HandEyeResult results[2];
  double seconds = 0.0;
  for (int k = 0; k < 2; ++k) {
    recordings[k] = HandEyeRecording("vicon_" + std::to_string(k + 1));
    if (recordings[k].empty()) {
      std::cerr << "ethz is left out: ../shared/data is not there\n";
      return;
    }
    seconds += 0.5 * benchmark::Seconds([&] { results[k] = CalibrateHandEye(recordings[k]); });
  }
  const auto report = [](const std::string& method, double time, const Pose& a, const Pose& b, nlohmann::ordered_json more) {
    more["point"] = "the camera's centre";
    more["apart_degrees"] = RotationAngle(a.inverse() * b) * DegreesPerRadian;
    benchmark::Report("handeye", "two recordings of one rig", method, time, (a.translation() - b.translation()).norm(), "mm",
                      more);
  };
  nlohmann::ordered_json more = {{"scans", {recordings[0].size(), recordings[1].size()}},
                                 {"inliers", {results[0].inliers, results[1].inliers}},
                                 {"rms_mm", {results[0].rmsMm, results[1].rmsMm}},
                                 {"rms_degrees", {results[0].rmsDegrees, results[1].rmsDegrees}}};
  for (const HandEyeResult& result : results)
    more["noise"].push_back({{"sensor_degrees", result.noise.sensor.degrees},
                             {"volume_degrees", result.noise.volume.degrees},
                             {"volume_mm", result.noise.volume.mm},
                             {"centre", {result.noise.centre.x(), result.noise.centre.y(), result.noise.centre.z()}}});
  report("maximum-likelihood", seconds, results[0].solution.volumeToSensor, results[1].solution.volumeToSensor, more);
  for (const auto& contestant : Contestants()) {
    if (contestant.first.find("opencv") == 0 && contestant.first != "opencv park")
      continue; // half a minute each
    Pose poses[2];
    bool solved = true;
    const double time = benchmark::Seconds([&] {
      for (int k = 0; k < 2; ++k)
        solved = Solved(contestant.second, recordings[k], poses[k]) && solved;
    });
    if (!solved) {
      std::cerr << contestant.first << " fails on the recordings\n";
      continue;
    }
    report(contestant.first, 0.5 * time, poses[0], poses[1], nlohmann::ordered_json::object());
  }
}

} // namespace

int main(int argc, char** argv)
{
  const int trials = argc > 1 ? std::max(1, std::atoi(argv[1])) : benchmark::Trials(500);
  std::vector<std::string> cases(argv + std::min(argc, 2), argv + argc);
  if (cases.empty())
    cases = {"both", "sensor", "outliers", "estimated", "held-out", "ethz"};
  const auto wanted = [&cases](const char* name) { return std::find(cases.begin(), cases.end(), name) != cases.end(); };

  for (const int poses : {5, 8, 20})
    for (const double degrees : {60.0, 15.0}) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.degrees = degrees;
      if (wanted("both"))
        Simulate("noise on both sides", scenario, trials, false, true);
      if (wanted("estimated"))
        Simulate("noise on both sides, estimated", scenario, trials, true, false);
      if (wanted("sensor")) {
        scenario.volumeNoise = {0.0, 0.0};
        Simulate("noise on the sensor", scenario, trials, false, true);
      }
    }
  if (wanted("outliers"))
    for (const int poses : {10, 20}) {
      HandEyeScenario scenario;
      scenario.poses = poses;
      scenario.outliers = poses / 5;
      Simulate("20% outliers", scenario, trials, false, true);
    }
  if (wanted("held-out"))
    TestOnOthers(trials);
  if (wanted("ethz"))
    CompareRecordings();
  return 0;
}
