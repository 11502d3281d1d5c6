// SPDX-License-Identifier: BSD-3-Clause
#include "HistoryPanel.h"
#include "Controls.h"
#include "Job.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <QDateTime>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QShortcut>
#include <QVBoxLayout>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

namespace echorama {

namespace {
constexpr int ListMs = 1000; ///< after the last edit: by then its backup is on the disk

// What does not fit ends in dots; the button's tip has it whole.
void Elide(QPushButton* button, const QString& text)
{
  constexpr int margins = 16;
  button->setText(button->fontMetrics().elidedText(text, Qt::ElideRight, button->width() - margins));
}

} // namespace

HistoryPanel::HistoryPanel(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench)
{
  setObjectName("historyPanel");
  undo_ = Button(this, "undo", tr("Undo"), tr("Takes the last edit back (Ctrl+Z)"), [this] { bench_->Session()->Undo(); });
  redo_ = Button(this, "redo", tr("Redo"), tr("Makes it again (Ctrl+Shift+Z)"), [this] { bench_->Session()->Redo(); });
  auto* title = new QLabel(tr("Backups (click one to return to it; this can be undone)"), this);
  title->setWordWrap(true);
  for (QPushButton* button : {undo_, redo_}) // labels of edits can be long
    button->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  backups_ = new QListWidget(this);
  backups_->setObjectName("backups");
  backups_->setAccessibleName(tr("Backups, the newest first"));
  backups_->setAlternatingRowColors(true);
  backups_->setWordWrap(true); // names of volumes can be long
  backups_->setTextElideMode(Qt::ElideNone);
  backups_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  backups_->setVerticalScrollBarPolicy(Qt::ScrollBarAlwaysOn); // heights of lines are found as if it were there
  backups_->setResizeMode(QListView::Adjust);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->addWidget(undo_);
  layout->addWidget(redo_);
  layout->addWidget(title);
  layout->addWidget(backups_, 1);
  list_.setSingleShot(true);
  list_.setInterval(ListMs);
  connect(&list_, &QTimer::timeout, this, &HistoryPanel::ListBackups);
  connect(backups_, &QListWidget::itemClicked, this, [this](QListWidgetItem* item) { Restore(backups_->row(item)); });
  auto* enter = new QShortcut(Qt::Key_Return, backups_, nullptr, nullptr, Qt::WidgetShortcut);
  connect(enter, &QShortcut::activated, this, [this] { Restore(backups_->currentRow()); });
  connect(bench, &Workbench::HistoryChanged, this, &HistoryPanel::ShowHistory);
  connect(bench, &Workbench::ScoredChanged, this,
          [this] { backups_->setEnabled(!bench_->IsScored()); }); // one may hold the solution
  ShowHistory();
}

// A panel behind another tab counts as visible, but is not painted.
void HistoryPanel::paintEvent(QPaintEvent* event)
{
  QWidget::paintEvent(event);
  if (!isOld_)
    return;
  isOld_ = false;
  ListBackups();
}

void HistoryPanel::resizeEvent(QResizeEvent* event)
{
  QWidget::resizeEvent(event);
  ShowButtons();
}

void HistoryPanel::ShowButtons()
{
  const auto* session = bench_->Session();
  const auto label = [](const QString& verb, const std::string& what) {
    return what.empty() ? verb : QString("%1: %2").arg(verb, QString::fromStdString(what));
  };
  undo_->setEnabled(session->GetUndoCount() > 0);
  redo_->setEnabled(session->GetRedoCount() > 0);
  const QString undo = label(tr("Undo"), session->GetUndoLabel()), redo = label(tr("Redo"), session->GetRedoLabel());
  undo_->setToolTip(undo + '\n' + tr("Takes the last edit back (Ctrl+Z)"));
  redo_->setToolTip(redo + '\n' + tr("Makes it again (Ctrl+Shift+Z)"));
  Elide(undo_, undo);
  Elide(redo_, redo);
}

void HistoryPanel::ShowHistory()
{
  ShowButtons();
  if (visibleRegion().isEmpty())
    isOld_ = true;
  else
    list_.start(); // again from the beginning: only when edits have ended
}

// Labels are inside the files, and there are a hundred of them: they are read on another thread.
void HistoryPanel::ListBackups()
{
  if (isListing_) {
    list_.start();
    return;
  }
  isListing_ = true;
  const std::string folder = bench_->Session()->GetBackupFolder();
  const auto read = std::make_shared<std::vector<Line>>();
  const Job* job = Job::Start(
      this, tr("Listing backups"),
      [folder, read](const Progress&) {
        vtkNew<vtkStringArray> paths, labels;
        vtkNew<vtkDoubleArray> times;
        const int count = vtkUltrasoundAlignmentSession::GetBackupsIn(folder.c_str(), paths, labels, times);
        for (int i = 0; i < count; i++)
          read->push_back({paths->GetValue(i), labels->GetValue(i), times->GetValue(i)});
      },
      [this, read] { ShowBackups(*read); },
      [this](const QString& error) { bench_->Warn(tr("Backups cannot be listed: %1").arg(error), {}, objectName()); });
  connect(job, &Job::Ended, this, [this] { isListing_ = false; });
}

void HistoryPanel::ShowBackups(const std::vector<Line>& lines)
{
  if (lines == shown_ && backups_->count() > 0)
    return; // it stays where it was scrolled to
  shown_ = lines;
  backups_->clear();
  for (const Line& line : lines) {
    const QString path = QString::fromStdString(line.path), label = QString::fromStdString(line.label);
    const QDateTime time = QDateTime::fromMSecsSinceEpoch(static_cast<qint64>(1000.0 * line.time));
    const bool isToday = time.date() == QDate::currentDate();
    auto* item = new QListWidgetItem(
        QString("%1  %2").arg(time.toString(isToday ? "hh:mm:ss" : "yyyy-MM-dd hh:mm"), Breakable(label)), backups_);
    item->setData(Qt::UserRole, path);
    item->setToolTip(label + '\n' + path);
    if (label == "damaged")
      item->setFlags(Qt::NoItemFlags);
  }
}

void HistoryPanel::Restore(int row)
{
  const QListWidgetItem* item = backups_->item(row);
  if (!item || !item->flags().testFlag(Qt::ItemIsEnabled))
    return;
  const QByteArray path = item->data(Qt::UserRole).toString().toUtf8();
  bench_->Try(objectName(), [&] { return bench_->Session()->RestoreBackup(path.constData()); },
              {{tr("Choose another backup"), [this] { backups_->setFocus(Qt::OtherFocusReason); }}});
}

} // namespace echorama
