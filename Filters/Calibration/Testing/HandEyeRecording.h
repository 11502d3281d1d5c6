// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Random.h"
#include "Filters/Calibration/HandEye.h"
#include "Readers/PoseLog.h"
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

namespace echorama {

/// A recording of a hand that holds a camera over a board (hand_eye_calibration of ETH Zurich): the camera is the volume, the
/// board the world. Empty where ../shared/data is not there.
inline std::vector<HandEyePair> HandEyeRecording(const std::string& name)
{
  const std::filesystem::path path =
      std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/handeye_ethz" / ("paired_" + name + ".csv");
  std::vector<HandEyePair> pairs;
  if (!std::filesystem::exists(path))
    return pairs;
  const PoseLog log = ReadPoseLog(path.string());
  const std::vector<ToolPose> hand = log.Of("HandToBase"), board = log.Of("TargetToCamera");
  for (std::size_t i = 0; i < std::min(hand.size(), board.size()); ++i)
    pairs.push_back({hand[i].pose, board[i].pose.inverse(), ""});
  return pairs;
}

/// So many of them, from the first to the last.
inline std::vector<HandEyePair> EvenlyChosen(const std::vector<HandEyePair>& pairs, std::size_t count)
{
  std::vector<HandEyePair> chosen;
  for (std::size_t i = 0; i < count; ++i)
    chosen.push_back(pairs[(i * (pairs.size() - 1) + (count - 1) / 2) / (count - 1)]);
  return chosen;
}

/// Views to calibrate with, and others to test the calibration on.
struct HandEyeHalves {
  std::vector<HandEyePair> used, heldOut;
};
inline HandEyeHalves SplitAtRandom(std::vector<HandEyePair> pairs, std::uint64_t seed)
{
  Random random(seed);
  for (std::size_t i = pairs.size() - 1; i > 0; --i)
    std::swap(pairs[i], pairs[random.Below(i + 1)]);
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  return {{pairs.begin(), middle}, {middle, pairs.end()}};
}

/// Root mean square distance, mm, of a fixed \a point of the world, as the tracker and the calibration place it in each view,
/// from its mean place.
inline double HandEyeRepeat(const std::vector<HandEyePair>& views, const Pose& volumeToSensor, const Eigen::Vector3d& point)
{
  std::vector<Eigen::Vector3d> places;
  for (const HandEyePair& view : views)
    places.emplace_back(view.sensorToTracker * volumeToSensor * view.volumeToWorld.inverse() * point);
  const Eigen::Vector3d sum = std::accumulate(places.begin(), places.end(), Eigen::Vector3d(0.0, 0.0, 0.0));
  double squares = 0.0;
  for (const Eigen::Vector3d& place : places)
    squares += (place - sum / static_cast<double>(places.size())).squaredNorm();
  return std::sqrt(squares / static_cast<double>(places.size()));
}

} // namespace echorama
