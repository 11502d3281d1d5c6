// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Tracking/Optical/BlinkCode.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;

TEST(BlinkCode, AnyTwoWordsDifferInThreeSlotsHoweverTheyAreShifted)
{
  for (int lights = 1; lights <= 4; ++lights)
    for (const int offSlots : {1, 2}) {
      const BlinkCode code = BlinkCode::Make(lights, offSlots);
      ASSERT_EQ(code.Lights(), lights);
      for (int a = 0; a < lights; ++a) {
        int off = 0, pause = 0;
        for (int slot = 0; slot < code.Length(); ++slot)
          off += !code.On(a, slot);
        EXPECT_GE(off, 3); // no lamp
        for (int slot = 0; slot < 2 * code.Length(); ++slot) {
          pause = code.On(a, slot) ? 0 : pause + 1;
          EXPECT_LE(pause, 2);
        }
        for (int slot = 0; slot < offSlots; ++slot)
          EXPECT_FALSE(code.On(a, slot));
        for (int b = 0; b < lights; ++b)
          for (int shift = 0; shift < code.Length(); ++shift) {
            int different = 0, outOfStep = 0; // of the latter, frames hold the halves of two slots
            for (int slot = 0; slot < code.Length(); ++slot) {
              different += code.On(a, slot) != code.On(b, slot + shift);
              outOfStep += code.On(a, slot) + code.On(a, slot + 1) != code.On(b, slot + shift) + code.On(b, slot + shift + 1);
            }
            if (a != b || shift != 0) {
              EXPECT_GE(different, 3) << lights << " lights: " << a << ", " << b << " shifted by " << shift;
              EXPECT_GE(outOfStep, 4) << lights << " lights: " << a << ", " << b << " shifted by " << shift;
            }
          }
      }
      // None is shorter: a program of its own went through all sets of words. Some differ in 3 slots in 8, but in fewer out of
      // step.
      constexpr int shortest[] = {7, 9, 10, 11};
      EXPECT_EQ(code.Length(), shortest[lights - 1]) << lights << " " << offSlots; // an eighth of a second
    }
  EXPECT_THROW(BlinkCode::Make(0), Error);
  EXPECT_THROW(BlinkCode::Make(5), Error);
  EXPECT_THROW(BlinkCode::Make(2, 3), Error);
}

TEST(BlinkCode, ShareIsTheIntegralOfTheWord)
{
  const BlinkCode code = BlinkCode::Make(3, 2);
  Random random(4);
  for (int trial = 0; trial < 200; ++trial) {
    const int light = static_cast<int>(random.Below(3));
    const double from = random.Uniform(-40.0, 40.0), to = from + random.Uniform(0.01, 3.0);
    double sum = 0.0;
    const int steps = 20000;
    for (int i = 0; i < steps; ++i)
      sum += code.On(light, static_cast<std::int64_t>(std::floor(from + (to - from) * (i + 0.5) / steps)));
    EXPECT_NEAR(code.OnShare(light, from, to), sum / steps, 2e-3);
  }
}

// What a camera would see of one light: whole windows of the code, with noise, at any phase.
std::vector<BlinkObservation> Seen(const BlinkCode& code, const BlinkTiming& timing, int light, double phase, int frames,
                                   Random& random, double noise = 0.05, double frameSeconds = 1.0 / 90.0)
{
  std::vector<BlinkObservation> seen;
  for (int frame = 0; frame < frames; ++frame) {
    const double begin = 7.0 + frame * frameSeconds, from = (begin - phase) / timing.slot;
    const double share = code.OnShare(light, from, from + timing.exposure / timing.slot);
    seen.push_back({begin, share < 0.07 ? 0.0 : 800.0 * share * (1.0 + noise * random.Normal())});
  }
  return seen;
}

TEST(BlinkCode, LightAndPhaseAreFoundAtAnyPhase)
{
  for (int lights = 2; lights <= 4; ++lights) {
    const BlinkCode code = BlinkCode::Make(lights, 2);
    const BlinkTiming timing;
    const double period = code.Length() * timing.slot;
    int found = 0, trials = 400;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(11, static_cast<std::uint64_t>(trial));
      const int light = static_cast<int>(random.Below(static_cast<std::uint64_t>(lights)));
      const double phase = random.Uniform(0.0, period);
      const auto seen = Seen(code, timing, light, phase, code.Length() * 3 / 2, random);
      const BlinkMatch match = MatchBlink(code, timing, seen, std::nullopt);
      if (match.light < 0)
        continue;
      ++found;
      EXPECT_EQ(match.light, light);
      const double off = std::remainder(match.phase - phase, period);
      EXPECT_LT(std::abs(off), 0.4 * timing.slot);
    }
    EXPECT_GT(found, trials * 97 / 100) << lights;
  }
}

