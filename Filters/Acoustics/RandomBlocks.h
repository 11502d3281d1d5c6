// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>

namespace echorama {

/// Random::Block() of many counters with one key, in place: word n of counter i is words[n][i]. The loops are plain, so that
/// compilers make vectors of them; inline, so that they become part of the loop that they stand in.
template <int count>
inline void RandomBlocks(std::uint32_t (&words)[4][count], std::array<std::uint32_t, 2> key)
{
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < count; ++i) {
      const std::uint64_t a = std::uint64_t{0xD2511F53u} * words[0][i], b = std::uint64_t{0xCD9E8D57u} * words[2][i];
      words[0][i] = static_cast<std::uint32_t>(b >> 32) ^ words[1][i] ^ key[0];
      words[1][i] = static_cast<std::uint32_t>(b);
      words[2][i] = static_cast<std::uint32_t>(a >> 32) ^ words[3][i] ^ key[1];
      words[3][i] = static_cast<std::uint32_t>(a);
    }
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
}

} // namespace echorama
