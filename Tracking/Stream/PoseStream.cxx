// SPDX-License-Identifier: BSD-3-Clause
// One lock guards everything: a pose is a hundred bytes, ten thousand of them a second are no load. What costs more (making a
// matrix rigid, sorting latencies) is done outside of it, and nobody who needs it is woken while it is held: subscriptions have
// locks of their own.
//
// Each tool keeps its newest poses, in the order of time, in a ring that grows to its bound and is then never allocated again.
//
// A sender's clock is compared with ours by time minus arrival. A pose that is held up on its way makes that smaller for a while,
// never larger; so the largest of late is what a punctual pose has, and only one that lies above it by much, or a time before the
// last one, tells of a clock that has jumped. The largest fades by a millisecond per second, far above what quartzes drift.
// What came before a jump cannot be interpolated with what comes after, so it is forgotten.
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
#include <numeric>

namespace echorama {
namespace {

constexpr std::size_t LongestName = 256, LongestSentence = 512; // bytes: a peer may send anything
constexpr double ClockFading = 1e-3;                            // seconds per second

// What wait_for can hold: other than that, inf and NaN would not come back at all or at once.
std::chrono::duration<double> Patience(double seconds)
{
  return std::chrono::duration<double>(seconds > 0.0 ? std::min(seconds, 3600.0) : 0.0);
}

double Middle(std::vector<double>& values) // which change places; not empty
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

} // namespace

ParameterList Describe(StreamLimits& p)
{
  return {
      Parameter("LongestGapSeconds", p.longestGapSeconds, {0, 600, true}, "s",
                "Poses that lie further apart in time are not interpolated. Counts when the device is opened.")
          .Advanced(),
      Parameter("PosesPerTool", p.posesPerTool, {2, 1000000}, "", "The newest poses of a tool that are remembered."),
      Parameter("Tools", p.tools, {1, 4096}, "", "The most tools of which poses are taken."),
      Parameter(
          "JumpSeconds", p.jumpSeconds, {0, 600, true}, "s",
          "A sender's clock that goes back by more than this has jumped, and so has one that runs ahead of ours by this much "
          "more than before. A pose that is held up on its way is no jump. After one, what came before is forgotten."),
  };
}

const char* DeviceStateText(DeviceState state)
{
  static const char* const texts[] = {"idle", "connecting", "running", "lost", "ended", "failed"};
  return texts[static_cast<int>(state)];
}

const char* RejectionText(Rejection reason)
{
  static const char* const texts[RejectionCount] = {"malformed", "too large",    "foreign",       "not rigid",
                                                    "duplicate", "out of order", "too many tools"};
  return texts[static_cast<int>(reason)];
}

double ToolStatistics::DropoutShare() const
{
  const double all = static_cast<double>(Taken());
  return all > 0.0 ? 1.0 - static_cast<double>(valid) / all : 0.0;
}

std::uint64_t StreamStatistics::Rejected() const
{
  return std::accumulate(rejected.begin(), rejected.end(), std::uint64_t{0});
}

const ToolStatistics* StreamStatistics::Find(const std::string& tool) const
{
  const auto found = std::find_if(tools.begin(), tools.end(), [&tool](const ToolStatistics& one) {
    const auto frames = FramesOf(one.name);
    return one.name == tool || (frames && frames->first == tool);
  });
  return found == tools.end() ? nullptr : &*found;
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
  std::deque<ToolPose> taken; // the sender does not wait until they are copied
  {
    std::unique_lock<std::mutex> lock(parts_->mutex);
    parts_->filled.wait_for(lock, Patience(seconds), [&] { return !parts_->poses.empty(); });
    taken.swap(parts_->poses);
  }
  return {std::make_move_iterator(taken.begin()), std::make_move_iterator(taken.end())};
}

std::uint64_t PoseSubscription::Lost() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->lost;
}

namespace {

// A ToolPose without its name.
struct Sample {
  double time = 0.0, arrival = 0.0;
  Pose pose = Pose::Identity();
  TransformStatus status = TransformStatus::Missing;
  bool isTimed = true; // by its sender; otherwise its time is that of its arrival, which says nothing of a latency