TEST(BlinkCode, OneLostFrameIsToleratedAndErrorsAreNoticed)
{
  const BlinkCode code = BlinkCode::Make(4, 2);
  const BlinkTiming timing;
  int found = 0, trials = 0;
  for (int light = 0; light < 4; ++light)
    for (int lost = 0; lost < code.Length(); ++lost) {
      Random random(5, static_cast<std::uint64_t>(lost));
      auto seen = Seen(code, timing, light, 0.003, code.Length(), random);
      seen.erase(seen.begin() + lost);
      const BlinkMatch match = MatchBlink(code, timing, seen, 0.003);
      EXPECT_EQ(match.light, light);
      // Beside it, one light seen that is off, or the other way round: never another's.
      for (std::size_t wrong = 0; wrong < seen.size(); ++wrong) {
        auto bad = seen;
        bad[wrong].brightness = bad[wrong].brightness > 0.0 ? 0.0 : 800.0;
        const BlinkMatch doubtful = MatchBlink(code, timing, bad, 0.003);
        EXPECT_TRUE(doubtful.light == light || doubtful.light == -1);
        found += doubtful.light == light;
        ++trials;
      }
    }
  EXPECT_LT(found, trials / 2); // noticed
}

TEST(BlinkCode, WhatDoesNotBlinkLikeThatIsNobody)
{
  const BlinkCode code = BlinkCode::Make(2, 1);
  const BlinkTiming timing;
  for (std::uint64_t trial = 0; trial < 2000; ++trial) {
    Random random(21, trial);
    std::vector<BlinkObservation> lamp, flicker;
    for (int frame = 0; frame < code.Length() * 3 / 2; ++frame) {
      lamp.push_back({frame / 90.0, 500.0 + 25.0 * random.Normal()});
      flicker.push_back({frame / 90.0, random.Uniform() < 0.6 ? random.Uniform(100.0, 900.0) : 0.0});
    }
    EXPECT_EQ(MatchBlink(code, timing, lamp, std::nullopt).light, -1);
    // Known phase: a random flicker must not pass often. (It is asked for at every frame.)
    if (trial < 200) {
      EXPECT_LT(MatchBlink(code, timing, flicker, 0.0).light, 0) << trial;
    }
  }
  EXPECT_EQ(MatchBlink(code, timing, {}, std::nullopt).light, -1);
}

// A spot in which two lights lie is nobody's; a little of another does not matter.
TEST(BlinkCode, TwoLightsInOneSpotAreNobody)
{
  const BlinkTiming timing;
  int asOne = 0, found = 0, trials = 0;
  for (int lights = 2; lights <= 4; ++lights) {
    const BlinkCode code = BlinkCode::Make(lights, 2);
    for (int trial = 0; trial < 300; ++trial) {
      Random random(12, static_cast<std::uint64_t>(trial));
      const double phase = random.Uniform(0.0, code.Length() * timing.slot), share = random.Uniform(0.4, 1.0);
      const int light = static_cast<int>(random.Below(static_cast<std::uint64_t>(lights))), other = (light + 1) % lights;
      const int frames = code.Length() * 3 / 2;
      const auto one = Seen(code, timing, light, phase, frames, random), two = Seen(code, timing, other, phase, frames, random);
      auto both = one, little = one;
      for (std::size_t i = 0; i < one.size(); ++i) {
        both[i].brightness += share * two[i].brightness;
        little[i].brightness += 0.05 * two[i].brightness;
      }
      EXPECT_EQ(MatchBlink(code, timing, both, phase).light, -1) << lights << " " << trial;
      asOne += BlinkResidual(code, timing, both, light, phase) < 0.15;
      found += MatchBlink(code, timing, little, phase).light == light;
      ++trials;
    }
  }
  EXPECT_GT(asOne, trials / 2); // it would have passed for one
  EXPECT_GT(found, trials * 95 / 100);
}

TEST(BlinkCode, LightsInTurnNeedTheTrigger)
{
  const BlinkCode code = BlinkCode::Alternating();
  EXPECT_TRUE(code.NeedsTrigger());
  const BlinkTiming timing;
  Random random(3);
  const auto seen = Seen(code, timing, 1, 7.0, 6, random);
  EXPECT_EQ(MatchBlink(code, timing, seen, std::nullopt).light, -1);
  EXPECT_EQ(MatchBlink(code, timing, seen, 7.0).light, 1);
}

} // namespace
