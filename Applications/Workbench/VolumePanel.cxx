// SPDX-License-Identifier: BSD-3-Clause
#include "VolumePanel.h"
#include "Controls.h"
#include "VolumeTable.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <algorithm>
#include <QColorDialog>
#include <QEvent>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QItemSelectionModel>
#include <QLabel>
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
  QHeaderView* header = view_->horizontalHeader();
  header->setMinimumSectionSize(20);
  header->setSectionResizeMode(VolumeTable::Name, QHeaderView::Stretch);
  for (int column = 0; column < VolumeTable::Columns; column++)
    if (column != VolumeTable::Name)
      header->setSectionResizeMode(column, QHeaderView::Fixed);
  FitColumns();
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
  changed_ = TextField(this, "sourcesChanged");
  again_ = Button(this, "makeAgain", tr("Make again"), tr("Makes the result of its sources as they are now"),
                  [this] { emit MakeAgain(again_->property("of").toInt()); });
  layout->addWidget(changed_);
  layout->addWidget(again_);

  connect(view_->selectionModel(), &QItemSelectionModel::selectionChanged, this, &VolumePanel::TakeSelection);
  connect(bench, &Workbench::SelectionChanged, this, &VolumePanel::ShowSelection);
  connect(table_, &VolumeTable::modelReset, this, &VolumePanel::ShowSelection);
  connect(table_, &VolumeTable::LinksChanged, this, &VolumePanel::ShowChanged);
  ShowChanged();
}

void VolumePanel::changeEvent(QEvent* event)
{
  QWidget::changeEvent(event);
  if (event->type() == QEvent::FontChange)
    FitColumns();
}

// As wide as what is in them, whatever the font; the names get the rest.
void VolumePanel::FitColumns()
{
  const QFontMetrics font = view_->fontMetrics();
  const int row = font.height() + 8;
  QHeaderView* header = view_->horizontalHeader();
  QFont bold = header->font();
  bold.setBold(true); // as headers of selected columns are
  int sum = 0;
  for (int column = 0; column < VolumeTable::Columns; column++) {
    if (column == VolumeTable::Name)
      continue;
    const QString title = table_->headerData(column, Qt::Horizontal, Qt::DisplayRole).toString();
    const int text = std::max(QFontMetrics(bold).horizontalAdvance(title),
                              column == VolumeTable::Opacity ? font.horizontalAdvance("100 %") : 0);
    header->resizeSection(column, std::max(row, text + 10));
    sum += header->sectionSize(column);
  }
  view_->verticalHeader()->setDefaultSectionSize(row);
  view_->setMinimumWidth(sum + font.horizontalAdvance("name of it") + 8);
}

void VolumePanel::ShowChanged()
{
  int id = 0;
  for (const int each : bench_->Volumes())
    if (id == 0 && !bench_->Session()->GetSourcesChanged(each).empty())
      id = each;
  changed_->setVisible(id > 0);
  again_->setVisible(id > 0);
  again_->setProperty("of", id);
  if (id > 0)
    changed_->setText(tr("%1: sources changed").arg(bench_->NameOf(id)));
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
