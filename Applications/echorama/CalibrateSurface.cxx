// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate surface: a camera in a printed skin, from a light that is put on numbered marks; and later whether that
// still holds. Who puts it there is a person, who is told what comes next and what is wrong; a recording of one; or, with a
// simulated camera, a simulated hand.
#include "Calibrate.h"
#include "Core/Base/Angles.h"
#include "Core/Base/FormatText.h"
#include "Core/Geometry/LandmarkFile.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/MountedShell.h"
#include "Tracking/Optical/SimulatedHand.h"
#include "Tracking/Optical/SurfaceCalibration.h"
#include "Tracking/Optical/SurfaceFile.h"
#include "Tracking/Stream/Clock.h"
#include "Volumes.h"
#include <chrono>
#include <CLI/Validators.hpp>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>
#include <poll.h>
#include <set>
#include <thread>
#include <unistd.h>
#include <vtkUltrasoundMeshFile.h>

namespace echorama {
namespace {

constexpr double PatienceSeconds = 15.0; // without a rest; then the person is told what is seen, and a simulated hand goes on

struct SurfaceOptions {
  std::string camera, mesh, marks, output, check, shell;
  std::vector<double> cameraPosition, up{0.0, 0.0, 1.0};
  double focal = 0.0, maximumAngle = 100.0, slotMs = 0.0, wallMm = 0.0;
  SurfaceLights lights{2, 2, false};
  bool all = false;
  int light = 1, checkMarks = 5;
  SpotDetectorParameters detector;
  SurfaceCalibrationParameters calibration;
};

// Frames, and in a simulation the hand that puts the light where it is told.
class Stage {
public:
  // The source of a simulation is made when skin and marks are known.
  Stage(const SurfaceOptions& options, const std::shared_ptr<const TrackedSkin>& skin, const std::vector<Eigen::Vector3d>& marks)
  {
    const TrackerAddress address = TrackerAddress::Parse(options.camera);
    if (address.scheme != "simulated") {
      source_ = MakeCamera(address);
      return;
    }
    SimulatedHandParameters hand;
    address.Set(Join({Describe(simulation_), Describe(hand)}));
    hand.peak = simulation_.peak;
    hand_ = std::make_shared<SimulatedHand>(hand, marks,
                                            [skin](const Eigen::Vector3d& point) { return skin->NearestTo(point)->point; });
    std::vector<SimulatedLight> lights;
    for (int i = 0; i < simulation_.lights; ++i)
      lights.push_back(simulation_.Light(i, [hand = hand_, isHeld = i + 1 == options.light](double time) {
        return isHeld ? hand->At(time) : LightOnSkin{Eigen::Vector3d::Zero(), 0.0, 0.0};
      }));
    auto simulated = std::make_unique<SimulatedSource>(simulation_, skin, std::move(lights));
    simulated_ = simulated.get();
    source_ = std::move(simulated);
  }

  CameraSource& Source() { return *source_; }
  bool IsSimulated() const { return hand_ != nullptr; }
  // A mark is asked for; a hand hears of it after the newest frame, or the first.
  void Ask(int mark)
  {
    asked_ = mark;
    TellHand();
  }
  void Saw(const CameraFrame& newest)
  {
    newest_ = newest.begin;
    TellHand();
  }

private:
  void TellHand()
  {
    if (!hand_ || !newest_ || asked_ == 0)
      return;
    const double sourceTime = simulation_.speed > 0.0 ? (*newest_ - simulated_->Start()) * simulation_.speed : *newest_;
    hand_->GoTo(static_cast<std::size_t>(std::exchange(asked_, 0)) - 1, sourceTime + 1.0 / simulation_.camera.frameRate);
  }

