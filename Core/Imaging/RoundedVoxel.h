// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace echorama {

/// A number as a voxel of type T: whole numbers are rounded (halves up) and limited to what T holds.
template <class T, class A>
T RoundedVoxel(A value)
{
  if constexpr (std::is_integral_v<T>)
    return static_cast<T>(std::clamp(std::floor(value + A(0.5)), static_cast<A>(std::numeric_limits<T>::min()),
                                     static_cast<A>(std::numeric_limits<T>::max())));
  else
    return static_cast<T>(value);
}

} // namespace echorama
