// SPDX-License-Identifier: BSD-3-Clause
// The graph is built once; each question puts the poses of its moment into it and searches the way, which is short. The newest
// poses of several tools need not be of one moment. Where they are not, the question is asked twice: of the newest poses, which
// tells who is on the way, and then of the moment that the slowest of these has reached. Poses of different moments are never put
// together, unless there is no moment that all of them have.
#include "Tracking/Stream/LiveTransforms.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

const std::string InverseWords = "inverse of "; // as ComposedTransform::path says it

std::string EdgeOf(const std::string& step)
{
  return step.compare(0, InverseWords.size(), InverseWords) == 0 ? step.substr(InverseWords.size()) : step;
}

std::string Tenths(double seconds)
{
  return NumberText(std::round(seconds * 10.0) / 10.0);
}

} // namespace

LiveTransforms::LiveTransforms(const PoseStream& stream, const std::vector<NamedTransform>& fixed, double freshSeconds)
  : stream_(stream), freshSeconds_(freshSeconds), graph_(fixed)
{
  if (!(freshSeconds > 0.0 && freshSeconds <= 3600.0))
    throw Error(Error::Kind::InvalidParameter, "how long a pose is fresh must be above 0 and at most 3600 s");
}

void LiveTransforms::MoveTo(const std::vector<ToolPose>& poses, bool onlyFresh) const
{
  const double now = ClockNow();
  tools_.clear();
  stale_.clear();
  for (const ToolPose& pose : poses) {
    const auto frames = FramesOf(pose.name);
    if (!frames)
      continue;
    NamedTransform edge{frames->first, frames->second, Eigen::Affine3d(pose.pose.matrix()), pose.status, {}, ""};
    if (onlyFresh && pose.status != TransformStatus::Missing && !(now - pose.arrival <= freshSeconds_)) {
      stale_[edge.Name()] = now - pose.arrival;
      edge.status = TransformStatus::Missing;
    }
    if (edge.Complaint().empty()) {
      tools_[edge.Name()] = pose;
      graph_.Set(edge);
    }
  }
}

LiveTransform LiveTransforms::Ask(const std::string& from, const std::string& to) const
{
  LiveTransform answer;
  try {
    answer.transform = graph_.Find(from, to);
  } catch (const Error& error) {
    answer.transform.status = TransformStatus::Missing;
    answer.message = error.what();
    return answer;
  }
  for (const std::string& step : answer.transform.path) {
    const std::string name = EdgeOf(step);
    const auto tool = tools_.find(name);
    if (tool != tools_.end() && !(answer.time <= tool->second.time))
      answer.time = tool->second.time;
    const auto frames = FramesOf(name);
    const NamedTransform* edge = frames ? graph_.Edge(frames->first, frames->second) : nullptr;
    if (!edge || edge->status == TransformStatus::Valid)
      continue;
    answer.message += answer.message.empty() ? "" : "; ";
    if (const auto stale = stale_.find(name); stale != stale_.end())
      answer.message += name + " came last " + Tenths(stale->second) + " s ago";
    else
      answer.message += name + (edge->status == TransformStatus::Missing ? " is missing" : " is out of range");
  }
  if (answer.transform.status != TransformStatus::Missing && !answer.transform.matrix.matrix().allFinite()) {
    answer.transform.status = TransformStatus::Missing;
    answer.message = "a matrix on the way cannot be inverted: " + answer.transform.PathText();
  }
  return answer;
}

LiveTransform LiveTransforms::Find(const std::string& from, const std::string& to, double time) const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!std::isnan(time)) {
    MoveTo(stream_.Poses(time), false);
    return Ask(from, to);
  }
  MoveTo(stream_.Poses(time), stream_.Live());
  const LiveTransform newest = Ask(from, to);
  if (newest.Status() == TransformStatus::Missing)
    return newest;
  const auto isLater = [this, &newest](const std::string& step) {
    const auto tool = tools_.find(EdgeOf(step));
    return tool != tools_.end() && tool->second.time > newest.time;
  };
  const std::vector<std::string>& way = newest.transform.path;
  if (std::none_of(way.begin(), way.end(), isLater))
    return newest;
  // No common moment: senders whose clocks do not agree, or a tool that has just come. Better the newest than none, and said so.
  const auto isYounger = [this, &newest](const std::string& step) {
    const auto tool = tools_.find(EdgeOf(step));
    return tool != tools_.end() && !stream_.Covers(tool->second.name, newest.time);
  };
  if (std::any_of(way.begin(), way.end(), isYounger)) {
    LiveTransform mixed = newest;
    mixed.time = std::numeric_limits<double>::quiet_NaN();
    mixed.message += (mixed.message.empty() ? "" : "; ") + std::string("poses of different moments");
    return mixed;
  }
  // A tool that was not seen then is missing, whatever has come of it since.
  MoveTo(stream_.Poses(newest.time), false);
  return Ask(from, to);
}

LiveTransform LiveTransforms::Find(const std::string& name, double time) const
{
  if (const auto frames = FramesOf(name))
    return Find(frames->first, frames->second, time);
  LiveTransform answer;
  answer.transform.status = TransformStatus::Missing;
  answer.message = "\"" + name + "\" does not name two frames, as ProbeToTracker does";
  return answer;
}

TransformGraph LiveTransforms::Graph(double time) const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  MoveTo(stream_.Poses(time), std::isnan(time) && stream_.Live());
  return graph_;
}

} // namespace echorama
