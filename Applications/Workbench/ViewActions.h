// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QObject>
#include <QVector>

class QAction;
class QActionGroup;
class QMenu;
class QToolBar;

namespace echorama {

class ViewGrid;
class Workbench;

/// Hot-keys: the tool in hand, which volumes slices show and how, and the views. x, y, z, c, +, -, arrows and Page keys are left
/// to the alignment widget.
class ViewActions : public QObject {
  Q_OBJECT

public:
  ViewActions(Workbench* bench, ViewGrid* views, QObject* parent);
  void AddTools(QMenu* menu, QToolBar* bar);
  void AddTo(QMenu* menu, QToolBar* bar);

private:
  void ShowLook();
  void ChangeBrush(double factor);

  Workbench* bench_;
  ViewGrid* views_;
  QActionGroup *tools_, *shown_, *modes_;
  QVector<QAction*> more_, brush_;
  QAction *switch_, *flicker_, *linear_, *linked_;
};

} // namespace echorama