  ToolPose Named(const std::string& name) const { return {name, time, arrival, pose, status}; }
};

// The newest, the oldest first.
class Ring {
public:
  std::size_t Size() const { return samples_.size(); }
  bool Empty() const { return samples_.empty(); }
  const Sample& operator[](std::size_t i) const
  {
    const std::size_t at = first_ + i;
    return samples_[at < samples_.size() ? at : at - samples_.size()];
  }
  const Sample& Last() const { return (*this)[samples_.size() - 1]; }
  void Add(const Sample& sample, std::size_t bound)
  {
    if (samples_.size() < bound) {
      samples_.push_back(sample);
    } else {
      samples_[first_] = sample;
      first_ = first_ + 1 < samples_.size() ? first_ + 1 : 0;
    }
  }
  void Clear()
  {
    samples_.clear();
    first_ = 0;
  }
  // How many are older than \a time.
  std::size_t Before(double time) const
  {
    std::size_t low = 0;
    for (std::size_t high = Size(); low < high;) {
      const std::size_t middle = low + (high - low) / 2;
      if ((*this)[middle].time < time)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

private:
  std::vector<Sample> samples_;
  std::size_t first_ = 0;
};

struct Tool {
  Ring samples;
  double clockOffset = 0.0; // largest of late of time minus arrival
  double taken = 0.0;       // our clock: when the newest was, whatever the arrival that a recording tells
  std::uint64_t byStatus[3] = {0, 0, 0}, clockJumps = 0;

  ToolPose Latest(const std::string& name) const
  {
    if (!samples.Empty())
      return samples.Last().Named(name);
    Sample nothing;
    nothing.time = nothing.arrival = std::numeric_limits<double>::quiet_NaN();
    return nothing.Named(name);
  }

  ToolPose At(const std::string& name, double time, double longestGap) const
  {
    Sample result;
    result.time = time;
    result.arrival = std::numeric_limits<double>::quiet_NaN();
    const std::size_t next = samples.Before(time);
    if (next == samples.Size())
      return result.Named(name);
    const Sample& b = samples[next];
    if (b.time == time)
      return b.Named(name);
    if (next == 0)
      return result.Named(name);
    const Sample& a = samples[next - 1];
    if (b.time - a.time > longestGap || a.status == TransformStatus::Missing || b.status == TransformStatus::Missing)
      return result.Named(name);
    result.pose = Interpolate(a.pose, b.pose, (time - a.time) / (b.time - a.time));
    result.arrival = b.arrival;
    result.status = a.status == TransformStatus::Valid ? b.status : a.status;
    return result.Named(name);
  }
};

// What statistics are made of, copied under the lock.
struct Intervals {
  std::vector<double> times, arrivals, latencies;
};

void Summarize(const Intervals& window, bool live, ToolStatistics& statistics)
{
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const std::size_t count = window.times.size();
  statistics.remembered = count;
  if (!live || (count > 0 && window.latencies.empty()))
    statistics.medianLatencySeconds = statistics.latencySpreadSeconds = unknown;
  if (count < 2)
    return;
  std::vector<double> steps(count - 1), values(count);
  for (std::size_t i = 0; i + 1 < count; ++i)
    steps[i] = window.times[i + 1] - window.times[i];
  statistics.longestGapSeconds = *std::max_element(steps.begin(), steps.end());
  values.assign(steps.begin(), steps.end());
  const double usual = Middle(values);
  for (const double step : steps)
    statistics.gaps += step > 2.0 * usual ? 1 : 0;

  const std::vector<double>& clock = live ? window.arrivals : window.times;
  const double mean = (clock.back() - clock.front()) / static_cast<double>(count - 1);
  statistics.rateHz = mean > 0.0 ? 1.0 / mean : 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const double off = clock[i + 1] - clock[i] - mean;
    squares += off * off;
  }
  statistics.jitterSeconds = std::sqrt(squares / static_cast<double>(count - 1));

  if (live && !window.latencies.empty()) {
    values = window.latencies;
    const double smallest = *std::min_element(values.begin(), values.end());
    statistics.medianLatencySeconds = Middle(values);
    const auto high = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 95 / 100);
    std::nth_element(values.begin(), high, values.end());
    statistics.latencySpreadSeconds = *high - smallest;
  }
}

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
    total.lastRejection = what.substr(0, LongestSentence);
  }

  // With the lock held. \returns false when the pose is not taken.
  bool Take(ToolPose& pose)
  {
    if (pose.name.empty() || pose.name.size() > LongestName) {
      Count(Rejection::Malformed, pose.name.empty() ? "a tool without a name" : "a tool's name is longer than 256 bytes");
      return false;
    }
    auto found = tools.find(pose.name);
    if (found == tools.end()) {
      if (tools.size() >= limits.tools) {
        Count(Rejection::TooManyTools, pose.name + ": there are too many tools");
        return false;
      }
      found = tools.emplace(pose.name, Tool()).first;
    }
    Tool& tool = found->second;

    const bool first = tool.samples.Empty();
    double since = 0.0;
    const bool isTimed = std::isfinite(pose.time);
    if (!isTimed) {
      pose.time = pose.arrival;
      // Two may arrive within one tick of the clock; neither is a duplicate.
      if (!first && pose.time <= tool.samples.Last().time && tool.samples.Last().time - pose.time < limits.jumpSeconds)
        pose.time = std::nextafter(tool.samples.Last().time, std::numeric_limits<double>::infinity());
    }
    const double offset = pose.time - pose.arrival;
    bool jumped = false;
    if (!first) {
      const Sample& last = tool.samples.Last();
      since = std::max(0.0, pose.arrival - last.arrival);
      jumped = last.time - pose.time > limits.jumpSeconds || (total.live && offset - tool.clockOffset > limits.jumpSeconds);
      if (!jumped && pose.time <= last.time) {
        if (pose.time == last.time)
          Count(Rejection::Duplicate, pose.name + ": came again");
        else
          Count(Rejection::OutOfOrder, pose.name + ": is older than the newest");
        return false;
      }
    }
    if (jumped) {
      ++tool.clockJumps;
      tool.samples.Clear();
    }
    tool.clockOffset = first || jumped ? offset : std::max(offset, tool.clockOffset - ClockFading * since);
    ++tool.byStatus[static_cast<std::size_t>(pose.status)];
    tool.taken = ClockNow();
    tool.samples.Add({pose.time, pose.arrival, pose.pose, pose.status, isTimed}, limits.posesPerTool);
    ++version;
    return true;
  }

  // With the lock held, so that all subscribers see the same order.
  void Publish(const ToolPose& pose)
  {
    const auto gone = [&pose](const std::weak_ptr<PoseSubscription>& pointer) {
      const auto subscription = pointer.lock();
      if (!subscription)
        return true;
      PoseSubscription::Parts& queue = *subscription->parts_;
      {
        const std::lock_guard<std::mutex> lock(queue.mutex);
        queue.poses.push_back(pose);
        if (queue.poses.size() > queue.bound) {
          queue.poses.pop_front();
          ++queue.lost;
        }
      }
      queue.filled.notify_all();
      return false;
    };
    subscriptions.erase(std::remove_if(subscriptions.begin(), subscriptions.end(), gone), subscriptions.end());
  }
};

