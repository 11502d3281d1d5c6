// SPDX-License-Identifier: BSD-3-Clause
#include "Job.h"
#include "Messages.h"
#include <exception>
#include <QElapsedTimer>
#include <QThread>

namespace echorama {

Job::Job(QObject* owner, QString label) : QObject(owner), label_(std::move(label)) {}

Job* Job::Start(QObject* owner, const QString& label, Work work, std::function<void()> done,
                std::function<void(const QString&)> failed)
{
  auto* job = new Job(owner, label);
  const auto error = std::make_shared<QString>();
  const auto failure = std::make_shared<bool>(false);
  const auto cancelled = job->cancelled_;
  job->thread_ = QThread::create([job, cancelled, error, failure, work = std::move(work)] {
    QElapsedTimer sinceShown;
    const Progress progress([&](double fraction) {
      if (!sinceShown.isValid() || sinceShown.elapsed() > 33) {
        sinceShown.start();
        emit job->Progressed(fraction);
      }
      return !*cancelled;
    });
    Messages::OfThread messages;
    try {
      work(progress);
      messages.ThrowErrors();
    } catch (const std::bad_alloc&) {
      *failure = true;
      *error = QStringLiteral("there is not enough memory");
    } catch (const std::exception& problem) {
      *failure = true;
      *error = QString::fromUtf8(problem.what());
    }
  });
  // The thread's end is a queued event: it comes on the job's thread, which is the window's.
  connect(job->thread_, &QThread::finished, job, [job, error, failure, done = std::move(done), failed = std::move(failed)] {
    const bool isDone = !*failure && !job->IsCancelled();
    if (isDone)
      done();
    else if (!job->IsCancelled())
      failed(*error);
    emit job->Ended(isDone);
    job->deleteLater();
  });
  job->thread_->start();
  return job;
}

Job::~Job()
{
  Cancel();
  thread_->disconnect(this);
  thread_->wait();
  delete thread_;
}

void Job::Cancel()
{
  *cancelled_ = true;
}

} // namespace echorama
