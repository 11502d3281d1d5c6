// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Memory.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <unistd.h>

namespace echorama {
namespace {
namespace fs = std::filesystem;
constexpr double Unknown = std::numeric_limits<double>::infinity();

// The number that a file begins with, or that follows a word in it.
double NumberIn(const fs::path& file, const std::string& after = {}, double otherwise = Unknown)
{
  std::ifstream stream(file);
  for (std::string word; word != after && stream >> word;)
    continue;
  double number = 0.0;
  return stream >> number ? number : otherwise; // "max" is no number
}

// What the limits of a control group, and of those above it, leave. Cached files can be had back.
double LeftByGroups(const fs::path& root)
{
  double left = Unknown;
  std::ifstream stream(root / "proc/self/cgroup"); // hierarchy:controllers:/path; the second version has neither number nor names
  for (std::string line; std::getline(stream, line);) {
    const bool isSecond = line.rfind("0::/", 0) == 0;
    if (!isSecond && line.find(":memory:/") == std::string::npos)
      continue;
    const fs::path mount = root / (isSecond ? "sys/fs/cgroup" : "sys/fs/cgroup/memory");
    for (fs::path folder = mount / line.substr(line.find(":/") + 2); folder.native().size() >= mount.native().size();
         folder = folder.parent_path()) {
      const double limit = NumberIn(folder / (isSecond ? "memory.max" : "memory.limit_in_bytes"));
      double used = NumberIn(folder / (isSecond ? "memory.current" : "memory.usage_in_bytes"), {}, limit);
      for (const char* cached : {"active_file", "inactive_file"})
        used -= NumberIn(folder / "memory.stat", isSecond ? cached : std::string("total_") + cached, 0.0);
      if (limit < Unknown)
        left = std::min(left, std::max(0.0, limit - used));
    }
  }
  return left;
}

} // namespace

double FreeMemory(const std::string& root)
{
  const double all = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE)) / 1024.0;
  return std::min(1024.0 * NumberIn(fs::path(root) / "proc/meminfo", "MemAvailable:", all), LeftByGroups(root));
}

std::string GigabytesText(double bytes)
{
  return Format(bytes < 999.5e9 ? "%.3g GB" : "%.0f GB", 1e-9 * bytes);
}

} // namespace echorama
