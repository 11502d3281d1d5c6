// SPDX-License-Identifier: BSD-3-Clause
// One thread takes the frames of all cameras as they come, or, of recordings, in the order of their times. Each camera has its
// own detector and tracks. With every frame all lights are asked where they are at one moment: when the frame has been worked on,
// or so many milliseconds after its exposure. Pixels are predicted, and mapped to the skin afterwards.
//
// How good predictions were is measured on the skin: between two places where a light was seen, 50 ms apart at most, a straight
// line says where it was at the moment that had been predicted.
#include "Tracking/Devices/OpticalTracker.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/JoinedText.h"
#include "Tracking/Cameras/RecordedSource.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/MountedShell.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/ReaderPatience.h"
#include <algorithm>
#include <cmath>
#include <deque>

namespace echorama {
namespace {

constexpr double WaitSeconds = 0.02, ShortWait = 1e-3, SilentSeconds = 0.5, ToldSeconds = 0.25, RetrySeconds = 1.0;
constexpr double BrightSeconds = 0.5; // of frames without a usable picture
constexpr double DeadSeconds = 10.0;  // in which others were seen
constexpr double Weak = 0.5;          // of the brightness that a light had when it was calibrated
constexpr double BridgeSeconds = 0.05;
constexpr double Forget = 0.998; // of what is averaged, per value
constexpr int OldFrames = 3;     // a view without frames for so long says nothing of where lights are
constexpr double AgreeMm = 1.0, AgreeSigmas = 5.0;

std::vector<std::string> SplitAtCommas(const std::string& text)
{
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    parts.push_back(text.substr(at, comma - at));
    at = comma + 1;
  }
  return parts;
}

// "camera:0,camera:2": commas within names of files are none of ours.
std::vector<std::string> SplitCameras(const std::string& place)
{
  std::vector<std::string> cameras;
  for (const std::string& part : SplitAtCommas(place)) {
    const std::vector<std::string> schemes = CameraSchemes();
    const bool begins = std::any_of(schemes.begin(), schemes.end(), [&part](const std::string& scheme) {
      return part.compare(0, scheme.size() + 1, scheme + ":") == 0;
    });
    if (begins || cameras.empty())
      cameras.push_back(part);
    else
      cameras.back() += "," + part;
  }
  return cameras;
}

// z into the skin; about it as little turned as can be.
Eigen::Matrix3d IntoSkin(const Eigen::Vector3d& normal)
{
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -normal).toRotationMatrix();
}

// Its pixels are of 1 mm, and lie nowhere in particular.
StreamedImage PictureOf(const CameraFrame& frame)
{
  StreamedImage image;
  image.name = "Camera";
  image.time = frame.begin;
  image.arrival = frame.arrival;
  image.geometry.dimensions = {frame.grey.width, frame.grey.height, 1};
  auto voxels = std::make_shared<std::vector<unsigned char>>();
  for (int y = frame.grey.height - 1; y >= 0; --y) // images have y upwards
    for (int x = 0; x < frame.grey.width; ++x)
      voxels->push_back(frame.grey(x, y));
  image.voxels = std::move(voxels);
  return image;
}

double Variance(const MappedPoint& place)
{
  return std::max(place.covariance.trace(), 1e-12);
}

} // namespace

ParameterList Describe(OpticalTrackerParameters& p)
{
  return {
      Parameter("Shell", p.shell,
                "The calibration of the printed skin, a file of echorama calibrate surface; one for each camera."),
      Parameter("Mounted", p.mounted, "What the marker of the mounted shell says, to be compared with that of the calibration."),
      Parameter("Tools", p.tools, "Names of the lights in the order of their codes, with commas."),
      Parameter("PredictMs", p.predictMs, {-1, 1000}, "ms",
                "How far beyond the middle of the exposure places are predicted; -1: to when they are told."),
      Parameter("PictureRate", p.pictureRate, {0, 1000}, "Hz",
                "How often the picture of the (first) camera goes out as an image, to look at; 0: never."),
      Parameter("Truth", p.truth,
                "Of a camera that does not exist: also where the lights truly are, as tools with the names ProbeTruth, "
                "NeedleTruth ..."),
      Parameter("Film", p.film, "A new file, .igs.mhd, that frames of the camera are recorded to."),
  };
}

