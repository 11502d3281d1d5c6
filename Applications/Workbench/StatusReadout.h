// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QLabel>

namespace echorama {

class Workbench;

/// In the status bar: where the mouse points, and the grey level of the volume there (the selected one first).
class StatusReadout : public QLabel {
  Q_OBJECT

public:
  explicit StatusReadout(Workbench* bench, QWidget* parent = nullptr);
  void ShowAt(double x, double y, double z);

private:
  Workbench* bench_;
};

} // namespace echorama
