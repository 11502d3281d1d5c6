// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <string>

namespace echorama {

/// \throws Error(InvalidParameter): its name, its value and [from, to], when it lies outside or is not a number.
inline void CheckRange(const std::string& name, double value, double from, double to)
{
  if (!(value >= from && value <= to))
    throw Error(Error::Kind::InvalidParameter,
                name + " is " + NumberText(value) + "; it must be in [" + NumberText(from) + ", " + NumberText(to) + "]");
}

} // namespace echorama