OpticalTrackerParameters OpticalTrackerParameters::Of(const TrackerAddress& address)
{
  OpticalTrackerParameters p;
  TrackerAddress own = address, others = address;
  own.options.clear();
  ParameterList list = Describe(p);
  for (const auto& [name, value] : address.options)
    for (const Parameter& parameter : list)
      if (name == parameter.Key() || "--" + name == parameter.Flag()) {
        own.options[name] = value;
        others.options.erase(name);
      }
  own.Set(list);
  if (address.place.empty())
    throw Error(Error::Kind::InvalidParameter, address.text +
                                                   ": which camera? Say optical:camera:0?shell=FILE; sources of frames are " +
                                                   Joined(CameraSchemes()));
  for (const std::string& camera : SplitCameras(address.place)) {
    const TrackerAddress named = TrackerAddress::Parse(camera);
    others.scheme = named.scheme;
    others.place = named.place;
    p.cameras.push_back(others);
  }
  const std::vector<std::string> shells = p.cameras.size() > 1 ? SplitAtCommas(p.shell) : std::vector<std::string>{p.shell};
  for (std::size_t i = 0; i < p.cameras.size(); ++i) // what does not exist is simulated as it was calibrated
    if (p.cameras[i].scheme == "simulated" && i < shells.size())
      p.cameras[i].options.emplace("surface", shells[i]);
  if (p.shell.empty())
    throw Error(Error::Kind::InvalidParameter,
                address.text + ": which printed skin? Say shell=FILE, a file of echorama calibrate surface");
  return p;
}

// One camera, at work.
struct OpticalTracker::View {
  OpticalView* given;
  CameraFormat format;
  std::unique_ptr<LightTracker> lights;
  std::unique_ptr<MountedShell> mounted; // nullptr: the calibration does not say which shell it is of
  double heard = 0.0, lag = 0.0;         // our clock; from the middle of an exposure to when it was worked on
  double newest = -1e300;                // begin of the newest frame
  double blindSince = -1.0;              // begin of a frame; below 0: it is not blind
  double brokenSince = -1.0;             // our clock
  bool hasEnded = false;
  std::int64_t frames = 0;
  std::string broken;

  double Exposure() const { return 1e-3 * given->surface.tracks.exposureMs; }
  void BeginAnew()
  {
    const CalibratedSurface& surface = given->surface;
    lights = std::make_unique<LightTracker>(surface.MakeTracker());
    if (!surface.shell.empty())
      mounted = std::make_unique<MountedShell>(
          surface.map.State().optics.lens,
          MountedShell::TurnFrames(surface.lights.Code(), surface.tracks.slotMs, surface.tracks.frameMs));
  }
};

// One light, and what is told of it.
struct OpticalTracker::Tool {
  std::string name, frame;
  double seenSeconds = 0.0;           // in frames
  double unseenWhileOthersWere = 0.0; // s, since it was seen
  double level = 0.0;                 // of its brightness, over what was calibrated
  Touch touch = Touch::Unknown;
  std::string state = "not seen yet";
  std::deque<std::pair<double, Eigen::Vector3d>> predicted;
  std::optional<std::pair<double, Eigen::Vector3d>> measured;
  double squares = 0.0, weight = 0.0; // of prediction errors
};

struct OpticalTracker::Filming {
  CameraRecorder recorder;
  std::string problem;
};

OpticalTracker::OpticalTracker(const OpticalTrackerParameters& parameters) : parameters_(parameters)
{
  CheckRanges(parameters_);
  const std::vector<std::string> shells =
      parameters_.cameras.size() > 1 ? SplitAtCommas(parameters_.shell) : std::vector<std::string>{parameters_.shell};
  if (shells.size() != parameters_.cameras.size())
    throw Error(Error::Kind::InvalidParameter,
                parameters_.cameras.front().text + ": there are " + std::to_string(parameters_.cameras.size()) +
                    " cameras, but " + std::to_string(shells.size()) + " calibrations: shell=FILE,FILE names one for each");
  for (std::size_t i = 0; i < shells.size(); ++i)
    given_.push_back({MakeCamera(parameters_.cameras[i]), {}, shells[i]});
}

OpticalTracker::OpticalTracker(const OpticalTrackerParameters& parameters, std::vector<OpticalView> views)
  : parameters_(parameters), given_(std::move(views))
{
  CheckRanges(parameters_);
  parameters_.cameras.clear();
  if (given_.empty())
    throw Error(Error::Kind::InvalidParameter, "an optical tracker without a camera");
}

