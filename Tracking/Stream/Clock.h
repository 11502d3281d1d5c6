// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <chrono>

namespace echorama {

/// Our clock: seconds since 1970, taken once from the system and counted on from there without jumps, so that neither a
/// correction of the system's clock nor daylight saving time ever moves a pose.
inline double ClockNow()
{
  using Steady = std::chrono::steady_clock;
  struct Origin {
    Steady::time_point steady = Steady::now();
    double seconds = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  };
  static const Origin origin;
  return origin.seconds + std::chrono::duration<double>(Steady::now() - origin.steady).count();
}

} // namespace echorama
