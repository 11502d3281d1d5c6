// SPDX-License-Identifier: BSD-3-Clause
#include "VolumePanel.h"
#include "Controls.h"
#include "VolumeTable.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <QColorDialog>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QItemSelectionModel>
#include <QPushButton>
#include <QScopedValueRollback>
#include <QTableView>
#include <QVBoxLayout>

namespace echorama {

VolumePanel::VolumePanel(Workbench* bench, QWidget* parent)
  : QWidget(parent), bench_(bench), table_(new VolumeTable(bench, this)), view_(new QTableView(this))
{
  setObjectName("volumePanel");
  view_->setObjectName("volumes");
  view_->setAccessibleName(tr("Volumes"));
  view_->setModel(table_);
  view_->setSelectionBehavior(QAbstractItemView::SelectRows);
  view_->setSelectionMode(QAbstractItemView::ExtendedSelection);
  view_->setShowGrid(false);
  view_->setAlternatingRowColors(true);
  view_->setTabKeyNavigation(false);
  view_->setEditTriggers(QAbstractItemView::DoubleClicked | QAbstractItemView::EditKeyPressed); // letters are shortcuts
  view_->verticalHeader()->hide();
  view_->verticalHeader()->setDefaultSectionSize(24);
  QHeaderView* header = view_->horizontalHeader();
  header->setMinimumSectionSize(20);
  header->setSectionResizeMode(VolumeTable::Name, QHeaderView::Stretch);
  const int widths[] = {42, 26, 0, 54, 44};
  for (int column = 0; column < VolumeTable::Columns; column++)
    if (column != VolumeTable::Name) {
      header->setSectionResizeMode(column, QHeaderView::Fixed);
      header->resizeSection(column, widths[column]);
    }
  connect(view_, &QTableView::doubleClicked, this, &VolumePanel::ChooseColour);

  auto* session = bench->Session();
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->addWidget(view_);
  auto* row = new QHBoxLayout;
  row->setSpacing(2);
  row->addWidget(Button(this, "selectAll", tr("All"), tr("Select all volumes (Ctrl+A)"), [session] { session->SelectAll(); }));
  row->addWidget(Button(this, "selectNone", tr("None"), tr("Select no volume (Ctrl+D)"), [session] { session->SelectNone(); }));
  row->addWidget(Button(this, "selectInvert", tr("Invert"), tr("Select those that are not selected (Ctrl+I)"),
                        [session] { session->InvertSelection(); }));
  row->addWidget(Button(this, "group", tr("Group"), tr("Keep the selected volumes together (Ctrl+G)"),
                        [session] { session->GroupSelection(); }));
  layout->addLayout(row);
  for (auto* button : findChildren<QPushButton*>())
    button->setMinimumWidth(20);

  connect(view_->selectionModel(), &QItemSelectionModel::selectionChanged, this, &VolumePanel::TakeSelection);
  connect(bench, &Workbench::SelectionChanged, this, &VolumePanel::ShowSelection);
  connect(table_, &VolumeTable::modelReset, this, &VolumePanel::ShowSelection);
}

void VolumePanel::TakeSelection()
{
  if (following_)
    return;
  {
    const QScopedValueRollback<bool> follow(following_, true);
    // A click on one of a group takes the others away and means all of the group; a Ctrl+click takes one away and means all.
    // What happened to the row that was clicked decides: it is told to the session last.
    const bool isAdding = view_->selectionModel()->isRowSelected(view_->currentIndex().row(), {});
    Tell(!isAdding);
    Tell(isAdding);
  }
  ShowSelection(); // with the groups of what was clicked
}

void VolumePanel::Tell(bool on)
{
  for (int row = 0; row < table_->rowCount(); row++)
    if (const int id = table_->IdOf(row);
        view_->selectionModel()->isRowSelected(row, {}) == on && bench_->Session()->IsSelected(id) != on)
      bench_->Session()->Select(id, on);
}

void VolumePanel::ShowSelection()
{
  if (following_)
    return;
  const QScopedValueRollback<bool> follow(following_, true);
  QItemSelection rows;
  for (int row = 0; row < table_->rowCount(); row++)
    if (bench_->Session()->IsSelected(table_->IdOf(row)))
      rows.select(table_->index(row, 0), table_->index(row, VolumeTable::Columns - 1));
  view_->selectionModel()->select(rows, QItemSelectionModel::ClearAndSelect);
}

void VolumePanel::ChooseColour(const QModelIndex& index)
{
  if (index.column() != VolumeTable::Colour)
    return;
  auto* dialog = new QColorDialog(index.data(Qt::EditRole).value<QColor>(), this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(tr("Tint of %1").arg(bench_->NameOf(table_->IdOf(index.row()))));
  const QPersistentModelIndex place(index);
  connect(dialog, &QColorDialog::colorSelected, this, [this, place](const QColor& colour) {
    if (place.isValid())
      table_->setData(place, colour, Qt::EditRole);
  });
  dialog->open();
}

} // namespace echorama