OpticalTracker::~OpticalTracker()
{
  OpticalTracker::Stop();
}

void OpticalTracker::OpenViews()
{
  views_.clear();
  isLive_ = true;
  int lights = 0;
  for (OpticalView& given : given_) {
    if (!parameters_.cameras.empty())
      given.surface = ReadSurface(given.name);
    auto view = std::make_unique<View>();
    view->given = &given;
    if (!parameters_.mounted.empty())
      given.surface.CheckShell(parameters_.mounted, given.name);
    view->format = given.camera->Open();
    given.surface.CheckPicture(view->format.width, view->format.height, given.name);
    const double exposure = given.surface.tracks.exposureMs;
    if (!given.surface.brightness.Empty() && view->format.exposureMs > 0.0 &&
        std::fabs(view->format.exposureMs / exposure - 1.0) > 0.1)
      throw Error(
          Error::Kind::BadInput,
          given.name +
              Format(": it was calibrated with an exposure of %g ms, and the camera has %g ms: lights are told to touch by "
                     "how bright they are",
                     exposure, view->format.exposureMs));
    if (given.surface.lights.alternating)
      throw Error(Error::Kind::NotPossible, given.name +
                                                ": its lights take turns; whose turn it is follows from the number of a frame's "
                                                "slot, which no camera tells");
    if (!views_.empty() && given.camera->IsLive() != isLive_)
      throw Error(Error::Kind::InvalidParameter,
                  given.name + ": cameras that are live and recordings cannot be joined: their times are not of one clock");
    // Frames are timed by the camera that there is; the slots of the code by the lights' driver, as when it was calibrated.
    SpotTracksParameters& tracks = given.surface.tracks;
    tracks.frameMs = 1000.0 / view->format.frameRate;
    if (view->format.exposureMs > 0.0)
      tracks.exposureMs = view->format.exposureMs;
    tracks.rowUs = view->format.rowUs;
    view->BeginAnew();
    view->heard = ClockNow();
    if (parameters_.truth && !dynamic_cast<const SimulatedSource*>(given.camera.get()))
      throw Error(Error::Kind::InvalidParameter, given.name + ": truth=on needs a simulated camera: nobody knows it of others");
    lights = std::max(lights, static_cast<int>(view->lights->Lights().size()));
    isLive_ = isLive_ && given.camera->IsLive();
    views_.push_back(std::move(view));
  }
  tools_.clear();
  const std::vector<std::string> names = SplitAtCommas(parameters_.tools);
  for (int i = 0; i < lights; ++i) {
    const auto index = static_cast<std::size_t>(i);
    Tool tool;
    tool.frame = index < names.size() && !names[index].empty() ? names[index] : "Tool" + std::to_string(i + 1);
    tool.name = tool.frame + "ToTracker";
    tools_.push_back(std::move(tool));
  }
}

void OpticalTracker::Start(PoseStream& poses, ImageStream* images)
{
  Stop();
  images_ = parameters_.pictureRate > 0.0 ? images : nullptr;
  shown_ = -1e300;
  try {
    OpenViews();
    if (!parameters_.film.empty())
      film_.reset(new Filming{CameraRecorder(parameters_.film, views_.front()->format), ""});
  } catch (...) {
    Stop();
    throw;
  }
  sent_ = -1e300;
  disagreements_ = 0;
  poses.SetLive(isLive_);
  poses.SetState(DeviceState::Connecting, "no frame has come yet");
  RunDevice(worker_, poses, [this, &poses](const Worker::Signal& signal) { Run(signal, poses); });
}

void OpticalTracker::Stop()
{
  worker_.Stop();
  for (OpticalView& given : given_)
    given.camera->Close();
  film_.reset();
}

