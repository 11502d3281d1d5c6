// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Checksum.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <cstdint>
#include <cstring>

namespace echorama {

std::string Checksum(const void* bytes, std::size_t count)
{
  // Words are multiplied and mixed, the rest of the last one is filled with its length.
  const auto* at = static_cast<const unsigned char*>(bytes);
  std::uint64_t hash = 0x9E3779B97F4A7C15u ^ count;
  for (std::size_t done = 0; done < count; done += 8) {
    std::uint64_t word = count;
    std::memcpy(&word, at + done, std::min<std::size_t>(8, count - done));
    hash = (hash ^ word) * 0xD6E8FEB86659FD93u;
    hash ^= hash >> 32;
  }
  return Format("%016llx", static_cast<unsigned long long>(hash));
}

bool IsChecksum(const std::string& text)
{
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

} // namespace echorama
