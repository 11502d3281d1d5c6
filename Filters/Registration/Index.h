// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>

namespace echorama {

/// A number that counts from 0, as containers want it.
constexpr std::size_t Index(std::ptrdiff_t number)
{
  return static_cast<std::size_t>(number);
}

} // namespace echorama
