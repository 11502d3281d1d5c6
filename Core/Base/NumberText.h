// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

namespace echorama {

/// The shortest text that gives the number back to the last bit. Never depends on the locale.
template <class T>
std::string NumberText(T number)
{
  char digits[64];
  return std::string(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

/// Reads \a text, all of it, as one number. \returns false, and leaves \a number alone, when it is anything else or does
/// not fit. Never depends on the locale.
template <class T>
bool ParseNumber(std::string_view text, T& number)
{
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);
  T parsed{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), parsed);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size())
    return false;
  number = parsed;
  return true;
}

} // namespace echorama
