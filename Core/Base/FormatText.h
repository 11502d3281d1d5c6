// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdio>
#include <string>

namespace echorama {

/// What std::printf would print, at most 399 characters of it.
template <class... Values>
std::string Format(const char* format, Values... values)
{
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// "12 x 34 x 56", for messages.
template <class First, class... Others>
std::string SizeText(First first, Others... others)
{
  return (std::to_string(first) + ... + (" x " + std::to_string(others)));
}
inline std::string SizeText(const std::array<int, 3>& size)
{
  return SizeText(size[0], size[1], size[2]);
}

} // namespace echorama
