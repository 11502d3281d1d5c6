// SPDX-License-Identifier: BSD-3-Clause
#pragma once

class QApplication;

namespace echorama {

/// Neutral dark grey: around ultrasound a bright or coloured window changes how grey levels look.
void ApplyTheme(QApplication& application);

} // namespace echorama
