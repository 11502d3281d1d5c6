// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

namespace echorama {

/// When each light of a set is on: words of equal length, one bit per slot of time, repeated for ever. One driver switches all
/// lights, so that they share their phase, which a camera need not know.
class BlinkCode {
public:
  /// The shortest words for 1 to 4 lights of which any two, shifted against each other in any way, differ in 3 slots at least:
  /// then one frame may be lost and one more error is still noticed; also by a camera out of step, which sees half of two slots.
  /// In the first \a offSlots (1 or 2) all are off, so that the background is seen; a rolling shutter needs 2. No light is off in
  /// more than 2 slots on end, and none is mistaken for a lamp that is always on. \throws Error(InvalidParameter)
  static BlinkCode Make(int lights, int offSlots = 1);
  /// Two lights in turn, as in dissertation 7.1. It says whose light it is only to a camera that is triggered by the driver: its
  /// phase cannot be seen.
  static BlinkCode Alternating();

  int Lights() const { return static_cast<int>(words_.size()); }
  int Length() const { return length_; }
  int OffSlots() const { return offSlots_; }
  bool NeedsTrigger() const { return needsTrigger_; }
  bool On(int light, std::int64_t slot) const;
  /// The share of the time [from, to), in slots, in which a light is on.
  double OnShare(int light, double from, double to) const;

private:
  BlinkCode(std::vector<std::uint32_t> words, int length, int offSlots, bool needsTrigger);
  double OnBefore(std::size_t light, double time) const; // slots that it was on since time 0

  std::vector<std::uint32_t> words_; // bit s: on in slot s
  std::vector<std::vector<double>> onBefore_;
  int length_, offSlots_;
  bool needsTrigger_;
};

/// How a camera samples a code, in seconds.
struct BlinkTiming {
  double slot = 1.0 / 90.0;
  double exposure = 0.008;
};

/// What was seen of one light in one frame.
struct BlinkObservation {
  double begin = 0.0;      ///< of the exposure of the row where it is, s
  double brightness = 0.0; ///< in any unit; 0: nothing was there
};

struct BlinkMatch {
  int light = -1;     ///< -1: none fits clearly better than all others
  double phase = 0.0; ///< when slot 0 begins, s, in [0, length * slot)
};

/// Whose light it is: the one whose code, of the given phase or of any, explains the brightness best, if that leaves less than
/// \a limit of it, the best rival clearly more, and no single frame
/// speaks against it. With a \a limit of 1, single frames may.
BlinkMatch MatchBlink(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen,
                      std::optional<double> phase, double limit = 0.15);

/// How bright a light is that is on for the whole exposure, by least squares; 0 when nothing was seen of it.
double BlinkAmplitude(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                      double phase);

/// What of the brightness, squared, one light at one phase leaves unexplained, in [0, 1].
double BlinkResidual(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                     double phase);

/// How much light of \a other there is in it, over that of \a light, if it is the light of both; 1 where it is not \a light's at
/// all, 0 where nobody can tell.
double BlinkMixture(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                    int other, double phase);

} // namespace echorama
