// SPDX-License-Identifier: BSD-3-Clause
// Times are whole nanoseconds, each computed from the number of its slot: after a week at 90 Hz that is as exact as at first.
// Dimming shortens the time that a light is on in a slot, and leaves it in one piece: a camera that looks for less than a slot
// sees a brightness that depends on where in the slot it looks, but whose word it is stays the same.
#include "LightSchedule.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {

ParameterList Describe(LightScheduleParameters& p)
{
  return {
      Parameter(
          "Code", Choice(p.code, {"blink", "alternating"}),
          "Words by which a camera tells the lights apart by itself; or two lights in turn, for a camera that is triggered."),
      Parameter("RateHz", p.rateHz, {0.1, 2000.0}, "Hz", "Slots a second: the frame rate of the camera."),
      Parameter("OffSlots", p.offSlots, {1, 2}, "",
                "Slots of each word in which all lights are off, for the background: two for a camera that is not triggered.")
          .When("Code", "blink"),
      Parameter("OnShare", p.onShare, {0.01, 1.0}, "",
                "How much of a slot a light is on, if it is on in it: less is dimmer, and takes less power."),
      Parameter("TriggerShare", p.triggerShare, {0.01, 0.9}, "", "How much of a slot the camera's trigger line is high."),
  };
}

namespace {

BlinkCode CodeOf(const LightScheduleParameters& p)
{
  CheckRanges(p);
  if (p.code == LightScheduleParameters::Code::Blink)
    return BlinkCode::Make(p.lights, p.offSlots);
  if (p.lights != 2)
    throw Error(Error::Kind::InvalidParameter, "two lights can alternate, not " + std::to_string(p.lights));
  return BlinkCode::Alternating();
}

} // namespace

LightSchedule::LightSchedule(const LightScheduleParameters& parameters) : parameters_(parameters), code_(CodeOf(parameters)) {}

std::int64_t LightSchedule::BeginOf(std::int64_t slot) const
{
  return std::llround(static_cast<double>(slot) * 1e9 / parameters_.rateHz);
}

std::int64_t LightSchedule::SlotAt(std::int64_t at) const
{
  auto slot = std::max<std::int64_t>(0, std::llround(static_cast<double>(at) * parameters_.rateHz / 1e9));
  while (slot > 0 && BeginOf(slot) > at)
    --slot;
  return slot;
}

std::vector<LightChange> LightSchedule::ChangesIn(std::int64_t slot) const
{
  std::uint32_t lights = 0;
  for (int light = 0; light < code_.Lights(); ++light)
    lights |= static_cast<std::uint32_t>(code_.On(light, slot)) << light;
  const std::uint32_t trigger = parameters_.trigger ? 1u << code_.Lights() : 0u;
  const std::int64_t begin = BeginOf(slot);
  const auto length = static_cast<double>(BeginOf(slot + 1) - begin);
  const std::int64_t lightsEnd = begin + std::llround(parameters_.onShare * length);
  const std::int64_t triggerEnd = begin + std::llround(parameters_.triggerShare * length);
  std::vector<std::int64_t> times{begin};
  if (lights != 0 && parameters_.onShare < 1.0)
    times.push_back(lightsEnd);
  if (trigger != 0)
    times.push_back(triggerEnd);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<LightChange> changes;
  for (const std::int64_t at : times)
    changes.push_back({at, (at < lightsEnd ? lights : 0u) | (at < triggerEnd ? trigger : 0u)});
  return changes;
}

double LightSchedule::MeanOnShare(int light) const
{
  return code_.OnShare(light, 0.0, code_.Length()) * parameters_.onShare;
}

double LightSchedule::LongestOnSeconds(int light) const
{
  if (parameters_.onShare < 1.0)
    return parameters_.onShare * SlotSeconds();
  int longest = 0, on = 0;
  for (int slot = 0; slot < 2 * code_.Length(); ++slot) {
    on = code_.On(light, slot) ? on + 1 : 0;
    longest = std::max(longest, on);
  }
  return longest * SlotSeconds();
}

std::string LightSchedule::Picture(const std::vector<std::string>& lines) const
{
  constexpr int columns = 5; // of a slot
  const int rows = code_.Lights() + (parameters_.trigger ? 1 : 0);
  std::size_t width = 7;
  for (const std::string& line : lines)
    width = std::max(width, line.size());
  const auto padded = [&](const std::string& text) { return text + std::string(width - text.size() + 2, ' '); };
  std::vector<std::string> names(static_cast<std::size_t>(rows));
  std::string text = Format("%g slots a second of %.3f ms; %d slots are a period of %.1f ms\n\n", parameters_.rateHz,
                            1e3 * SlotSeconds(), code_.Length(), 1e3 * SlotSeconds() * code_.Length());
  for (int row = 0; row < rows; ++row) {
    std::string& name = names[static_cast<std::size_t>(row)];
    name = row < code_.Lights() ? "light " + std::to_string(row) : "trigger";
    text += padded(name) + padded(static_cast<std::size_t>(row) < lines.size() ? lines[static_cast<std::size_t>(row)] : "-");
    text += row < code_.Lights()
                ? Format("on %.1f%% of the time, at most %.3f ms on end\n", 100.0 * MeanOnShare(row), 1e3 * LongestOnSeconds(row))
                : Format("high for %.3f ms as a slot begins\n", 1e3 * parameters_.triggerShare * SlotSeconds());
  }
  text += "\n" + padded("slot");
  for (int slot = 0; slot < code_.Length(); ++slot)
    text += Format("%-*d", columns, slot);
  while (text.back() == ' ')
    text.pop_back();
  text += "\n";
  for (int row = 0; row < rows; ++row) {
    text += padded(names[static_cast<std::size_t>(row)]);
    for (int slot = 0; slot < code_.Length(); ++slot) {
      const std::vector<LightChange> changes = ChangesIn(slot);
      const auto length = static_cast<double>(BeginOf(slot + 1) - BeginOf(slot));
      for (int column = 0; column < columns; ++column) {
        const double within = static_cast<double>(BeginOf(slot)) + (column + 0.45) / columns * length;
        std::uint32_t on = 0;
        for (const LightChange& change : changes)
          if (static_cast<double>(change.at) <= within)
            on = change.on;
        text += (on >> row & 1u) != 0 ? '#' : '.';
      }
    }
    text += "\n";
  }
  return text;
}

std::string LightSchedule::Csv() const
{
  std::string text = "seconds";
  for (int light = 0; light < code_.Lights(); ++light)
    text += ",light " + std::to_string(light);
  text += parameters_.trigger ? ",trigger\n" : "\n";
  for (int slot = 0; slot < code_.Length(); ++slot)
    for (const LightChange& change : ChangesIn(slot)) {
      text += NumberText(static_cast<double>(change.at) / 1e9);
      for (int row = 0; row < code_.Lights() + (parameters_.trigger ? 1 : 0); ++row)
        text += (change.on >> row & 1u) != 0 ? ",1" : ",0";
      text += "\n";
    }
  return text;
}

} // namespace echorama
