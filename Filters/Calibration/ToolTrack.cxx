// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Calibration/ToolTrack.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include <algorithm>
#include <cmath>
#include <tuple>

namespace echorama {
namespace {

// A transform that the recording does not hold itself, out of those it has at each moment; empty when they do not lead there.
std::vector<ToolPose> Composed(const PoseLog& recording, const std::string& name)
{
  const auto frames = FramesOf(name);
  std::vector<ToolPose> poses;
  if (!frames)
    return poses;
  for (std::size_t begin = 0, end = 0; begin < recording.poses.size(); begin = end) {
    TransformGraph graph;
    const double time = recording.poses[begin].time;
    for (end = begin; end < recording.poses.size() && recording.poses[end].time == time; ++end) {
      const ToolPose& pose = recording.poses[end];
      NamedTransform edge;
      std::tie(edge.from, edge.to) = FramesOf(pose.name).value_or(std::pair(pose.name, std::string("Tracker")));
      edge.matrix = pose.pose;
      edge.status = pose.status;
      graph.Set(edge);
    }
    ToolPose composed;
    composed.name = name;
    composed.time = time;
    composed.status = TransformStatus::Missing;
    try {
      const ComposedTransform found = graph.Find(frames->first, frames->second);
      composed.status = found.status;
      composed.pose.matrix() = found.matrix.matrix();
    } catch (const Error&) {
      // at this moment no way leads there
    }
    poses.push_back(composed);
    end = std::max(end, begin + 1); // without times, NaN is not even itself
  }
  const bool everFound =
      std::any_of(poses.begin(), poses.end(), [](const ToolPose& p) { return p.status != TransformStatus::Missing; });
  return everFound ? poses : std::vector<ToolPose>();
}

std::vector<TimedPose> Rising(const std::vector<TimedPose>& poses)
{
  std::vector<TimedPose> rising;
  for (const TimedPose& pose : poses)
    if (rising.empty() || pose.time > rising.back().time)
      rising.push_back(pose);
  return rising;
}

} // namespace

bool ToolTrack::IsTimed() const
{
  return !poses.empty() && std::isfinite(poses.front().time);
}

MotionPath ToolTrack::Path(const MotionSmoothing& smoothing, const Progress& progress) const
{
  try {
    return MotionPath(Rising(poses), smoothing, progress);
  } catch (const Error& error) {
    throw Error(error.GetKind(), source + ": " + error.what());
  }
}

std::size_t ToolTrack::Repeats() const
{
  return poses.size() - Rising(poses).size();
}

ToolTrack ToolTrackOf(const PoseLog& recording, const std::string& tool)
{
  std::string name = tool;
  if (name.empty()) {
    if (recording.tools.size() != 1)
      throw Error(Error::Kind::InvalidParameter,
                  recording.path + ": it holds several tools; choose one of " + Joined(recording.tools));
    name = recording.tools.front();
  }
  const bool known = std::find(recording.tools.begin(), recording.tools.end(), ToolTransformName(name)) != recording.tools.end();
  std::vector<ToolPose> poses = known ? std::vector<ToolPose>() : Composed(recording, name);
  if (poses.empty())
    poses = recording.Of(name);
  ToolTrack track;
  track.source = recording.path;
  track.notes = recording.notes;
  for (const ToolPose& pose : poses)
    if (pose.status == TransformStatus::Valid)
      track.poses.push_back({pose.time, pose.pose});
  if (track.poses.empty())
    throw Error(Error::Kind::BadInput, recording.path + ": " + name + " was never seen");
  if (const std::size_t lost = poses.size() - track.poses.size(); lost > 0)
    track.notes.push_back("the tracker did not see " + name + " in " + std::to_string(lost) + " of " +
                          std::to_string(poses.size()) + " moments");
  track.name = poses.front().name;
  const auto frames = FramesOf(track.name);
  track.from = frames ? frames->first : "Sensor";
  track.to = frames ? frames->second : "Tracker";
  return track;
}

} // namespace echorama
