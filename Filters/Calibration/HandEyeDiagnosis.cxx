// SPDX-License-Identifier: BSD-3-Clause
// What people get wrong, told from what they gave. Noise turns the poses of a probe that is held still, too: so turns count
// only when they are three times what noise alone would show. A wrong unit or an inverted side does not fit, and fits once
// it is put right; nine ways of putting right are tried, each with a fit of its own.
//
// Two mistakes leave no residual. S and M both inverted give S C' = O' M with C' and O' exchanged; both sides in metres give the
// same answer in metres. Only the size of what comes out can make one suspicious. For the first reason, too, S inverted alone and
// M inverted alone look the same: what is said then names both, with the length of the lever that follows from each.
#include "Filters/Calibration/HandEyeDiagnosis.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/ToolPose.h"
#include "Filters/Calibration/CalibrationText.h"
#include "Filters/Calibration/HandEyeSearch.h"
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace echorama {
namespace {

constexpr std::size_t AskedScans = 60;     // for a mistake that they have in common
constexpr double LeastRivalDegrees = 20.0; // apart
constexpr double LeastRivalCost = 16.0;    // chi^2 by which another answer must fit worse: four standard deviations

Pose CheckedPose(const Pose& pose, const std::string& name, const char* what)
{
  const auto complain = [&](const std::string& reason) {
    throw Error(Error::Kind::BadInput, "hand-eye calibration: the " + std::string(what) + " of " + name + " " + reason);
  };
  if (!pose.matrix().allFinite())
    complain("has numbers that are not finite");
  Pose nearest;
  if (!NearestPose(pose.matrix(), nearest)) {
    const Eigen::Matrix3d R = pose.linear();
    if (IsRotation(-R, 1e-3) || (R.determinant() < 0.0 && (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-3))
      complain("is a reflection, not a rotation: an axis points the wrong way, or two are exchanged");
    complain(Format("is not rigid: the lengths of its axes are %.4g, %.4g and %.4g, and should be 1 and at right angles",
                    R.col(0).norm(), R.col(1).norm(), R.col(2).norm()));
  }
  return nearest;
}

// Twice the root mean square distance of the positions from their middle.
double Extent(const std::vector<Pose>& poses)
{
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Pose& pose : poses)
    middle += pose.translation() / static_cast<double>(poses.size());
  double sum = 0.0;
  for (const Pose& pose : poses)
    sum += (pose.translation() - middle).squaredNorm() / static_cast<double>(poses.size());
  return 2.0 * std::sqrt(sum);
}

struct Sides {
  std::vector<Pose> sensors, volumes;
};
Sides SidesOf(const std::vector<HandEyePair>& pairs)
{
  Sides sides;
  for (const HandEyePair& pair : pairs) {
    sides.sensors.push_back(pair.sensorToTracker);
    sides.volumes.push_back(pair.volumeToWorld);
  }
  return sides;
}

} // namespace

std::string HandEyeScanName(const std::vector<HandEyePair>& pairs, std::size_t scan)
{
  return pairs[scan].name.empty() ? "scan " + std::to_string(scan + 1) : pairs[scan].name;
}

std::vector<HandEyePair> CheckedHandEyePairs(const std::vector<HandEyePair>& pairs)
{
  std::vector<HandEyePair> checked;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::string name = HandEyeScanName(pairs, i);
    checked.push_back({CheckedPose(pairs[i].sensorToTracker, name, "sensor pose"),
                       CheckedPose(pairs[i].volumeToWorld, name, "alignment"), name});
  }
  return checked;
}

std::vector<int> HandEyeRepeats(const std::vector<HandEyePair>& pairs)
{
  std::vector<int> repeats(pairs.size(), -1);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < i && repeats[i] < 0; ++j)
      if (repeats[j] < 0 && pairs[i].sensorToTracker.isApprox(pairs[j].sensorToTracker, 1e-9) &&
          pairs[i].volumeToWorld.isApprox(pairs[j].volumeToWorld, 1e-9))
        repeats[i] = static_cast<int>(j);
  return repeats;
}

