// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <string>

namespace echorama {

/// 64 bits of a hash as 16 hexadecimal digits: against mistakes, not against attacks. Some GB/s.
std::string Checksum(const void* bytes, std::size_t count);

/// Whether \a text could be one.
bool IsChecksum(const std::string& text);

} // namespace echorama
