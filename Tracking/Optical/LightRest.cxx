// SPDX-License-Identifier: BSD-3-Clause
// Noise of spots is independent from frame to frame; the tremor of a hand (about 10 Hz) is not. So the mean's error is taken from
// the means of a few blocks, each longer than that, and the noise of the spots themselves is its least.
#include "LightRest.h"
#include "Core/Base/Percentile.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

constexpr int TremorBlocks = 5;
constexpr double SteadySize = 0.15; // a light that comes down grows narrower meanwhile
constexpr int LiftedAfter = 20;     // frames without it
constexpr double FullyLit = 0.9;    // share of the brightnesses below that which counts

} // namespace

ParameterList Describe(LightRestParameters& p)
{
  return {Parameter("RestFrames", p.frames, {2.0 * TremorBlocks, 1000}, "",
                    "In so many frames a light must be seen at one place to be at rest there."),
          Parameter("StillPx", p.stillPx, {0, 100, true}, "px", "None of them may be further from their mean."),
          Parameter("LeavePx", p.leavePx, {0, 1000, true}, "px", "It has left the place once it is further from it.")};
}

Touch RestingLight::TouchBy(const BrightnessCalibration& brightness) const
{
  Spot spot;
  spot.position = position;
  spot.peak = peak;
  spot.size = size;
  return JudgeTouch(spot, brightness, Touch::Contact);
}

LightRest::LightRest(const LightRestParameters& parameters) : parameters_(parameters)
{
  CheckRanges(parameters);
}

std::optional<RestingLight> LightRest::Update(const TrackedLight& light, Touch touch)
{
  if (light.status == TrackedLight::Status::Lost) {
    samples_.clear();
    if (++lost_ >= LiftedAfter)
      rested_.reset();
    return {};
  }
  lost_ = 0;
  if (light.status != TrackedLight::Status::Seen)
    return {};
  if (rested_) {
    if ((light.spot.position - *rested_).norm() <= parameters_.leavePx)
      return {};
    samples_.clear();
    rested_.reset();
  }
  if (touch == Touch::Hover) {
    samples_.clear();
    return {};
  }
  samples_.push_back({light.spot.position, light.spot.covariance, light.spot.peak, light.spot.size});
  if (static_cast<int>(samples_.size()) > parameters_.frames)
    samples_.pop_front();
  if (static_cast<int>(samples_.size()) < parameters_.frames)
    return {};
  const RestingLight rest = Mean();
  for (const Sample& sample : samples_)
    if ((sample.position - rest.position).norm() > parameters_.stillPx || std::abs(sample.size / rest.size - 1.0) > SteadySize)
      return {};
  rested_ = rest.position;
  return rest;
}

RestingLight LightRest::Mean() const
{
  RestingLight rest;
  const double count = static_cast<double>(samples_.size());
  Eigen::Matrix2d ofSpots = Eigen::Matrix2d::Zero();
  std::vector<double> peaks;
  for (const Sample& sample : samples_) {
    rest.position += sample.position / count;
    rest.size += sample.size / count;
    ofSpots += sample.covariance / (count * count);
    peaks.push_back(sample.peak);
  }
  rest.peak = Percentile(std::move(peaks), FullyLit);
  Eigen::Matrix2d ofBlocks = Eigen::Matrix2d::Zero();
  for (int block = 0; block < TremorBlocks; ++block) {
    const std::size_t begin = samples_.size() * static_cast<std::size_t>(block) / TremorBlocks,
                      end = samples_.size() * static_cast<std::size_t>(block + 1) / TremorBlocks;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (std::size_t i = begin; i < end; ++i)
      mean += samples_[i].position / static_cast<double>(end - begin);
    ofBlocks += (mean - rest.position) * (mean - rest.position).transpose() / (TremorBlocks * (TremorBlocks - 1.0));
  }
  const double tremor = ofBlocks.trace() - ofSpots.trace();
  rest.covariance = tremor > 0.0 ? Eigen::Matrix2d(ofSpots + ofBlocks * (tremor / ofBlocks.trace())) : ofSpots;
  return rest;
}

} // namespace echorama
