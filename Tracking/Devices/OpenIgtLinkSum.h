// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>

namespace echorama {

/// OpenIGTLink's check sum of a body: CRC-64 of ECMA-182, the most significant bit first, from 0. Eight bytes at a time.
std::uint64_t OpenIgtLinkSum(const unsigned char* bytes, std::size_t size);

} // namespace echorama
