// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

/// Our clock: seconds since 1970, taken once from the system and counted on from there without jumps, so that neither a
/// correction of the system's clock nor daylight saving time ever moves a pose. It is one for all libraries of a process.
double ClockNow();

} // namespace echorama
