// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Job.h"
#include <functional>
#include <QPointer>
#include <QStringList>
#include <QVector>
#include <QWidget>

namespace echorama {

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
  /// Calls \a then when nothing runs any more; not if something fails before that, as what it says would go unread.
  void WhenDone(std::function<void()> then);

signals:
  void CountChanged(int count);

private:
  void GoOn();

  int count_ = 0;
  std::function<void()> whenDone_;
  QVector<QPointer<Job>> jobs_;
};

} // namespace echorama
