// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdint>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>

namespace echorama::testing {

/// How many bytes this process reads from files while \a work is done, and some 100 for the question itself: an effort that does
/// not depend on how busy the machine is. Where the system does not count them, 0.
inline std::uint64_t BytesRead(const std::function<void()>& work)
{
  const auto count = [] {
    std::ifstream counters("/proc/self/io");
    std::string name;
    std::uint64_t bytes = 0;
    counters >> name >> bytes;
    return name == "rchar:" ? bytes : 0;
  };
  const std::uint64_t before = count();
  work();
  return count() - before;
}

/// The processor's time for \a work, which is repeated until that can be measured. What others do on the machine changes it
/// little, but which machine it is a lot: only for ratios.
inline double ProcessorSeconds(const std::function<void()>& work)
{
  const std::clock_t begin = std::clock();
  int times = 0;
  do {
    work();
    ++times;
  } while (std::clock() - begin < CLOCKS_PER_SEC / 20);
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / times;
}

} // namespace echorama::testing
