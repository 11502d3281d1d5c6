// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "GpioLines.h"
#include <algorithm>
#include <cerrno>
#include <cstring>

namespace echorama {

std::string GpioPlace::Path() const
{
  if (chip.find('/') != std::string::npos)
    return chip;
  return (chip.find_first_not_of("0123456789") == std::string::npos ? "/dev/gpiochip" : "/dev/") + chip;
}

namespace {

constexpr const char* Permission = "permission is missing; members of the group \"gpio\" may use GPIO lines on a Raspberry Pi "
                                   "(sudo usermod -aG gpio $USER, then log in again)";

} // namespace

void GpioPlace::FailChip(int error) const
{
  switch (error) {
  case ENOENT:
  case ENXIO:
    throw Error(Error::Kind::FileSystem, Path() + ": there is no such GPIO chip (gpiodetect lists those there are)");
  case EACCES:
  case EPERM:
    throw Error(Error::Kind::FileSystem, Path() + ": " + Permission);
  case ENOTTY:
  case ENODEV:
    throw Error(Error::Kind::FileSystem, Path() + ": that is no GPIO chip");
  default:
    throw Error(Error::Kind::FileSystem, Path() + ": " + std::strerror(error));
  }
}

void GpioPlace::FailLines(int error) const
{
  throw Error(Error::Kind::FileSystem, Path() + ": its lines cannot be driven: " +
                                           (error == EBUSY                      ? "another program has just taken one"
                                            : error == EACCES || error == EPERM ? Permission
                                                                                : std::strerror(error)));
}

void GpioPlace::FailTaken(const std::string& line, const char* consumer) const
{
  throw Error(Error::Kind::FileSystem, Path() + ": line " + line + " is taken" +
                                           (consumer && *consumer ? " by \"" + std::string(consumer) + "\"" : "") +
                                           "; end what uses it, or choose another line");
}

std::vector<unsigned> GpioPlace::Offsets(unsigned count, const std::function<int(const char*)>& offsetOf) const
{
  std::vector<unsigned> offsets;
  for (const std::string& line : lines) {
    unsigned offset = 0;
    if (ParseNumber(line, offset)) {
      if (offset >= count)
        throw Error(Error::Kind::InvalidParameter,
                    Path() + ": there is no line " + line + "; it has lines 0 to " + std::to_string(count == 0 ? 0 : count - 1));
    } else {
      const int found = offsetOf(line.c_str());
      if (found < 0)
        throw Error(Error::Kind::InvalidParameter, Path() + ": it has no line named " + line + " (gpioinfo lists them)");
      offset = static_cast<unsigned>(found);
    }
    if (std::find(offsets.begin(), offsets.end(), offset) != offsets.end())
      throw Error(Error::Kind::InvalidParameter, Path() + ": line " + line + " is named twice");
    offsets.push_back(offset);
  }
  return offsets;
}

} // namespace echorama