  std::optional<double> newest_; // begin of that frame
  int asked_ = 0;                // what the hand has not been told
  SimulatedSourceParameters simulation_;
  std::shared_ptr<SimulatedHand> hand_;
  SimulatedSource* simulated_ = nullptr; // source_, when it is one
  std::unique_ptr<CameraSource> source_;
};

// What a person types meanwhile, a line at a time.
class TypedLines {
public:
  std::optional<std::string> Next()
  {
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    char block[256];
    while (!ended_ && text_.find('\n') == std::string::npos && poll(&waiting, 1, 0) > 0) {
      const ssize_t count = read(STDIN_FILENO, block, sizeof block);
      ended_ = count <= 0;
      if (count > 0)
        text_.append(block, static_cast<std::size_t>(count));
    }
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos && (!ended_ || text_.empty())) // the last line may lack its end
      return {};
    const std::string line = text_.substr(0, end);
    text_.erase(0, end == std::string::npos ? end : end + 1);
    return line;
  }

private:
  std::string text_;
  bool ended_ = false;
};

void Tell(const std::string& line)
{
  std::cerr << line << '\n';
}

// Runs frames through \a tracker until \a take says that it is enough. \a take is asked about every frame; \a idle after a while
// in which no light was at rest; \a obey all the time, also while no frames come.
template <class Obey, class Take, class Idle>
void Watch(Session& session, Stage& stage, LightTracker& tracker, const std::string& camera, const Obey& obey, const Take& take,
           const Idle& idle)
{
  CameraFrame frame;
  FrameState state = FrameState::Good;
  double quietSince = -1.0, heard = ClockNow();
  bool isBroken = false, isSilent = false;
  session.Work("watch", camera, [&](const Progress& progress) {
    for (;;) {
      progress(0.0);
      if (!obey())
        return;
      CameraSource::Outcome outcome = CameraSource::Outcome::Nothing;
      try { // a plug that comes loose for a moment does not end what takes ten minutes
        if (isBroken && ClockNow() - heard > 1.0) {
          heard = ClockNow();
          stage.Source().Open();
          isBroken = false;
          Tell("the camera is back");
        }
        if (isBroken)
          std::this_thread::sleep_for(std::chrono::milliseconds(50));
        else
          outcome = stage.Source().Next(frame, 0.1);
      } catch (const Error& error) {
        if (!stage.Source().IsLive())
          throw;
        if (!std::exchange(isBroken, true))
          Tell(error.what());
        stage.Source().Close();
        heard = ClockNow();
      }
      if (outcome == CameraSource::Outcome::Ended)
        return;
      if (outcome == CameraSource::Outcome::Nothing) {
        if (!isBroken && ClockNow() - heard > 2.0 && !std::exchange(isSilent, true))
          Tell("no frame has come for 2 s");
        continue;
      }
      isSilent = false;
      heard = ClockNow();
      stage.Saw(frame);
      tracker.Update(frame.grey, frame.begin);
      if (tracker.Spots().state != state) {
        state = tracker.Spots().state;
        if (state != FrameState::Good)
          Tell(tracker.Spots().message);
      }
      if (quietSince < 0.0)
        quietSince = frame.begin;
      bool isRest = false;
      if (!take(frame.grey, isRest))
        return;
      if (isRest)
        quietSince = frame.begin;
      else if (frame.begin - quietSince > PatienceSeconds) {
        quietSince = frame.begin;
        if (!idle())
          return;
      }
    }
  });
}

std::string WhatIsSeen(const LightTracker& tracker, int light)
{
  const TrackedLight& seen = tracker.Lights()[static_cast<std::size_t>(light) - 1];
  if (seen.status != TrackedLight::Status::Lost)
    return Format("light %d is seen, but does not rest", light);
  return Format("light %d is not seen; there are %d spots of light", light, static_cast<int>(tracker.Spots().spots.size()));
}

const TrackedLight& HeldLight(const LightTracker& tracker, int light)
{
  return tracker.Lights()[static_cast<std::size_t>(light) - 1];
}

void CheckLight(int light, const BlinkCode& code)
{
  if (light < 1 || light > code.Lights())
    Misused(Format("there is no light %d; there are %d", light, code.Lights()));
}

std::string Today()
{
  const std::time_t now = std::time(nullptr);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", std::localtime(&now));
  return text;
}

// Roughly: it looks along Up from the middle of the marks, as high as the lowest of them.
Pose RoughCamera(const SurfaceOptions& options, const std::vector<Eigen::Vector3d>& marks)
{
  Eigen::Vector3d up(options.up[0], options.up[1], options.up[2]);
  if (!(up.norm() > 0.0) || !up.allFinite())
    Misused("--up must be a direction");
  up.normalize();
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up).toRotationMatrix();
  if (!options.cameraPosition.empty()) {
    pose.translation() = Eigen::Vector3d(options.cameraPosition[0], options.cameraPosition[1], options.cameraPosition[2]);
    return pose;
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& mark : marks)
    box.extend(pose.linear().transpose() * mark);
  Eigen::Vector3d middle = box.center();
  middle.z() = box.min().z();
  pose.translation() = pose.linear() * middle;
  return pose;
}