void OpticalTracker::Run(const Worker::Signal& signal, PoseStream& poses)
{
  double told = 0.0;
  ReaderPatience patience;
  while (!signal.Stopped()) {
    for (const auto& view : views_) {
      // Recordings: the one that is behind goes first.
      if (!isLive_ && std::any_of(views_.begin(), views_.end(),
                                  [&view](const auto& other) { return !other->hasEnded && other->newest < view->newest; }))
        continue;
      CameraSource& camera = *view->given->camera;
      CameraFrame frame;
      try {
        if (view->brokenSince >= 0.0) {
          if (ClockNow() - view->brokenSince < RetrySeconds)
            continue;
          view->brokenSince = ClockNow();
          view->format = camera.Open();
          view->brokenSince = -1.0;
          view->BeginAnew(); // perhaps in another shell
        }
        if (view->hasEnded)
          continue;
        const CameraSource::Outcome outcome = camera.Next(frame, views_.size() == 1 ? WaitSeconds : ShortWait);
        view->hasEnded = outcome == CameraSource::Outcome::Ended;
        if (outcome != CameraSource::Outcome::Frame)
          continue;
      } catch (const Error& error) {
        if (!camera.IsLive())
          throw;
        camera.Close(); // and try again, in a while
        view->broken = error.what();
        view->brokenSince = ClockNow();
        continue;
      }
      Use(*view, frame, poses);
      if (!isLive_ && !patience.Wait(poses, signal))
        return;
    }
    const bool isOver = std::all_of(views_.begin(), views_.end(), [](const auto& view) { return view->hasEnded; });
    if (isOver && film_ && film_->problem.empty()) {
      try {
        film_->recorder.Finish();
      } catch (const Error& error) {
        film_->problem = error.what();
      }
    }
    if (isOver || ClockNow() - told > ToldSeconds) {
      told = ClockNow();
      const auto state = StateNow();
      if (state != poses.State())
        poses.SetState(state.first, state.second);
    }
    if (isOver)
      return;
    if (std::all_of(views_.begin(), views_.end(), [](const auto& view) { return view->brokenSince >= 0.0; }) &&
        !signal.Sleep(0.05))
      return;
  }
}

void OpticalTracker::Use(View& view, const CameraFrame& frame, PoseStream& poses)
{
  if (film_ && &view == views_.front().get() && film_->problem.empty()) {
    try {
      film_->recorder.Add(frame);
    } catch (const Error& error) { // the disk is full: tracking goes on
      film_->problem = error.what();
    }
  }
  if (images_ && &view == views_.front().get() &&
      frame.begin - shown_ > 1.0 / parameters_.pictureRate - 0.5 / view.format.frameRate) {
    shown_ = frame.begin;
    images_->Add(PictureOf(frame));
  }
  const CalibratedSurface& surface = view.given->surface;
  if (const auto marker = view.mounted ? view.mounted->Add(frame.grey) : std::nullopt;
      marker && marker->status == ShellMarkerReading::Status::Read && !IsNameOf(surface.shell, *marker))
    surface.CheckShell(ShellNameOf(*marker), view.given->name);
  const double period = 1e-3 * surface.tracks.frameMs;
  const std::vector<TrackedLight>& lights = view.lights->Update(frame.grey, frame.begin);
  view.newest = frame.begin;
  view.heard = ClockNow();
  ++view.frames;
  const bool isBlind = view.lights->Spots().state != FrameState::Good;
  view.blindSince = isBlind ? (view.blindSince < 0.0 ? frame.begin : view.blindSince) : -1.0;

  const bool isAnySeen = std::any_of(lights.begin(), lights.end(),
                                     [](const TrackedLight& light) { return light.status == TrackedLight::Status::Seen; });
  for (const TrackedLight& light : lights) {
    Tool& tool = tools_[static_cast<std::size_t>(light.light)];
    if (light.status == TrackedLight::Status::Seen) {
      tool.seenSeconds += period;
      tool.unseenWhileOthersWere = 0.0;
      Measure(view, light);
    } else if (light.status == TrackedLight::Status::Lost && isAnySeen) {
      tool.unseenWhileOthersWere += period;
    }
  }

  const double middle = frame.begin + 0.5 * view.Exposure();
  const double now = view.given->camera->IsLive() ? ClockNow() : std::max(frame.arrival, middle);
  view.lag = now - middle;
  const double time = parameters_.predictMs < 0.0 ? now : middle + 1e-3 * parameters_.predictMs;
  if (!(time > sent_)) // of another camera there was a later one
    return;
  sent_ = time;
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    Tool& tool = tools_[i];
    ToolPose pose;
    pose.name = tool.name;
    pose.time = time;
    const MappedPoint place = PlaceOf(i, time, tool.touch);
    if (place.status == MappedPoint::Status::Mapped) {
      pose.status = tool.touch == Touch::Hover ? TransformStatus::OutOfRange : TransformStatus::Valid;
      pose.pose.translation() = place.point;
      pose.pose.linear() = IntoSkin(place.normal);
      tool.state = tool.touch == Touch::Hover ? "hovers" : tool.touch == Touch::Contact ? "touches" : "seen";
      tool.predicted.emplace_back(time, place.point);
      if (tool.predicted.size() > 64)
        tool.predicted.pop_front();
    } else {
      pose.status = TransformStatus::Missing;
    }
    poses.Add(std::move(pose));
  }
  if (parameters_.truth)
    TellTruth(view, time, poses);
}

