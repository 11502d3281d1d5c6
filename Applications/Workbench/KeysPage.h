// SPDX-License-Identifier: BSD-3-Clause
#pragma once

class QWidget;

namespace echorama {

/// What keys and mouse buttons do, in a window that can stay open.
void ShowKeysPage(QWidget* parent);

} // namespace echorama