void RefuseTooLittleMotion(const std::vector<HandEyePair>& pairs, const PoseNoise& sensorNoise, const PoseNoise& volumeNoise)
{
  if (pairs.size() < 3)
    RefuseHandEye(Format("three different scans are needed at least, 8 to 20 for accuracy, and there %s %d",
                         pairs.size() == 1 ? "is" : "are", static_cast<int>(pairs.size())));
  const Sides sides = SidesOf(pairs);
  const Eigen::Vector3d axis = SpreadOf(sides.volumes).axis;
  const auto check = [&axis](const char* name, const std::vector<Pose>& poses, const PoseNoise& noise) {
    const Eigen::Vector3d turns = SpreadOf(poses).turns * DegreesPerRadian; // the least first
    // Two of three axes count in a spread, so noise alone shows the root of two.
    const double limit = 3.0 * std::sqrt(2.0) * std::max(noise.degrees, 0.01);
    if (turns[2] < limit && Extent(poses) < std::max(6.0 * noise.mm, 1e-6))
      RefuseHandEye(Format("the poses of the %s are all the same; the probe must be turned between scans", name));
    if (turns[2] < limit)
      RefuseHandEye(Format(
          "the %s turned by %.2g degrees only (root mean square), no more than the noise may be, and translations alone say "
          "nothing of where the volume lies on the sensor; turn by 30 degrees and more, about different axes",
          name, turns[2]));
    if (turns[0] < limit)
      RefuseHandEye(
          Format("all turns of the %s are about one axis, or parallel ones (across it: %.2f degrees); the calibration may "
                 "shift along it. Axis in the volume's frame: (%.2f, %.2f, %.2f). Add scans that turn about an axis across it by "
                 "30 degrees and more",
                 name, turns[0], axis.x(), axis.y(), axis.z()));
  };
  check("sensor", sides.sensors, sensorNoise);
  check("volumes", sides.volumes, volumeNoise);
}

void RefuseTwoAnswers(const std::vector<HandEyePair>& pairs, const std::vector<char>& inlier, const HandEyeModel& model,
                      const HandEyeSolution& solution, const Eigen::Vector3d& target, double noiseScale)
{
  const std::vector<Eigen::Vector3d> axes = HandEyeRivalAxes(pairs, inlier, model, solution, noiseScale);
  if (axes.empty())
    return;
  const HandEyeModel::Fit best = model.Refine(solution, inlier);
  std::vector<Eigen::Vector3d> rivals;
  for (const Eigen::Vector3d& axis : axes) {
    const HandEyeModel::Fit rival = model.Refine(HandEyeRival(pairs, inlier, best.solution, axis, target), inlier);
    const double apart = DegreesPerRadian * RotationAngle(best.solution.volumeToSensor.inverse() * rival.solution.volumeToSensor);
    if (apart > LeastRivalDegrees && rival.cost <= best.cost + LeastRivalCost * noiseScale * noiseScale)
      rivals.push_back(axis);
  }
  if (rivals.empty())
    return;
  // A turn that keeps none of the axes: about one across a single axis, or between several.
  Eigen::Vector3d between = Eigen::Vector3d::Zero();
  std::string text;
  for (const Eigen::Vector3d& axis : rivals) {
    between += axis;
    text += Format("%s(%.2f, %.2f, %.2f)", text.empty() ? "" : " or ", axis.x(), axis.y(), axis.z());
  }
  if (rivals.size() == 1)
    between = rivals.front().unitOrthogonal();
  between.normalize();
  RefuseHandEye(
      Format("%s answers fit alike: the calibration may be turned by half a turn about the volume's axis %s, which every turn "
             "between the scans keeps or reverses. Add a scan that is turned by 30 to 90 degrees about (%.2f, %.2f, %.2f)",
             rivals.size() == 1 ? "two" : "several", text.c_str(), between.x(), between.y(), between.z()));
}

