// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <atomic>
#include <functional>
#include <memory>
#include <QObject>
#include <QString>

class QThread;

namespace echorama {

/// Work that takes longer than a window may wait: it runs on a thread of its own, tells how far it is, and can be cancelled.
///
/// `work` runs on the thread; it must not touch widgets or the session, only what it was given, and calls its Progress often:
/// that is how it learns that it was cancelled. What VTK classes report as errors meanwhile becomes a thrown Error (Messages.h).
/// Then, on the window's thread, one of `done` and `failed` is called; neither after Cancel(). A job deletes itself when it has
/// ended, and goes with its owner: the owner waits until the work has noticed.
class Job : public QObject {
  Q_OBJECT

public:
  using Work = std::function<void(const Progress&)>;

  static Job* Start(QObject* owner, const QString& label, Work work, std::function<void()> done,
                    std::function<void(const QString& error)> failed);
  ~Job() override;

  const QString& Label() const { return label_; }
  void Cancel();
  bool IsCancelled() const { return *cancelled_; }

signals:
  void Progressed(double fraction); ///< at most some thirty times a second
  void Ended(bool done);            ///< false: failed or cancelled; the job still exists

private:
  Job(QObject* owner, QString label);

  QString label_;
  std::shared_ptr<std::atomic<bool>> cancelled_ = std::make_shared<std::atomic<bool>>(false);
  QThread* thread_ = nullptr;
};

} // namespace echorama
