// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace echorama {

/// Bytes of the character of UTF-8 at the beginning of \a text, 1 to 4; 0 when there is none that is well formed (RFC 3629) or it
/// is a control character.
inline std::size_t PrintableUtf8(std::string_view text)
{
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (text.empty() || byte(0) < 0x20 || byte(0) == 0x7f)
    return 0;
  if (byte(0) < 0x80)
    return 1;
  const std::size_t size = byte(0) < 0xc2 ? 0 : byte(0) < 0xe0 ? 2 : byte(0) < 0xf0 ? 3 : byte(0) < 0xf5 ? 4 : 0;
  if (size == 0 || text.size() < size)
    return 0;
  for (std::size_t i = 1; i < size; ++i)
    if (byte(i) < 0x80 || byte(i) > 0xbf)
      return 0;
  // Longer than need be, halves of pairs, beyond the last, and the control characters U+0080 to U+009F.
  const bool none = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xed && byte(1) > 0x9f) ||
                    (byte(0) == 0xf0 && byte(1) < 0x90) || (byte(0) == 0xf4 && byte(1) > 0x8f) ||
                    (byte(0) == 0xc2 && byte(1) < 0xa0);
  return none ? 0 : size;
}

/// Whether \a text is nothing but such characters.
inline bool IsPrintableUtf8(std::string_view text)
{
  while (!text.empty()) {
    const std::size_t size = PrintableUtf8(text);
    if (size == 0)
      return false;
    text.remove_prefix(size);
  }
  return true;
}

/// \a text for a person's terminal, a message or a log: bytes that are no such character become \\x1b and the like, so that those
/// of a damaged or malicious file do nothing there. Line ends stay.
inline std::string Printable(std::string_view text)
{
  constexpr const char* digits = "0123456789abcdef";
  std::string printable;
  printable.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = PrintableUtf8(text);
    const auto byte = static_cast<unsigned char>(text.front());
    if (size > 0 || byte == '\n')
      printable.append(text.substr(0, size > 0 ? size : 1));
    else
      printable.append({'\\', 'x', digits[byte >> 4], digits[byte & 15]});
    text.remove_prefix(size > 0 ? size : 1);
  }
  return printable;
}

} // namespace echorama
