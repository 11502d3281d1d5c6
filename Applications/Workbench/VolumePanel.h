// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QItemSelection;
class QLabel;
class QModelIndex;
class QPushButton;
class QTableView;

namespace echorama {

class VolumeTable;
class Workbench;

/// The list of volumes; its selected rows are the session's selection, both ways. Below it says which result is no longer what
/// its sources would give.
class VolumePanel : public QWidget {
  Q_OBJECT

public:
  explicit VolumePanel(Workbench* bench, QWidget* parent = nullptr);

signals:
  void MakeAgain(int id);

protected:
  void changeEvent(QEvent* event) override;

private:
  void FitColumns();
  void ShowChanged();
  void TakeSelection();
  void Tell(bool on);
  void ShowSelection();
  void ChooseColour(const QModelIndex& index);

  Workbench* bench_;
  VolumeTable* table_;
  QTableView* view_;
  QLabel* changed_;
  QPushButton* again_;
  bool following_ = false; ///< one of the two is being told of the other
};

} // namespace echorama
