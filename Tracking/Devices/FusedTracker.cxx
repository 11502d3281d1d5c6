// SPDX-License-Identifier: BSD-3-Clause
// Two devices with streams of their own, and a thread that takes every pose of both, once, in the order of their times as far as
// they are known: of a recording, the line that is ahead waits for the other. Whatever comes of the filter goes on as one tool.
// A thread that waits for one line looks at the other every few milliseconds.
#include "Tracking/Devices/FusedTracker.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Geometry/TransformGraph.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/ReaderPatience.h"
#include <cmath>
#include <deque>
#include <limits>

namespace echorama {
namespace {

constexpr double lookSeconds = 0.004, silentSeconds = 0.5, stateSeconds = 0.1;
constexpr double agreeSeconds = 10.0; // by how much the clocks of both lines may differ, with what the filter remembers
constexpr double backSeconds = 1.0;   // a clock that jumped

} // namespace

ParameterList Describe(FusedTrackerParameters& p)
{
  return Join(
      {{Parameter("PositionTool", p.positionTool, "The tool whose place is the probe's; none: the first that is heard of."),
        Parameter("OrientationTool", p.orientationTool, "The tool whose turn is the IMU's; none: the first that is heard of."),
        Parameter("Clock", Choice(p.clock, {"sender", "arrival"}),
                  "What puts the poses of both lines in order: their senders' clocks, which must be one, or when they come."),
        Parameter("Normals", Choice(p.normals, {"none", "tool"}),
                  "What says where the surface looks: nothing, or the tool of the position, whose z looks into it."),
        Parameter("Mounting", p.mounting, {-360, 360}, "degrees", "How the IMU is turned in the probe: an axis times an angle."),
        Parameter("AlignTo", p.alignTo, {-1e6, 1e6}, "", "Where the array points at first; 0 0 0: somebody will say so."),
        Parameter("AlignDegrees", p.alignDegrees, {0.01, 90}, "degrees", "How well that is known.")},
       Describe(p.filter)});
}

FusedTrackerParameters FusedTrackerParameters::Of(const TrackerAddress& address)
{
  const std::size_t bar = address.place.find('|');
  if (bar == std::string::npos)
    throw Error(Error::Kind::InvalidParameter,
                address.text + ": two trackers are fused as fused:POSITION-LINE|ORIENTATION-LINE, or with |OPTION=VALUE behind");
  FusedTrackerParameters p;
  p.positionLine = address.place.substr(0, bar);
  p.orientationLine = address.place.substr(bar + 1);
  if (p.orientationLine.empty())
    throw Error(Error::Kind::InvalidParameter, address.text + ": there is no line of an orientation behind the bar");
  address.Set(Describe(p));
  return p;
}

struct FusedTracker::Line {
  const char* what;
  std::string tool; // that counts; "": the first
  std::unique_ptr<PoseStream> poses;
  std::shared_ptr<PoseSubscription> all;
  std::unique_ptr<TrackerDevice> device;
  std::deque<ToolPose> waiting;
  double heard = 0.0;                                      // our clock
  double stamp = std::numeric_limits<double>::quiet_NaN(); // of the last pose that was used
  std::pair<DeviceState, std::string> state;

  Line(const char* name, const std::string& address, std::string wanted)
    : what(name), tool(std::move(wanted)), device(MakeTracker(address))
  {
  }

