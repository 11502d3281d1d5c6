// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>

namespace echorama {

inline constexpr bool HostIsBigEndian = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;

/// Reverses the bytes of count numbers of size bytes each, in place.
void SwapBytes(char* bytes, std::size_t size, std::size_t count);

} // namespace echorama
