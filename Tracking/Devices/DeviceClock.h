// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdint>

namespace echorama {

/// Puts a device's millisecond counter onto our clock.
///
/// A message is late by what the way takes, and sometimes by much more, but never early: so the offset between the clocks is
/// the smallest difference of arrival and counter that is seen. It is followed slowly, faster down (a message that came
/// sooner) than up (crystals that drift apart), so that mapped times neither leap nor run backwards: intervals are stretched
/// by at most 2 %. What remains is the shortest way itself, a few milliseconds on a serial line. The counter may wrap at 2^32.
/// A counter that leaps by more than a second against our clock has been set anew: the offset is, too.
class DeviceClock {
public:
  /// When a message was sent: seconds on our clock. \a arrival: when it came, on our clock.
  double Map(std::uint32_t milliseconds, double arrival);
  std::uint64_t Jumps() const { return jumps_; }
  double LastJump() const { return lastJump_; } ///< seconds that the counter went ahead; negative: back
  void Reset() { *this = DeviceClock(); }

private:
  bool started_ = false;
  std::uint32_t last_ = 0;
  double counter_ = 0.0; // seconds, unwrapped
  double offset_ = 0.0;
  std::uint64_t jumps_ = 0;
  double lastJump_ = 0.0;
};

} // namespace echorama