nlohmann::ordered_json JsonOf(const SurfaceAccuracy& accuracy)
{
  return {{"marks", accuracy.marks},    {"inliers", accuracy.inliers},  {"median_mm", accuracy.medianMm},
          {"mm95", accuracy.mm95},      {"most_mm", accuracy.mostMm},   {"scatter_mm", accuracy.scatterMm},
          {"own_mm95", accuracy.ownMm}, {"coverage", accuracy.coverage}};
}

// Which shell is mounted, if it says so; before it was read: nothing has been seen of it.
void TellMarker(Session& session, const ShellMarkerReading& marker)
{
  if (marker.status == ShellMarkerReading::Status::Read) {
    Tell("the marker of the mounted shell says " + ShellNameOf(marker));
    session.result["mounted"] = ShellNameOf(marker);
  } else {
    Tell(marker.status == ShellMarkerReading::Status::Unclear
             ? "a shell's marker is seen, but cannot be read: is it covered, or the room too dark?"
             : "no shell's marker is seen");
  }
}

// What a person may type while marks are taken. \returns whether it goes on
bool Obey(const std::string& line, SurfaceCalibration& calibration)
{
  int mark = 0;
  if (line == "s")
    calibration.Skip();
  else if (line == "b")
    calibration.Back();
  else if (std::sscanf(line.c_str(), "g %d", &mark) == 1)
    try {
      calibration.GoTo(mark);
    } catch (const Error& error) {
      Tell(error.what());
    }
  else if (line == "g" && calibration.Status().gapMark > 0)
    calibration.GoTo(calibration.Status().gapMark);
  else if (line == "e")
    return false;
  else
    Tell("s: skip this mark, b: the last one again, g 17: go to mark 17, g: to the largest gap, e: end and write");
  return true;
}

