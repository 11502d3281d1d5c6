// SPDX-License-Identifier: BSD-3-Clause
// A recording is cut into moments: poses of one time, and the frame of images that has it. The thread (or Step) hands out one
// after the other. Poses are held in memory, images are read when their moment comes.
#include "Tracking/Devices/ReplayTracker.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Readers/SequenceFile.h"
#include "Readers/SequencePoses.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/ReaderPatience.h"
#include <algorithm>
#include <cmath>
#include <optional>

namespace echorama {

ParameterList Describe(ReplayParameters& p)
{
  return Join({{Parameter("Speed", p.speed, {0, 1000}, "", "1: as it was recorded; 0: as fast as it is taken."),
                Parameter("Loop", p.loop, "Whether at the end it begins again; times go on. Not at speed 0."),
                Parameter("Step", p.step, "Whether poses come one moment at a time, when asked."),
                Parameter("From", p.from, {0, Unlimited}, "s", "Begins so long after the first pose."),
                Parameter("To", p.to, {0, Unlimited}, "s", "Ends so long after the first pose.")},
               Describe(p.log)});
}

void ReplayParameters::Check() const
{
  CheckRanges(*this);
  const auto refuse = [](const char* what) { throw Error(Error::Kind::InvalidParameter, what); };
  if (path.empty())
    refuse("a replay needs a file: replay:FILE");
  if (loop && !step && speed == 0.0)
    refuse("a replay that begins again and again needs a speed above 0");
  if (!(to >= from))
    refuse("\"to\" must not be less than \"from\"");
}

ReplayParameters ReplayParameters::Of(const TrackerAddress& address)
{
  ReplayParameters p;
  p.path = address.place;
  address.Set(Describe(p));
  return p;
}

struct ReplayTracker::Recording {
  struct Moment {
    double time = 0.0;
    std::size_t begin = 0, end = 0; // poses
    int frame = -1;                 // none
  };

  const ReplayParameters& parameters;
  PoseStream& poses;
  ImageStream* images = nullptr;
  PoseLog log;
  std::unique_ptr<SequenceFile> file;    // when there are images to show
  std::unique_ptr<SequencePoses> placed; // when it says where they lie
  std::vector<Moment> moments;           // in the order of time
  double period = 0.0;                   // of a loop, seconds
  double round = 0.0;                    // how often the end was reached
  std::size_t next = 0;
  int shown = -1; // frame, by ShowImage

  Recording(const ReplayParameters& p, PoseStream& poseStream, ImageStream* imageStream)
    : parameters(p), poses(poseStream), images(imageStream), log(ReadPoseLog(p.path, p.log))
  {
    if (!std::isfinite(log.poses.front().time))
      throw Error(Error::Kind::BadFile,
                  p.path + ": it has no times; say how many poses of a tool are a second: rowsPerSecond=20");
    const double first = log.poses.front().time;
    const auto wanted = [&](double time) { return time - first >= p.from && time - first <= p.to; };
    for (std::size_t i = 0; i < log.poses.size(); ++i) {
      const double time = log.poses[i].time;
      if (!wanted(time))
        continue;
      if (moments.empty() || moments.back().time != time)
        moments.push_back({time, i, i, -1});
      moments.back().end = i + 1;
    }
    if (moments.empty())
      throw Error(Error::Kind::BadFile, p.path + ": there are no poses from " + NumberText(p.from) + " s " +
                                            (p.to < ReplayParameters().to ? "to " + NumberText(p.to) + " s" : "on") +
                                            "; it lasts " + NumberText(log.poses.back().time - first) + " s");
    if (images && LooksLikeSequence(p.path))
      OpenImages(wanted);
    const double duration = moments.back().time - moments.front().time;
    period = moments.size() > 1 ? duration + duration / static_cast<double>(moments.size() - 1) : 1.0;
  }

  template <class Wanted>
  void OpenImages(const Wanted& wanted)
  {
    file = std::make_unique<SequenceFile>(parameters.path);
    const SequenceContent& content = file->Content();
    if (!content.HasImages())
      return;
    std::vector<Moment> frames;
    for (int index = 0; index < content.frames; ++index) {
      const double time = parameters.log.rowsPerSecond > 0.0 ? index / parameters.log.rowsPerSecond : file->Time(index);
      if (std::isfinite(time) && wanted(time) && file->Frame(index).imageValid)
        frames.push_back({time, 0, 0, index});
    }
    // Its poses are those of its frames; a frame without one makes a moment of its own.
    const auto earlier = [](const Moment& a, const Moment& b) { return a.time < b.time; };
    std::stable_sort(frames.begin(), frames.end(), earlier);
    std::vector<Moment> alone;
    for (const Moment& frame : frames) {
      const auto same = std::lower_bound(moments.begin(), moments.end(), frame, earlier);
      if (same != moments.end() && same->time == frame.time)
        same->frame = frame.frame;
      else
        alone.push_back(frame);
    }
    moments.insert(moments.end(), alone.begin(), alone.end());
    std::stable_sort(moments.begin(), moments.end(), earlier);
    try {
      placed = std::make_unique<SequencePoses>(content, std::vector<NamedTransform>());
    } catch (const Error& error) { // several worlds to choose from: they lie where the header puts them
      log.notes.push_back(std::string("the images are not placed: ") + error.what());
    }
  }

