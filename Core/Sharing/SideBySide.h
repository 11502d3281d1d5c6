// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstddef>
#include <functional>

namespace echorama {

/// Does \a task for 0 ... count - 1, several at once: for long tasks with parallel loops of their own. Each is given a progress
/// of its own, which \a progress learns of from the calling thread alone. A thread that waits for a loop of a task does not begin
/// another one meanwhile, so that what a task takes of the clock is its own.
/// \throws what a task throws first, or Error(Cancelled). No other is begun then; those that are under way end at their next
/// progress.
void SideBySide(std::ptrdiff_t count, const Progress& progress,
                const std::function<void(std::ptrdiff_t task, const Progress& progress)>& task);

/// How many tasks keep all threads busy to the end, though one takes longer than another: two for each thread.
std::ptrdiff_t TasksAtOnce();

} // namespace echorama
