// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/LightSchedule.h"
#include <array>
#include <cstdint>
#include <functional>
#include <string>

namespace echorama {

/// The lines that lights, and a camera's trigger, hang on.
class LightLines {
public:
  virtual ~LightLines() = default;
  /// All of them at once, as in LightChange. \throws Error
  virtual void Set(std::uint32_t on) = 0;
};

class LightClock {
public:
  virtual ~LightClock() = default;
  virtual std::int64_t Now() = 0; ///< ns
  /// May return before that, for instance when a signal comes.
  virtual void SleepUntil(std::int64_t time) = 0;
};

/// CLOCK_MONOTONIC, with absolute deadlines.
class SystemLightClock : public LightClock {
public:
  std::int64_t Now() override;
  void SleepUntil(std::int64_t time) override;
};

/// How punctual a run was.
struct LightRun {
  /// A change is late when it comes so much after its time, of the time for which lights are on in a slot: their brightness is
  /// then as much off.
  static constexpr double LateShare = 0.1;

  std::int64_t begin = 0;   ///< of slot 0, by the clock, once that is known
  std::int64_t slots = 0;   ///< whose time has come
  std::int64_t changes = 0; ///< that were made
  std::int64_t late = 0;    ///< of these
  std::int64_t missed = 0;  ///< slots that were over before anything could be done, and were passed over
  std::int64_t worst = 0;   ///< ns

  /// Of what should have been done, in [0, 1].
  double ShareOfLate() const;
  /// The share \a of all changes came no later than this, in seconds; a fifth too much at most.
  double Within(double of) const;
  /// "half within 0.06 ms, 99% within 0.11 ms, the worst 0.30 ms"
  std::string Punctuality() const;

  void Add(std::int64_t lateness, std::int64_t limit);

private:
  std::array<std::int64_t, 160> counts_{}; // by quarters of octaves of microseconds
};

/// Drives the lights for so many slots, or until \a goOn, which is asked at every change, says no. The times of all slots follow
/// from the moment of the first: what was late delays nothing, and slots that are over are passed over. All lines are off when it
/// returns or throws, unless they could not be set; then the error says so. \a run can be read by goOn, as it goes. \throws Error
/// of the lines
void RunLights(const LightSchedule& schedule, LightLines& lines, LightClock& clock, std::int64_t slots,
               const std::function<bool()>& goOn, LightRun& run);

/// Half a second of the same with all lines off, unless that is less than ten slots. \throws Error(NotPossible) that tells how
/// late changes were, when more than 5% of them were late.
void RehearseLights(const LightSchedule& schedule, LightLines& lines, LightClock& clock, const std::function<bool()>& goOn);

} // namespace echorama
