// SPDX-License-Identifier: BSD-3-Clause
#include "HistoryPanel.h"
#include "Controls.h"
#include "Redraw.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <QDateTime>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QVBoxLayout>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

namespace echorama {

namespace {
constexpr int ListMs = 300; ///< listing reads a folder; a person who holds a key down does not need it each time
}

HistoryPanel::HistoryPanel(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench)
{
  setObjectName("historyPanel");
  undo_ = Button(this, "undo", tr("Undo"), tr("Takes the last edit back (Ctrl+Z)"), [this] { bench_->Session()->Undo(); });
  redo_ = Button(this, "redo", tr("Redo"), tr("Makes it again (Ctrl+Shift+Z)"), [this] { bench_->Session()->Redo(); });
  auto* title = new QLabel(tr("Backups (click: back to it; can be undone)"), this);
  title->setWordWrap(true);
  for (QPushButton* button : {undo_, redo_}) // labels of edits can be long
    button->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  backups_ = new QListWidget(this);
  backups_->setObjectName("backups");
  backups_->setAccessibleName(tr("Backups, the newest first"));
  backups_->setAlternatingRowColors(true);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->addWidget(undo_);
  layout->addWidget(redo_);
  layout->addWidget(title);
  layout->addWidget(backups_, 1);
  list_ = new Redraw(this, [this] { ListBackups(); });
  connect(backups_, &QListWidget::itemClicked, this, [this](QListWidgetItem* item) { Restore(backups_->row(item)); });
  connect(backups_, &QListWidget::itemActivated, this, [this](QListWidgetItem* item) { Restore(backups_->row(item)); });
  connect(bench, &Workbench::HistoryChanged, this, &HistoryPanel::ShowHistory);
  ShowHistory();
}

void HistoryPanel::showEvent(QShowEvent* event)
{
  QWidget::showEvent(event);
  list_->Ask();
}

void HistoryPanel::ShowHistory()
{
  const auto* session = bench_->Session();
  const auto label = [](const QString& verb, const std::string& what) {
    return what.empty() ? verb : QString("%1: %2").arg(verb, QString::fromStdString(what));
  };
  undo_->setEnabled(session->GetUndoCount() > 0);
  redo_->setEnabled(session->GetRedoCount() > 0);
  undo_->setText(label(tr("Undo"), session->GetUndoLabel()));
  redo_->setText(label(tr("Redo"), session->GetRedoLabel()));
  if (isVisible())
    list_->Ask(ListMs);
}

void HistoryPanel::ListBackups()
{
  vtkNew<vtkStringArray> paths, labels;
  vtkNew<vtkDoubleArray> times;
  const int count = bench_->Session()->GetBackups(paths, labels, times);
  backups_->clear();
  for (int i = 0; i < count; i++) {
    const QString path = QString::fromStdString(paths->GetValue(i)), label = QString::fromStdString(labels->GetValue(i));
    const QDateTime time = QDateTime::fromMSecsSinceEpoch(static_cast<qint64>(1000.0 * times->GetValue(i)));
    const bool isToday = time.date() == QDate::currentDate();
    auto* item =
        new QListWidgetItem(QString("%1  %2").arg(time.toString(isToday ? "hh:mm:ss" : "yyyy-MM-dd hh:mm"), label), backups_);
    item->setData(Qt::UserRole, path);
    item->setToolTip(path);
    if (label == "damaged")
      item->setFlags(Qt::NoItemFlags);
  }
}

void HistoryPanel::Restore(int row)
{
  const QListWidgetItem* item = backups_->item(row);
  if (item && item->flags().testFlag(Qt::ItemIsEnabled))
    bench_->Session()->RestoreBackup(item->data(Qt::UserRole).toString().toUtf8().constData());
}

} // namespace echorama
