// SPDX-License-Identifier: BSD-3-Clause
// One lock guards everything: a pose is a hundred bytes, ten thousand of them a second are no load. Each tool keeps its newest
// poses in the order of time. A sender's clock is compared with ours by arrival minus time: where that leaps, its clock has
// jumped, and what came before cannot be interpolated with what comes after, so it is forgotten.
#include "Tracking/Stream/PoseStream.h"
#include "Core/Base/Error.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>

namespace echorama {

void StreamLimits::Check() const
{
  const auto refuse = [](const char* what) { throw Error(Error::Kind::InvalidParameter, what); };
  if (posesPerTool < 2 || posesPerTool > 1000000)
    refuse("the poses that are remembered per tool must be 2 to 1000000");
  if (tools < 1 || tools > 4096)
    refuse("the number of tools must be 1 to 4096");
  if (!(longestGapSeconds > 0.0 && longestGapSeconds <= 600.0))
    refuse("the longest gap must be above 0 and at most 600 s");
  if (!(jumpSeconds > 0.0 && jumpSeconds <= 600.0))
    refuse("the jump of a clock must be above 0 and at most 600 s");
}

const char* DeviceStateText(DeviceState state)
{
  switch (state) {
  case DeviceState::Connecting:
    return "connecting";
  case DeviceState::Running:
    return "running";
  case DeviceState::Lost:
    return "lost";
  case DeviceState::Ended:
    return "ended";
  case DeviceState::Failed:
    return "failed";
  default:
    return "idle";
  }
}

const char* RejectionText(Rejection reason)
{
  static const char* const texts[RejectionCount] = {"malformed", "too large", "replayed",     "foreign",
                                                    "not rigid", "duplicate", "out of order", "too many tools"};
  return texts[static_cast<int>(reason)];
}

double ToolStatistics::DropoutShare() const
{
  const double all = static_cast<double>(valid + missing + outOfRange);
  return all > 0.0 ? 1.0 - static_cast<double>(valid) / all : 0.0;
}

struct PoseSubscription::Parts {
  mutable std::mutex mutex;
  std::condition_variable filled;
  std::deque<ToolPose> poses;
  std::size_t bound = 0;
  std::uint64_t lost = 0;
};

PoseSubscription::PoseSubscription(std::size_t bound) : parts_(std::make_unique<Parts>())
{
  parts_->bound = std::max<std::size_t>(1, bound);
}

PoseSubscription::~PoseSubscription() = default;

std::vector<ToolPose> PoseSubscription::Take(double seconds)
{
  std::unique_lock<std::mutex> lock(parts_->mutex);
  parts_->filled.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return !parts_->poses.empty(); });
  std::vector<ToolPose> taken(std::make_move_iterator(parts_->poses.begin()), std::make_move_iterator(parts_->poses.end()));
  parts_->poses.clear();
  return taken;
}

std::uint64_t PoseSubscription::Lost() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->lost;
}

namespace {

struct Tool {
  std::deque<ToolPose> poses;
  ToolStatistics counts;
};

} // namespace

struct PoseStream::Parts {
  StreamLimits limits;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::uint64_t version = 0;
  std::map<std::string, Tool> tools;
  StreamStatistics total; // without the tools
  std::vector<std::weak_ptr<PoseSubscription>> subscriptions;

  void Count(Rejection reason, const std::string& what)
  {
    ++total.rejected[static_cast<std::size_t>(reason)];
    total.lastRejection = what;
  }
  void Changed()
  {
    ++version;
    changed.notify_all();
  }
};

PoseStream::PoseStream(const StreamLimits& limits) : parts_(std::make_unique<Parts>())
{
  limits.Check();
  parts_->limits = limits;
}

PoseStream::~PoseStream() = default;

