// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Job.h"
#include <QPointer>
#include <QStringList>
#include <QVector>
#include <QWidget>

namespace echorama {

struct Workspace;

/// In the status bar: what runs in the background, how far it is, and a button to stop it. Empty when nothing runs.
class JobBar : public QWidget {
  Q_OBJECT

public:
  explicit JobBar(QWidget* parent = nullptr);
  /// Shows \a job until it ends. Several are shown beside each other.
  void Watch(Job* job);
  /// How many are running.
  int Count() const { return count_; }
  QStringList Labels() const;
  void StopAll();

signals:
  void CountChanged(int count);

private:
  int count_ = 0;
  QVector<QPointer<Job>> jobs_;
};

/// A panel whose work runs in the background, one job at a time.
class JobPanel : public QWidget {
  Q_OBJECT

public:
  JobPanel(Workspace& workspace, QWidget* parent);
  ~JobPanel() override;

protected:
  /// See Workspace::Run. ShowState() is called when it begins, and when it has ended.
  void Start(const QString& label, Job::Work work, std::function<void()> done);
  bool IsRunning() const { return job_; }
  virtual void ShowState() = 0;

  Workspace& workspace_;

private:
  QPointer<Job> job_;
};

} // namespace echorama
