// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Tracking/Optical/LightSchedule.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;

LightScheduleParameters Four()
{
  LightScheduleParameters p;
  p.lights = 4;
  p.rateHz = 59.94;
  p.onShare = 0.3;
  p.trigger = true;
  return p;
}

// What lines show at a moment, from the changes of its slot alone.
std::uint32_t StateAt(const LightSchedule& schedule, std::int64_t at)
{
  std::uint32_t on = 0;
  for (const LightChange& change : schedule.ChangesIn(schedule.SlotAt(at)))
    if (change.at <= at)
      on = change.on;
  return on;
}

TEST(LightSchedule, LinesShowTheCodeForTheirShareOfEachSlot)
{
  for (const double onShare : {0.01, 0.3, 0.5, 1.0})
    for (const bool trigger : {false, true}) {
      LightScheduleParameters p = Four();
      p.onShare = onShare;
      p.trigger = trigger;
      const LightSchedule schedule(p);
      Random random(3);
      for (int trial = 0; trial < 3000; ++trial) {
        const auto slot = static_cast<std::int64_t>(random.Below(1000000));
        const double within = random.Uniform(0.0, 1.0);
        if (std::abs(within - onShare) < 1e-5 || std::abs(within - p.triggerShare) < 1e-5)
          continue; // rounding
        const auto at = static_cast<std::int64_t>((static_cast<double>(slot) + within) * 1e9 / p.rateHz);
        std::uint32_t expected = trigger && within < p.triggerShare ? 16u : 0u;
        for (int light = 0; light < 4; ++light)
          if (within < onShare && schedule.Code().On(light, slot))
            expected |= 1u << light;
        ASSERT_EQ(StateAt(schedule, at), expected) << "slot " << slot << " + " << within << ", on for " << onShare;
      }
    }
}

TEST(LightSchedule, SlotsNeverDrift)
{
  LightScheduleParameters p;
  p.rateHz = 90.0;
  const LightSchedule schedule(p);
  for (std::int64_t slot = 0; slot < 200000000; slot += 999983) // 25 days
    ASSERT_LE(std::abs(schedule.BeginOf(slot) - (slot * 100000000 + 4) / 9), 1) << slot;
  for (const double rate : {0.1, 59.94, 90.0, 2000.0}) {
    p.rateHz = rate;
    const LightSchedule other(p);
    for (std::int64_t slot = 1; slot < 10000000; slot = 2 * slot + 1) {
      ASSERT_EQ(other.SlotAt(other.BeginOf(slot)), slot) << rate;
      ASSERT_EQ(other.SlotAt(other.BeginOf(slot) - 1), slot - 1) << rate;
      ASSERT_EQ(other.ChangesIn(slot).front().at, other.BeginOf(slot)) << rate;
    }
    EXPECT_EQ(other.SlotAt(-5), 0);
  }
}

TEST(LightSchedule, HowLongLightsAreOnIsWhatTheyShow)
{
  for (const double onShare : {0.25, 1.0}) {
    LightScheduleParameters p = Four();
    p.onShare = onShare;
    const LightSchedule schedule(p);
    const int samples = 400, length = schedule.Code().Length();
    for (int light = 0; light < 4; ++light) {
      int on = 0, run = 0, longest = 0;
      for (int i = 0; i < 3 * length * samples; ++i) {
        const auto at = static_cast<std::int64_t>((i + 0.5) / samples * 1e9 / p.rateHz);
        run = (StateAt(schedule, at) >> light & 1u) != 0 ? run + 1 : 0;
        on += run > 0;
        longest = std::max(longest, run);
      }
      EXPECT_NEAR(schedule.MeanOnShare(light), static_cast<double>(on) / (3 * length * samples), 1e-9);
      EXPECT_NEAR(schedule.LongestOnSeconds(light), longest / (samples * p.rateHz), 1e-9);
    }
  }
}

// A camera that is out of step, with a clock that runs otherwise, sees dimmed lights, with some noise: their brightness depends
// on where in the slots it looks.
TEST(LightSchedule, DimmedLightsAreToldApartByACameraOutOfStep)
{
  for (const double onShare : {1.0, 0.7, 0.5, 0.3}) {
    LightScheduleParameters p;
    p.onShare = onShare;
    const LightSchedule schedule(p);
    const BlinkCode& code = schedule.Code();
    const BlinkTiming timing{schedule.SlotSeconds(), 0.008};
    int known = 0, wrong = 0, all = 0;
    const double noise = 5.0 * std::min(1.0, onShare * timing.slot / timing.exposure); // of 100: 5% of its brightness
    Random random(7);
    for (int light = 0; light < code.Lights(); ++light)
      for (int trial = 0; trial < 100; ++trial) {
        const double first = (1000.0 + trial / 100.0 * code.Length()) * timing.slot;
        std::vector<BlinkObservation> seen;
        for (int frame = 0; frame < code.Length() * 3 / 2; ++frame) {
          const double begin = first + frame * timing.slot * (1.0 + 20e-6);
          double sum = 0.0;
          for (int i = 0; i < 100; ++i)
            sum += StateAt(schedule, std::llround(1e9 * (begin + (i + 0.5) / 100 * timing.exposure))) >> light & 1u;
          seen.push_back({begin, std::max(0.0, sum + noise * random.Normal())});
        }
        const BlinkMatch match = MatchBlink(code, timing, seen, std::nullopt);
        known += match.light == light;
        wrong += match.light >= 0 && match.light != light;
        ++all;
      }
    EXPECT_EQ(wrong, 0) << onShare;
    EXPECT_GE(known, (onShare >= 0.5 ? 0.98 : 0.85) * all) << onShare; // shorter ones may fall between two exposures
  }
}

TEST(LightSchedule, SaysWhatItCannotDo)
{
  const auto refuse = [](auto change, const char* words) {
    LightScheduleParameters p;
    change(p);
    try {
      const LightSchedule schedule(p);
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refuse([](auto& p) { p.rateHz = 0.0; }, "RateHz is 0 Hz");
  refuse([](auto& p) { p.rateHz = std::nan(""); }, "RateHz");
  refuse([](auto& p) { p.onShare = 1.5; }, "OnShare is 1.5");
  refuse([](auto& p) { p.triggerShare = 1.0; }, "TriggerShare is 1");
  refuse([](auto& p) { p.lights = 5; }, "1 to 4 lights, not for 5");
  refuse([](auto& p) { p.offSlots = 3; }, "OffSlots is 3");
  refuse(
      [](auto& p) {
        p.code = LightScheduleParameters::Code::Alternating;
        p.lights = 3;
      },
      "two lights can alternate, not 3");
}

} // namespace
