// SPDX-License-Identifier: BSD-3-Clause
// Codes are found by trying: words of few off slots first, each beside those that are taken, with a step back when none fits, for
// lengths from the shortest.
//
// A match needs no threshold on single frames. With a rolling shutter, or slots out of step with frames, a frame may see the end
// of one slot and the beginning of the next; so the expected brightness is the share of its exposure in which the light is on,
// times an unknown amplitude, which least squares give in closed form. One frame that is wrong by a third of it is an error.
// Phases are tried at quarters of a slot, all lights at each. What the light of two explains, each in proportion to its own word,
// is the light of two in one spot.
#include "BlinkCode.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <bitset>
#include <cmath>
#include <functional>

namespace echorama {

namespace {

constexpr int LongestWord = 16;
constexpr int Distance = 3;
constexpr int LongestPause = 2;
constexpr int PhasesPerSlot = 4;
// Words differ in three slots of about ten: one wrong slot leaves a tenth, another's word a quarter, or less between two phases.
constexpr double LeastMargin = 0.08, LeastRatio = 3.0;
constexpr double LargestError = 0.35;   // of a light's brightness: more than this in one frame is an error
constexpr double LeastDifference = 0.3; // of the same: less in one frame tells nothing apart
constexpr double LargestMixture = 0.25; // of another's light, over its own, in what is one light's

std::uint32_t Turned(std::uint32_t word, int by, int length)
{
  const std::uint32_t all = (1u << length) - 1u;
  return by == 0 ? word : ((word << by) | (word >> (length - by))) & all;
}

int Bits(std::uint32_t word)
{
  return static_cast<int>(std::bitset<32>(word).count());
}

// A camera out of step sees half of each of two slots: in how many of its frames two words then differ by half a light at least.
int HalfDifferences(std::uint32_t a, std::uint32_t b, int length)
{
  const auto difference = [&](int slot) {
    return static_cast<int>(a >> (slot % length) & 1u) - static_cast<int>(b >> (slot % length) & 1u);
  };
  int count = 0;
  for (int slot = 0; slot < length; ++slot)
    count += difference(slot) + difference(slot + 1) != 0;
  return count;
}

bool Differ(std::uint32_t a, std::uint32_t b, int length)
{
  return Bits(a ^ b) >= Distance && HalfDifferences(a, b, length) > Distance;
}

// Whether a word can be told from itself at another phase, and from a lamp that is always on.
bool IsUseful(std::uint32_t word, int length, int offSlots)
{
  if ((word & ((1u << offSlots) - 1u)) != 0 || length - Bits(word) < Distance)
    return false;
  for (int by = 1; by < length; ++by)
    if (!Differ(word, Turned(word, by, length), length))
      return false;
  int pause = 0;
  for (int slot = 0; slot < 2 * length; ++slot) {
    pause = (word >> (slot % length) & 1u) != 0 ? 0 : pause + 1;
    if (pause > LongestPause)
      return false;
  }
  return true;
}

bool AreApart(std::uint32_t a, std::uint32_t b, int length)
{
  for (int by = 0; by < length; ++by)
    if (!Differ(a, Turned(b, by, length), length))
      return false;
  return true;
}

} // namespace

BlinkCode::BlinkCode(std::vector<std::uint32_t> words, int length, int offSlots, bool needsTrigger)
  : words_(std::move(words)), length_(length), offSlots_(offSlots), needsTrigger_(needsTrigger)
{
  for (const std::uint32_t word : words_) {
    std::vector<double> sums{0.0};
    for (int slot = 0; slot < length_; ++slot)
      sums.push_back(sums.back() + (word >> slot & 1u));
    onBefore_.push_back(std::move(sums));
  }
}

BlinkCode BlinkCode::Make(int lights, int offSlots)
{
  if (lights < 1 || lights > 4)
    throw Error(Error::Kind::InvalidParameter, "blink codes are for 1 to 4 lights, not for " + std::to_string(lights));
  if (offSlots < 1 || offSlots > LongestPause)
    throw Error(Error::Kind::InvalidParameter, "a blink code has 1 or 2 slots with all lights off");
  for (int length = 4; length <= LongestWord; ++length) {
    std::vector<std::uint32_t> useful;
    for (std::uint32_t word = 0; word < 1u << length; ++word)
      if (IsUseful(word, length, offSlots))
        useful.push_back(word);
    std::stable_sort(useful.begin(), useful.end(), [](std::uint32_t a, std::uint32_t b) { return Bits(a) > Bits(b); });
    std::vector<std::uint32_t> taken;
    const std::function<bool(std::size_t)> extend = [&](std::size_t from) {
      if (static_cast<int>(taken.size()) == lights)
        return true;
      for (std::size_t i = from; i < useful.size(); ++i) {
        if (!std::all_of(taken.begin(), taken.end(), [&](std::uint32_t other) { return AreApart(useful[i], other, length); }))
          continue;
        taken.push_back(useful[i]);
        if (extend(i + 1))
          return true;
        taken.pop_back();
      }
      return false;
    };
    if (extend(0))
      return BlinkCode(taken, length, offSlots, false);
  }
  throw Error(Error::Kind::NotPossible, "there are no blink codes for so many lights");
}

BlinkCode BlinkCode::Alternating()
{
  return BlinkCode({1u, 2u}, 2, 0, true);
}

bool BlinkCode::On(int light, std::int64_t slot) const
{
  const std::int64_t within = (slot % length_ + length_) % length_;
  return (words_[static_cast<std::size_t>(light)] >> within & 1u) != 0;
}

double BlinkCode::OnBefore(std::size_t light, double time) const
{
  const std::vector<double>& sums = onBefore_[light];
  const double periods = std::floor(time / length_);
  const double within = std::clamp(time - periods * length_, 0.0, static_cast<double>(length_));
  const int slot = std::min(static_cast<int>(within), length_ - 1);
  const auto at = static_cast<std::size_t>(slot);
  return periods * sums.back() + sums[at] + (within - slot) * (sums[at + 1] - sums[at]);
}

double BlinkCode::OnShare(int light, double from, double to) const
{
  if (!(to > from))
    return On(light, static_cast<std::int64_t>(std::floor(from))) ? 1.0 : 0.0;
  const auto index = static_cast<std::size_t>(light);
  return std::clamp((OnBefore(index, to) - OnBefore(index, from)) / (to - from), 0.0, 1.0);
}

namespace {

double ShareIn(const BlinkCode& code, const BlinkTiming& timing, const BlinkObservation& observation, int light, double phase)
{
  const double from = (observation.begin - phase) / timing.slot;
  return code.OnShare(light, from, from + timing.exposure / timing.slot);
}

// What was seen of a light beside what its code says.
struct BlinkSums {
  double squares = 0.0, expected = 0.0, both = 0.0;
  bool IsDark() const { return squares <= 0.0 || both <= 0.0; }
};

BlinkSums SumUp(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                double phase)
{
  BlinkSums sums;
  for (const BlinkObservation& o : seen) {
    const double share = ShareIn(code, timing, o, light, phase);
    sums.squares += o.brightness * o.brightness;
    sums.expected += share * share;
    sums.both += share * o.brightness;
  }
  return sums;
}

// Whether more than one frame tells two lights apart: one may be wrong.
bool AreToldApart(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                  int other, double phase)
{
  return std::count_if(seen.begin(), seen.end(), [&](const BlinkObservation& o) {
           return std::abs(ShareIn(code, timing, o, light, phase) - ShareIn(code, timing, o, other, phase)) > LeastDifference;
         }) > 1;
}

// The largest difference in one frame, over the brightness of the light.
double LargestDifference(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                         double phase)
{
  const BlinkSums sums = SumUp(code, timing, seen, light, phase);
  if (sums.IsDark())
    return 1.0;
  double largest = 0.0;
  for (const BlinkObservation& o : seen)
    largest = std::max(largest, std::abs(o.brightness * sums.expected / sums.both - ShareIn(code, timing, o, light, phase)));
  return largest;
}

} // namespace

double BlinkAmplitude(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                      double phase)
{
  const BlinkSums sums = SumUp(code, timing, seen, light, phase);
  return sums.IsDark() ? 0.0 : sums.both / sums.expected;
}

double BlinkResidual(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                     double phase)
{
  const BlinkSums sums = SumUp(code, timing, seen, light, phase);
  return sums.IsDark() ? 1.0 : std::clamp(1.0 - sums.both * sums.both / (sums.squares * sums.expected), 0.0, 1.0);
}

double BlinkMixture(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen, int light,
                    int other, double phase)
{
  double own = 0.0, others = 0.0, both = 0.0, ofOwn = 0.0, ofOther = 0.0; // products of shares, and with what was seen
  for (const BlinkObservation& o : seen) {
    const double a = ShareIn(code, timing, o, light, phase), b = ShareIn(code, timing, o, other, phase);
    own += a * a;
    others += b * b;
    both += a * b;
    ofOwn += a * o.brightness;
    ofOther += b * o.brightness;
  }
  const double least = own * others - both * both;
  if (least <= 1e-6 * own * others)
    return 0.0; // nobody can tell
  const double amplitude = ofOwn * others - ofOther * both, otherAmplitude = ofOther * own - ofOwn * both;
  return amplitude > 0.0 ? otherAmplitude / amplitude : 1.0;
}

BlinkMatch MatchBlink(const BlinkCode& code, const BlinkTiming& timing, const std::vector<BlinkObservation>& seen,
                      std::optional<double> phase, double limit)
{
  BlinkMatch best;
  double least = 1.0, rival = 1.0; // residuals: of the best, and of the best other light
  std::vector<double> residuals(static_cast<std::size_t>(code.Lights()), 1.0);
  const int phases = phase ? 1 : PhasesPerSlot * code.Length();
  for (int light = 0; light < code.Lights(); ++light)
    for (int step = 0; step < phases; ++step) {
      const double at = phase ? *phase : step * timing.slot / PhasesPerSlot;
      const double residual = BlinkResidual(code, timing, seen, light, at);
      double& ofLight = residuals[static_cast<std::size_t>(light)];
      ofLight = std::min(ofLight, residual);
      if (residual < least) {
        least = residual;
        best.light = light;
        best.phase = at;
      }
    }
  for (int light = 0; light < code.Lights(); ++light)
    if (light != best.light)
      rival = std::min(rival, residuals[static_cast<std::size_t>(light)]);
  if (best.light < 0 || (code.NeedsTrigger() && !phase) ||
      (limit < 1.0 && LargestDifference(code, timing, seen, best.light, best.phase) > LargestError))
    best.light = -1;
  for (int other = 0; limit < 1.0 && best.light >= 0 && other < code.Lights(); ++other)
    if (other != best.light && (!AreToldApart(code, timing, seen, best.light, other, best.phase) ||
                                BlinkMixture(code, timing, seen, best.light, other, best.phase) > LargestMixture))
      best.light = -1; // two lights in one spot
  if (least > limit || rival < std::max(least + LeastMargin, LeastRatio * least))
    best.light = -1;
  return best;
}

} // namespace echorama
