// SPDX-License-Identifier: BSD-3-Clause
// The threads live only while something waits for them: an idle session wakes nobody.
#include "Widgets/Session/BackupWriter.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Core/Base/Worker.h"
#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <utility>

namespace echorama {
namespace {

constexpr double Glance = 0.05; // seconds between looks at whether a waiting drag has ended
constexpr double Repeat = 1.0;  // seconds within which edits of one label are one

double Since(Clock::time_point time)
{
  return std::chrono::duration<double>(Clock::now() - time).count();
}

struct Item {
  Project project;
  std::string label;
  bool finished = true;
};

} // namespace

struct BackupWriter::Parts {
  Backups backups;
  double interval;

  std::mutex mutex; // of what follows
  std::deque<Item> queue;
  bool active = false;                    // the thread will look at the queue again
  bool syncing = false, unsynced = false; // the other thread will look at this again: whether something waits for the disk
  std::string failure, diskFailure;
  bool told = false; // of a failure; until there is none

  // Touched only by who writes: the thread, or its owner when there is none.
  std::string lastLabel;
  bool lastFinished = true;
  Clock::time_point lastTime = Clock::now() - std::chrono::hours(1);

  Worker disk, worker; // the last members: they end before the others go

  Parts(const std::string& folder, LastBackup after, double seconds, int keep)
    : backups(folder, std::move(after), keep), interval(seconds)
  {
  }

  void Write(const Item& item)
  {
    std::string reason;
    const bool again = !lastFinished || (item.label == lastLabel && Since(lastTime) < Repeat);
    lastTime = Clock::now(); // before: a disk that is slow does not put off the next one
    try {
      if (backups.Write(item.project, item.label, again))
        lastLabel = item.label;
      lastFinished = item.finished;
    } catch (const std::exception& error) {
      reason = error.what();
    }
    {
      const std::lock_guard<std::mutex> lock(mutex);
      Note(failure, reason);
      if (!reason.empty())
        return;
      unsynced = true;
      if (std::exchange(syncing, true))
        return;
    }
    try {
      disk.Start([this](const Worker::Signal&) { Sync(); });
    } catch (const std::exception&) { // the system has no thread to give
      Sync();
    }
  }

  void Sync()
  {
    for (;;) {
      {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!std::exchange(unsynced, false)) {
          syncing = false;
          return;
        }
      }
      std::string reason;
      try {
        backups.Sync();
      } catch (const std::exception& error) {
        reason = error.what();
      }
      const std::lock_guard<std::mutex> lock(mutex);
      Note(diskFailure, reason);
    }
  }

  void Note(std::string& trouble, const std::string& reason)
  {
    trouble = reason;
    told = told && !Failure().empty();
  }
  const std::string& Failure() const { return failure.empty() ? diskFailure : failure; }

  void Run(const Worker::Signal& signal)
  {
    for (;;) {
      Item item;
      double wait = 0.0;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        if (queue.empty() || signal.Stopped()) {
          active = false;
          return;
        }
        if (!queue.front().finished)
          wait = interval - Since(lastTime);
        if (wait <= 0.0) {
          item = std::move(queue.front());
          queue.pop_front();
        }
      }
      if (wait > 0.0)
        signal.Sleep(std::min(wait, Glance));
      else
        Write(item);
    }
  }

  void Drain()
  {
    worker.Stop();
    active = false;
    for (; !queue.empty(); queue.pop_front())
      Write(queue.front());
  }
};

BackupWriter::BackupWriter(const std::string& folder, LastBackup after, double interval, int keep)
  : parts_(std::make_unique<Parts>(folder, std::move(after), interval, keep))
{
}

BackupWriter::~BackupWriter()
{
  parts_->Drain();
}

const std::string& BackupWriter::Folder() const
{
  return parts_->backups.Folder();
}

void BackupWriter::Post(Project project, const std::string& label, bool finished)
{
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    if (!parts_->queue.empty() && (!parts_->queue.back().finished || parts_->queue.back().label == label))
      parts_->queue.pop_back(); // nobody has seen it yet
    parts_->queue.push_back({std::move(project), label, finished});
    if (parts_->active)
      return;
    parts_->active = true;
  }
  try {
    parts_->worker.Start([this](const Worker::Signal& signal) { parts_->Run(signal); });
  } catch (const std::exception&) { // the system has no thread to give, or no memory for one
    parts_->Drain();
  }
}

void BackupWriter::Wait()
{
  parts_->Drain();
}

void BackupWriter::Flush()
{
  Wait();
  parts_->disk.Stop(); // it ends when nothing waits
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  if (!parts_->Failure().empty()) {
    parts_->told = true;
    throw Error(Error::Kind::FileSystem, parts_->Failure());
  }
}

std::string BackupWriter::TakeFailure()
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  if (parts_->Failure().empty() || std::exchange(parts_->told, true))
    return {};
  return parts_->Failure();
}

std::set<int> BackupWriter::Numbers()
{
  Wait();
  return parts_->backups.Numbers();
}

void BackupWriter::MarkSaved()
{
  Wait();
  parts_->backups.MarkSaved();
}

void BackupWriter::DiscardUnsaved()
{
  parts_->worker.Stop();
  parts_->active = false;
  parts_->queue.clear();
  parts_->backups.DiscardUnsaved();
}

} // namespace echorama
