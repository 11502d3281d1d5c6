// SPDX-License-Identifier: BSD-3-Clause
#include "JobBar.h"
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QTimer>
#include <QToolButton>
#include <utility>

namespace echorama {

namespace {
constexpr int ShowMs = 300;
}

JobBar::JobBar(QWidget* parent) : QWidget(parent)
{
  setObjectName("jobBar");
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
}

void JobBar::Watch(Job* job)
{
  auto* row = new QWidget(this);
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(8, 0, 4, 0);
  auto* label = new QLabel(job->Label(), row);
  auto* bar = new QProgressBar(row);
  bar->setObjectName("jobProgress");
  bar->setRange(0, 1000);
  bar->setMaximumWidth(160);
  auto* stop = new QToolButton(row);
  stop->setObjectName("jobCancel");
  stop->setText(tr("Cancel"));
  stop->setToolTip(tr("Stop this. Everything stays as it was."));
  layout->addWidget(label);
  layout->addWidget(bar);
  layout->addWidget(stop);
  this->layout()->addWidget(row);
  row->hide(); // what is done before anybody could read of it does not make the window jump
  auto* later = new QTimer(row);
  later->setSingleShot(true);
  connect(later, &QTimer::timeout, row, &QWidget::show);
  later->start(ShowMs);
  jobs_.append(job);
  emit CountChanged(++count_);

  connect(job, &Job::Progressed, bar, [bar](double fraction) { bar->setValue(static_cast<int>(1000.0 * fraction)); });
  connect(stop, &QToolButton::clicked, job, [job, stop, label] {
    job->Cancel();
    stop->setEnabled(false);
    label->setText(tr("Stopping: %1").arg(job->Label()));
  });
  connect(job, &Job::Ended, this, [this, job](bool done) {
    if (!done && !job->IsCancelled())
      whenDone_ = {};
  });
  connect(job, &QObject::destroyed, this, [this, row, later] {
    later->stop();
    row->hide(); // at once: it goes when Qt gets to it, and whoever drags then would see everything jump
    row->deleteLater();
    jobs_.removeAll(nullptr);
    emit CountChanged(--count_);
    GoOn();
  });
}

void JobBar::WhenDone(std::function<void()> then)
{
  whenDone_ = std::move(then);
  GoOn();
}

void JobBar::GoOn()
{
  if (count_ == 0 && whenDone_)
    QTimer::singleShot(0, this, std::exchange(whenDone_, {})); // the job that ended is not quite gone
}

QStringList JobBar::Labels() const
{
  QStringList labels;
  for (const auto& job : jobs_)
    if (job)
      labels.append(job->Label());
  return labels;
}

void JobBar::StopAll()
{
  for (const auto& job : jobs_)
    if (job)
      job->Cancel();
}

} // namespace echorama
