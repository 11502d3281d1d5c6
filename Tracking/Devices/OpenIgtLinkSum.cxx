// SPDX-License-Identifier: BSD-3-Clause
// The remainder of a polynomial division, eight bytes at a time: tables[n][b] is what a byte b leaves behind n bytes further on,
// so eight look-ups that do not wait for each other take the place of eight that do. A volume of 16 MB would otherwise spend
// longer in its check sum than on its way.
#include "Tracking/Devices/OpenIgtLinkSum.h"
#include "Tracking/Devices/BigEndian.h"
#include <array>

namespace echorama {
namespace {

using Tables = std::array<std::array<std::uint64_t, 256>, 8>;

Tables MakeTables()
{
  constexpr std::uint64_t Polynomial = 0x42f0e1eba9ea3693; // x^64 is left out
  Tables tables{};
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    std::uint64_t rest = byte << 56;
    for (int bit = 0; bit < 8; ++bit)
      rest = (rest << 1) ^ (rest >> 63 ? Polynomial : 0);
    tables[0][byte] = rest;
  }
  for (std::size_t n = 1; n < 8; ++n)
    for (std::size_t byte = 0; byte < 256; ++byte)
      tables[n][byte] = (tables[n - 1][byte] << 8) ^ tables[0][tables[n - 1][byte] >> 56];
  return tables;
}

} // namespace

std::uint64_t OpenIgtLinkSum(const unsigned char* bytes, std::size_t size)
{
  static const Tables tables = MakeTables();
  std::uint64_t sum = 0;
  for (; size >= 8; bytes += 8, size -= 8) {
    sum ^= big_endian::Read<std::uint64_t>(bytes);
    sum = tables[7][sum >> 56] ^ tables[6][sum >> 48 & 255] ^ tables[5][sum >> 40 & 255] ^ tables[4][sum >> 32 & 255] ^
          tables[3][sum >> 24 & 255] ^ tables[2][sum >> 16 & 255] ^ tables[1][sum >> 8 & 255] ^ tables[0][sum & 255];
  }
  for (; size > 0; ++bytes, --size)
    sum = (sum << 8) ^ tables[0][sum >> 56 ^ *bytes];
  return sum;
}

} // namespace echorama
