// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstdint>
#include <functional>

namespace echorama {

/// What a task in another process may take.
struct TaskLimits {
  double seconds = 60.0;                        ///< of processor time, > 0; rounded up to whole ones
  std::uint64_t bytes = std::uint64_t{1} << 30; ///< of memory, beside what this process has
};

enum class TaskOutcome {
  Succeeded,
  Failed, ///< the task returned false, threw, crashed, or had not enough memory
  TimedOut,
};

/// Runs \a task in a process of its own, a fork of this one, silently: for code that is not ours, prints, and may crash or hang
/// on damaged data. What it changes is seen here in shared memory alone. It may not rely on other threads: they are not in the
/// fork.
///
/// \param progress asked about every 20 ms, with \a fraction, whether to go on
///
/// \throws Error(NotPossible) when no process can be started; Error(Cancelled), with the process ended.
TaskOutcome RunIsolated(const std::function<bool()>& task, const TaskLimits& limits, const Progress& progress = {},
                        double fraction = 0.0);

} // namespace echorama
