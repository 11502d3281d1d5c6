// SPDX-License-Identifier: BSD-3-Clause
// Until the phase of the lights is known there is no background, and spots are what stands out of its surroundings. Then every
// frame, or every part of it, in which all lights are off goes into the background. When most of the picture differs from it, a
// lamp was switched on or a shade drawn: the background is made anew.
#include "LightTracker.h"

namespace echorama {

LightTracker::LightTracker(const SpotDetectorParameters& detector, const SpotTracksParameters& tracks, BlinkCode code,
                           BrightnessCalibration brightness)
  : detector_(detector), tracks_(tracks, std::move(code)), brightness_(std::move(brightness)),
    touches_(tracks_.Lights().size(), Touch::Unknown)
{
}

const std::vector<TrackedLight>& LightTracker::Update(const GreyFrame& frame, double time)
{
  const bool useBackground = background_.IsComplete() && background_.Fits(frame);
  spots_ = detector_.Detect(frame, useBackground ? &background_ : nullptr);
  if (useBackground && spots_.state == FrameState::Changed) {
    background_.Clear();
    spots_ = detector_.Detect(frame);
  }
  const std::vector<TrackedLight>& lights = tracks_.Update(time, spots_.spots, spots_.state != FrameState::Good);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].status == TrackedLight::Status::Lost)
      touches_[i] = Touch::Unknown;
    else if (lights[i].status == TrackedLight::Status::Seen)
      touches_[i] = JudgeTouch(lights[i].spot, brightness_, touches_[i]);
  }
  for (const auto& [begin, end] : tracks_.DarkRows(time, frame.height))
    background_.Add(frame, begin, end);
  return lights;
}

} // namespace echorama
