// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/VtkMessage.h"
#include <algorithm>

namespace echorama {

std::string SentenceOfVtkMessage(std::string text)
{
  for (const char* prefix : {"ERROR: In ", "Warning: In ", "Generic Warning: In "})
    if (text.rfind(prefix, 0) == 0) {
      const std::size_t line = text.find('\n');
      text.erase(0, line == std::string::npos ? 0 : line + 1);
      const std::size_t name = text.find(" (0x"), end = text.find("): ");
      if (name != std::string::npos && end != std::string::npos && name < end && text.find(' ') == name)
        text.erase(0, end + 3);
      break;
    }
  std::replace(text.begin(), text.end(), '\n', ' ');
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

std::string ReasonAmong(const std::vector<std::string>& errors)
{
  const auto why = std::find_if(errors.begin(), errors.end(), [](const std::string& error) {
    return error.find("returned failure for request") == std::string::npos;
  });
  return errors.empty() ? std::string() : why == errors.end() ? errors.front() : *why;
}

} // namespace echorama