void PoseStream::Add(ToolPose pose)
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  if (!std::isfinite(pose.arrival))
    pose.arrival = ClockNow();
  if (!std::isfinite(pose.time))
    pose.time = pose.arrival;
  const bool known = parts_->tools.count(pose.name) > 0;
  if (!known && parts_->tools.size() >= parts_->limits.tools) {
    parts_->Count(Rejection::TooManyTools, pose.name + ": there are too many tools");
    return;
  }
  if (pose.status != TransformStatus::Missing) {
    Pose rigid;
    if (NearestPose(pose.pose.matrix(), rigid)) {
      pose.pose = rigid;
    } else {
      parts_->Count(Rejection::NotRigid, pose.name + ": its matrix is no pose");
      pose.status = TransformStatus::Missing;
    }
  }
  if (pose.status == TransformStatus::Missing)
    pose.pose = Pose::Identity();

  Tool& tool = parts_->tools[pose.name];
  tool.counts.name = pose.name;
  if (!tool.poses.empty()) {
    const ToolPose& last = tool.poses.back();
    const double leap = (pose.time - last.time) - (pose.arrival - last.arrival);
    if (std::fabs(leap) > parts_->limits.jumpSeconds) {
      ++tool.counts.clockJumps;
      tool.poses.clear();
    } else if (pose.time == last.time) {
      parts_->Count(Rejection::Duplicate, pose.name + ": came again");
      return;
    } else if (pose.time < last.time) {
      parts_->Count(Rejection::OutOfOrder, pose.name + ": is older than the newest");
      return;
    }
  }
  switch (pose.status) {
  case TransformStatus::Valid:
    ++tool.counts.valid;
    break;
  case TransformStatus::Missing:
    ++tool.counts.missing;
    break;
  case TransformStatus::OutOfRange:
    ++tool.counts.outOfRange;
    break;
  }
  tool.poses.push_back(pose);
  if (tool.poses.size() > parts_->limits.posesPerTool)
    tool.poses.pop_front();
  for (std::size_t i = 0; i < parts_->subscriptions.size();) {
    if (const auto subscription = parts_->subscriptions[i].lock()) {
      PoseSubscription::Parts& queue = *subscription->parts_;
      const std::lock_guard<std::mutex> inner(queue.mutex);
      queue.poses.push_back(pose);
      if (queue.poses.size() > queue.bound) {
        queue.poses.pop_front();
        ++queue.lost;
      }
      queue.filled.notify_all();
      ++i;
    } else {
      parts_->subscriptions.erase(parts_->subscriptions.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  parts_->Changed();
}

void PoseStream::Reject(Rejection reason, const std::string& what)
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->Count(reason, what);
}

void PoseStream::SetState(DeviceState state, const std::string& message)
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->total.state = state;
  parts_->total.message = message;
  parts_->Changed();
}

std::vector<std::string> PoseStream::Tools() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  std::vector<std::string> names;
  for (const auto& [name, tool] : parts_->tools)
    names.push_back(name);
  return names;
}

ToolPose PoseStream::Latest(const std::string& name) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  const auto found = parts_->tools.find(name);
  if (found != parts_->tools.end() && !found->second.poses.empty())
    return found->second.poses.back();
  ToolPose none;
  none.name = name;
  none.status = TransformStatus::Missing;
  return none;
}

ToolPose PoseStream::At(const std::string& name, double time) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  ToolPose result;
  result.name = name;
  result.time = time;
  result.status = TransformStatus::Missing;
  const auto found = parts_->tools.find(name);
  if (found == parts_->tools.end())
    return result;
  const std::deque<ToolPose>& poses = found->second.poses;
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), time, [](const ToolPose& pose, double at) { return pose.time < at; });
  if (after == poses.end())
    return result;
  if (after->time == time)
    return *after;
  if (after == poses.begin())
    return result;
  const ToolPose &a = *(after - 1), &b = *after;
  if (b.time - a.time > parts_->limits.longestGapSeconds || a.status == TransformStatus::Missing ||
      b.status == TransformStatus::Missing)
    return result;
  const double t = (time - a.time) / (b.time - a.time);
  result.pose = Interpolate(a.pose, b.pose, t);
  result.arrival = b.arrival;
  result.status = a.status == TransformStatus::Valid ? b.status : a.status;
  return result;
}

std::vector<ToolPose> PoseStream::History(const std::string& name) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  const auto found = parts_->tools.find(name);
  return found == parts_->tools.end() ? std::vector<ToolPose>()
                                      : std::vector<ToolPose>(found->second.poses.begin(), found->second.poses.end());
}

StreamStatistics PoseStream::Statistics() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  StreamStatistics statistics = parts_->total;
  for (const auto& [name, tool] : parts_->tools)
    statistics.tools.push_back(tool.counts);
  return statistics;
}

std::uint64_t PoseStream::Version() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->version;
}

std::uint64_t PoseStream::WaitBeyond(std::uint64_t seen, double seconds) const
{
  std::unique_lock<std::mutex> lock(parts_->mutex);
  parts_->changed.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return parts_->version != seen; });
  return parts_->version;
}

std::shared_ptr<PoseSubscription> PoseStream::Subscribe(std::size_t bound)
{
  auto subscription = std::make_shared<PoseSubscription>(bound);
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->subscriptions.push_back(subscription);
  return subscription;
}

} // namespace echorama
