// SPDX-License-Identifier: BSD-3-Clause
#include "SideBySide.h"
#include "Core/Base/Parallel.h"
#include <atomic>
#include <exception>
#include <tbb/task_arena.h>
#include <thread>

namespace echorama {

void SideBySide(std::ptrdiff_t count, const Progress& progress,
                const std::function<void(std::ptrdiff_t task, const Progress& progress)>& task)
{
  std::atomic<std::ptrdiff_t> done{0};
  std::atomic<bool> isOver{false};
  std::exception_ptr failure; // of the task that failed first: the others' may be that they were stopped
  const Progress own([&, caller = std::this_thread::get_id()](double fraction) {
    if (std::this_thread::get_id() == caller)
      progress((static_cast<double>(done) + fraction) / static_cast<double>(count));
    return !isOver;
  });
  ParallelFor(count, [&](std::ptrdiff_t i) {
    if (isOver)
      return;
    try {
      own(0.0);
      tbb::this_task_arena::isolate([&] { task(i, own); });
      ++done;
    } catch (...) {
      if (!isOver.exchange(true))
        failure = std::current_exception();
    }
  });
  if (failure)
    std::rethrow_exception(failure);
}

std::ptrdiff_t TasksAtOnce()
{
  return 2 * tbb::this_task_arena::max_concurrency();
}

} // namespace echorama