void OpticalTracker::TellTruth(const View& view, double time, PoseStream& poses) const
{
  const auto& source = dynamic_cast<const SimulatedSource&>(*view.given->camera);
  for (std::size_t i = 0; i < std::min(tools_.size(), static_cast<std::size_t>(source.Lights())); ++i) {
    const LightOnSkin light = source.TruthAt(static_cast<int>(i), time);
    ToolPose pose;
    pose.name = tools_[i].frame + "TruthToTracker";
    pose.time = time;
    pose.status = light.peak <= 0.0     ? TransformStatus::Missing
                  : light.hoverMm > 0.0 ? TransformStatus::OutOfRange
                                        : TransformStatus::Valid;
    pose.pose.translation() = light.point;
    if (const auto skin = view.given->surface.map.Skin()->NearestTo(light.point))
      pose.pose.linear() = IntoSkin(skin->normal);
    poses.Add(std::move(pose));
  }
}

// What a light does between two frames is unknown to all cameras alike: how sure they are is told by what they saw, and one that
// saw it a frame later counts alone.
MappedPoint OpticalTracker::PlaceOf(std::size_t light, double time, Touch& touch)
{
  Tool& tool = tools_[light];
  std::vector<const View*> seeing;
  double freshest = -1e300;
  for (const auto& view : views_) {
    const double period = 1e-3 * view->given->surface.tracks.frameMs;
    const std::vector<TrackedLight>& lights = view->lights->Lights();
    if (light >= lights.size() || lights[light].status == TrackedLight::Status::Lost || view->brokenSince >= 0.0 ||
        time - view->newest > OldFrames * period + std::max(view->lag, 1e-3 * parameters_.predictMs))
      continue;
    seeing.push_back(view.get());
    freshest = std::max(freshest, lights[light].time);
  }
  std::vector<MappedPoint> places;
  std::vector<const View*> from;
  for (const View* view : seeing) {
    const TrackedLight& seen = view->lights->Lights()[light];
    const auto pixel = view->lights->Tracks().Predict(seen.light, time);
    if (!pixel || seen.time < freshest - 1.5e-3 * view->given->surface.tracks.frameMs)
      continue;
    const MappedPoint place = view->given->surface.map.Map(*pixel, seen.covariance);
    if (place.status != MappedPoint::Status::Mapped)
      continue;
    places.push_back(place);
    from.push_back(view);
  }
  if (places.empty()) {
    tool.state = seeing.empty() ? (tool.seenSeconds > 0.0 ? "lost" : "not seen yet") : "where the calibration does not reach";
    touch = Touch::Unknown;
    return {};
  }
  const auto best = std::min_element(places.begin(), places.end(),
                                     [](const MappedPoint& a, const MappedPoint& b) { return Variance(a) < Variance(b); });
  const View& view = *from[static_cast<std::size_t>(best - places.begin())];
  touch = view.lights->TouchOf(static_cast<int>(light));
  if (touch == Touch::Unknown && !view.given->surface.brightness.Empty())
    touch = Touch::Hover; // until it has been judged
  MappedPoint joined = *best;
  double sum = 1.0 / Variance(*best);
  joined.point *= sum;
  joined.normal *= sum;
  bool agree = true;
  for (const MappedPoint& place : places) {
    if (&place == &*best)
      continue;
    agree = agree && (place.point - best->point).norm() < AgreeMm + AgreeSigmas * std::sqrt(Variance(place) + Variance(*best));
    joined.point += place.point / Variance(place);
    joined.normal += place.normal / Variance(place);
    sum += 1.0 / Variance(place);
  }
  if (places.size() == 1 || !agree) {
    disagreements_ += !agree;
    return *best;
  }
  joined.point /= sum;
  joined.normal.normalize();
  joined.covariance *= 1.0 / (sum * Variance(*best));
  return joined;
}