void MakeCalibration(Session& session, const SurfaceOptions& options)
{
  if (options.mesh.empty() || options.marks.empty() || options.output.empty())
    Misused("a calibration needs --mesh, --marks and --output; or --check and a calibration");
  for (const std::string& written : {options.output, SurfaceMeshFile(options.output)})
    CheckOutput(written, {options.mesh, options.marks});
  std::shared_ptr<const TrackedSkin> skin;
  std::vector<Eigen::Vector3d> marks;
  session.Time("read", [&] {
    TriangleSurface surface = ReadMesh(options.mesh);
    MendSurface(surface);
    skin = std::make_shared<const TrackedSkin>(std::move(surface), options.wallMm);
    for (const Landmark& landmark : ReadLandmarks(options.marks))
      marks.push_back(landmark.position);
  });
  Stage stage(options, skin, marks);
  const CameraFormat format = stage.Source().Open();

  CalibratedSurface result;
  result.shell = options.shell;
  result.camera = options.camera;
  result.date = Today();
  result.lights = options.lights;
  result.detector = options.detector;
  result.tracks.frameMs = 1e3 / format.frameRate;
  result.tracks.exposureMs = format.exposureMs > 0.0 ? format.exposureMs : 0.7 * result.tracks.frameMs;
  result.tracks.rowUs = format.rowUs;
  result.tracks.slotMs = options.slotMs > 0.0 ? options.slotMs : result.tracks.frameMs;
  const BlinkCode code = result.lights.Code();
  CheckLight(options.light, code);
  LightTracker tracker = result.MakeTracker();
  result.marks = marks;

  FisheyeLens lens;
  lens.width = format.width;
  lens.height = format.height;
  lens.centreX = 0.5 * (format.width - 1);
  lens.centreY = 0.5 * (format.height - 1);
  lens.focal = options.focal > 0.0 ? options.focal : 190.0 * format.width / 640.0;
  lens.maximumAngle = options.maximumAngle;
  SurfaceCalibration calibration(marks, skin, lens, RoughCamera(options, marks), options.calibration);

  TypedLines typed;
  int asked = 0;
  std::size_t reported = 0;
  std::set<int> passedOver; // by a simulated hand, since the last mark that was taken
  const int turnFrames = MountedShell::TurnFrames(code, result.tracks.slotMs, result.tracks.frameMs);
  std::optional<MountedShell> mounted(std::in_place, lens, turnFrames); // and again, once the lens is known
  bool isMarkerTold = false, isLensKnown = false;
  const auto askNext = [&] {
    asked = calibration.Next();
    if (asked > 0) {
      Tell(Format("mark %d, please (%d of %d taken)", asked, calibration.Status().taken, calibration.Status().marks));
      stage.Ask(asked);
    }
  };
  askNext();
  Watch(
      session, stage, tracker, options.camera,
      [&] {
        while (const auto line = typed.Next()) {
          if (!Obey(*line, calibration))
            return false;
          if (asked != calibration.Next())
            askNext();
        }
        return true;
      },
      [&](const GreyFrame& frame, bool& isRest) {
        const auto marker = mounted->Add(frame);
        const bool isRead = marker && marker->status == ShellMarkerReading::Status::Read;
        if (isRead && !options.shell.empty() && !IsNameOf(options.shell, *marker))
          throw Error(Error::Kind::BadInput, "--shell says " + options.shell + ", and the marker of the mounted shell says " +
                                                 ShellNameOf(*marker) + ": nothing is calibrated");
        if (isRead || (marker && isLensKnown)) {
          TellMarker(session, *marker);
          isMarkerTold = true;
        }
        if (isRead)
          result.shell = ShellNameOf(*marker);
        if (!isMarkerTold && !isLensKnown && calibration.Status().hasMap) {
          isLensKnown = true;
          mounted.emplace(calibration.Fitted().map.State().optics.lens, turnFrames);
        }
        const CalibrationStep step = calibration.Update(HeldLight(tracker, options.light));
        isRest = step.event != CalibrationStep::Event::None;
        if (isRest) {
          Tell(step.message);
          passedOver.clear();
          const CalibrationStatus& status = calibration.Status();
          if (status.report.observations != reported) {
            reported = status.report.observations;
            for (const std::string& line : status.Lines(options.calibration.wantedMm))
              Tell(line);
          }
          if (status.isEnough && !options.all)
            return false;
        }
        if (isRest)
          askNext();
        return asked > 0;
      },
      [&] {
        Tell(WhatIsSeen(tracker, options.light));
        if (stage.IsSimulated()) {
          if (!passedOver.insert(asked).second)
            return false; // nothing is left that it could do
          calibration.Skip();
          askNext();
        }
        return true;
      });
  stage.Source().Close();
  if (!isMarkerTold)
    TellMarker(session, {});
  if (result.shell.empty())
    Tell("the calibration does not say which shell it is of; --shell may say it");

  session.Work("calibrate", options.output, [&](const Progress& progress) {
    try {
      calibration.Fit(progress);
    } catch (const Error& error) { // what was done before is not lost by what came last
      if (error.GetKind() == Error::Kind::Cancelled || !calibration.Status().hasMap)
        throw;
      session.Note(options.output + ": the map is that of before the last marks, which it does not fit: " + error.what());
      session.status = Session::Doubtful;
    }
    result.map = calibration.Fitted().map;
  });
  const CalibrationStatus& status = calibration.Status();
  result.brightness = calibration.Brightness();
  result.accuracy = {status.taken,
                     static_cast<int>(status.report.inliers),
                     status.report.heldOutMedianMm,
                     status.report.heldOut95Mm,
                     status.report.heldOutMostMm,
                     status.scatterMm,
                     status.ownMm,
                     status.coverage};
  WriteSurface(options.output, result);
  for (const std::string& line : status.Lines(options.calibration.wantedMm))
    session.Say(line);
  session.Say("wrote " + options.output);
  session.result["output"] = options.output;
  session.result["accuracy"] = JsonOf(result.accuracy);
  session.result["enough"] = status.isEnough;
  nlohmann::ordered_json outliers = nlohmann::ordered_json::array();
  for (const CalibrationOutlier& outlier : status.outliers)
    outliers.push_back({{"mark", outlier.mark}, {"mm", outlier.distanceMm}});
  session.result["outliers"] = outliers;
  if (result.accuracy.mm95 > options.calibration.wantedMm) {
    session.Note(Format("the accuracy that is wanted, %.2f mm in 95%%, is not reached: %.2f mm", options.calibration.wantedMm,
                        result.accuracy.mm95));
    session.status = Session::Doubtful;
  }
  if (status.coverage < 0.9) {
    session.Note(Format("only %.0f%% of the skin's picture is covered: elsewhere the tracker will have no answer",
                        100.0 * status.coverage));
    session.status = Session::Doubtful;
  }
}

