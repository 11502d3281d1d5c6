// SPDX-License-Identifier: BSD-3-Clause
// Progress is reported by the calling thread alone, because callbacks end in Python or a user interface. It takes part
// in the loop, so it comes by often enough.
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <atomic>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <thread>

namespace echorama {

void ParallelRanges(std::ptrdiff_t count, std::ptrdiff_t grain, const Progress& progress, const RangeBody& body)
{
  if (count <= 0)
    return;
  grain = std::max<std::ptrdiff_t>(grain, 1);
  const std::ptrdiff_t ranges = (count + grain - 1) / grain;
  const auto caller = std::this_thread::get_id();
  std::atomic<std::ptrdiff_t> done{0};
  std::ptrdiff_t reported = 0; // hundredths; touched by the caller's thread only
  progress(0.0);
  tbb::parallel_for(tbb::blocked_range<std::ptrdiff_t>(0, ranges, 1), [&](const tbb::blocked_range<std::ptrdiff_t>& piece) {
    for (std::ptrdiff_t r = piece.begin(); r < piece.end(); ++r) {
      body(r * grain, std::min(count, (r + 1) * grain));
      const std::ptrdiff_t now = (++done) * 100 / ranges;
      if (std::this_thread::get_id() == caller && now > reported) {
        reported = now;
        progress(static_cast<double>(now) / 100.0);
      }
    }
  });
  progress(1.0);
}

struct ThreadLimit::Control {
  explicit Control(int threads) : control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
{
  if (threads < 0)
    throw Error(Error::Kind::InvalidParameter, "the number of threads must not be negative");
  if (threads > 0)
    control_ = std::make_unique<Control>(threads);
}

ThreadLimit::~ThreadLimit() = default;

} // namespace echorama
