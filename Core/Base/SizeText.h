// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <string>

namespace echorama {

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
