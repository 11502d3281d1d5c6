// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <chrono>

namespace echorama {

using Clock = std::chrono::steady_clock;

inline double SecondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

} // namespace echorama
