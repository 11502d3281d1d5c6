// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Ranks that are threads of one process, behind the functions of vtkMultiProcessController that ControllerWork calls.
#include "Core/Sharing/ControllerWork.h"
#include <algorithm>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace echorama {

class ThreadRanks {
public:
  explicit ThreadRanks(int ranks) : sent_(static_cast<std::size_t>(ranks)) {}

  class Controller {
  public:
    Controller(ThreadRanks& all, int rank) : all_(all), rank_(rank) {}
    int GetNumberOfProcesses() const { return static_cast<int>(all_.sent_.size()); }
    int GetLocalProcessId() const { return rank_; }
    int AllGather(const long long* send, long long* receive, long long length)
    {
      const auto told =
          all_.Gather(rank_, {reinterpret_cast<const char*>(send), static_cast<std::size_t>(length) * sizeof(*send)});
      for (const std::string& each : told)
        receive = std::copy_n(reinterpret_cast<const long long*>(each.data()), length, receive);
      return 1;
    }
    int AllGatherV(const char* send, char* receive, long long length, const long long* lengths, const long long* places)
    {
      const auto told = all_.Gather(rank_, {send, static_cast<std::size_t>(length)});
      for (std::size_t rank = 0; rank < told.size(); ++rank)
        if (static_cast<long long>(told[rank].size()) == lengths[rank])
          std::copy(told[rank].begin(), told[rank].end(), receive + places[rank]);
        else
          return 0;
      return 1;
    }

  private:
    ThreadRanks& all_;
    int rank_;
  };

  /// Runs \a work on every rank at the same time; what each threw, in words, or "".
  std::vector<std::string> Run(const std::function<void(SharedWork&)>& work, std::int64_t mostBytes = 1 << 20)
  {
    std::vector<std::string> errors(sent_.size());
    std::vector<std::thread> threads;
    for (std::size_t rank = 0; rank < sent_.size(); ++rank)
      threads.emplace_back([this, rank, mostBytes, &errors, &work] {
        try {
          Controller controller(*this, static_cast<int>(rank));
          ControllerWork<Controller> shared(&controller, mostBytes);
          shared.Run([&] { work(shared); });
        } catch (const std::exception& error) {
          errors[rank] = error.what();
        }
      });
    for (std::thread& thread : threads)
      thread.join();
    return errors;
  }

private:
  // All have sent before one receives, and all have received before one sends again.
  std::vector<std::string> Gather(int rank, const std::string& mine)
  {
    std::unique_lock<std::mutex> lock(mutex_);
    sent_[static_cast<std::size_t>(rank)] = mine;
    Meet(lock);
    const std::vector<std::string> all = sent_;
    Meet(lock);
    return all;
  }
  void Meet(std::unique_lock<std::mutex>& lock)
  {
    const int meeting = meetings_;
    if (++here_ == static_cast<int>(sent_.size())) {
      here_ = 0;
      ++meetings_;
      changed_.notify_all();
    } else
      changed_.wait(lock, [&] { return meetings_ != meeting; });
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  int here_ = 0, meetings_ = 0;
  std::vector<std::string> sent_;
};

} // namespace echorama
