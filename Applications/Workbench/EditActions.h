// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QObject>

class QAction;
class QMenu;

namespace echorama {

class Workbench;

/// Undo, redo, selection, groups, removal.
class EditActions : public QObject {
  Q_OBJECT

public:
  EditActions(Workbench* bench, QObject* parent);
  void AddTo(QMenu* menu);
  QAction* UndoAction() const { return undo_; }
  QAction* RedoAction() const { return redo_; }

private:
  void ShowHistory();
  void ShowSelection();
  void Remove();

  Workbench* bench_;
  QAction *undo_, *redo_, *all_, *none_, *invert_, *group_, *ungroup_, *remove_;
};

} // namespace echorama
