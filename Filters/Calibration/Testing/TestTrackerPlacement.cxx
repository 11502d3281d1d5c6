// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/TransformFile.h"
#include "Filters/Calibration/TrackerPlacement.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

Pose PoseOf(const Vector3d& place, const Vector3d& turn)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(turn);
  pose.translation() = place;
  return pose;
}

Pose RandomPose(Random& random)
{
  const auto vector = [&random] { return Vector3d(random.Normal(), random.Normal(), random.Normal()); };
  const Vector3d place = 80.0 * vector();
  return PoseOf(place, vector());
}

// Three volumes of one world, put somewhere else each, and what a tracker saw of their probe: S = O P C^-1 (eq. 4.1), where P is
// where the probe truly was.
struct Scans {
  Pose calibration, worldToTracker;
  std::vector<Pose> probeToWorld, moved; // moved: by which a volume lies wrong
  std::vector<TrackedVolume> volumes;
  ToolTrack track;

  explicit Scans(std::uint64_t seed)
  {
    Random random(seed, 1);
    calibration = RandomPose(random);
    worldToTracker = RandomPose(random);
    track.source = "log.csv";
    track.name = "ProbeToTracker";
    track.from = "Probe";
    track.to = "Tracker";
    for (int i = 0; i < 3; ++i) {
      probeToWorld.push_back(RandomPose(random));
      moved.push_back(i == 0 ? Pose::Identity() : RandomPose(random));
      TrackedVolume volume;
      volume.name = "scan " + std::to_string(i + 1);
      volume.time = 10.0 * i;
      volume.probeToWorld = moved[i] * probeToWorld[i];
      volumes.push_back(volume);
      const Pose sensor = worldToTracker * probeToWorld[i] * calibration.inverse();
      for (const double t : {-0.3, 0.0, 0.3})
        track.poses.push_back({10.0 * i + t, sensor});
    }
  }
  VolumeCalibration Calibration(const std::string& frame = "") const { return {calibration, 1.0, frame}; }
};

template <class Function>
std::string MessageOf(Error::Kind kind, const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return "";
}

bool Says(const std::string& text, const std::string& words)
{
  return text.find(words) != std::string::npos;
}

ToolPose Seen(const std::string& name, double time, const Pose& pose, TransformStatus status = TransformStatus::Valid)
{
  return {name, time, time, pose, status};
}

} // namespace

TEST(TrackerPlacement, PutsVolumesBackAsSeenFromAnyFixedOne)
{
  for (const std::size_t fixed : {0u, 1u, 2u}) {
    const Scans scans(7);
    TrackerPlacementParameters parameters;
    parameters.fixed = static_cast<int>(fixed);
    const TrackerPlacement placed = PlaceByTracker(scans.track, scans.volumes, scans.Calibration(), parameters);
    EXPECT_EQ(placed.volumeToWorld[fixed].matrix(), Eigen::Matrix4d::Identity());
    EXPECT_TRUE(Says(placed.how, "time stamps"));
    for (std::size_t i = 0; i < 3; ++i) // where it lies wrong is taken back, and it goes where the fixed one lies wrong
      EXPECT_LT((placed.volumeToWorld[i].matrix() - (scans.moved[fixed] * scans.moved[i].inverse()).matrix()).norm(), 1e-9)
          << fixed << i;
  }
}

TEST(TrackerPlacement, FilesThatLieAsAcquiredNeedNoProbe)
{
  Scans scans(8);
  for (TrackedVolume& volume : scans.volumes)
    volume.probeToWorld.reset();
  const TrackerPlacement placed = PlaceByTracker(scans.track, scans.volumes, scans.Calibration());
  for (std::size_t i = 0; i < 3; ++i) // the file is the probe's frame
    EXPECT_LT((placed.volumeToWorld[i].matrix() - (scans.probeToWorld[0].inverse() * scans.probeToWorld[i]).matrix()).norm(),
              1e-9);
  EXPECT_TRUE(placed.notes.empty());
  scans.volumes[2].direction = ExpRotation(Vector3d(0.1, 0, 0));
  const auto notes = PlaceByTracker(scans.track, scans.volumes, scans.Calibration()).notes;
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(Says(notes[0], "scan 3: its axes differ from those of scan 1"));
}

