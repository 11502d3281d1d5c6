// SPDX-License-Identifier: BSD-3-Clause
// 24 bits of the number and 24 of its checksum, the highest first, fill the columns between the fixed ones, column by column.
#include "MarkerPattern.h"
#include "Core/Base/Error.h"
#include <string>

namespace echorama {
namespace {

// The fixed columns, from the lowest pair up: no run of cells, and no turn or mirror image of them, looks the same.
bool FixedBit(int pair, int column)
{
  static constexpr bool fixed[3][MarkerPattern::pairs] = {{true, false, true}, {true, true, false}, {false, true, true}};
  return fixed[column < 2 ? column : 2][pair];
}

std::uint32_t ChecksumOf(std::uint32_t id)
{
  const char bytes[] = {static_cast<char>(id >> 16 & 255u), static_cast<char>(id >> 8 & 255u), static_cast<char>(id & 255u)};
  return Crc24(std::string_view(bytes, 3));
}

} // namespace

MarkerPattern MarkerPattern::Of(std::uint32_t id)
{
  if (id >> 24 != 0)
    throw Error(Error::Kind::InvalidParameter, "the number of a marker is " + std::to_string(id) + "; it must be below 2^24");
  const std::uint64_t message = static_cast<std::uint64_t>(id) << 24 | ChecksumOf(id);
  MarkerPattern pattern;
  int next = 47;
  for (int column = 0; column < columns; ++column)
    for (int pair = 0; pair < pairs; ++pair)
      pattern.bits[static_cast<std::size_t>(pair)][static_cast<std::size_t>(column)] =
          IsFixed(column) ? FixedBit(pair, column) : (message >> next-- & 1u) != 0;
  return pattern;
}

bool MarkerPattern::IsDark(int row, int column) const
{
  if (row < 0 || row >= rows || column < 0 || column >= columns)
    return false;
  return bits[static_cast<std::size_t>(row / 2)][static_cast<std::size_t>(column)] == (row % 2 == 0);
}

std::optional<std::uint32_t> MarkerPattern::Id() const
{
  std::uint64_t message = 0;
  for (int column = 0; column < columns; ++column)
    for (int pair = 0; pair < pairs; ++pair) {
      const bool bit = bits[static_cast<std::size_t>(pair)][static_cast<std::size_t>(column)];
      if (!IsFixed(column))
        message = message << 1 | static_cast<std::uint64_t>(bit);
      else if (bit != FixedBit(pair, column))
        return std::nullopt;
    }
  const auto id = static_cast<std::uint32_t>(message >> 24);
  return (message & 0xffffffu) == ChecksumOf(id) ? std::optional<std::uint32_t>(id) : std::nullopt;
}

std::uint32_t Crc24(std::string_view bytes)
{
  std::uint32_t crc = 0xB704CEu;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint32_t>(static_cast<unsigned char>(byte)) << 16;
    for (int bit = 0; bit < 8; ++bit) {
      crc <<= 1;
      if (crc & 0x1000000u)
        crc ^= 0x1864CFBu;
    }
  }
  return crc & 0xffffffu;
}

} // namespace echorama
