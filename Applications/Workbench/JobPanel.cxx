// SPDX-License-Identifier: BSD-3-Clause
#include "JobPanel.h"
#include "JobBar.h"
#include "Workspace.h"
#include <QTimer>

namespace echorama {

Job* Workspace::Run(QObject* owner, const QString& label, std::function<void(const Progress&)> work, std::function<void()> done,
                    const Message::Answers& answers, const QString& topic)
{
  Job* job = Job::Start(owner, label, std::move(work), std::move(done),
                        [this, label, answers, of = topic.isEmpty() ? owner->objectName() : topic](const QString& error) {
                          show({Message::Warning, QString("%1: %2").arg(label, error), answers, of});
                        });
  jobs->Watch(job);
  return job;
}

void Workspace::BetweenEdits(QObject* owner, const std::function<void()>& edit) const
{
  if (session->GetKernel().Editing())
    QTimer::singleShot(100, owner, [this, owner, edit] { BetweenEdits(owner, edit); });
  else
    edit();
}

JobPanel::JobPanel(Workspace& workspace, QWidget* parent) : QWidget(parent), workspace_(workspace) {}

JobPanel::~JobPanel()
{
  delete job_; // before the buttons
}

void JobPanel::Start(const QString& label, Job::Work work, std::function<void()> done)
{
  workspace_.show({Message::Note, {}, {}, objectName()}); // what the last one said is of the past
  job_ = workspace_.Run(this, label, std::move(work), std::move(done));
  connect(job_, &Job::Ended, this, [this] {
    job_ = nullptr;
    ShowState();
  });
  ShowState();
}

} // namespace echorama
