// SPDX-License-Identifier: BSD-3-Clause
// Sleeping until a moment, not for a time, keeps delays from adding up. Whoever comes late sets what belongs to now: a light is
// never on for a slot in which it should be off because something else took long.
#include "LightDriver.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <cmath>
#include <ctime>

namespace echorama {

std::int64_t SystemLightClock::Now()
{
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1000000000 + now.tv_nsec;
}

void SystemLightClock::SleepUntil(std::int64_t time)
{
  // In pieces: a signal that came before the sleep began would not end it.
  time = std::min(time, Now() + 100000000);
  timespec until{};
  until.tv_sec = static_cast<time_t>(time / 1000000000);
  until.tv_nsec = static_cast<long>(time % 1000000000);
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

namespace {

std::size_t BinOf(std::int64_t lateness, std::size_t bins)
{
  const double microseconds = std::max(0.0, static_cast<double>(lateness) / 1e3);
  return std::min(bins - 1, static_cast<std::size_t>(std::ceil(4.0 * std::log2(1.0 + microseconds))));
}

} // namespace

void LightRun::Add(std::int64_t lateness, std::int64_t limit)
{
  ++changes;
  late += lateness > limit;
  worst = std::max(worst, lateness);
  ++counts_[BinOf(lateness, counts_.size())];
}

double LightRun::ShareOfLate() const
{
  return changes + missed == 0 ? 0.0 : static_cast<double>(late + missed) / static_cast<double>(changes + missed);
}

double LightRun::Within(double of) const
{
  std::int64_t sum = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    sum += counts_[bin];
    if (static_cast<double>(sum) >= of * static_cast<double>(changes))
      return std::min(1e-6 * (std::exp2(static_cast<double>(bin) / 4.0) - 1.0), 1e-9 * static_cast<double>(worst));
  }
  return 1e-9 * static_cast<double>(worst);
}

std::string LightRun::Punctuality() const
{
  return Format("half within %.2f ms, 99%% within %.2f ms, the worst %.2f ms", 1e3 * Within(0.5), 1e3 * Within(0.99),
                1e-6 * static_cast<double>(worst));
}

namespace {

std::int64_t LateLimit(const LightSchedule& schedule)
{
  return static_cast<std::int64_t>(1e9 * LightRun::LateShare * schedule.Parameters().onShare * schedule.SlotSeconds());
}

void Drive(const LightSchedule& schedule, LightLines& lines, LightClock& clock, std::int64_t slots,
           const std::function<bool()>& goOn, LightRun& run)
{
  const std::int64_t limit = LateLimit(schedule);
  const std::int64_t start = run.begin = clock.Now() + 1000000;
  const auto now = [&] { return clock.Now() - start; };
  const auto waitFor = [&](std::int64_t at) { // whether to go on then
    while (now() < at) {
      if (!goOn())
        return false;
      clock.SleepUntil(start + at);
    }
    return goOn();
  };
  for (std::int64_t slot = 0; slot < slots; ++slot) {
    const std::int64_t current = std::min(schedule.SlotAt(now()), slots); // the clock may stand before slot 0
    if (current > slot) {
      run.missed += current - slot;
      run.slots += current - slot;
      slot = current;
      if (slot == slots)
        return;
    }
    ++run.slots;
    const std::vector<LightChange> changes = schedule.ChangesIn(slot);
    for (std::size_t i = 0; i < changes.size(); ++i) {
      if (!waitFor(changes[i].at))
        return;
      if (i + 1 < changes.size() && now() >= changes[i + 1].at) {
        run.Add(now() - changes[i].at, 0); // left out: the next one is due
        continue;
      }
      lines.Set(changes[i].on);
      run.Add(now() - changes[i].at, limit);
    }
  }
  waitFor(schedule.BeginOf(slots)); // the last slot has its time too
}

} // namespace

void RunLights(const LightSchedule& schedule, LightLines& lines, LightClock& clock, std::int64_t slots,
               const std::function<bool()>& goOn, LightRun& run)
{
  const auto off = [&] {
    try {
      lines.Set(0);
      return true;
    } catch (const Error&) {
      return false;
    }
  };
  try {
    Drive(schedule, lines, clock, slots, goOn, run);
    lines.Set(0);
  } catch (const Error& error) {
    if (!off())
      throw Error(error.GetKind(), std::string(error.what()) + "; nor could the lights be switched off");
    throw;
  } catch (...) {
    off();
    throw;
  }
}

void RehearseLights(const LightSchedule& schedule, LightLines& lines, LightClock& clock, const std::function<bool()>& goOn)
{
  struct Dark : LightLines {
    explicit Dark(LightLines& theirs) : lines(theirs) {}
    void Set(std::uint32_t) override { lines.Set(0); }
    LightLines& lines;
  } dark(lines);
  const double rate = schedule.Parameters().rateHz;
  const auto slots = static_cast<std::int64_t>(0.5 * rate);
  if (slots < 10)
    return;
  LightRun run;
  RunLights(schedule, dark, clock, slots, goOn, run);
  if (run.ShareOfLate() > 0.05)
    throw Error(
        Error::Kind::NotPossible,
        Format("RateHz: this machine cannot hold %g Hz: %.0f%% of all changes came more than %.3f ms late, or not at all (%s); "
               "choose a lower rate, a larger OnShare, or allow real-time priority",
               rate, 100.0 * run.ShareOfLate(), 1e-6 * static_cast<double>(LateLimit(schedule)), run.Punctuality().c_str()));
}

} // namespace echorama