  void Start(ImageStream* images)
  {
    poses = std::make_unique<PoseStream>();
    all = poses->Subscribe();
    waiting.clear();
    heard = ClockNow();
    device->Start(*poses, images);
  }
  // Whether something waits, or nothing will come any more.
  void Take(double seconds)
  {
    state = poses->State(); // first: what was sent before the end is there then
    if (waiting.empty())
      for (ToolPose& pose : all->Take(seconds))
        waiting.push_back(std::move(pose));
  }
  bool IsOver() const { return waiting.empty() && (state.first == DeviceState::Ended || state.first == DeviceState::Failed); }
  bool Wants(const ToolPose& pose)
  {
    if (tool.empty())
      tool = pose.name;
    const auto frames = FramesOf(pose.name);
    return pose.name == tool || (frames && frames->first == tool);
  }
};

FusedTracker::FusedTracker(const FusedTrackerParameters& parameters)
  : parameters_(parameters), filter_(parameters.filter), sent_(std::numeric_limits<double>::quiet_NaN())
{
  CheckRanges(parameters_);
  if (!parameters_.positionLine.empty())
    position_ = std::make_unique<Line>("the position", parameters_.positionLine, parameters_.positionTool);
  orientation_ = std::make_unique<Line>("the orientation", parameters_.orientationLine, parameters_.orientationTool);
}

FusedTracker::~FusedTracker()
{
  FusedTracker::Stop();
}

void FusedTracker::Start(PoseStream& poses, ImageStream* images)
{
  Stop();
  filter_ = SurfacePoseFilter(parameters_.filter, ExpRotation(RadiansPerDegree * parameters_.mounting));
  sent_ = std::numeric_limits<double>::quiet_NaN();
  name_.clear();
  if (position_)
    position_->Start(images);
  try {
    orientation_->Start(position_ ? nullptr : images);
  } catch (...) {
    if (position_)
      position_->device->Stop();
    throw;
  }
  isLive_ = orientation_->poses->Live() && (!position_ || position_->poses->Live());
  poses.SetLive(isLive_);
  poses.SetState(DeviceState::Connecting, "nothing has come yet");
  RunDevice(worker_, poses, [this, &poses](const Worker::Signal& signal) { Run(signal, poses); });
}

void FusedTracker::Stop()
{
  worker_.Stop();
  for (Line* line : {position_.get(), orientation_.get()})
    if (line && line->poses)
      line->device->Stop();
}

void FusedTracker::Run(const Worker::Signal& signal, PoseStream& poses)
{
  Line *const place = position_.get(), *const turn = orientation_.get();
  double told = 0.0;
  ReaderPatience patience;
  while (!signal.Stopped()) {
    turn->Take(lookSeconds);
    if (place)
      place->Take(isLive_ ? 0.0 : lookSeconds);
    const auto waitsFor = [this](const Line& line) { return line.waiting.empty() && !isLive_ && !line.IsOver(); };
    for (;;) {
      Line* next = !place || place->waiting.empty() ? turn : turn->waiting.empty() ? place : nullptr;
      if (!next) // both wait
        next = StampOf(turn->waiting.front()) <= StampOf(place->waiting.front()) ? turn : place;
      if (next->waiting.empty() || (place && (waitsFor(*place) || waitsFor(*turn))))
        break;
      const ToolPose pose = std::move(next->waiting.front());
      next->waiting.pop_front();
      Use(*next, pose, poses);
      if (!isLive_ && !patience.Wait(poses, signal))
        return;
    }
    if (ClockNow() - told > stateSeconds || turn->IsOver() || (place && place->IsOver())) {
      told = ClockNow();
      const auto state = StateNow();
      if (state != poses.State())
        poses.SetState(state.first, state.second);
      if (state.first == DeviceState::Ended || state.first == DeviceState::Failed)
        return;
    }
  }
}

double FusedTracker::StampOf(const ToolPose& pose) const
{
  return parameters_.clock == FusedTrackerParameters::Clock::Sender ? pose.time : pose.arrival;
}

// What is not measured is left out: where that lasts, the fused tool comes no more.
void FusedTracker::Use(Line& line, const ToolPose& pose, PoseStream& poses)
{
  if (!line.Wants(pose) || pose.status != TransformStatus::Valid)
    return;
  const bool isPlace = &line == position_.get();
  const double stamp = StampOf(pose);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (isPlace || !position_)
    name_ = pose.name;
  line.heard = ClockNow();
  line.stamp = stamp;
  try {
    if (isPlace) {
      const Eigen::Vector3d at = pose.pose.translation();
      std::optional<Eigen::Vector3d> normal;
      if (parameters_.normals == FusedTrackerParameters::Normals::Tool) // which somebody has written into the line
        normal = -pose.pose.linear().col(2);
      else if (normals_)
        normal = normals_(at);
      filter_.AddSurface(stamp, at, normal);
    } else {
      filter_.AddImu(stamp, Eigen::Quaterniond(pose.pose.linear()));
      if (!position_)
        filter_.AddSurface(stamp - parameters_.filter.imuDelay + parameters_.filter.surfaceDelay, place_, placeNormal_);
    }
  } catch (const Error& error) {
    poses.Reject(Rejection::OutOfOrder, line.what + (": " + std::string(error.what())));
    return;
  }
  auto newest = filter_.Newest();
  if (newest && !filter_.IsAligned() && parameters_.alignTo.norm() > 1e-9 &&
      filter_.Align(newest->time, parameters_.alignTo, parameters_.alignDegrees))
    newest = filter_.Newest();
  // Each moment once, in their order, unless a clock went back.
  if (!newest || newest->time == sent_ || (newest->time < sent_ && newest->time > sent_ - backSeconds))
    return;
  sent_ = newest->time;
  ToolPose fused;
  fused.name = name_;
  fused.time = newest->time;
  fused.pose = newest->probeToWorld;
  fused.status = filter_.IsAligned() ? TransformStatus::Valid : TransformStatus::OutOfRange;
  poses.Add(std::move(fused));
}

std::pair<DeviceState, std::string> FusedTracker::StateNow() const
{
  const double now = ClockNow();
  std::string silent;
  bool hasEnded = false;
  for (const Line* line : {position_.get(), orientation_.get()}) {
    if (!line)
      continue;
    const auto& [state, message] = line->state;
    const std::string since =
        isLive_ && now - line->heard > silentSeconds ? Format("silent for %.1f s", now - line->heard) : std::string();
    if (state == DeviceState::Failed || state == DeviceState::Lost || state == DeviceState::Connecting)
      return {state, line->what + (": " + message) + (since.empty() ? "" : ", " + since)};
    hasEnded = hasEnded || line->IsOver();
    if (!since.empty())
      silent += (silent.empty() ? "" : "; ") + std::string(line->what) + ": " + since;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (silent.empty() && !hasEnded && position_ && std::abs(position_->stamp - orientation_->stamp) > agreeSeconds)
    silent = Format("the clocks of both lines are %.3g s apart: clock=arrival takes when poses come",
                    std::abs(position_->stamp - orientation_->stamp));
  const std::string heading =
      filter_.IsAligned() ? Format("the heading is known to %.0f degrees", DegreesPerRadian * filter_.HeadingSigma())
      : std::isnan(sent_) ? std::string("both lines have not reached one moment yet")
                          : std::string("the heading is not known: somebody has to say where the array points");
  return {hasEnded ? DeviceState::Ended : DeviceState::Running, silent.empty() ? heading : silent};
}

void FusedTracker::SetPlace(const Eigen::Vector3d& place, const std::optional<Eigen::Vector3d>& normal)
{
  if (!place.allFinite() || (normal && (!normal->allFinite() || !(normal->norm() > 1e-9))))
    throw Error(Error::Kind::InvalidParameter, "the place of the probe or its normal is not finite, or the normal has no length");
  const std::lock_guard<std::mutex> lock(mutex_);
  place_ = place;
  placeNormal_ = normal;
}

void FusedTracker::SetNormals(NormalOf normals)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  normals_ = std::move(normals);
}

void FusedTracker::Align(const Eigen::Vector3d& direction, double sigmaDegrees)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto newest = filter_.Newest();
  if (!newest)
    throw Error(Error::Kind::NotPossible, "the heading cannot be aligned: both lines have not reached one moment yet");
  if (!filter_.Align(newest->time, direction, sigmaDegrees))
    throw Error(Error::Kind::NotPossible, "the heading cannot be aligned: the array, or where it is to point, is upright");
}

void FusedTracker::AlignBySlide(double seconds, double sigmaDegrees)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto newest = filter_.Newest();
  if (!newest || !(seconds > 0.0) || !filter_.AlignBySlide(newest->time - seconds, newest->time, sigmaDegrees))
    throw Error(Error::Kind::NotPossible,
                "the heading cannot be aligned: the probe was not slid by 10 mm or more along its array, "
                "within the last 10 s");
}

double FusedTracker::HeadingSigma() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return filter_.HeadingSigma();
}

} // namespace echorama