  std::string Summary() const
  {
    std::string text = log.path + ": " + std::to_string(log.poses.size()) + " poses of " + std::to_string(log.tools.size()) +
                       (log.tools.size() == 1 ? " tool, " : " tools, ") + NumberText(moments.front().time) + " to " +
                       NumberText(moments.back().time) + " s";
    for (const std::string& note : log.notes)
      text += "; " + note;
    return text;
  }

  // When the next moment comes, on the clock of the recording, from its first.
  double Due() const { return round * period + moments[next].time - moments.front().time; }

  void ShowFrame(int index, double time)
  {
    const SequenceContent& content = file->Content();
    const SequenceFrame frame = file->Frame(index);
    StreamedImage image;
    image.name = "Image";
    image.time = time;
    image.geometry = content.geometry;
    if (placed && placed->ImageIsPlaced()) {
      placed->MoveTo(frame);
      const ComposedTransform toWorld = placed->Find(placed->Image());
      if (toWorld.status == TransformStatus::Valid && toWorld.matrix.matrix().allFinite() &&
          AreAxesOfGrid(toWorld.matrix, content.dimensions))
        image.geometry = FrameGeometry(toWorld.matrix, content.dimensions);
    }
    image.type = content.type;
    image.components = static_cast<int>(content.components);
    auto voxels = std::make_shared<std::vector<unsigned char>>(content.FrameBytes());
    file->ReadFrame(index, voxels->data());
    image.voxels = std::move(voxels);
    images->Add(std::move(image));
  }

  void AddPoses(const Moment& moment, double shift) const
  {
    for (std::size_t i = moment.begin; i < moment.end; ++i) {
      ToolPose pose = log.poses[i];
      pose.time += shift;
      pose.arrival += shift;
      poses.Add(std::move(pose));
    }
  }

  // Hands out the next moment. \returns false at the end, or when the file turns out to be damaged.
  bool Play()
  {
    if (next == moments.size())
      return false;
    const Moment& moment = moments[next];
    const double shift = round * period; // times go on from round to round
    try {
      if (moment.frame >= 0)
        ShowFrame(moment.frame, moment.time + shift);
    } catch (const Error& error) {
      next = moments.size();
      poses.SetState(DeviceState::Failed, error.what());
      return false;
    }
    AddPoses(moment, shift);
    if (++next < moments.size())
      return true;
    if (parameters.loop) {
      next = 0;
      round += 1.0;
    } else {
      poses.SetState(DeviceState::Ended, Summary());
    }
    return true;
  }
};

ReplayTracker::ReplayTracker(const ReplayParameters& parameters) : parameters_(parameters)
{
  parameters_.Check();
}

ReplayTracker::~ReplayTracker()
{
  ReplayTracker::Stop();
}

void ReplayTracker::Start(PoseStream& poses, ImageStream* images)
{
  Stop();
  recording_ = std::make_unique<Recording>(parameters_, poses, images);
  poses.SetLive(false);
  poses.SetState(DeviceState::Running, recording_->Summary());
  if (parameters_.step)
    return;
  RunDevice(worker_, poses, [recording = recording_.get()](const Worker::Signal& signal) {
    const double begun = ClockNow(), speed = recording->parameters.speed;
    ReaderPatience patience;
    while (!signal.Stopped() && recording->next < recording->moments.size()) {
      const double wait = speed > 0.0 ? begun + recording->Due() / speed - ClockNow() : 0.0;
      if (wait > 0.0) {
        if (!signal.Sleep(wait))
          return;
      } else if ((speed == 0.0 && !patience.Wait(recording->poses, signal)) || !recording->Play()) {
        return;
      }
    }
  });
}

void ReplayTracker::Stop()
{
  worker_.Stop();
  if (recording_)
    SetStopped(recording_->poses); // a thread has said so already; one that is stepped has none
  recording_.reset();
}

bool ReplayTracker::Step()
{
  return parameters_.step && recording_ && recording_->Play();
}

void ReplayTracker::ShowAll(PoseStream& poses, ImageStream* images)
{
  Stop();
  recording_ = std::make_unique<Recording>(parameters_, poses, images);
  poses.SetLive(false);
  for (const Recording::Moment& moment : recording_->moments)
    recording_->AddPoses(moment, 0.0);
  recording_->next = recording_->moments.size();
  poses.SetState(DeviceState::Ended, recording_->Summary());
}

std::vector<double> ReplayTracker::Times() const
{
  std::vector<double> times;
  if (recording_)
    for (const Recording::Moment& moment : recording_->moments)
      times.push_back(moment.time);
  return times;
}

void ReplayTracker::ShowImage(double time)
{
  const Recording::Moment* nearest = nullptr;
  if (recording_ && recording_->images)
    for (const Recording::Moment& moment : recording_->moments)
      if (moment.frame >= 0 && (!nearest || std::fabs(moment.time - time) < std::fabs(nearest->time - time)))
        nearest = &moment;
  if (!nearest || nearest->frame == recording_->shown)
    return;
  recording_->ShowFrame(nearest->frame, nearest->time);
  recording_->shown = nearest->frame;
}

} // namespace echorama