std::string ExplainDisagreement(const std::vector<HandEyePair>& given, const HandEyeParameters& parameters,
                                const HandEyeNoise& noise, const HandEyeConsensus& consensus, const Progress& progress)
{
  std::vector<HandEyePair> pairs = given;
  if (given.size() > AskedScans) {
    pairs.clear();
    for (std::size_t i = 0; i < AskedScans; ++i)
      pairs.push_back(given[i * given.size() / AskedScans]);
  }
  struct Repair {
    double sensorUnit, volumeUnit;
    bool invert; // one side; which one, residuals cannot tell
    const char* text;
  };
  static const Repair repairs[] = {
      {1000.0, 1.0, false, "the sensor poses are in metres, not mm: multiply their translations by 1000"},
      {1.0, 1000.0, false, "the alignments are in metres, not mm: multiply their translations by 1000"},
      {10.0, 1.0, false, "the sensor poses are in centimetres, not mm: multiply their translations by 10"},
      {1.0, 10.0, false, "the alignments are in centimetres, not mm: multiply their translations by 10"},
      {25.4, 1.0, false, "the sensor poses are in inches, not mm: multiply their translations by 25.4"},
      {1.0, 25.4, false, "the alignments are in inches, not mm: multiply their translations by 25.4"},
      {1.0, 1.0, true, ""},
      {1000.0, 1.0, true, "the sensor poses are in metres (multiply their translations by 1000) and "},
      {1.0, 1000.0, true, "the alignments are in metres (multiply their translations by 1000) and "},
  };
  const auto repaired = [&pairs](const Repair& repair, bool invertSensor) {
    std::vector<HandEyePair> result = pairs;
    for (HandEyePair& pair : result) {
      pair.sensorToTracker.translation() *= repair.sensorUnit;
      pair.volumeToWorld.translation() *= repair.volumeUnit;
      if (repair.invert) {
        Pose& pose = invertSensor ? pair.sensorToTracker : pair.volumeToWorld;
        pose = pose.inverse();
      }
    }
    return result;
  };
  const auto solve = [&parameters, &noise](const std::vector<HandEyePair>& tried) {
    const HandEyeModel model(tried, noise, parameters.target);
    return FindHandEyeConsensus(tried, model, true, parameters.target, false, parameters.seed);
  };
  const Repair* best = nullptr;
  // Minus the logarithm of the likelihood, of Student's distribution, which outliers do not rule.
  const auto doubt = [](const HandEyeConsensus& found) {
    double sum = 0.0;
    for (const double chiSquare : found.fit.chiSquare)
      sum += 6.0 * std::log1p(chiSquare / 6.0);
    return sum;
  };
  double leastDoubt = doubt(pairs.size() < given.size() ? solve(pairs) : consensus) - std::log(1000.0);
  double tried = 0.0;
  for (const Repair& repair : repairs) {
    progress(0.1 * tried++);
    const double repairedDoubt = doubt(solve(repaired(repair, true)));
    if (repairedDoubt < leastDoubt) {
      leastDoubt = repairedDoubt;
      best = &repair;
    }
  }
  if (!best)
    return "";
  std::string text = std::string("They would agree if ") + best->text;
  if (best->invert) {
    double levers[2];
    for (const bool sensor : {true, false})
      levers[sensor ? 0 : 1] = (solve(repaired(*best, sensor)).fit.solution.volumeToSensor * parameters.target).norm();
    text += Format(
        "one side is the wrong way round: invert the sensor poses if they are TrackerToSensor (the target then lies %.0f mm "
        "from the sensor), or the alignments if they are WorldToVolume (%.0f mm)",
        levers[0], levers[1]);
  }
  return text;
}

std::vector<std::string> HandEyeSuspicions(const std::vector<HandEyePair>& pairs, const HandEyeSolution& solution,
                                           const HandEyeParameters& parameters)
{
  std::vector<std::string> notes;
  const Sides sides = SidesOf(pairs);
  const double lever = (solution.volumeToSensor * parameters.target).norm();
  const double sensorExtent = Extent(sides.sensors), volumeExtent = Extent(sides.volumes);
  if (sensorExtent < 3.0 && volumeExtent < 3.0 && lever < 3.0)
    notes.push_back(
        Format("All lengths are tiny: the sensor moved within %.3g mm, and lies %.3g mm from the target. The poses of both "
               "sides may be in metres; then the result is, too.",
               sensorExtent, lever));
  const double other = solution.worldToTracker.inverse().translation().norm();
  if (lever > 400.0 && lever > 2.0 * other)
    notes.push_back(
        Format("The volume's target lies %.0f mm from the sensor, which is far for a probe. If the poses of both sides were "
               "given the wrong way round, VolumeToSensor and WorldToTracker have changed places; residuals cannot tell.",
               lever));
  return notes;
}

} // namespace echorama