// Some marks again: whether the camera is where it was.
void CheckCalibration(Session& session, const SurfaceOptions& options)
{
  if (!options.mesh.empty() || !options.marks.empty() || !options.output.empty())
    Misused("--check takes mesh and marks from the calibration, and writes nothing");
  CalibratedSurface surface;
  session.Time("read", [&] { surface = ReadSurface(options.check); });
  if (!options.shell.empty())
    surface.CheckShell(options.shell, options.check);
  CheckLight(options.light, surface.lights.Code());
  Stage stage(options, surface.map.Skin(), surface.marks);
  const CameraFormat format = stage.Source().Open();
  surface.CheckPicture(format.width, format.height, options.check);
  // Whether a light touches is judged once it rests.
  LightTracker tracker(surface.detector, surface.tracks, surface.lights.Code());

  std::vector<int> remaining = DriftMarks(surface.map, surface.marks, options.checkMarks);
  if (remaining.size() < 4)
    throw Error(Error::Kind::NotPossible, options.check + Format(": it holds %d marks that the camera sees; a check needs four",
                                                                 static_cast<int>(remaining.size())));
  std::map<int, SurfaceObservation> seen;
  std::set<int> refused; // once: whoever insists is believed
  LightRest rest(options.calibration.rest);
  SurfaceDrift drift;
  bool isJudged = false, isRepeated = false;
  MountedShell mounted(surface.map.State().optics.lens,
                       MountedShell::TurnFrames(surface.lights.Code(), surface.tracks.slotMs, surface.tracks.frameMs));
  bool isMarkerTold = false;
  const auto ask = [&] {
    Tell(Format("mark %d, please (%d to go)", remaining.front(), static_cast<int>(remaining.size())));
    stage.Ask(remaining.front());
  };
  ask();
  Watch(
      session, stage, tracker, options.camera, [] { return true; },
      [&](const GreyFrame& frame, bool& isRest) {
        if (const auto marker = mounted.Add(frame)) {
          const bool isRead = marker->status == ShellMarkerReading::Status::Read;
          if (isRead && !surface.shell.empty() && !IsNameOf(surface.shell, *marker))
            surface.CheckShell(ShellNameOf(*marker), options.check);
          TellMarker(session, *marker);
          isMarkerTold = true;
          if (isRead && surface.shell.empty())
            Tell(options.check + ": it does not say which shell it was made in");
        }
        const auto resting = rest.Update(HeldLight(tracker, options.light), Touch::Unknown);
        if (!resting)
          return true;
        isRest = true;
        const int mark = remaining.front();
        if (resting->TouchBy(surface.brightness) == Touch::Hover && refused.insert(mark).second) {
          Tell(Format("the light is too weak or too wide there for one that touches the skin: press it onto mark %d, or lift it "
                      "and put it "
                      "there again",
                      mark));
          ask();
          return true;
        }
        seen[mark] = {resting->position, resting->covariance, surface.marks[static_cast<std::size_t>(mark) - 1], mark};
        remaining.erase(remaining.begin());
        if (remaining.empty()) {
          std::vector<SurfaceObservation> again;
          for (const auto& [number, observation] : seen)
            again.push_back(observation);
          drift = JudgeDrift(DriftPoints(surface.map, again, surface.accuracy.scatterMm));
          isJudged = true;
          if (drift.verdict != SurfaceDrift::Verdict::WrongMark || isRepeated)
            return false;
          Tell(drift.message);
          isRepeated = true;
          remaining = {drift.mark};
        }
        ask();
        return true;
      },
      [&] {
        Tell(WhatIsSeen(tracker, options.light));
        return !stage.IsSimulated();
      });
  stage.Source().Close();
  if (!isMarkerTold)
    TellMarker(session, {});
  if (!isJudged)
    throw Error(Error::Kind::NotPossible, options.camera + Format(": it ended before %d marks were visited", options.checkMarks));
  const char* verdicts[] = {"holds", "moved", "wrong mark", "changed"};
  session.result["verdict"] = verdicts[static_cast<int>(drift.verdict)];
  session.result["chance"] = drift.chance;
  session.result["rms_px"] = drift.rmsPx;
  if (drift.verdict == SurfaceDrift::Verdict::Moved) {
    session.result["moved_mm"] = drift.movedMm.norm();
    session.result["turned_degrees"] = drift.turned.norm() * DegreesPerRadian;
  }
  session.Say(drift.message);
  if (drift.verdict != SurfaceDrift::Verdict::Holds)
    session.status = Session::Doubtful;
}

} // namespace

