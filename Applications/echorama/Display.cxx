// SPDX-License-Identifier: BSD-3-Clause
// In a file of its own, because Xlib.h defines macros named Success, None and Status.
#include "Display.h"

#include "Core/Base/Error.h"
#include <X11/Xlib.h>

namespace echorama {

void CheckDisplay()
{
  Display* display = XOpenDisplay(nullptr);
  if (!display)
    throw Error(Error::Kind::NotPossible, "DISPLAY: there is no X server to draw with; without a screen, run under xvfb-run");
  XCloseDisplay(display);
}

} // namespace echorama
