// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace echorama {

/// The one place that names a threading library (oneTBB). Ranges are cut at multiples of \a grain, whatever the number
/// of threads, so that a body which keeps its own sums per range gives the same result on one thread and on many.
using RangeBody = std::function<void(std::ptrdiff_t begin, std::ptrdiff_t end)>;

/// Runs body(begin, end) over [0, count) in ranges of \a grain (the last may be shorter), in parallel.
/// Exceptions of the body, and Error(Cancelled) when \a progress asks to stop, end the loop and reach the caller.
void ParallelRanges(std::ptrdiff_t count, std::ptrdiff_t grain, const Progress& progress, const RangeBody& body);

/// Runs body(i) for i in [0, count), in parallel: for items that are much work each, such as slices.
template <class Body>
void ParallelFor(std::ptrdiff_t count, const Progress& progress, const Body& body)
{
  ParallelRanges(count, 1, progress, [&body](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i)
      body(i);
  });
}

template <class Body>
void ParallelFor(std::ptrdiff_t count, const Body& body)
{
  ParallelFor(count, Progress(), body);
}

/// Sums map(begin, end) over the ranges of [0, count), in their order: the same result for any number of threads.
/// T needs a default value that is zero, and +=.
template <class T, class Map>
T ParallelSum(std::ptrdiff_t count, std::ptrdiff_t grain, const Map& map)
{
  if (count <= 0)
    return T{};
  grain = grain > 1 ? grain : 1;
  std::vector<T> parts(static_cast<std::size_t>((count + grain - 1) / grain));
  ParallelRanges(count, grain, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    parts[static_cast<std::size_t>(begin / grain)] = map(begin, end);
  });
  T sum{};
  for (const T& part : parts)
    sum += part;
  return sum;
}

/// While it lives, parallel loops of this process use at most \a threads threads (0: as many as there are cores).
class ThreadLimit {
public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

private:
  struct Control;
  std::unique_ptr<Control> control_;
};

} // namespace echorama
