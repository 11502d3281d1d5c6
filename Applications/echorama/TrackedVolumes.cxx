// SPDX-License-Identifier: BSD-3-Clause
#include "TrackedVolumes.h"
#include "Core/Geometry/MotionPath.h"
#include "Readers/PoseLog.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <cmath>
#include <tuple>
#include <vtkUltrasoundAcquisition.h>

namespace echorama {

void TrackerOptions::AddTo(CLI::App& options, bool required)
{
  CLI::Option* file = options.add_option("--tracker", log,
                                         "Recording of the tracker: a sequence (.igs.mha), a table (.csv), as echorama track "
                                         "--record writes it");
  if (required)
    file->required();
  options.add_option("--tool", tool, "The tool that is fixed to the probe, as the recording calls it (default: its only one)");
  options.add_option(
      "--at", times,
      "When each volume was made, in seconds on the recording's clock (default: the volumes' time stamps, else the "
      "recording's poses one by one)");
  options.add_option("--unit", unitMm, "Unit of the recording's lengths in mm; 1000: metres (default: as the file says)")
      ->check(CLI::Range(1e-3, 1e6));
  options
      .add_option("--window", windowSeconds,
                  "Standard deviation of the window over which the poses are averaged, in seconds; 0: none")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
}

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

} // namespace

TrackedTool ReadTool(Session& session, const std::string& log, const std::string& tool, double unitMm)
{
  PoseLogOptions options;
  options.unitMm = unitMm;
  const PoseLog recording = ReadPoseLog(log, options);
  for (const std::string& note : recording.notes)
    session.Note(log + ": " + note);
  std::string name = tool;
  if (name.empty()) {
    if (recording.tools.size() != 1) {
      std::string list;
      for (const std::string& each : recording.tools)
        list += (list.empty() ? "" : ", ") + each;
      throw Error(Error::Kind::InvalidParameter, log + ": it holds several tools; choose one with --tool: " + list);
    }
    name = recording.tools.front();
  }
  TrackedTool tracked;
  std::size_t lost = 0;
  const bool known = std::find(recording.tools.begin(), recording.tools.end(), ToolTransformName(name)) != recording.tools.end();
  std::vector<ToolPose> poses = known ? std::vector<ToolPose>() : Composed(recording, name);
  if (poses.empty())
    poses = recording.Of(name);
  for (const ToolPose& pose : poses)
    if (pose.status == TransformStatus::Valid)
      tracked.poses.push_back(pose);
    else
      ++lost;
  if (tracked.poses.empty())
    throw Error(Error::Kind::BadInput, log + ": " + name + " was never seen");
  if (lost > 0)
    session.Note(log + ": the tracker did not see " + name + " in " + std::to_string(lost) + " of " +
                 std::to_string(lost + tracked.poses.size()) + " moments");
  tracked.name = tracked.poses.front().name;
  const auto frames = FramesOf(tracked.name);
  tracked.from = frames ? frames->first : "Sensor";
  tracked.to = frames ? frames->second : "Tracker";
  return tracked;
}

std::vector<Pose> SensorPoses(Session& session, const TrackerOptions& options, const TrackedTool& tool,
                              const std::vector<LoadedVolume>& volumes)
{
  const std::size_t n = volumes.size();
  std::vector<double> times = options.times;
  std::string how = "at the given times";
  if (!times.empty() && times.size() != n)
    throw Error(Error::Kind::InvalidParameter,
                "--at: " + std::to_string(times.size()) + " times for " + std::to_string(n) + " volumes");
  const bool timed = std::isfinite(tool.poses.front().time);
  if (times.empty() && timed) {
    for (const LoadedVolume& volume : volumes)
      if (const auto stamp = vtkUltrasoundAcquisition::TimeStampOf(volume.image))
        times.push_back(*stamp);
    if (times.size() != n && !times.empty())
      throw Error(Error::Kind::BadInput, std::to_string(n - times.size()) + " of " + std::to_string(n) +
                                             " volumes have no time stamp: say with --at when each was made");
    how = "at the volumes' time stamps";
  }
  std::vector<Pose> poses;
  if (times.empty()) {
    if (tool.poses.size() != n)
      throw Error(Error::Kind::BadInput, options.log + ": it has " + std::to_string(tool.poses.size()) + " valid poses of " +
                                             tool.name + " for " + std::to_string(n) +
                                             " volumes without time stamps: say with --at when each was made, or give a "
                                             "recording with one pose for each");
    for (const ToolPose& pose : tool.poses)
      poses.push_back(pose.pose);
    session.Say("tracker: one pose of " + tool.name + " for each volume, in their order");
    return poses;
  }
  if (!timed)
    throw Error(Error::Kind::BadInput, options.log + ": it has no times");
  std::vector<TimedPose> timedPoses;
  for (const ToolPose& pose : tool.poses)
    if (timedPoses.empty() || pose.time > timedPoses.back().time)
      timedPoses.push_back({pose.time, pose.pose});
  if (timedPoses.size() < tool.poses.size())
    session.Note(options.log + ": " + std::to_string(tool.poses.size() - timedPoses.size()) + " poses of " + tool.name +
                 " repeat a time and were left out");
  MotionSmoothing smoothing;
  smoothing.sigmaSeconds = options.windowSeconds;
  const MotionPath path(timedPoses, smoothing);
  for (std::size_t i = 0; i < n; ++i) {
    try {
      poses.push_back(path.At(times[i]));
    } catch (const Error& error) {
      throw Error(error.GetKind(),
                  options.log + ": " + tool.name + " is not known when " + volumes[i].file + " was made: " + error.what());
    }
  }
  session.Say("tracker: poses of " + tool.name + " " + how);
  return poses;
}

VolumeFrames VolumeFrames::Of(Session& session, const std::vector<LoadedVolume>& volumes, const std::string& frame)
{
  VolumeFrames frames;
  std::vector<Pose> probes;
  std::string without;
  for (const LoadedVolume& volume : volumes) {
    if (const auto probe = vtkUltrasoundAcquisition::ProbeToWorldOf(volume.image)) // of the image where it is now
      probes.push_back(volume.volumeToWorld.inverse() * *probe);
    else if (without.empty())
      without = volume.file;
  }
  frames.ofProbe = frame.empty() ? without.empty() : frame == "probe";
  if (!frames.ofProbe) {
    frames.toFile.assign(volumes.size(), Pose::Identity());
    for (const LoadedVolume& volume : volumes)
      if ((volume.geometry.direction - volumes.front().geometry.direction).cwiseAbs().maxCoeff() > 1e-4) {
        session.Note(volume.file + ": its axes differ from those of " + volumes.front().file +
                     "; the files should lie as they were acquired, fixed to the probe");
        break;
      }
    return frames;
  }
  if (!without.empty())
    throw Error(Error::Kind::BadInput,
                without + ": it does not say where its probe was (ProbeToWorld), which the calibration needs");
  frames.toFile = probes;
  return frames;
}

} // namespace echorama
