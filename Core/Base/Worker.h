// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <memory>
#include <string>

namespace echorama {

/// A thread that waits for a device or the disk, and can be told to stop. (Parallel loops over data are Core/Base/Parallel.h;
/// this is for waiting alone, and the only place of the house that makes threads for it.)
class Worker {
public:
  /// What a job asks now and then.
  class Signal {
  public:
    bool Stopped() const;
    /// Sleeps (at most an hour), but no longer than until the worker is stopped. \returns false when it was.
    bool Sleep(double seconds) const;

  private:
    friend class Worker;
    struct State;
    std::shared_ptr<State> state_;
  };

  Worker() = default;
  ~Worker() { Stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Starts \a job, which must return soon after its signal says Stopped. Stops an earlier one first. A job that throws has
  /// ended; what it threw is told by Failure(). Neither this nor Stop may be called by the job itself.
  /// \throws std::system_error when the system has no thread to give; there is no job then.
  void Start(std::function<void(const Signal&)> job);
  /// Tells the job to stop and waits for its end. Does nothing when there is none.
  void Stop();
  /// Whether a job was started and has not returned.
  bool Running() const;
  /// What the job threw, as a sentence; empty when it did not.
  std::string Failure() const;

private:
  struct Thread;
  std::shared_ptr<Thread> thread_;
};

} // namespace echorama