PoseStream::PoseStream(const StreamLimits& limits) : parts_(std::make_unique<Parts>())
{
  CheckRanges(limits);
  parts_->limits = limits;
}

PoseStream::~PoseStream() = default;

void PoseStream::Add(ToolPose pose)
{
  if (!std::isfinite(pose.arrival))
    pose.arrival = ClockNow();
  bool rigid = true;
  if (pose.status != TransformStatus::Missing) {
    Pose nearest = Pose::Identity();
    rigid = NearestPose(pose.pose.matrix(), nearest);
    pose.pose = nearest;
    if (!rigid)
      pose.status = TransformStatus::Missing;
  } else {
    pose.pose = Pose::Identity();
  }
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    if (!rigid)
      parts_->Count(Rejection::NotRigid, pose.name + ": its matrix is no pose");
    if (!parts_->Take(pose))
      return;
    parts_->Publish(pose);
  }
  parts_->changed.notify_all();
}

void PoseStream::Reject(Rejection reason, const std::string& what)
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->Count(reason, what);
}

void PoseStream::SetState(DeviceState state, const std::string& message)
{
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    parts_->total.state = state;
    parts_->total.message = message;
    ++parts_->version;
  }
  parts_->changed.notify_all();
}

void PoseStream::SetLive(bool live)
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->total.live = live;
}

bool PoseStream::Live() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->total.live;
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
  return (found == parts_->tools.end() ? Tool() : found->second).Latest(name);
}

ToolPose PoseStream::At(const std::string& name, double time) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  const auto found = parts_->tools.find(name);
  return found == parts_->tools.end() ? Tool().At(name, time, 0.0)
                                      : found->second.At(name, time, parts_->limits.longestGapSeconds);
}

