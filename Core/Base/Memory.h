// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

/// Bytes of memory that this machine can give without swapping; where it does not tell, all that it has.
double FreeMemory();

} // namespace echorama
