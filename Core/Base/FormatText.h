// SPDX-License-Identifier: BSD-3-Clause
#pragma once
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

} // namespace echorama