void OpticalTracker::Measure(View& view, const TrackedLight& light)
{
  Tool& tool = tools_[static_cast<std::size_t>(light.light)];
  // A light that is dark but not wide touches, and is weak. In part of the exposures it is on for a part: the brightest counts.
  const BrightnessCalibration& calibrated = view.given->surface.brightness;
  double level = light.spot.peak / (3.0 * view.given->surface.detector.threshold) * Weak;
  if (!calibrated.Empty()) {
    const ContactSample touching = calibrated.At(light.position);
    level = light.spot.size < 1.2 * touching.size ? light.spot.peak / touching.peak : 1.0;
  }
  tool.level = std::max(level, 0.99 * tool.level);

  const MappedPoint place = view.given->surface.map.Map(light.position, light.covariance);
  if (place.status != MappedPoint::Status::Mapped)
    return;
  if (tool.measured && light.time > tool.measured->first && light.time - tool.measured->first < BridgeSeconds) {
    const auto& [before, from] = *tool.measured;
    for (const auto& [time, predicted] : tool.predicted)
      if (time > before && time <= light.time) {
        const Eigen::Vector3d truth = from + (time - before) / (light.time - before) * (place.point - from);
        tool.squares = Forget * tool.squares + (predicted - truth).squaredNorm();
        tool.weight = Forget * tool.weight + 1.0;
      }
  }
  tool.measured = {light.time, place.point};
  while (!tool.predicted.empty() && tool.predicted.front().first <= light.time)
    tool.predicted.pop_front();
}

// What should be seen to, the worst first; empty: nothing.
std::string OpticalTracker::Complaint() const
{
  for (const auto& view : views_)
    if (view->blindSince >= 0.0 && view->newest - view->blindSince > BrightSeconds)
      return view->given->name + ": " + view->lights->Spots().message;
  if (film_ && !film_->problem.empty())
    return "the film has ended: " + film_->problem;
  for (const Tool& tool : tools_) {
    if (tool.unseenWhileOthersWere > DeadSeconds && tool.seenSeconds == 0.0)
      return "the light of " + tool.frame + " has never been seen, others have: is it on, and its battery full?";
    if (tool.seenSeconds > 2.0 && tool.unseenWhileOthersWere == 0.0 && tool.level < Weak)
      return Format("the light of %s is weak, %.0f%% of what it should be: its battery may be empty", tool.frame.c_str(),
                    100.0 * tool.level);
  }
  return {};
}

std::pair<DeviceState, std::string> OpticalTracker::StateNow() const
{
  std::int64_t frames = 0, lost = 0;
  double lag = 0.0;
  bool isOver = true;
  for (const auto& view : views_) {
    frames += view->frames;
    lost += view->given->camera->Lost();
    lag = std::max(lag, view->lag);
    isOver = isOver && view->hasEnded;
    if (view->brokenSince >= 0.0)
      return {DeviceState::Lost, view->broken};
    if (const double silent = ClockNow() - view->heard;
        !view->hasEnded && silent > SilentSeconds && view->given->camera->IsLive())
      return {view->frames > 0 ? DeviceState::Lost : DeviceState::Connecting,
              view->format.name + Format(": no frame has come for %.1f s", silent)};
  }
  if (frames == 0)
    return {isOver ? DeviceState::Ended : DeviceState::Connecting, "no frame has come yet"};
  std::string text = Complaint();
  for (const Tool& tool : tools_)
    text += (text.empty()         ? ""
             : text.back() == '?' ? " "
                                  : ", ") +
            tool.frame + " " + tool.state +
            (tool.weight > 30.0 ? Format(" (predictions %.2f mm off)", std::sqrt(tool.squares / tool.weight)) : std::string());
  text += Format(", %.0f ms from exposure to pose, %lld of %lld frames lost", 1e3 * lag, static_cast<long long>(lost),
                 static_cast<long long>(lost + frames));
  if (disagreements_ > 0)
    text += Format(", cameras disagreed %lld times", static_cast<long long>(disagreements_));
  return {isOver ? DeviceState::Ended : DeviceState::Running, text};
}

} // namespace echorama
