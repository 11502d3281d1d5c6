// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QItemSelection;
class QModelIndex;
class QTableView;

namespace echorama {

class VolumeTable;
class Workbench;

/// The list of volumes; its selected rows are the session's selection, both ways.
class VolumePanel : public QWidget {
  Q_OBJECT

public:
  explicit VolumePanel(Workbench* bench, QWidget* parent = nullptr);

private:
  void TakeSelection();
  void Tell(bool on);
  void ShowSelection();
  void ChooseColour(const QModelIndex& index);

  Workbench* bench_;
  VolumeTable* table_;
  QTableView* view_;
  bool following_ = false; ///< one of the two is being told of the other
};

} // namespace echorama
