// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QString>

class QApplication;
class QPalette;

namespace echorama {

/// "dark": neutral dark grey, as around ultrasound a bright or coloured window changes how grey levels look. "light", and
/// "system": the one of the two that the desktop has. Can be changed while windows are open. Fonts are the system's.
void ApplyTheme(QApplication& application, const QString& theme = "dark");

/// Whether texts are light on dark.
bool IsDark(const QPalette& palette);

} // namespace echorama
