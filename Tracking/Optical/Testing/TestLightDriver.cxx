// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Tracking/Optical/LightDriver.h"
#include <gtest/gtest.h>
#include <stdexcept>

namespace {

using namespace echorama;

constexpr std::int64_t Begin = 123456789012345; // of the clock

struct FakeClock : LightClock {
  std::int64_t now = Begin;
  std::function<std::int64_t(int sleep)> over = [](int) { return 0; }; // how much too long a sleep is
  int sleeps = 0;

  std::int64_t Now() override { return now; }
  void SleepUntil(std::int64_t time) override { now = std::max(now, time) + over(sleeps++); }
};

struct FakeLines : LightLines {
  explicit FakeLines(FakeClock& theClock) : clock(theClock) {}
  struct Setting {
    std::int64_t at;
    std::uint32_t on;
  };
  FakeClock& clock;
  std::vector<Setting> settings;
  int failsAt = -1, failsFrom = 1 << 30, calls = 0;
  std::int64_t cost = 0;

  void Set(std::uint32_t on) override
  {
    clock.now += cost;
    const int call = calls++;
    if (call == failsAt || call >= failsFrom)
      throw Error(Error::Kind::FileSystem, "the line is gone");
    settings.push_back({clock.now, on});
  }
};

const auto always = [] { return true; };

LightSchedule Dimmed()
{
  LightScheduleParameters p;
  p.onShare = 0.4;
  p.trigger = true;
  return LightSchedule(p);
}

TEST(LightDriver, EveryChangeComesAtItsTime)
{
  const LightSchedule schedule = Dimmed();
  FakeClock clock;
  FakeLines lines(clock);
  LightRun run;
  RunLights(schedule, lines, clock, 1000, always, run);
  std::size_t i = 0;
  for (int slot = 0; slot < 1000; ++slot)
    for (const LightChange& change : schedule.ChangesIn(slot)) {
      ASSERT_LT(i, lines.settings.size());
      ASSERT_EQ(lines.settings[i].at - lines.settings[0].at, change.at);
      ASSERT_EQ(lines.settings[i++].on, change.on);
    }
  ASSERT_EQ(lines.settings.size(), i + 1);
  EXPECT_EQ(lines.settings.back().on, 0u);
  EXPECT_EQ(lines.settings.back().at - lines.settings[0].at, schedule.BeginOf(1000)); // the last slot was a whole one
  EXPECT_EQ(run.slots, 1000);
  EXPECT_EQ(run.changes, static_cast<std::int64_t>(i));
  EXPECT_EQ(run.late + run.missed + run.worst, 0);
}

TEST(LightDriver, DelaysDoNotAddUp)
{
  const LightSchedule schedule = Dimmed();
  FakeClock clock;
  clock.over = [](int) { return 150000; };
  FakeLines lines(clock);
  lines.cost = 20000;
  LightRun run;
  RunLights(schedule, lines, clock, 20000, always, run);
  EXPECT_EQ(run.worst, 170000);
  EXPECT_EQ(run.late, 0);
  EXPECT_EQ(run.slots, 20000);
  EXPECT_NEAR(run.Within(0.5), 170e-6, 40e-6);
  EXPECT_EQ(clock.now - Begin, 1000000 + schedule.BeginOf(20000) + 150000 + 20000);
}

TEST(LightDriver, LateIsATenthOfTheTimeThatALightIsOn)
{
  const LightSchedule schedule = Dimmed(); // on for 4.444 ms
  for (const auto& [over, late] : {std::pair(440000, false), std::pair(450000, true)}) {
    FakeClock clock;
    clock.over = [over = over](int) { return over; };
    FakeLines lines(clock);
    LightRun run;
    RunLights(schedule, lines, clock, 100, always, run);
    EXPECT_EQ(run.ShareOfLate(), late ? 1.0 : 0.0) << over;
  }
}

TEST(LightDriver, AfterAPauseItIsInStepAtOnceAndCountsWhatItMissed)
{
  LightScheduleParameters p;
  const LightSchedule schedule(p); // a change a slot
  const std::int64_t slot = schedule.BeginOf(1);
  FakeClock clock;
  clock.over = [&](int sleep) { return sleep == 20 ? 7 * slot / 2 : 0; }; // asleep from slot 20 to the middle of slot 23
  FakeLines lines(clock);
  LightRun run;
  RunLights(schedule, lines, clock, 40, always, run);
  EXPECT_EQ(run.slots, 40);
  EXPECT_EQ(run.missed, 2); // 21 and 22; what was due in 20 came late
  EXPECT_EQ(run.late, 2);
  EXPECT_NEAR(static_cast<double>(run.worst), 3.5 * static_cast<double>(slot), 1.0);
  EXPECT_DOUBLE_EQ(run.ShareOfLate(), 4.0 / 40.0);
  const std::int64_t start = lines.settings[0].at;
  for (const FakeLines::Setting& setting : lines.settings)
    if (setting.at - start > schedule.BeginOf(23) + slot / 2 && &setting != &lines.settings.back()) {
      const std::int64_t now = schedule.SlotAt(setting.at - start);
      EXPECT_EQ(setting.at - start, schedule.BeginOf(now)); // nothing is made up for
      EXPECT_EQ(setting.on, schedule.ChangesIn(now).front().on);
    }
  // The state of slot 23 was set as soon as the pause was over.
  bool found = false;
  for (const FakeLines::Setting& setting : lines.settings)
    found = found || (setting.at - start > schedule.BeginOf(23) && setting.at - start < schedule.BeginOf(24) &&
                      setting.on == schedule.ChangesIn(23).front().on);
  EXPECT_TRUE(found);
}

// Who is asleep while a light should go off sets it off, not on.
TEST(LightDriver, WhatIsOverIsNotSetAnyMore)
{
  LightScheduleParameters p;
  p.onShare = 0.1;
  const LightSchedule schedule(p);
  FakeClock clock;
  clock.over = [&](int) { return schedule.BeginOf(1) / 2; };
  FakeLines lines(clock);
  LightRun run;
  RunLights(schedule, lines, clock, 50, always, run);
  for (const FakeLines::Setting& setting : lines.settings)
    EXPECT_EQ(setting.on, 0u);
  EXPECT_EQ(run.ShareOfLate(), 1.0);
}

TEST(LightDriver, LightsAreOffHoweverItEnds)
{
  const LightSchedule schedule = Dimmed();
  {
    FakeClock clock; // stopped while a light is on
    FakeLines lines(clock);
    LightRun run;
    RunLights(
        schedule, lines, clock, 1 << 30, [&] { return lines.settings.empty() || (lines.settings.back().on & 1u) == 0; }, run);
    ASSERT_GE(lines.settings.size(), 2u);
    EXPECT_EQ(lines.settings[lines.settings.size() - 2].on & 1u, 1u);
    EXPECT_EQ(lines.settings.back().on, 0u);
    EXPECT_EQ(lines.settings.back().at, lines.settings[lines.settings.size() - 2].at); // at once
  }
  FakeClock whole;
  FakeLines every(whole);
  LightRun undisturbed;
  RunLights(schedule, every, whole, 100, always, undisturbed);
  for (int fail = 0; fail < every.calls; ++fail) { // the last one switches them off
    FakeClock clock;
    FakeLines lines(clock);
    lines.failsAt = fail;
    LightRun run;
    try {
      RunLights(schedule, lines, clock, 100, always, run);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "the line is gone");
    }
    ASSERT_FALSE(lines.settings.empty());
    EXPECT_EQ(lines.settings.back().on, 0u);
    EXPECT_EQ(lines.calls, fail + 2);
  }
  FakeClock clock;
  FakeLines dead(clock), other(clock);
  dead.failsFrom = 12;
  LightRun run;
  try {
    RunLights(schedule, dead, clock, 100, always, run);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the line is gone; nor could the lights be switched off");
  }
  FakeLines atTheEnd(clock);
  atTheEnd.failsFrom = every.calls - 1;
  try {
    RunLights(schedule, atTheEnd, clock, 100, always, run);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the line is gone; nor could the lights be switched off");
  }
  const auto fail = [&]() -> bool {
    if (!other.settings.empty() && other.settings.back().on != 0)
      throw std::runtime_error("no error of ours");
    return true;
  };
  EXPECT_THROW(RunLights(schedule, other, clock, 100, fail, run), std::runtime_error);
  EXPECT_EQ(other.settings.back().on, 0u);
}

