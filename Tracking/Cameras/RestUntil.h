// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cmath>
#include <ctime>

namespace echorama {

/// Waits until our clock says \a due, but for no more than \a seconds. \returns whether it does
inline bool RestUntil(double due, double seconds)
{
  const double until = std::min(due, ClockNow() + seconds);
  for (double rest = until - ClockNow(); rest > 0.0; rest = until - ClockNow()) {
    const timespec time{static_cast<time_t>(rest), static_cast<long>(1e9 * (rest - std::floor(rest)))};
    nanosleep(&time, nullptr); // a signal cuts it short
  }
  return ClockNow() >= due;
}

} // namespace echorama
