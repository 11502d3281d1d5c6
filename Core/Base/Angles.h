// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

inline constexpr double Pi = 3.14159265358979323846;
inline constexpr double RadiansPerDegree = 0.017453292519943295;
inline constexpr double DegreesPerRadian = 57.29577951308232;

} // namespace echorama
