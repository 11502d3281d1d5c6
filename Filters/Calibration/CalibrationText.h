// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include <string>

namespace echorama {

[[noreturn]] inline void RefuseHandEye(const std::string& reason)
{
  throw Error(Error::Kind::NotPossible, "hand-eye calibration: " + reason);
}

} // namespace echorama
