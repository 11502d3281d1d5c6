// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Job.h"
#include <QPointer>
#include <QWidget>

namespace echorama {

struct Workspace;

/// A panel whose work runs in the background, one job at a time.
class JobPanel : public QWidget {
  Q_OBJECT

public:
  JobPanel(Workspace& workspace, QWidget* parent);
  ~JobPanel() override;

protected:
  /// See Workspace::Run. What was said last of the topic of the panel's name goes. ShowState() is called when it begins, and when
  /// it has ended.
  void Start(const QString& label, Job::Work work, std::function<void()> done);
  bool IsRunning() const { return job_; }
  virtual void ShowState() = 0;

  Workspace& workspace_;

private:
  QPointer<Job> job_;
};

} // namespace echorama
