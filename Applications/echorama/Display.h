// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

/// Throws Error(NotPossible) when there is nothing to draw on: VTK would end the process.
void CheckDisplay();

} // namespace echorama
