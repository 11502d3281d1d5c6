// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QCheckBox;
class QComboBox;
class QLabel;
class QMenu;

namespace echorama {

class NeedleTool;
class Scan;

/// The needle: whether there is one, what holds it, where it is, and how it looks.
class NeedlePanel : public QWidget {
  Q_OBJECT

public:
  NeedlePanel(Scan* scan, NeedleTool* needle, QWidget* parent = nullptr);

private:
  void ShowState();

  NeedleTool* needle_;
  QCheckBox* shown_;
  QComboBox* guide_;
  QLabel* state_;
};

/// Its keys. Left and right are as \a image shows them.
void AddNeedleActions(QMenu* menu, NeedleTool* needle, const Scan* scan);

} // namespace echorama
