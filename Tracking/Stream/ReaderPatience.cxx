// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ReaderPatience.h"
#include "Tracking/Stream/Clock.h"

namespace echorama {
namespace {

// How full subscriptions may become, how often it looks, and how long it waits.
constexpr double HalfFull = 0.5, LookSeconds = 0.001, PatienceSeconds = 10.0;

} // namespace

bool ReaderPatience::Wait(const PoseStream& poses, const Worker::Signal& signal)
{
  double backlog = poses.Backlog();
  if (backlog <= HalfFull)
    isAnybodyThere_ = true;
  for (double seen = ClockNow(); isAnybodyThere_ && backlog > HalfFull;) {
    if (!signal.Sleep(LookSeconds))
      return false;
    const double left = poses.Backlog(), now = ClockNow();
    if (left < backlog)
      seen = now;
    isAnybodyThere_ = now - seen < PatienceSeconds;
    backlog = left;
  }
  return true;
}

} // namespace echorama
