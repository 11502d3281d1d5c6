// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/BrightnessCalibration.h"
#include "Tracking/Optical/SpotTracks.h"
#include <vector>

namespace echorama {

/// From the frames of one camera to lights with names: detector, background and tracks, joined. What a camera or a recording puts
/// in, and what maps pixels to skin takes out, are of no concern here.
class LightTracker {
public:
  /// \throws Error(InvalidParameter)
  LightTracker(const SpotDetectorParameters& detector, const SpotTracksParameters& tracks, BlinkCode code,
               BrightnessCalibration brightness = {});

  /// A frame whose first row began to be exposed at \a time. \throws Error(BadInput) as SpotTracks::Update
  const std::vector<TrackedLight>& Update(const GreyFrame& frame, double time);

  const std::vector<TrackedLight>& Lights() const { return tracks_.Lights(); }
  /// Of each light: while it is not lost.
  Touch TouchOf(int light) const { return touches_[static_cast<std::size_t>(light)]; }
  const SpotFrame& Spots() const { return spots_; } ///< of the newest frame
  bool HasBackground() const { return background_.IsComplete(); }
  const SpotTracks& Tracks() const { return tracks_; }

private:
  double OnShare(const TrackedLight& light, double time) const; // of its exposure

  SpotDetector detector_;
  BlinkCode code_;
  SpotTracksParameters timing_;
  SpotTracks tracks_;
  BrightnessCalibration brightness_;
  LightsOffBackground background_;
  SpotFrame spots_;
  std::vector<Touch> touches_;
};

} // namespace echorama
