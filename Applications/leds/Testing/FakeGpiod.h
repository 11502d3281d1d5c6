// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

/// A chip of 54 lines named GPIO0 and so on, of which line 4 is another program's. What else is wrong with it, and where it
/// writes what lines show, says the environment:
///   FAKE_GPIO   missing | denied | busy: it cannot be opened, or its lines cannot be taken
///               broken:N: the Nth setting of lines fails;  dead:N: all from the Nth on;  slow:N: each takes N microseconds
///   FAKE_GPIO_LOG  a file: a line "seconds values" of each setting, "released" at the end
namespace fake {

constexpr unsigned Lines = 54, Taken = 4;
inline const char* const Consumer = "somebody's heater";

inline std::string Word()
{
  const char* value = std::getenv("FAKE_GPIO");
  const std::string text = value ? value : "";
  return text.substr(0, text.find(':'));
}

inline long Number()
{
  const std::string text = std::getenv("FAKE_GPIO") ? std::getenv("FAKE_GPIO") : "";
  return text.find(':') == std::string::npos ? 0 : std::atol(text.c_str() + text.find(':') + 1);
}

inline void Log(const std::string& text)
{
  static std::FILE* file = std::getenv("FAKE_GPIO_LOG") ? std::fopen(std::getenv("FAKE_GPIO_LOG"), "w") : nullptr;
  if (!file)
    return;
  std::fprintf(file, "%s\n", text.c_str());
  std::fflush(file);
}

inline double Now()
{
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// \returns whether it can be opened; errno says why not.
inline bool Open(const char* path)
{
  errno = Word() == "denied" ? EACCES : ENOENT;
  return Word() != "denied" && Word() != "missing" && std::string(path) == "/dev/gpiochip0";
}

inline int OffsetOf(const char* name)
{
  for (unsigned line = 0; line < Lines; ++line)
    if (name == "GPIO" + std::to_string(line))
      return static_cast<int>(line);
  errno = ENOENT;
  return -1;
}

/// Logs n values, or fails. \returns as libgpiod does.
template <class Value>
int Set(const Value* values, std::size_t n)
{
  static long count = 0;
  ++count;
  if ((Word() == "broken" && count == Number()) || (Word() == "dead" && count >= Number())) {
    errno = EIO;
    return -1;
  }
  if (Word() == "slow")
    for (const double end = Now() + 1e-6 * static_cast<double>(Number()); Now() < end;) {
    }
  char time[32];
  std::snprintf(time, sizeof time, "%.9f", Now());
  std::string text = time;
  for (std::size_t i = 0; i < n; ++i)
    text += " " + std::to_string(static_cast<int>(values[i]));
  Log(text);
  return 0;
}

} // namespace fake
