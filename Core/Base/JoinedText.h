// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>

namespace echorama {

/// All of \a texts with \a between each two: "a, b, c".
template <class Texts>
std::string Joined(const Texts& texts, const char* between = ", ")
{
  std::string all;
  bool first = true;
  for (const std::string& text : texts) {
    all += (first ? "" : between) + text;
    first = false;
  }
  return all;
}

} // namespace echorama
