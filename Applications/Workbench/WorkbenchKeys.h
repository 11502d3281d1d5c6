// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "KeysPage.h"

namespace echorama {

/// What mouse and keys do in the views of the workbench.
QVector<KeysOf> WorkbenchKeys();

} // namespace echorama
