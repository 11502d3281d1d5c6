// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Memory.h"
#include <fstream>
#include <string>
#include <unistd.h>

namespace echorama {

double FreeMemory()
{
  std::ifstream stream("/proc/meminfo");
  std::string word;
  while (stream >> word)
    if (double kilobytes = 0.0; word == "MemAvailable:" && stream >> kilobytes)
      return kilobytes * 1024.0;
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

} // namespace echorama