TEST(LightDriver, ARehearsalLightsNothingAndRefusesARateThatCannotBeHeld)
{
  LightScheduleParameters p;
  p.rateHz = 500.0;
  p.trigger = true;
  const LightSchedule schedule(p);
  for (const auto& [over, refused] : {std::pair(190000, false), std::pair(210000, true)}) {
    FakeClock clock;
    clock.over = [over = over](int) { return over; };
    FakeLines lines(clock);
    bool thrown = false;
    try {
      RehearseLights(schedule, lines, clock, always);
    } catch (const Error& error) {
      thrown = true;
      EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
      EXPECT_NE(
          std::string(error.what()).find("cannot hold 500 Hz: 100% of all changes came more than 0.200 ms late, or not at all"),
          std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find("the worst 0.21 ms"), std::string::npos) << error.what();
    }
    EXPECT_EQ(thrown, refused) << over;
    EXPECT_GT(lines.settings.size(), 250u);
    EXPECT_LT(clock.now - Begin, 600000000);
    for (const FakeLines::Setting& setting : lines.settings)
      ASSERT_EQ(setting.on, 0u);
  }
  for (const int each : {25, 17}) { // one of twenty may be late
    FakeClock clock;
    clock.over = [each](int sleep) { return sleep % each == 0 ? 900000 : 0; };
    FakeLines lines(clock);
    if (each > 20)
      EXPECT_NO_THROW(RehearseLights(schedule, lines, clock, always));
    else
      EXPECT_THROW(RehearseLights(schedule, lines, clock, always), Error);
  }
}