TEST(TrackerPlacement, TheCalibrationDecidesWhichFrameTheVolumeIs)
{
  Scans scans(9);
  // All know their probe, and the calibration is that of files: the probes play no part.
  const TrackerPlacement asFiles = PlaceByTracker(scans.track, scans.volumes, scans.Calibration("file"));
  EXPECT_LT((asFiles.volumeToWorld[1].matrix() - (scans.probeToWorld[0].inverse() * scans.probeToWorld[1]).matrix()).norm(),
            1e-9);
  scans.volumes[1].probeToWorld.reset();
  const std::string reason =
      MessageOf(Error::Kind::BadInput, [&] { PlaceByTracker(scans.track, scans.volumes, scans.Calibration("probe")); });
  EXPECT_TRUE(Says(reason, "scan 2: it does not say where its probe was")) << reason;
  EXPECT_FALSE(FindVolumeFrames(scans.volumes).ofProbe);
}

TEST(TrackerPlacement, MatchesByGivenTimesThenStampsThenOrder)
{
  Scans scans(10);
  TrackerPlacementParameters parameters;
  parameters.times = {20.0, 10.0, 0.0}; // against the stamps
  const auto sensor = [&scans](int i) { return scans.track.poses[static_cast<std::size_t>(3 * i + 1)].pose.matrix(); };
  const SensorPoses given = MatchSensor(scans.track, scans.volumes, parameters),
                    stamped = MatchSensor(scans.track, scans.volumes);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((given.poses[i].matrix() - sensor(2 - i)).norm(), 1e-9);
    EXPECT_LT((stamped.poses[i].matrix() - sensor(i)).norm(), 1e-9);
  }
  EXPECT_TRUE(Says(given.how, "given times"));
  // Without any time: one by one, and only when there are as many.
  for (TrackedVolume& volume : scans.volumes)
    volume.time.reset();
  std::string reason = MessageOf(Error::Kind::BadInput, [&] { MatchSensor(scans.track, scans.volumes); });
  EXPECT_TRUE(Says(reason, "log.csv: it has 9 valid poses of ProbeToTracker for 3 volumes")) << reason;
  scans.track.poses = {scans.track.poses[8], scans.track.poses[4], scans.track.poses[0]};
  for (TimedPose& pose : scans.track.poses)
    pose.time = NAN;
  EXPECT_LT((MatchSensor(scans.track, scans.volumes).poses[2].matrix() - scans.track.poses[2].pose.matrix()).norm(), 1e-12);
  reason = MessageOf(Error::Kind::BadInput, [&] { MatchSensor(scans.track, scans.volumes, parameters); });
  EXPECT_TRUE(Says(reason, "it has no times")) << reason;
}

TEST(TrackerPlacement, RefusesWhatCannotBeMatchedAndNamesIt)
{
  Scans scans(11);
  TrackerPlacementParameters parameters;
  parameters.times = {0.0, 10.0};
  MessageOf(Error::Kind::InvalidParameter, [&] { MatchSensor(scans.track, scans.volumes, parameters); });
  parameters.times = {0.0, 5.0, 20.0}; // between two, where there is nothing
  std::string reason = MessageOf(Error::Kind::NotPossible, [&] { MatchSensor(scans.track, scans.volumes, parameters); });
  EXPECT_TRUE(Says(reason, "ProbeToTracker is not known when scan 2 was made")) << reason;
  parameters.smoothing.longestGapSeconds = 20.0;
  EXPECT_EQ(MatchSensor(scans.track, scans.volumes, parameters).poses.size(), 3u);
  parameters.times = {0.0, 10.0, 21.0}; // after its end
  reason = MessageOf(Error::Kind::NotPossible, [&] { MatchSensor(scans.track, scans.volumes, parameters); });
  EXPECT_TRUE(Says(reason, "scan 3")) << reason;
  scans.volumes[0].time.reset();
  reason = MessageOf(Error::Kind::BadInput, [&] { MatchSensor(scans.track, scans.volumes); });
  EXPECT_TRUE(Says(reason, "1 of 3 volumes have no time stamp")) << reason;
  parameters.fixed = 3;
  MessageOf(Error::Kind::InvalidParameter, [&] { PlaceByTracker(scans.track, scans.volumes, scans.Calibration(), parameters); });
}

