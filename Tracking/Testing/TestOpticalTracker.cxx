// SPDX-License-Identifier: BSD-3-Clause
// From frames of simulated cameras, whose truth is known, to poses of tools.
#include "Testing/Sanitized.h"
#include "Testing/TemporaryFolder.h"
#include "Tracking/Cameras/RecordedSource.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/OpticalTracker.h"
#include "Tracking/Optical/Testing/SurfaceTruth.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

namespace {

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A dome as a mesh, and a small camera in it, so that tests are quick.
struct Rig {
  SimulatedSourceParameters source;
  std::shared_ptr<const TrackedSkin> skin;
  double seenFrom = -1e9, seenTo = 1e9; // columns of the picture that are calibrated
  double mapSigma = 1e-3;               // of the lens's numbers, px; of the pose, mm
  Vector3d mapError = Vector3d::Zero(); // by which the map has the camera elsewhere, mm
  BrightnessCalibration brightness;

  Rig()
  {
    source = SimulatedSourceParameters::Of(TrackerAddress::Parse(
        "simulated:?width=320&height=240&focal=95&centreX=159.5&centreY=119.5&speed=0&frames=360&cameraTurn=0 0 20"));
    skin = std::make_shared<const TrackedSkin>(truth::Ellipsoid({110.0, 95.0, 90.0}, 6));
  }

  CalibratedSurface Surface() const
  {
    SurfaceMapState state;
    state.optics.lens = source.camera.lens;
    std::vector<Vector2d> pixels;
    for (double y = 4.0; y < 240.0; y += 8.0)
      for (double x = 4.0; x < 320.0; x += 8.0)
        if (x >= seenFrom && x <= seenTo)
          pixels.emplace_back(x, y);
    state.covered = PixelCoverage::Of(std::move(pixels));
    state.cameraToShell = source.CameraToShell();
    state.cameraToShell.translation() += mapError;
    Eigen::VectorXd variances = Eigen::VectorXd::Constant(13, 1e-14);
    variances.segment<3>(0).setConstant(mapSigma * mapSigma);
    variances.segment<3>(7).setConstant(mapSigma * mapSigma);
    state.covariance = variances.asDiagonal();
    CalibratedSurface made;
    made.map = SurfaceMap(std::move(state), skin);
    made.shell = "belly-7";
    made.lights.lights = source.lights;
    made.tracks.frameMs = made.tracks.slotMs = 1000.0 / source.camera.frameRate;
    made.tracks.exposureMs = source.camera.exposureMs;
    made.brightness = brightness;
    return made;
  }
  std::unique_ptr<SimulatedSource> Camera() const { return Camera({}); }
  std::unique_ptr<SimulatedSource> Camera(std::vector<SimulatedLight> lights) const
  {
    if (lights.empty())
      for (int i = 0; i < source.lights; ++i)
        lights.push_back(source.Light(i, [this, i](double time) { return At(i, time); }));
    return std::make_unique<SimulatedSource>(source, skin, std::move(lights));
  }
  // A light on a circle of the shell; the second elsewhere, the other way round.
  std::function<LightOnSkin(int, double)> path = [](int, double) { return LightOnSkin(); };
  LightOnSkin At(int light, double time) const
  {
    const double around = (light == 0 ? 4.0 : -3.0) * time, x = light == 0 ? -30.0 : 35.0;
    LightOnSkin place = path(light, time);
    place.point = OnSkin(x + 25.0 * std::cos(around), 25.0 * std::sin(around));
    return place;
  }
  Vector3d OnSkin(double x, double y) const { return skin->FirstHit({x, y, 0.0}, Vector3d::UnitZ())->point; }

  OpticalView View() const { return {Camera(), Surface(), "belly.json"}; }
};

std::vector<OpticalView> Views(OpticalView first)
{
  std::vector<OpticalView> views;
  views.push_back(std::move(first));
  return views;
}

struct Told {
  std::vector<ToolPose> poses;
  DeviceState state = DeviceState::Idle;
  std::string message;

