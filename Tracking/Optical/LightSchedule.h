// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Tracking/Optical/BlinkCode.h"
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// What the driver of the lights is told.
struct LightScheduleParameters {
  enum class Code { Blink, Alternating };

  Code code = Code::Blink;
  int offSlots = 2;
  double rateHz = 90.0;
  double onShare = 1.0;
  double triggerShare = 0.5;

  int lights = 2;       ///< 1 to 4; two when they alternate
  bool trigger = false; ///< whether a line triggers the camera
};

ParameterList Describe(LightScheduleParameters&);

/// What lines show from a moment on.
struct LightChange {
  std::int64_t at = 0;  ///< ns after slot 0 began
  std::uint32_t on = 0; ///< bit i: light i; the bit after those of the lights: the trigger
};

/// When every line of the lights' driver changes, for ever: each light that is on in a slot comes on as the slot begins and
/// goes off when the on-share of it is over; the trigger rises as any slot begins.
class LightSchedule {
public:
  /// \throws Error(InvalidParameter)
  explicit LightSchedule(const LightScheduleParameters& parameters);

  const LightScheduleParameters& Parameters() const { return parameters_; }
  const BlinkCode& Code() const { return code_; }
  double SlotSeconds() const { return 1.0 / parameters_.rateHz; }

  /// In ns after slot 0 began, to the nearest: of any slot by itself, so that nothing adds up.
  std::int64_t BeginOf(std::int64_t slot) const;
  /// The slot that this moment is in, ns after slot 0 began; not before 0.
  std::int64_t SlotAt(std::int64_t at) const;
  /// One to three changes, in their order; the first is where the slot begins, even if it changes nothing.
  std::vector<LightChange> ChangesIn(std::int64_t slot) const;

  /// Of all time, in [0, 1].
  double MeanOnShare(int light) const;
  /// How long a light is on without a pause, at most.
  double LongestOnSeconds(int light) const;

  /// For people: a line of each light (\a lines: where it hangs, then the trigger's), and a picture of one period.
  std::string Picture(const std::vector<std::string>& lines) const;
  /// For programs: what the lines show from when on, over one period, in seconds.
  std::string Csv() const;

private:
  LightScheduleParameters parameters_;
  BlinkCode code_;
};

} // namespace echorama
