// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QListWidget;
class QPushButton;

namespace echorama {

class Redraw;
class Workbench;

/// Undo and redo, and the backups: one after every edit, also of earlier days; a click brings one back (which can be undone).
class HistoryPanel : public QWidget {
  Q_OBJECT

public:
  explicit HistoryPanel(Workbench* bench, QWidget* parent = nullptr);

protected:
  void showEvent(QShowEvent* event) override;

private:
  void ShowHistory();
  void ListBackups();
  void Restore(int row);

  Workbench* bench_;
  QPushButton *undo_, *redo_;
  QListWidget* backups_;
  Redraw* list_;
};

} // namespace echorama
