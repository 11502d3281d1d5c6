// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FormatText.h"
#include <cstdint>
#include <string_view>

namespace echorama {

/// Of any bytes, as 16 hexadecimal digits (FNV-1a, 64 bits): against accidents, not against attacks. For texts; it takes a
/// nanosecond a byte.
inline std::string TextChecksum(std::string_view bytes)
{
  std::uint64_t sum = 14695981039346656037u;
  for (const char byte : bytes)
    sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211u;
  return Format("%016llx", static_cast<unsigned long long>(sum));
}

} // namespace echorama
