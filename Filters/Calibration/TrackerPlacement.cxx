// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Calibration/TrackerPlacement.h"
#include "Core/Base/Error.h"
#include "Core/Base/Json.h"
#include "Core/Geometry/TransformFile.h"

namespace echorama {
namespace {

// What the report of a calibration says of the frame; "volumeFrame" is how older files spell it.
std::string FrameIn(const std::string& report)
{
  const auto json = nlohmann::json::parse(report.empty() ? "{}" : report);
  for (const char* key : {"volume_frame", "volumeFrame"})
    if (json.is_object() && json.contains(key) && json[key].is_string())
      return json[key];
  return "";
}

} // namespace

VolumeCalibration ReadVolumeCalibration(const std::string& path, const std::string& sensor)
{
  const TransformGraph graph(ReadTransforms(path));
  const NamedTransform* edge = graph.Edge("Volume", sensor);
  if (!edge)
    throw Error(Error::Kind::BadInput, path + ": it has no VolumeTo" + sensor + "; choose the tool that was calibrated");
  if (!IsRotation(edge->matrix.linear()) || edge->status != TransformStatus::Valid)
    throw Error(Error::Kind::BadInput, path + ": " + edge->Name() + " is not a rigid, valid pose");
  VolumeCalibration calibration;
  calibration.volumeToSensor.matrix() = edge->matrix.matrix();
  calibration.errorMm = edge->errorMm;
  calibration.frame = FrameIn(ReadTransformReport(path));
  return calibration;
}

ParameterList Describe(TrackerPlacementParameters& p)
{
  return Join({Describe(p.smoothing),
               {Parameter("FixedVolume", p.fixed, {0, Unlimited}, "", "The volume that stays where it is, counted from 0.")}});
}

SensorPoses MatchSensor(const ToolTrack& track, const std::vector<TrackedVolume>& volumes,
                        const TrackerPlacementParameters& parameters)
{
  const std::size_t n = volumes.size();
  std::vector<double> times = parameters.times;
  if (!times.empty() && times.size() != n)
    throw Error(Error::Kind::InvalidParameter,
                std::to_string(times.size()) + " times are given for " + std::to_string(n) + " volumes");
  SensorPoses sensor;
  sensor.how = "poses of " + track.name + (times.empty() ? " at the volumes' time stamps" : " at the given times");
  if (times.empty() && track.IsTimed()) {
    for (const TrackedVolume& volume : volumes)
      if (volume.time)
        times.push_back(*volume.time);
    if (times.size() != n && !times.empty())
      throw Error(Error::Kind::BadInput, std::to_string(n - times.size()) + " of " + std::to_string(n) +
                                             " volumes have no time stamp: say when each was made");
  }
  if (times.empty()) {
    if (track.poses.size() != n)
      throw Error(Error::Kind::BadInput, track.source + ": it has " + std::to_string(track.poses.size()) + " valid poses of " +
                                             track.name + " for " + std::to_string(n) +
                                             " volumes without time stamps: say when each was made, or give a recording with "
                                             "one pose for each");
    for (const TimedPose& pose : track.poses)
      sensor.poses.push_back(pose.pose);
    sensor.how = "one pose of " + track.name + " for each volume, in their order";
    return sensor;
  }
  if (!track.IsTimed())
    throw Error(Error::Kind::BadInput, track.source + ": it has no times");
  if (const std::size_t repeats = track.Repeats(); repeats > 0)
    sensor.notes.push_back(track.source + ": " + std::to_string(repeats) + " poses of " + track.name +
                           " repeat a time and were left out");
  const MotionPath path = track.Path(parameters.smoothing);
  for (std::size_t i = 0; i < n; ++i) {
    try {
      sensor.poses.push_back(path.At(times[i]));
    } catch (const Error& error) {
      throw Error(error.GetKind(),
                  track.source + ": " + track.name + " is not known when " + volumes[i].name + " was made: " + error.what());
    }
  }
  return sensor;
}

VolumeFrames FindVolumeFrames(const std::vector<TrackedVolume>& volumes, const std::string& frame)
{
  const TrackedVolume* without = nullptr;
  for (const TrackedVolume& volume : volumes)
    if (!volume.probeToWorld && !without)
      without = &volume;
  VolumeFrames frames;
  frames.ofProbe = frame.empty() ? !without : frame == "probe";
  if (frames.ofProbe && without)
    throw Error(Error::Kind::BadInput,
                without->name + ": it does not say where its probe was (ProbeToWorld), which the calibration needs");
  for (const TrackedVolume& volume : volumes) {
    frames.toWorld.push_back(frames.ofProbe ? *volume.probeToWorld : Pose::Identity());
    if (!frames.ofProbe && frames.notes.empty() && (volume.direction - volumes.front().direction).cwiseAbs().maxCoeff() > 1e-4)
      frames.notes.push_back(volume.name + ": its axes differ from those of " + volumes.front().name +
                             "; the files should lie as they were acquired, fixed to the probe");
  }
  return frames;
}

TrackerPlacement PlaceByTracker(const ToolTrack& track, const std::vector<TrackedVolume>& volumes,
                                const VolumeCalibration& calibration, const TrackerPlacementParameters& parameters)
{
  CheckRanges(parameters);
  const auto fixed = static_cast<std::size_t>(parameters.fixed);
  if (fixed >= volumes.size())
    throw Error(Error::Kind::InvalidParameter,
                "the fixed volume is number " + std::to_string(fixed) + " (from 0) of " + std::to_string(volumes.size()));
  const VolumeFrames frames = FindVolumeFrames(volumes, calibration.frame);
  const SensorPoses sensor = MatchSensor(track, volumes, parameters);
  const Pose& c = calibration.volumeToSensor;
  TrackerPlacement placement{std::vector<Pose>(volumes.size(), Pose::Identity()), sensor.how, frames.notes};
  placement.notes.insert(placement.notes.end(), sensor.notes.begin(), sensor.notes.end());
  for (std::size_t i = 0; i < volumes.size(); ++i)
    if (i != fixed)
      placement.volumeToWorld[i] =
          frames.toWorld[fixed] * c.inverse() * sensor.poses[fixed].inverse() * sensor.poses[i] * c * frames.toWorld[i].inverse();
  return placement;
}

} // namespace echorama
