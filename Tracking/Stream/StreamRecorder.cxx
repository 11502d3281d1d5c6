// SPDX-License-Identifier: BSD-3-Clause
// Poses are taken as they come. A frame is closed when a pose of another time comes, when a tool comes for the second time, or
// when nothing has come for a while. One pose that the file cannot hold, because of what a peer calls its tool, costs that pose
// alone: only the disk ends a recording.
#include "Tracking/Stream/StreamRecorder.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Worker.h"
#include "Readers/PoseLog.h"
#include "Readers/SequenceText.h"
#include <cmath>
#include <exception>
#include <mutex>
#include <utility>

namespace echorama {
namespace {

constexpr double StepSeconds = 0.05; // for another tool of the same moment, and between two looks at the signal

} // namespace

struct StreamRecorder::Parts {
  const std::string path;
  std::shared_ptr<PoseSubscription> source;
  SequenceRecorder recorder;
  SequenceFrame frame; // not yet closed
  mutable std::mutex mutex;
  RecordingState state; // guarded
  std::unique_ptr<Error> error;
  bool stopped = false;
  Worker worker; // the last: it stops before the rest goes

  Parts(const std::string& file, std::shared_ptr<PoseSubscription> poses, const SequenceRecorderOptions& options)
    : path(file), source(std::move(poses)), recorder(file, {}, options)
  {
  }

  void CloseFrame()
  {
    if (frame.transforms.empty())
      return;
    const SequenceFrame closed = std::exchange(frame, {});
    try {
      recorder.Append(closed);
    } catch (const Error& refusal) {
      if (refusal.GetKind() != Error::Kind::InvalidParameter && refusal.GetKind() != Error::Kind::BadInput)
        throw;
      LeaveOut(closed.transforms.size(), refusal.what());
      return;
    }
    const std::lock_guard<std::mutex> lock(mutex);
    state.poses += closed.transforms.size();
  }

  void LeaveOut(std::size_t poses, const std::string& why)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    state.leftOut += poses;
    state.lastLeftOut = why;
  }

  void Take(const ToolPose& pose)
  {
    if (!CanNameTransform(pose.name)) {
      LeaveOut(1, path + ": \"" + pose.name + "\" is no name that a recording can hold");
      return;
    }
    if (frame.time != pose.time || frame.Find(pose.name))
      CloseFrame();
    if (frame.transforms.empty()) {
      frame.time = pose.time;
      if (std::isfinite(pose.time))
        frame.fields.emplace_back("UnfilteredTimestamp", NumberText(pose.time));
    }
    frame.transforms.push_back({pose.name, Eigen::Affine3d(pose.pose.matrix()), pose.status, TransformStatusText(pose.status)});
    if (std::isfinite(pose.arrival))
      frame.fields.emplace_back(pose.name + ArrivalField, NumberText(pose.arrival));
  }

  // \returns whether anything came
  bool Step(double seconds)
  {
    const std::vector<ToolPose> poses = source->Take(seconds);
    for (const ToolPose& pose : poses)
      Take(pose);
    if (poses.empty())
      CloseFrame();
    recorder.FlushWhenDue();
    const std::lock_guard<std::mutex> lock(mutex);
    state.frames = static_cast<std::uint64_t>(recorder.Frames());
    state.safe = static_cast<std::uint64_t>(recorder.SafeFrames());
    state.lost = source->Lost();
    return !poses.empty();
  }

  void End(const Error& problem)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    error = std::make_unique<Error>(problem);
    state.problem = problem.what();
  }

  void Run(const Worker::Signal& signal)
  {
    try {
      while (!signal.Stopped())
        Step(StepSeconds);
      Step(0.0); // what came until then; a source that goes on must not keep it from ending
      CloseFrame();
      recorder.Finish();
    } catch (const Error& problem) {
      End(problem);
    } catch (const std::exception& problem) { // no memory, say
      End(Error(Error::Kind::NotPossible, path + ": " + problem.what()));
    }
    const std::lock_guard<std::mutex> lock(mutex);
    state.safe = static_cast<std::uint64_t>(recorder.SafeFrames());
    state.frames = state.problem.empty() ? static_cast<std::uint64_t>(recorder.Frames()) : state.safe;
    state.lost = source->Lost();
  }
};

StreamRecorder::StreamRecorder(const std::string& path, std::shared_ptr<PoseSubscription> poses,
                               const SequenceRecorderOptions& options)
  : parts_(std::make_unique<Parts>(path, std::move(poses), options))
{
  Parts* const p = parts_.get();
  p->worker.Start([p](const Worker::Signal& signal) { p->Run(signal); });
}

StreamRecorder::~StreamRecorder() = default;

RecordingState StreamRecorder::State() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->state;
}

void StreamRecorder::Stop()
{
  Parts& p = *parts_;
  p.worker.Stop();
  if (p.error && !std::exchange(p.stopped, true))
    throw Error(*p.error);
}

void StreamRecorder::StopIfAnything()
{
  try {
    Stop();
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::BadInput || State().frames > 0)
      throw;
  }
}

} // namespace echorama
