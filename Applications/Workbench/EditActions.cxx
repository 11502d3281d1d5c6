// SPDX-License-Identifier: BSD-3-Clause
#include "EditActions.h"
#include "Controls.h"
#include "Workbench.h"
#include <QAction>
#include <QMenu>

namespace echorama {

EditActions::EditActions(Workbench* bench, QObject* parent) : QObject(parent), bench_(bench)
{
  auto* session = bench->Session();
  undo_ = MakeAction(this, "undoAction", tr("&Undo"), "Ctrl+Z", tr("Take the last edit back"), [session] { session->Undo(); });
  redo_ = MakeAction(this, "redoAction", tr("&Redo"), "Ctrl+Shift+Z", tr("Make the edit again"), [session] { session->Redo(); });
  redo_->setShortcuts({QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")});
  all_ = MakeAction(this, "selectAllAction", tr("Select &all"), "Ctrl+A", tr("Select all volumes"),
                    [session] { session->SelectAll(); });
  none_ = MakeAction(this, "selectNoneAction", tr("Select &none"), "Ctrl+D", tr("Select no volume"),
                     [session] { session->SelectNone(); });
  invert_ = MakeAction(this, "selectInvertAction", tr("&Invert selection"), "Ctrl+I", tr("Select those that are not selected"),
                       [session] { session->InvertSelection(); });
  group_ = MakeAction(this, "groupAction", tr("&Group"), "Ctrl+G", tr("Keep the selected volumes together"),
                      [session] { session->GroupSelection(); });
  ungroup_ = MakeAction(this, "ungroupAction", tr("U&ngroup"), "Ctrl+Shift+G", tr("Let the selected volumes move alone again"),
                        [session] { session->UngroupSelection(); });
  remove_ = MakeAction(this, "removeAction", tr("Re&move volumes"), "Ctrl+Delete",
                       tr("Take the selected volumes out of the session; their files stay, and it can be undone"),
                       [this] { Remove(); });
  connect(bench, &Workbench::HistoryChanged, this, &EditActions::ShowHistory);
  connect(bench, &Workbench::SelectionChanged, this, &EditActions::ShowSelection);
  connect(bench, &Workbench::VolumesChanged, this, &EditActions::ShowSelection);
  ShowHistory();
  ShowSelection();
}

void EditActions::AddTo(QMenu* menu)
{
  menu->addActions({undo_, redo_});
  menu->addSeparator();
  menu->addActions({all_, none_, invert_});
  menu->addSeparator();
  menu->addActions({group_, ungroup_, remove_});
}

void EditActions::ShowHistory()
{
  const auto* session = bench_->Session();
  undo_->setEnabled(session->GetUndoCount() > 0);
  redo_->setEnabled(session->GetRedoCount() > 0);
  undo_->setText(session->GetUndoCount() > 0 ? tr("&Undo: %1").arg(QString::fromStdString(session->GetUndoLabel()))
                                             : tr("&Undo"));
  redo_->setText(session->GetRedoCount() > 0 ? tr("&Redo: %1").arg(QString::fromStdString(session->GetRedoLabel()))
                                             : tr("&Redo"));
}

void EditActions::ShowSelection()
{
  const int selected = bench_->SelectedVolumes().size(), count = bench_->Session()->GetNumberOfVolumes();
  bool isGrouped = false;
  for (int id : bench_->SelectedVolumes())
    isGrouped |= bench_->Session()->GetGroup(id) > 0;
  for (QAction* action : {all_, invert_})
    action->setEnabled(count > 0);
  none_->setEnabled(selected > 0);
  group_->setEnabled(selected > 1);
  ungroup_->setEnabled(isGrouped);
  remove_->setEnabled(selected > 0);
}

void EditActions::Remove()
{
  auto* session = bench_->Session();
  const QVector<int> ids = bench_->SelectedVolumes();
  session->BeginEdit(
      (ids.size() == 1 ? tr("Remove %1").arg(bench_->NameOf(ids.first())) : tr("Remove %1 volumes").arg(ids.size()))
          .toUtf8()
          .constData());
  for (int id : ids)
    session->RemoveVolume(id);
  session->EndEdit();
}

} // namespace echorama
