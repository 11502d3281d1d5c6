// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/DeviceClock.h"
#include <algorithm>
#include <cmath>

namespace echorama {

double DeviceClock::Map(std::uint32_t milliseconds, double arrival)
{
  constexpr double Jump = 1.0, FollowDown = 0.02, FollowUp = 2e-4;                              // s; seconds per second
  const double step = started_ ? 0.001 * static_cast<std::int32_t>(milliseconds - last_) : 0.0; // through the wrap
  last_ = milliseconds;
  counter_ += step;
  const double seen = arrival - counter_;
  if (!started_ || std::fabs(seen - offset_) > Jump) {
    if (started_) {
      ++jumps_;
      lastJump_ = offset_ - seen;
    }
    started_ = true;
    offset_ = seen;
  } else {
    const double passed = std::max(0.0, step);
    offset_ += std::clamp(seen - offset_, -FollowDown * passed, FollowUp * passed);
  }
  return counter_ + offset_;
}

} // namespace echorama