TEST(TrackerPlacement, PosesAreAveragedOverTheWindow)
{
  ToolTrack track = Scans(12).track;
  track.poses.clear();
  constexpr double pulse = 15.0; // radians per second
  for (int i = 0; i <= 400; ++i) {
    const double t = 0.01 * i;
    track.poses.push_back({t, PoseOf(Vector3d(5.0 * std::cos(pulse * (t - 2.0)), 0, 0), Vector3d::Zero())});
  }
  track.poses.insert(track.poses.begin() + 200, track.poses[200]); // one that repeats its time
  TrackedVolume volume;
  volume.time = 2.0;
  TrackerPlacementParameters parameters;
  for (const double window : {0.0, 0.1, 0.2}) {
    parameters.smoothing.sigmaSeconds = window;
    const SensorPoses sensor = MatchSensor(track, {volume}, parameters);
    EXPECT_NEAR(sensor.poses[0].translation().x(), 5.0 * std::exp(-0.5 * pulse * pulse * window * window), 0.02) << window;
    ASSERT_EQ(sensor.notes.size(), 1u);
    EXPECT_TRUE(Says(sensor.notes[0], "1 poses of ProbeToTracker repeat a time"));
  }
}

class VolumeCalibrationFile : public echorama::testing::TemporaryFolder {};

TEST_F(VolumeCalibrationFile, IsThatOfTheTool)
{
  const Pose c = PoseOf(Vector3d(1, 2, 3), Vector3d(0.1, 0.2, 0.3));
  NamedTransform edge;
  edge.from = "Volume";
  edge.to = "Probe";
  edge.matrix = c;
  edge.errorMm = 0.75;
  const std::string path = Path("calibration.json");
  // The key's present spelling, that of older files, and none.
  const std::pair<const char*, const char*> reports[] = {
      {R"({"volume_frame": "file"})", "file"}, {R"({"volumeFrame": "probe"})", "probe"}, {"", ""}};
  for (const auto& [report, frame] : reports) {
    WriteTransforms(path, {edge}, report);
    const VolumeCalibration read = ReadVolumeCalibration(path, "Probe");
    EXPECT_EQ(read.volumeToSensor.matrix(), c.matrix());
    EXPECT_EQ(read.errorMm, 0.75);
    EXPECT_EQ(read.frame, frame);
  }
  std::string reason = MessageOf(Error::Kind::BadInput, [&] { ReadVolumeCalibration(path, "Stylus"); });
  EXPECT_TRUE(Says(reason, "it has no VolumeToStylus")) << reason;
  edge.matrix.linear() *= 2.0;
  WriteTransforms(path, {edge});
  reason = MessageOf(Error::Kind::BadInput, [&] { ReadVolumeCalibration(path, "Probe"); });
  EXPECT_TRUE(Says(reason, "VolumeToProbe is not a rigid, valid pose")) << reason;
}

TEST(ToolTrack, ToolsAreComposedLeftOutAndChosen)
{
  Random random(13, 1);
  PoseLog log;
  log.path = "log.igs.mha";
  log.tools = {"StylusToTracker", "ReferenceToTracker"};
  std::vector<Pose> stylus, reference;
  for (int i = 0; i < 4; ++i) {
    stylus.push_back(RandomPose(random));
    reference.push_back(RandomPose(random));
    log.poses.push_back(Seen("StylusToTracker", i, stylus[i]));
    if (i != 2) // at that moment the reference was not recorded at all
      log.poses.push_back(
          Seen("ReferenceToTracker", i, reference[i], i == 3 ? TransformStatus::Missing : TransformStatus::Valid));
  }
  const ToolTrack composed = ToolTrackOf(log, "StylusToReference");
  ASSERT_EQ(composed.poses.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(composed.poses[i].time, static_cast<double>(i));
    EXPECT_LT((composed.poses[i].pose.matrix() - (reference[i].inverse() * stylus[i]).matrix()).norm(), 1e-9);
  }
  EXPECT_EQ(std::pair(composed.from, composed.to), std::pair(std::string("Stylus"), std::string("Reference")));
  ASSERT_EQ(composed.notes.size(), 1u);
  EXPECT_TRUE(Says(composed.notes[0], "did not see StylusToReference in 2 of 4 moments")) << composed.notes[0];

  EXPECT_EQ(ToolTrackOf(log, "Stylus").name, "StylusToTracker"); // a plain name will do
  std::string reason = MessageOf(Error::Kind::InvalidParameter, [&] { ToolTrackOf(log, ""); });
  EXPECT_TRUE(Says(reason, "choose one of StylusToTracker, ReferenceToTracker")) << reason;
  reason = MessageOf(Error::Kind::BadInput, [&] { ToolTrackOf(log, "NeedleToTracker"); });
  EXPECT_TRUE(Says(reason, "StylusToTracker")) << reason;
  for (ToolPose& pose : log.poses)
    pose.status = TransformStatus::Missing;
  reason = MessageOf(Error::Kind::BadInput, [&] { ToolTrackOf(log, "StylusToTracker"); });
  EXPECT_TRUE(Says(reason, "StylusToTracker was never seen")) << reason;
}