bool PoseStream::Covers(const std::string& name, double time) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  const auto found = parts_->tools.find(name);
  if (found == parts_->tools.end() || found->second.samples.Empty())
    return false;
  const Ring& samples = found->second.samples;
  return samples[0].time <= time && time <= samples.Last().time;
}

std::vector<ToolPose> PoseStream::Poses(double time) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  std::vector<ToolPose> poses;
  poses.reserve(parts_->tools.size());
  for (const auto& [name, tool] : parts_->tools)
    poses.push_back(std::isnan(time) ? tool.Latest(name) : tool.At(name, time, parts_->limits.longestGapSeconds));
  return poses;
}

std::vector<ToolPose> PoseStream::History(const std::string& name) const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  std::vector<ToolPose> history;
  if (const auto found = parts_->tools.find(name); found != parts_->tools.end()) {
    const Ring& samples = found->second.samples;
    history.reserve(samples.Size());
    for (std::size_t i = 0; i < samples.Size(); ++i)
      history.push_back(samples[i].Named(name));
  }
  return history;
}

StreamStatistics PoseStream::Statistics() const
{
  StreamStatistics statistics;
  std::vector<Intervals> windows;
  {
    const std::lock_guard<std::mutex> lock(parts_->mutex);
    statistics = parts_->total;
    for (const auto& [name, tool] : parts_->tools) {
      ToolStatistics& one = statistics.tools.emplace_back();
      one.name = name;
      one.valid = tool.byStatus[static_cast<std::size_t>(TransformStatus::Valid)];
      one.missing = tool.byStatus[static_cast<std::size_t>(TransformStatus::Missing)];
      one.outOfRange = tool.byStatus[static_cast<std::size_t>(TransformStatus::OutOfRange)];
      one.clockJumps = tool.clockJumps;
      if (!tool.samples.Empty())
        one.secondsSinceLast = ClockNow() - tool.taken;
      Intervals& window = windows.emplace_back();
      window.times.reserve(tool.samples.Size());
      window.arrivals.reserve(tool.samples.Size());
      for (std::size_t i = 0; i < tool.samples.Size(); ++i) {
        window.times.push_back(tool.samples[i].time);
        window.arrivals.push_back(tool.samples[i].arrival);
        if (tool.samples[i].isTimed)
          window.latencies.push_back(tool.samples[i].arrival - tool.samples[i].time);
      }
    }
  }
  for (std::size_t i = 0; i < windows.size(); ++i)
    Summarize(windows[i], statistics.live, statistics.tools[i]);
  return statistics;
}

std::pair<DeviceState, std::string> PoseStream::State() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return {parts_->total.state, parts_->total.message};
}

std::uint64_t PoseStream::Version() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->version;
}

std::uint64_t PoseStream::WaitBeyond(std::uint64_t seen, double seconds) const
{
  std::unique_lock<std::mutex> lock(parts_->mutex);
  parts_->changed.wait_for(lock, Patience(seconds), [&] { return parts_->version != seen; });
  return parts_->version;
}

bool PoseStream::WaitForPoses(std::uint64_t count, double seconds) const
{
  const double until = ClockNow() + seconds;
  for (std::uint64_t version = Version();;) {
    const StreamStatistics statistics = Statistics();
    std::uint64_t taken = 0;
    for (const ToolStatistics& tool : statistics.tools)
      taken += tool.Taken();
    if (taken >= count)
      return true;
    const double left = until - ClockNow();
    if (!(left > 0.0) || statistics.state == DeviceState::Ended || statistics.state == DeviceState::Failed)
      return false;
    version = WaitBeyond(version, left);
  }
}

std::shared_ptr<PoseSubscription> PoseStream::Subscribe(std::size_t bound)
{
  auto subscription = std::make_shared<PoseSubscription>(bound);
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->subscriptions.push_back(subscription);
  return subscription;
}

double PoseStream::Backlog() const
{
  double fullest = 0.0;
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  for (const auto& pointer : parts_->subscriptions) {
    if (const auto subscription = pointer.lock()) {
      const PoseSubscription::Parts& queue = *subscription->parts_;
      const std::lock_guard<std::mutex> queueLock(queue.mutex);
      fullest = std::max(fullest, static_cast<double>(queue.poses.size()) / static_cast<double>(queue.bound));
    }
  }
  return fullest;
}

} // namespace echorama
