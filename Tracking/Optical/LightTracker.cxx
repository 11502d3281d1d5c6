// SPDX-License-Identifier: BSD-3-Clause
// Until the phase of the lights is known there is no background, and spots are what stands out of its surroundings. Then every
// frame, or every part of it, in which all lights are off goes into the background. When most of the picture differs from it, a
// lamp was switched on or a shade drawn: the background is made anew.
//
// A camera that is not triggered sees lights for a part of some exposures, and as much darker. Whether they touch is judged by
// what they would be if they had been on for all of it.
#include "LightTracker.h"

namespace echorama {
namespace {

constexpr double LeastShare = 0.4; // of an exposure: less tells too little

} // namespace

LightTracker::LightTracker(const SpotDetectorParameters& detector, const SpotTracksParameters& tracks, BlinkCode code,
                           BrightnessCalibration brightness)
  : detector_(detector), code_(std::move(code)), timing_(tracks), tracks_(tracks, code_), brightness_(std::move(brightness)),
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
    else if (const double share = OnShare(lights[i], time);
             lights[i].status == TrackedLight::Status::Seen && share > LeastShare) {
      Spot whole = lights[i].spot;
      whole.peak /= share;
      touches_[i] = JudgeTouch(whole, brightness_, touches_[i]);
    }
  }
  for (const auto& [begin, end] : tracks_.DarkRows(time, frame.height))
    background_.Add(frame, begin, end);
  return lights;
}

double LightTracker::OnShare(const TrackedLight& light, double time) const
{
  const auto phase = tracks_.Phase();
  const double slot = 1e-3 * timing_.slotMs, begin = time + 1e-6 * timing_.rowUs * light.spot.position.y() - phase.value_or(0.0);
  return phase ? code_.OnShare(light.light, begin / slot, (begin + 1e-3 * timing_.exposureMs) / slot) : 0.0;
}

} // namespace echorama
