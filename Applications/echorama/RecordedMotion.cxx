// SPDX-License-Identifier: BSD-3-Clause
#include "RecordedMotion.h"
#include "Core/Base/Error.h"
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

} // namespace

RecordedMotion::RecordedMotion(const std::string& path, const SceneRecording& recording)
  : path_(path), trackerToWorld_(recording.trackerToWorld.Matrix().matrix()), motion_(Named(path, [&] {
      return MotionPath(PosesOf(path, recording.transform), {recording.smoothSeconds, recording.longestGapSeconds});
    }))
{
}

std::vector<double> RecordedMotion::Times(int count, double sweepSeconds) const
{
  const double first = motion_.FirstTime() + 0.5 * sweepSeconds, last = motion_.LastTime() - 0.5 * sweepSeconds;
  if (!(last >= first))
    throw Error(Error::Kind::NotPossible, path_ + ": the recording is shorter than one sweep");
  std::vector<double> times;
  for (int i = 0; i < count; ++i)
    times.push_back(count == 1 ? 0.5 * (first + last) : first + (last - first) * i / (count - 1));
  return times;
}

Pose RecordedMotion::At(double time) const
{
  // The ends of sums of times are off by rounding.
  constexpr double rounding = 1e-9; // s
  const double first = motion_.FirstTime(), last = motion_.LastTime();
  if (time > first - rounding && time < last + rounding)
    time = std::clamp(time, first, last);
  return Named(path_, [&] { return Pose(trackerToWorld_ * motion_.At(time)); });
}

std::vector<Pose> RecordedMotion::Around(double time, double seconds, int steps) const
{
  std::vector<Pose> poses;
  for (int step = 0; step < steps; ++step)
    poses.push_back(At(steps == 1 ? time : time + seconds * (static_cast<double>(step) / (steps - 1) - 0.5)));
  return poses;
}

} // namespace echorama
