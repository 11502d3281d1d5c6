// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QLabel>

namespace echorama {

class Workbench;

/// In the status bar: where the mouse points, and the grey level there of each volume that is shown (the selected ones first),
/// with its colour. Of many volumes those that have a grey level there come first, and how many more there are is said.
class StatusReadout : public QLabel {
  Q_OBJECT

public:
  explicit StatusReadout(Workbench* bench, QWidget* parent = nullptr);

private:
  void Show();

  Workbench* bench_;
};

} // namespace echorama