  std::vector<ToolPose> Of(const std::string& tool) const
  {
    std::vector<ToolPose> its;
    std::copy_if(poses.begin(), poses.end(), std::back_inserter(its), [&](const ToolPose& pose) { return pose.name == tool; });
    return its;
  }
  static long Count(const std::vector<ToolPose>& poses, TransformStatus status)
  {
    return std::count_if(poses.begin(), poses.end(), [status](const ToolPose& pose) { return pose.status == status; });
  }
};

// All that a device says until it is at its end.
Told Listen(TrackerDevice& device, double seconds = 60.0)
{
  PoseStream stream;
  const auto subscription = stream.Subscribe(1 << 16);
  device.Start(stream, nullptr);
  Told told;
  for (const double since = ClockNow(); ClockNow() - since < seconds;) {
    std::tie(told.state, told.message) = stream.State();
    for (ToolPose& pose : subscription->Take(0.02))
      told.poses.push_back(std::move(pose));
    if (told.state == DeviceState::Ended || told.state == DeviceState::Failed)
      break;
  }
  device.Stop();
  for (ToolPose& pose : subscription->Take(0.0))
    told.poses.push_back(std::move(pose));
  return told;
}

Told Listen(const Rig& rig, const OpticalTrackerParameters& parameters = {})
{
  OpticalTracker tracker(parameters, Views(rig.View()));
  return Listen(tracker);
}

double Median(std::vector<double> values)
{
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Distances of a tool's valid poses from where its light is at their times.
std::vector<double> Errors(const std::vector<ToolPose>& poses, const Rig& rig, int light, double from = 0.5)
{
  std::vector<double> errors;
  for (const ToolPose& pose : poses)
    if (pose.status == TransformStatus::Valid && pose.time > from)
      errors.push_back((pose.pose.translation() - rig.At(light, pose.time).point).norm());
  return errors;
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(OpticalTracker, TruthOfASimulatedCameraIsToldBesideIt)
{
  Rig rig;
  rig.source.frames = 90;
  OpticalTrackerParameters parameters;
  parameters.truth = true;
  const Told told = Listen(rig, parameters);
  const std::vector<ToolPose> truths = told.Of("NeedleTruthToTracker"), places = told.Of("NeedleToTracker");
  ASSERT_EQ(truths.size(), places.size());
  ASSERT_GT(truths.size(), 80u);
  for (std::size_t i = 0; i < truths.size(); ++i) {
    ASSERT_EQ(truths[i].time, places[i].time);
    ASSERT_LT((truths[i].pose.translation() - rig.At(1, truths[i].time).point).norm(), 1e-9);
    if (places[i].status == TransformStatus::Valid) {
      EXPECT_GT(truths[i].pose.linear().col(2).dot(places[i].pose.linear().col(2)), 0.99); // into the skin
    }
  }
}

TEST(OpticalTracker, ToolsLieOnTheSkinWhereTheirLightsAreWhenTheyAreTold)
{
  const Rig rig;
  const Told told = Listen(rig);
  EXPECT_EQ(told.state, DeviceState::Ended);
  for (const int light : {0, 1}) {
    const std::vector<ToolPose> its = told.Of(light == 0 ? "ProbeToTracker" : "NeedleToTracker");
    ASSERT_EQ(its.size(), 360u);
    const std::vector<double> errors = Errors(its, rig, light);
    ASSERT_GT(errors.size(), 290u); // of 315
    EXPECT_LT(Median(errors), 0.5); // it moves at 100 and at 75 mm/s: 1.5 and 1.1 mm in the 15 ms from exposure to pose
    for (std::size_t i = 0; i < its.size(); ++i) {
      EXPECT_NEAR(its[i].time, static_cast<double>(i) / 90.0 + 0.019, 1e-9);
      if (its[i].status != TransformStatus::Valid)
        continue;
      const Vector3d z = its[i].pose.linear().col(2), p = its[i].pose.translation();
      const Vector3d outwards = p.cwiseQuotient(Vector3d(110.0 * 110.0, 95.0 * 95.0, 90.0 * 90.0)).normalized();
      EXPECT_GT(-z.dot(outwards), 0.999); // into the skin
    }
  }
  EXPECT_SAYS(told.message, "Probe seen (predictions 0.");
  EXPECT_SAYS(told.message, "15 ms from exposure to pose, 0 of 360 frames lost");
}

TEST(OpticalTracker, TheErrorOfPredictionsThatIsToldIsTheirs)
{
  const Rig rig;
  OpticalTrackerParameters parameters;
  parameters.predictMs = 60.0;
  const Told told = Listen(rig, parameters);
  std::vector<double> errors = Errors(told.Of("ProbeToTracker"), rig, 0);
  double squares = 0.0;
  for (const double error : errors)
    squares += error * error;
  const std::size_t at = told.message.find("(predictions ");
  ASSERT_NE(at, std::string::npos) << told.message;
  const double said = std::atof(told.message.c_str() + at + 13);
  const double is = std::sqrt(squares / static_cast<double>(errors.size()));
  EXPECT_GT(is, 0.5);
  EXPECT_NEAR(said, is, 0.2 * is);
}

TEST(OpticalTracker, WithoutPredictionPlacesAreThoseOfTheExposure)
{
  const Rig rig;
  OpticalTrackerParameters parameters;
  parameters.predictMs = 0.0;
  const Told told = Listen(rig, parameters);
  const std::vector<ToolPose> its = told.Of("ProbeToTracker");
  EXPECT_NEAR(its[90].time, 1.0 + 0.004, 1e-9);
  EXPECT_LT(Median(Errors(its, rig, 0)), 0.15);
}

TEST(OpticalTracker, LightsThatAreAwayAreMissing)
{
  Rig rig;
  rig.path = [](int light, double time) { return LightOnSkin{Vector3d::Zero(), 0.0, light == 1 && time > 2.0 ? 0.0 : 160.0}; };
  const Told told = Listen(rig);
  int late = 0;
  for (const ToolPose& pose : told.Of("NeedleToTracker"))
    late += pose.time > 2.0 + 0.019 + 4.0 / 90.0 && pose.status != TransformStatus::Missing;
  EXPECT_EQ(late, 0);
  EXPECT_GT(Errors(told.Of("NeedleToTracker"), rig, 1).size(), 100u);
  EXPECT_GT(Errors(told.Of("ProbeToTracker"), rig, 0, 2.2).size(), 150u);
  EXPECT_SAYS(told.message, "Needle lost");
}

// As seen by the camera of a rig.
BrightnessCalibration Calibrated(const Rig& rig)
{
  const auto camera = rig.Camera();
  SpotDetector detector;
  std::vector<ContactSample> samples;
  for (const double x : {-60.0, -20.0, 20.0, 60.0})
    for (const double y : {-40.0, 0.0, 40.0}) {
      SimulatedFrame frame;
      camera->Camera().Render(0, {{[&](double) { return LightOnSkin{rig.OnSkin(x, y), 0.0, 160.0}; }, {}}}, frame);
      const SpotFrame spots = detector.Detect(frame.Grey());
      if (!spots.spots.empty())
        samples.push_back({spots.spots.front().position, spots.spots.front().peak, spots.spots.front().size});
    }
  return BrightnessCalibration::Fit(samples, 320, 240);
}

TEST(OpticalTracker, LightsThatHoverAreOutOfRange)
{
  Rig rig;
  rig.source.camera.hotPixels = 0;
  rig.brightness = Calibrated(rig);
  rig.path = [](int light, double) { return LightOnSkin{Vector3d::Zero(), light == 1 ? 3.0 : 0.0, 160.0}; };
  const Told told = Listen(rig);
  const std::vector<ToolPose> probe = told.Of("ProbeToTracker"), needle = told.Of("NeedleToTracker");
  EXPECT_GT(Told::Count(probe, TransformStatus::Valid), 290);
  EXPECT_EQ(Told::Count(needle, TransformStatus::Valid), 0);
  EXPECT_GT(Told::Count(needle, TransformStatus::OutOfRange), 250);
  EXPECT_SAYS(told.message, "Probe touches");
  EXPECT_SAYS(told.message, "Needle hovers");
}

TEST(OpticalTracker, WhatCannotBeTrackedRightlyIsRefused)
{
  const auto refused = [](std::vector<OpticalView> views, Error::Kind kind, const std::string& words) {
    OpticalTracker tracker({}, std::move(views));
    PoseStream stream;
    echorama::testing::ExpectRefused([&] { tracker.Start(stream, nullptr); }, kind, "belly.json", words);
  };
  const Rig rig;
  std::vector<OpticalView> views = Views(rig.View());
  views[0].surface.lights.alternating = true;
  refused(std::move(views), Error::Kind::NotPossible, "take turns");
  Rig live;
  live.source.speed = 1.0;
  views = Views(rig.View());
  views.push_back(live.View());
  refused(std::move(views), Error::Kind::InvalidParameter, "cannot be joined");
  // Brightness tells whether a light touches, at the exposure of the calibration alone.
  Rig bright, dim;
  bright.brightness = Calibrated(bright);
  dim.source.camera.exposureMs = 0.6 * bright.source.camera.exposureMs;
  views = Views(dim.View());
  views[0].surface = bright.Surface();
  refused(std::move(views), Error::Kind::BadInput, "exposure of 8 ms");
}

TEST(OpticalTracker, BeyondTheCalibrationThereAreNoPoses)
{
  Rig rig;
  rig.seenTo = 159.0; // the probe's half
  const Told told = Listen(rig);
  EXPECT_GT(Told::Count(told.Of("ProbeToTracker"), TransformStatus::Valid), 250);
  EXPECT_EQ(Told::Count(told.Of("NeedleToTracker"), TransformStatus::Valid), 0);
  EXPECT_SAYS(told.message, "Needle where the calibration does not reach");
}

TEST(OpticalTracker, TooMuchLightOfTheRoomIsTold)
{
  Rig rig;
  rig.source.camera.ambient = 255.0;
  rig.source.camera.vignetting = 0.0;
  rig.source.frames = 90;
  const Told told = Listen(rig);
  EXPECT_EQ(Told::Count(told.poses, TransformStatus::Valid), 0);
  EXPECT_EQ(told.poses.size(), 180u); // but what is missing is told
  EXPECT_SAYS(told.message, "belly.json: ");
  EXPECT_SAYS(told.message, "saturated");
}

TEST(OpticalTracker, PicturesOfTheCameraGoOutToBeLookedAt)
{
  Rig rig;
  rig.source.frames = 91;
  OpticalTrackerParameters parameters;
  parameters.pictureRate = 10.0;
  OpticalTracker tracker(parameters, Views(rig.View()));
  PoseStream stream;
  ImageStream images(64);
  tracker.Start(stream, &images);
  stream.WaitForPoses(100000, 60.0); // until its end
  tracker.Stop();
  ASSERT_EQ(images.Images().size(), 11u);
  const StreamedImage picture = images.Images().at(3);
  EXPECT_NEAR(picture.time, 0.3, 0.012);
  EXPECT_EQ(picture.geometry.dimensions[0], 320);
  const auto camera = rig.Camera();
  camera->Open();
  CameraFrame frame;
  do
    ASSERT_EQ(camera->Next(frame, 0.0), CameraSource::Outcome::Frame);
  while (frame.begin < picture.time);
  ASSERT_EQ(picture.voxels->size(), 320u * 240u);
  EXPECT_EQ((*picture.voxels)[239 * 320 + 7], frame.grey(7, 0)); // the first row is on top
}

TEST(OpticalTracker, ALightThatNeverShinesIsNamed)
{
  Rig rig;
  rig.path = [](int light, double) { return LightOnSkin{Vector3d::Zero(), 0.0, light == 1 ? 0.0 : 160.0}; };
  rig.source.frames = 1200;
  const Told told = Listen(rig);
  EXPECT_SAYS(told.message, "the light of Needle has never been seen, others have");
  rig.source.frames = 600; // too early to say so
  EXPECT_EQ(Listen(rig).message.find("never"), std::string::npos);
}

TEST(OpticalTracker, ALightThatIsWeakIsNamed)
{
  Rig rig;
  rig.source.camera.hotPixels = 0;
  rig.brightness = Calibrated(rig);
  rig.path = [](int light, double) { return LightOnSkin{Vector3d::Zero(), 0.0, light == 0 ? 56.0 : 160.0}; };
  const Told told = Listen(rig);
  EXPECT_SAYS(told.message, "the light of Probe is weak, 3");
}

TEST(OpticalTracker, AnotherSizeOfPicturesAndAnotherShellAreRefused)
{
  Rig rig;
  OpticalView view = rig.View();
  rig.source.camera.lens.width = 400;
  view.camera = rig.Camera();
  OpticalTracker tracker({}, Views(std::move(view)));
  PoseStream stream;
  echorama::testing::ExpectRefused([&] { tracker.Start(stream, nullptr); }, Error::Kind::BadInput, "belly.json", "400 x 240");
  OpticalTrackerParameters parameters;
  parameters.mounted = "head-2";
  OpticalTracker other(parameters, Views(Rig().View()));
  echorama::testing::ExpectRefused([&] { other.Start(stream, nullptr); }, Error::Kind::BadInput, "belly.json", "head-2");
}

// By the marker that its camera sees, without being told.
TEST(OpticalTracker, AShellWithAnotherMarkerIsRefusedOnceThatIsRead)
{
  for (const auto& [calibrated, isRefused] : {std::pair<const char*, bool>{"0A1B2D", true}, {"0a1b2c", false}, {"", false}}) {
    Rig rig;
    rig.source = SimulatedSourceParameters::Of(TrackerAddress::Parse("simulated:?speed=0&frames=100&marker=0A1B2C"));
    std::vector<OpticalView> views = Views(rig.View());
    views.front().surface.shell = calibrated;
    OpticalTracker tracker({}, std::move(views));
    const Told told = Listen(tracker);
    EXPECT_EQ(told.state, isRefused ? DeviceState::Failed : DeviceState::Ended) << told.message;
    if (isRefused) {
      EXPECT_SAYS(told.message, "belly.json: it was made in the shell \"0A1B2D\", and \"0A1B2C\" is mounted");
    }
  }
}

class OpticalTrackerFiles : public echorama::testing::TemporaryFolder {};

TEST_F(OpticalTrackerFiles, AFilmGivesTheSamePosesAgain)
{
  Rig rig;
  rig.source.camera.lostFrames = 0.02;
  OpticalTrackerParameters parameters;
  parameters.film = Path("film.igs.mhd");
  const Told live = Listen(rig, parameters);
  WriteSurface(Path("belly.json"), rig.Surface());
  const auto again = MakeTracker("optical:recording:" + Path("film.igs.mhd") + "?speed=0&shell=" + Path("belly.json"));
  const Told replayed = Listen(*again);
  ASSERT_EQ(live.poses.size(), replayed.poses.size());
  ASSERT_GT(live.poses.size(), 600u);
  for (std::size_t i = 0; i < live.poses.size(); ++i) {
    EXPECT_EQ(live.poses[i].name, replayed.poses[i].name);
    EXPECT_EQ(live.poses[i].time, replayed.poses[i].time);
    EXPECT_EQ(live.poses[i].status, replayed.poses[i].status);
    EXPECT_LT((live.poses[i].pose.translation() - replayed.poses[i].pose.translation()).norm(), 1e-4); // the mesh is of floats
  }
  EXPECT_THROW(Listen(rig, parameters), Error); // it is there already
  std::filesystem::resize_file(Path("film.igs.raw"), 320 * 240 * 20);
  echorama::testing::ExpectRefused([&] { Listen(*again); }, Error::Kind::BadFile, Path("film.igs"), "truncated");
}

TEST_F(OpticalTrackerFiles, LinesSayAllThatIsNeeded)
{
  Rig rig;
  WriteSurface(Path("belly.json"), rig.Surface());
  const std::string shell = "shell=" + Path("belly.json");
  // The camera that does not exist has the lens and the skin of the calibration.
  const auto tracker = MakeTracker("optical:simulated:?speed=0&frames=200&" + shell +
                                   "&tools=Linear,Biopsy&path=strokes&speedMmPerS=50&mounted=belly-7");
  const Told told = Listen(*tracker);
  EXPECT_GT(Told::Count(told.Of("LinearToTracker"), TransformStatus::Valid), 150);
  EXPECT_GT(Told::Count(told.Of("BiopsyToTracker"), TransformStatus::Valid), 150);

  const auto refused = [](const std::string& line, const std::string& words) {
    echorama::testing::ExpectRefused([&] { MakeTracker(line); }, Error::Kind::InvalidParameter, line.substr(0, 8), words);
  };
  refused("optical:?shell=a", "which camera?");
  refused("optical:simulated:?speed=0", "which printed skin?");
  refused("optical:film:x?shell=a", "no camera source film");
  refused("optical:camera:0?shell=a&colour=red", "no option colour");
  refused("optical:camera:0,camera:1?shell=a", "2 cameras, but 1 calibrations");
  EXPECT_EQ(OpticalTrackerParameters::Of(TrackerAddress::Parse("optical:recording:a,b.mhd,camera:1?shell=a,b")).cameras[0].place,
            "a,b.mhd");
  EXPECT_THROW(Listen(*MakeTracker("optical:camera:99?shell=" + Path("nothing.json"))), Error);
  // As one of two lines of a fused tracker.
  EXPECT_NO_THROW(MakeTracker("fused:optical:recording:f.igs.mhd?shell=a.json|simulated:?tools=1|normals=tool"));
}

// A camera that breaks and comes back, by hand.
class Fickle : public CameraSource {
public:
  explicit Fickle(std::unique_ptr<CameraSource> camera) : camera_(std::move(camera)) {}
  CameraFormat Open() override
  {
    if (isGone)
      throw Error(Error::Kind::FileSystem, "/dev/video7: there is no such camera");
    return camera_->Open();
  }
  Outcome Next(CameraFrame& frame, double seconds) override
  {
    if (isGone)
      throw Error(Error::Kind::FileSystem, "/dev/video7: the camera delivers no more");
    return isSilent ? Outcome::Nothing : camera_->Next(frame, seconds);
  }
  void Close() override { camera_->Close(); }
  bool IsLive() const override { return true; }
  std::int64_t Lost() const override { return camera_->Lost(); }
  std::atomic<bool> isGone{false}, isSilent{false};

private:
  std::unique_ptr<CameraSource> camera_;
};

TEST(OpticalTracker, ACameraThatGoesIsLostAndComesBack)
{
  Rig rig;
  rig.source.speed = 1.0;
  rig.source.frames = 0;
  OpticalView view = rig.View();
  auto fickle = std::make_unique<Fickle>(std::move(view.camera));
  Fickle& camera = *fickle;
  view.camera = std::move(fickle);
  OpticalTracker tracker({}, Views(std::move(view)));
  PoseStream stream;
  const auto waitFor = [&stream](DeviceState state, const std::string& words) {
    for (const double since = ClockNow(); ClockNow() - since < 20.0;) {
      const auto now = stream.State();
      if (now.first == state && now.second.find(words) != std::string::npos)
        return true;
      stream.WaitBeyond(stream.Version(), 0.05);
    }
    return false;
  };
  tracker.Start(stream, nullptr);
  EXPECT_TRUE(waitFor(DeviceState::Running, "Probe seen")) << stream.State().second;
  EXPECT_NEAR(stream.Latest("ProbeToTracker").time, ClockNow(), 1.0); // our clock
  camera.isGone = true;
  EXPECT_TRUE(waitFor(DeviceState::Lost, "/dev/video7: the camera delivers no more"));
  EXPECT_TRUE(waitFor(DeviceState::Lost, "/dev/video7: there is no such camera"));
  camera.isGone = false;
  EXPECT_TRUE(waitFor(DeviceState::Running, "Probe seen")) << stream.State().second;
  camera.isSilent = true;
  EXPECT_TRUE(waitFor(DeviceState::Lost, "no frame has come for"));
  const double begun = ClockNow();
  tracker.Stop();
  EXPECT_LT(ClockNow() - begun, 0.5);
  EXPECT_EQ(stream.State().first, DeviceState::Idle);
}

TEST(OpticalTracker, WhoWasWaitedForInVainIsWaitedForOnceItTakesAgain)
{
  Rig rig;
  rig.source.frames = 0; // without an end
  PoseStream stream;
  OpticalTracker tracker({}, Views(rig.View()));
  const auto reader = stream.Subscribe(10);
  const auto loses = [&](double seconds) {
    const std::uint64_t lost = reader->Lost();
    for (const double since = ClockNow(); ClockNow() - since < seconds && reader->Lost() == lost;)
      stream.WaitBeyond(stream.Version(), 0.02);
    return reader->Lost() > lost;
  };
  tracker.Start(stream, nullptr);
  ASSERT_TRUE(loses(60.0));
  reader->Take();
  EXPECT_FALSE(loses(1.0));
  EXPECT_GT(stream.Backlog(), 0.5); // it was not the tracker that was slow
}

// Two cameras that look at one dome from two places.
Told ListenToTwo(Rig& left, Rig& right)
{
  left.source.cameraMm = {-25.0, 0.0, 0.0};
  right.source.cameraMm = {25.0, 0.0, 0.0};
  std::vector<OpticalView> views = Views(left.View());
  views.push_back(right.View());
  views.back().name = "right.json";
  OpticalTracker tracker({}, std::move(views));
  return Listen(tracker);
}

TEST(OpticalTracker, OfTwoCamerasEitherWillDo)
{
  Rig left, right;
  left.seenTo = 150.0;
  right.seenFrom = 120.0;
  const Told told = ListenToTwo(left, right);
  for (const int light : {0, 1}) {
    const std::vector<double> errors = Errors(told.Of(light == 0 ? "ProbeToTracker" : "NeedleToTracker"), left, light);
    EXPECT_GT(errors.size(), 250u);
    EXPECT_LT(Median(errors), 0.6);
  }
}

TEST(OpticalTracker, OfTwoCamerasPlacesAreAveragedByTheirVariances)
{
  ECHORAMA_SKIP_SANITIZED();
  const auto shifted = [](double millimetres, double sigma) {
    Rig left, right;
    right.mapError = {millimetres, 0.0, 0.0};
    left.mapSigma = 0.5;
    right.mapSigma = sigma;
    return std::make_pair(ListenToTwo(left, right), left);
  };
  const auto offset = [](const std::pair<Told, Rig>& said) { // along x, of all probes
    double sum = 0.0;
    int count = 0;
    for (const ToolPose& pose : said.first.Of("ProbeToTracker"))
      if (pose.status == TransformStatus::Valid && pose.time > 0.5) {
        sum += (pose.pose.translation() - said.second.At(0, pose.time).point).x();
        ++count;
      }
    EXPECT_GT(count, 250);
    return sum / count;
  };
  const double alone = [] { // what the map's error does
    Rig right;
    right.source.cameraMm = {25.0, 0.0, 0.0};
    right.mapError = {0.8, 0.0, 0.0};
    double sum = 0.0;
    const std::vector<ToolPose> its = Listen(right).Of("ProbeToTracker");
    int count = 0;
    for (const ToolPose& pose : its)
      if (pose.status == TransformStatus::Valid && pose.time > 0.5) {
        sum += (pose.pose.translation() - right.At(0, pose.time).point).x();
        ++count;
      }
    return sum / count;
  }();
  EXPECT_GT(std::abs(alone), 0.4);
  const double equal = offset(shifted(0.8, 0.5)), unsure = offset(shifted(0.8, 5.0));
  EXPECT_NEAR(equal, 0.5 * alone, 0.25 * std::abs(alone));
  EXPECT_LT(std::abs(unsure), 0.15 * std::abs(alone));
  // 30 mm apart, they are not of one light: the surer one counts, and it is told. But for frames in which one alone knows the
  // light.
  const auto apart = shifted(30.0, 2.0);
  const std::vector<double> errors = Errors(apart.first.Of("ProbeToTracker"), apart.second, 0);
  EXPECT_GT(errors.size(), 250u);
  EXPECT_LT(std::count_if(errors.begin(), errors.end(), [](double error) { return error > 5.0; }), 0.03 * errors.size());
  EXPECT_SAYS(apart.first.message, "cameras disagreed");
}

} // namespace
