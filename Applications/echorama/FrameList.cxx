// SPDX-License-Identifier: BSD-3-Clause
#include "FrameList.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"

namespace echorama {
namespace {

std::vector<std::string_view> Split(std::string_view text, char separator)
{
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos)
      return parts;
    text.remove_prefix(end + 1);
  }
}

} // namespace

std::vector<int> FramesInList(const std::string& list, int count)
{
  const auto fail = [&](const std::string& reason) -> void {
    throw Error(Error::Kind::InvalidParameter,
                "--frames " + list + ": " + reason + " (the sequence has " + std::to_string(count) + " frames, counted from 0)");
  };
  std::vector<int> frames;
  for (const std::string_view part : Split(list.empty() ? ":" : list, ',')) {
    const std::vector<std::string_view> numbers = Split(part, ':');
    int values[3] = {0, count - 1, 1};
    if (numbers.size() > 3)
      fail("from:to:step has three numbers at most");
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (!(numbers[i].empty() && numbers.size() > 1) && !ParseNumber(numbers[i], values[i]))
        fail("\"" + std::string(numbers[i]) + "\" is not a whole number");
    if (numbers.size() == 1)
      values[1] = values[0];
    const auto [from, to, step] = values;
    if (from < 0 || to >= count || from > to || step < 1)
      fail("there are no frames " + std::string(part));
    for (long long frame = from; frame <= to; frame += step)
      frames.push_back(static_cast<int>(frame));
  }
  return frames;
}

} // namespace echorama