TEST(LightDriver, SharesOfLatenessAreThoseOfASortedList)
{
  LightRun run;
  std::vector<std::int64_t> all;
  std::uint64_t state = 1;
  for (int i = 0; i < 5000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    all.push_back(static_cast<std::int64_t>(1000.0 * std::exp2(static_cast<double>(state >> 40) / (1 << 24) * 12.0)));
    run.Add(all.back(), 500000);
  }
  std::sort(all.begin(), all.end());
  for (const double share : {0.5, 0.95, 0.99}) {
    const double exact = 1e-9 * static_cast<double>(all[static_cast<std::size_t>(share * 5000) - 1]);
    EXPECT_GE(run.Within(share), exact - 1e-12);
    EXPECT_LE(run.Within(share), 1.2 * exact + 2e-6);
  }
  double half = 0.0, most = 0.0, worst = 0.0;
  ASSERT_EQ(
      std::sscanf(run.Punctuality().c_str(), "half within %lf ms, 99%% within %lf ms, the worst %lf ms", &half, &most, &worst),
      3);
  EXPECT_NEAR(half, 1e3 * run.Within(0.5), 0.005);
  EXPECT_NEAR(most, 1e3 * run.Within(0.99), 0.005);
  EXPECT_NEAR(worst, 1e3 * run.Within(1.0), 0.005);
  EXPECT_EQ(run.Within(1.0), 1e-9 * static_cast<double>(all.back()));
  EXPECT_EQ(run.late, std::count_if(all.begin(), all.end(), [](std::int64_t each) { return each > 500000; }));
}

TEST(LightDriver, TheSystemsClockSleepsUntilAMomentAndNotLongAtATime)
{
  SystemLightClock clock;
  const std::int64_t start = clock.Now();
  clock.SleepUntil(start + 20000000);
  EXPECT_GE(clock.Now() - start, 20000000);
  clock.SleepUntil(start - 5); // is over
  const std::int64_t later = clock.Now();
  clock.SleepUntil(later + 3600000000000);
  EXPECT_LT(clock.Now() - later, 10000000000); // a tenth of a second, on an idle machine
}

} // namespace
