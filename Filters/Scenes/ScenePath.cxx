// SPDX-License-Identifier: BSD-3-Clause
#include "ScenePath.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/TransformGraph.h"
#include "Readers/SequencePoses.h"
#include <algorithm>

namespace echorama {
namespace {

// The poses of one transform over all frames.
std::vector<TimedPose> PosesOf(const std::string& path, const std::string& transform)
{
  const SequenceFile file(path);
  const auto frames = FramesOf(transform);
  if (!frames)
    throw Error(Error::Kind::BadInput, path + ": views.recording.transform: \"" + transform +
                                           "\" is no name of a transform, such as "
                                           "\"ProbeToTracker\"");
  const auto& [from, world] = *frames;
  SequencePoses composed(file.Content(), {}, from, world);
  if (!composed.Reaches(from))
    throw Error(Error::Kind::BadInput, path + ": its transforms do not lead from " + from + " to " + world);
  std::vector<TimedPose> poses;
  for (int i = 0; i < file.Content().frames; ++i) {
    const SequenceFrame frame = file.Frame(i);
    composed.MoveTo(frame);
    const ComposedTransform found = composed.Find(from);
    if (found.status != TransformStatus::Valid)
      continue;
    Pose pose = Pose::Identity();
    pose.translation() = found.matrix.translation();
    // Trackers write some six digits: the nearest rotation is meant.
    pose.linear() = NearestRotation(found.matrix.linear());
    if (!IsRotation(pose.linear()) || (found.matrix.linear() - pose.linear()).norm() > 1e-2)
      throw Error(Error::Kind::BadInput,
                  path + ": " + transform + " of frame " + std::to_string(i) + " is not a pose: it has scale, shear or a mirror");
    poses.push_back({frame.time, pose});
  }
  if (poses.empty())
    throw Error(Error::Kind::BadInput, path + ": no frame has a valid " + transform);
  return poses;
}

// What went wrong, with the name of the file before it.
template <class Function>
auto Named(const std::string& path, const Function& function)
{
  try {
    return function();
  } catch (const Error& error) {
    const std::string what = error.what();
    throw Error(error.GetKind(), what.rfind(path, 0) == 0 ? what : path + ": " + what);
  }
}

std::vector<TimedPose> PosesOf(const SceneMotion& motion)
{
  std::vector<TimedPose> poses;
  for (const SceneMotion::Key& key : motion.keys)
    poses.push_back({key.seconds, key.pose.ProbeToWorld()});
  return poses;
}

} // namespace

ScenePath::ScenePath(const std::string& path, const SceneRecording& recording)
  : name_(path), pathToWorld_(recording.trackerToWorld.Matrix().matrix()), motion_(Named(path, [&] {
      return MotionPath(PosesOf(path, recording.transform), {recording.smoothSeconds, recording.longestGapSeconds});
    }))
{
}

ScenePath::ScenePath(const SceneMotion& motion)
  : name_("views.keys"), motion_(Named(name_, [&] {
      constexpr double noSmoothing = 0.0, longest = 600.0; // s, the most there is
      return MotionPath(PosesOf(motion), {noSmoothing, longest});
    }))
{
}

std::optional<ScenePath> ScenePath::Of(const SynthesisScene& scene)
{
  if (const auto* recording = std::get_if<SceneRecording>(&scene.views))
    return ScenePath(scene.PathOf(recording->file), *recording);
  if (const auto* motion = std::get_if<SceneMotion>(&scene.views))
    return ScenePath(*motion);
  return {};
}

std::vector<double> ScenePath::Times(const ScenePathViews& views, double sweepSeconds) const
{
  const double first = motion_.FirstTime() + 0.5 * sweepSeconds, last = motion_.LastTime() - 0.5 * sweepSeconds;
  if (!(last >= first))
    throw Error(Error::Kind::NotPossible, name_ + ": the path is shorter than one sweep");
  if (!views.times.empty()) {
    for (const double time : views.times)
      if (!(time >= first && time <= last))
        throw Error(Error::Kind::NotPossible, name_ + ": the sweep around " + NumberText(time) +
                                                  " s is not within the path, from " + NumberText(motion_.FirstTime()) + " to " +
                                                  NumberText(motion_.LastTime()) + " s");
    return views.times;
  }
  std::vector<double> times;
  for (int i = 0; i < views.count; ++i)
    times.push_back(views.count == 1 ? 0.5 * (first + last) : first + (last - first) * i / (views.count - 1));
  return times;
}

Pose ScenePath::At(double time) const
{
  // The ends of sums of times are off by rounding.
  constexpr double rounding = 1e-9; // s
  const double first = motion_.FirstTime(), last = motion_.LastTime();
  if (time > first - rounding && time < last + rounding)
    time = std::clamp(time, first, last);
  return Named(name_, [&] { return Pose(pathToWorld_ * motion_.At(time)); });
}

} // namespace echorama
