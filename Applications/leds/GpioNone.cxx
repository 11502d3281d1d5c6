// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "GpioLines.h"

namespace echorama {

std::unique_ptr<LightLines> OpenGpioLines(const GpioPlace& place)
{
  throw Error(Error::Kind::NotPossible, place.Path() + ": this echorama-leds was built without libgpiod; only --dry-run works");
}

std::string GpioLibrary()
{
  return "no libgpiod";
}

} // namespace echorama
