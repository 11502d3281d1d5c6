// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace echorama {

/// Numbers as the network orders their bytes, the most significant first, whatever this machine does.
namespace big_endian {

template <std::size_t size>
using Unsigned =
    std::conditional_t<size == 1, std::uint8_t,
                       std::conditional_t<size == 2, std::uint16_t, std::conditional_t<size == 4, std::uint32_t, std::uint64_t>>>;

/// The number (integer or IEEE float) at \a bytes; sizeof(T) bytes must be there.
template <class T>
T Read(const unsigned char* bytes)
{
  Unsigned<sizeof(T)> bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    bits = static_cast<Unsigned<sizeof(T)>>((static_cast<std::uint64_t>(bits) << 8) | bytes[i]);
  T number;
  std::memcpy(&number, &bits, sizeof number);
  return number;
}

/// Appends a number.
template <class T>
void Write(std::vector<unsigned char>& bytes, T number)
{
  Unsigned<sizeof(T)> bits = 0;
  std::memcpy(&bits, &number, sizeof number);
  for (std::size_t i = sizeof(T); i-- > 0;)
    bytes.push_back(static_cast<unsigned char>(static_cast<std::uint64_t>(bits) >> (8 * i)));
}

/// The text in a field of \a size bytes: up to its first zero byte, or all of it.
inline std::string ReadText(const unsigned char* bytes, std::size_t size)
{
  std::size_t length = 0;
  while (length < size && bytes[length] != 0)
    ++length;
  return std::string(bytes, bytes + length);
}

/// Appends a field of \a size bytes, filled up with zeros; longer texts are cut.
inline void WriteText(std::vector<unsigned char>& bytes, const std::string& text, std::size_t size)
{
  for (std::size_t i = 0; i < size; ++i)
    bytes.push_back(i < text.size() ? static_cast<unsigned char>(text[i]) : 0);
}

} // namespace big_endian
} // namespace echorama
