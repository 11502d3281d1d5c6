// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
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

[[noreturn]] inline void RefuseHandEye(const std::string& reason)
{
  throw Error(Error::Kind::NotPossible, "hand-eye calibration: " + reason);
}

} // namespace echorama
