// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Worker.h"
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

namespace echorama {
namespace {

// These threads sleep nearly always, and what they wake for is late when they must wait for a turn. Since 6.12, Linux lets a
// thread ask for short turns, which come the sooner, by the field of other policies' run time; before, it ignores it.
void AskForShortTurns()
{
#ifdef SYS_sched_getattr
  struct {
    std::uint32_t size, policy;
    std::uint64_t flags;
    std::int32_t nice;
    std::uint32_t priority;
    std::uint64_t runtime, deadline, period; // ns
  } attributes{};
  if (syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0)
    return;
  attributes.runtime = 100000;
  syscall(SYS_sched_setattr, 0, &attributes, 0); // where it is not granted, nothing is lost
#endif
}

} // namespace

struct Worker::Signal::State {
  mutable std::mutex mutex;
  std::condition_variable changed;
  bool stopped = false, running = true;
  std::string failure;
};

struct Worker::Thread {
  Signal signal;
  std::thread thread;
};

bool Worker::Signal::Stopped() const
{
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->stopped;
}

bool Worker::Signal::Sleep(double seconds) const
{
  std::unique_lock<std::mutex> lock(state_->mutex);
  const std::chrono::duration<double> patience(seconds > 0.0 ? std::min(seconds, 3600.0) : 0.0);
  return !state_->changed.wait_for(lock, patience, [&] { return state_->stopped; });
}

void Worker::Start(std::function<void(const Signal&)> job)
{
  Stop();
  const auto thread = std::make_shared<Thread>();
  thread->signal.state_ = std::make_shared<Signal::State>();
  thread->thread = std::thread([job = std::move(job), signal = thread->signal] {
    AskForShortTurns();
    std::string failure;
    try {
      job(signal);
    } catch (const std::exception& error) {
      failure = error.what();
    } catch (...) {
      failure = "it threw something that is no exception";
    }
    const std::lock_guard<std::mutex> lock(signal.state_->mutex);
    signal.state_->running = false;
    signal.state_->failure = failure;
  });
  thread_ = thread; // now that there is one
}

void Worker::Stop()
{
  if (!thread_)
    return;
  {
    const std::lock_guard<std::mutex> lock(thread_->signal.state_->mutex);
    thread_->signal.state_->stopped = true;
  }
  thread_->signal.state_->changed.notify_all();
  thread_->thread.join();
  thread_.reset();
}

bool Worker::Running() const
{
  if (!thread_)
    return false;
  const std::lock_guard<std::mutex> lock(thread_->signal.state_->mutex);
  return thread_->signal.state_->running;
}

std::string Worker::Failure() const
{
  if (!thread_)
    return "";
  const std::lock_guard<std::mutex> lock(thread_->signal.state_->mutex);
  return thread_->signal.state_->failure;
}

} // namespace echorama
