// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/BrightnessCalibration.h"
#include "Tracking/Optical/SpotTracks.h"
#include <deque>
#include <optional>

namespace echorama {

struct LightRestParameters {
  int frames = 25;
  double stillPx = 1.0;
  double leavePx = 5.0;
};
ParameterList Describe(LightRestParameters& p);

/// A light that was held still, as it was seen meanwhile.
struct RestingLight {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();   ///< pixels, the mean
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero(); ///< of that mean, px^2: of the spots, and of the hand's tremor
  double peak = 0.0;                                    ///< of the frames that saw it brightest: others see part of a slot
  double size = 0.0;

  /// Whether it touches, as a light that is at rest; in single frames it may seem weaker.
  Touch TouchBy(const BrightnessCalibration& brightness) const;
};

/// Says when the light of a tool is held still on the skin: once each time, until it has been moved or lifted.
class LightRest {
public:
  /// \throws Error(InvalidParameter)
  explicit LightRest(const LightRestParameters& parameters = {});

  /// The light in the newest frame. Frames in which it is off, or hidden for a moment, do not count.
  std::optional<RestingLight> Update(const TrackedLight& light, Touch touch);

private:
  struct Sample {
    Eigen::Vector2d position;
    Eigen::Matrix2d covariance;
    double peak, size;
  };
  RestingLight Mean() const;

  LightRestParameters parameters_;
  std::deque<Sample> samples_;
  std::optional<Eigen::Vector2d> rested_; // where the last rest was
  int lost_ = 0;                          // frames on end
};

} // namespace echorama
