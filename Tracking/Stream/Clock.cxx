// SPDX-License-Identifier: BSD-3-Clause
#include "Clock.h"
#include <chrono>

namespace echorama {

double ClockNow()
{
  using Steady = std::chrono::steady_clock;
  using System = std::chrono::system_clock;
  struct Origin {
    Steady::time_point steady = Steady::now();
    double seconds = std::chrono::duration<double>(System::now().time_since_epoch()).count();
  };
  static const Origin origin;
  return origin.seconds + std::chrono::duration<double>(Steady::now() - origin.steady).count();
}

} // namespace echorama