CalibrateKind CalibrateSurfaceCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<SurfaceOptions>();
  CLI::App* options =
      calibrate.add_subcommand("surface", "A camera in a printed skin, from a light that is put on numbered marks");
  options->add_option("camera", values->camera, "The camera, as camera:0?width=640&height=480, recording:FILE or simulated:?...")
      ->required();
  options->add_option("--mesh", values->mesh, "The surface that the skin was made of, mm")->type_name("FILE");
  options->add_option("--marks", values->marks, "Its marks in their order: points.csv of echorama shell, or any list of points")
      ->type_name("FILE");
  options->add_option("-o,--output", values->output, "Calibration to write (.json; the mesh goes beside it as .stl)")
      ->type_name("FILE");
  options->add_option("--check", values->check, "See whether this calibration still holds, by some of its marks")
      ->type_name("FILE");
  options->add_option("--check-marks", values->checkMarks, "How many")->check(CLI::Range(4, 100))->capture_default_str();
  options->add_option("--shell", values->shell,
                      "What the marker in the shell says, where the camera does not see it; another one is refused");
  options->add_option("--wall-mm", values->wallMm, "From the mesh to what the camera sees of it: thickness, where that matters")
      ->check(CLI::Range(0.0, 50.0));
  options
      ->add_option("--camera-position", values->cameraPosition,
                   "Roughly, in the mesh's frame, mm (default: amid the lowest marks)")
      ->expected(3);
  options->add_option("--up", values->up, "Where it looks, in the mesh's frame")->expected(3)->capture_default_str();
  options->add_option("--focal", values->focal, "Of the lens, roughly: pixels per radian (default: 190 for a width of 640)")
      ->check(CLI::Range(1.0, 1e5));
  options->add_option("--maximum-angle", values->maximumAngle, "That the lens sees, degrees from its axis")
      ->check(CLI::Range(1.0, 180.0))
      ->capture_default_str();
  options->add_option("--lights", values->lights.lights, "Lights of the blink code")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  options->add_option("--off-slots", values->lights.offSlots, "Slots of it in which all are off")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  options->add_option("--slot-ms", values->slotMs, "Length of a slot (default: of a frame)")->check(CLI::Range(0.1, 1000.0));
  options->add_option("--light", values->light, "The one that is put on marks, from 1")->capture_default_str();
  options->add_flag("--all", values->all, "Ask for all marks, also when more would not help");
  AddParameter(options, Describe(values->detector), "Threshold")->excludes("--check");
  for (const char* name : {"RestFrames", "StillPx", "LeavePx"})
    AddParameter(options, Describe(values->calibration), name);
  for (const char* name : {"Passes", "NearMm", "WantedMm", "PlacementMm", "ResidualCentres"})
    AddParameter(options, Describe(values->calibration), name)->excludes("--check");
  for (const char* name :
       {"--wall-mm", "--camera-position", "--up", "--focal", "--maximum-angle", "--lights", "--off-slots", "--slot-ms", "--all"})
    options->get_option(name)->excludes("--check"); // which takes them from the calibration
  return {options, [values](Session& session) {
            if (values->check.empty())
              MakeCalibration(session, *values);
            else
              CheckCalibration(session, *values);
          }};
}

} // namespace echorama
