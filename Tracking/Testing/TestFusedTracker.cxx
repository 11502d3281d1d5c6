// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Testing/TemporaryFolder.h"
#include "Tracking/Devices/FusedTracker.h"
#include "Tracking/Devices/SimulatedTracker.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include "Tracking/Testing/SurfaceSimulation.h"
#include <functional>

using namespace echorama;
using Eigen::Quaterniond, Eigen::Vector3d;

namespace {

class FusedTrackerTest : public echorama::testing::TemporaryFolder {};

std::unique_ptr<FusedTracker> Make(const std::string& line)
{
  return std::make_unique<FusedTracker>(FusedTrackerParameters::Of(TrackerAddress::Parse(line)));
}

std::string TextOf(const Vector3d& v)
{
  return Format("%.17g %.17g %.17g", v[0], v[1], v[2]);
}

bool WaitUntil(const std::function<bool()>& holds, double seconds = 20.0)
{
  for (const double begun = ClockNow(); !holds();) {
    if (ClockNow() - begun > seconds)
      return false;
    PoseStream().WaitBeyond(0, 0.005);
  }
  return true;
}

// Of a message such as "the position: silent for 1.2 s"; below 0 when it says no such thing.
double SilentSeconds(const std::string& message)
{
  const std::size_t at = message.find("silent for ");
  return at == std::string::npos ? -1.0 : std::stod(message.substr(at + 11));
}

double DegreesBetween(const Pose& a, const Pose& b)
{
  return RotationAngle(a.inverse() * b) * DegreesPerRadian;
}

// A moment of what came, as a recording has it; a tool without a pose is missing.
void Append(SequenceRecorder& recorder, double time, const Pose& pose, const std::string& name)
{
  SequenceFrame frame;
  frame.time = time;
  frame.transforms.push_back({name, Eigen::Affine3d(pose.matrix())});
  recorder.Append(frame);
}

// The same motion seen by both, which tilts about its array: that points the same way all the while.
const char* const BothSimulated = "fused:simulated:?rate=100&noiseMm=0.2&tools=1&motion=sweep|"
                                  "simulated:?rate=120&noiseDegrees=0.3&latencyMs=10&tools=1&motion=sweep";

} // namespace

TEST_F(FusedTrackerTest, RecordingsWithNoiseDelayBiasAndDriftAreFusedAsByTheFilterItself)
{
  SurfaceSimulation s;
  s.seconds = 60.0;
  s.latitudeDegrees = 10.0;
  s.Run();
  // What the filter makes of it when it is fed by hand, in the order of arrival, and what the recordings hold.
  SurfacePoseFilter filter(s.Parameters(), s.sensorToProbe);
  SequenceRecorder places(Path("places.igs.mha")), turns(Path("turns.igs.mha"));
  s.Send(
      [&](double stamp, const Vector3d& point, const Vector3d& normal) {
        Pose pose = Pose::Identity();
        pose.translation() = point;
        pose.linear() = Quaterniond::FromTwoVectors(-Vector3d::UnitZ(), normal).toRotationMatrix();
        Append(places, stamp, pose, "ProbeToSkin");
        filter.AddSurface(stamp, point, normal);
      },
      [&](double stamp, const Quaterniond& q) {
        Pose pose(q);
        pose.translation() = Vector3d(1, 2, 3); // which means nothing
        Append(turns, stamp, pose, "ImuToLevel");
        filter.AddImu(stamp, q);
        if (const auto newest = filter.Newest(); newest && !filter.IsAligned())
          filter.Align(newest->time, s.At(0.0).probeToWorld.linear().col(0), 2.0);
      });
  places.Finish();
  turns.Finish();
  const Eigen::AngleAxisd mounting(s.sensorToProbe);
  PoseStream poses;
  const auto fused = Make("fused:replay:" + Path("places.igs.mha") + "?speed=0|replay:" + Path("turns.igs.mha") +
                          "?speed=0|surfaceDelay=0.04&imuDelay=0.015&normals=tool&alignDegrees=2&alignTo=" +
                          TextOf(s.At(0.0).probeToWorld.linear().col(0)) +
                          "&mounting=" + TextOf(mounting.angle() * DegreesPerRadian * mounting.axis()));
  const auto all = poses.Subscribe();
  fused->Start(poses, nullptr);
  ASSERT_TRUE(WaitUntil([&] { return poses.State().first == DeviceState::Ended; })) << poses.State().second;
  EXPECT_FALSE(poses.Live());
  double degrees = 0.0, mm = 0.0, last = -1.0;
  int count = 0;
  for (const ToolPose& pose : all->Take()) {
    ASSERT_EQ(pose.name, "ProbeToSkin");
    ASSERT_EQ(pose.status, TransformStatus::Valid);
    ASSERT_GT(pose.time, last);
    last = pose.time;
    if (pose.time < 5.0)
      continue;
    const Pose truth = Interpolate(s.At(std::floor(pose.time * 1000.0) / 1000.0).probeToWorld,
                                   s.At(std::ceil(pose.time * 1000.0) / 1000.0).probeToWorld, 0.5);
    degrees += std::pow(DegreesBetween(pose.pose, truth), 2);
    mm += (pose.pose.translation() - truth.translation()).squaredNorm();
    ++count;
  }
  ASSERT_GT(count, 55 * 85);
  RecordProperty("errors", Format("%.2f degrees %.2f mm", std::sqrt(degrees / count), std::sqrt(mm / count)));
  EXPECT_LT(std::sqrt(degrees / count), 8.0);
  EXPECT_LT(std::sqrt(mm / count), 0.6);
  // The same numbers, whatever the threads did.
  const auto byHand = filter.At(last);
  ASSERT_TRUE(byHand);
  EXPECT_LT(DegreesBetween(byHand->probeToWorld, poses.Latest("ProbeToSkin").pose), 1e-3);
  EXPECT_NEAR(fused->HeadingSigma(), filter.HeadingSigma(), 1e-6);
  EXPECT_EQ(fused->HeadingSigma() < 0.2, true);
}

TEST_F(FusedTrackerTest, WhoWasWaitedForInVainIsWaitedForOnceItTakesAgain)
{
  SequenceRecorder turns(Path("turns.igs.mha"));
  for (int i = 0; i < 20; ++i)
    Append(turns, 0.05 * i, Pose::Identity(), "ImuToLevel");
  turns.Finish();
  PoseStream poses;
  const auto reader = poses.Subscribe(100);
  const auto fused = Make("fused:|replay:" + Path("turns.igs.mha") + "?speed=50&loop=1|alignTo=1 0 0");
  fused->Start(poses, nullptr);
  ASSERT_TRUE(WaitUntil([&] { return reader->Lost() > 0; }, 60.0));
  reader->Take();
  const std::uint64_t lost = reader->Lost();
  EXPECT_TRUE(WaitUntil([&] { return poses.Backlog() > 0.5; }));
  EXPECT_FALSE(WaitUntil([&] { return reader->Lost() > lost; }, 0.5));
}

TEST_F(FusedTrackerTest, LiveItIsNotTrustedUntilItsHeadingIsSaid)
{
  PoseStream poses;
  const auto fused = Make(BothSimulated);
  EXPECT_THROW(fused->Align({1, 0, 0}, 3.0), Error); // nothing has come
  fused->Start(poses, nullptr);
  const auto latest = [&] { return poses.Latest("ProbeToTracker"); };
  ASSERT_TRUE(WaitUntil([&] { return latest().status == TransformStatus::OutOfRange; }));
  ASSERT_TRUE(WaitUntil([&] { return poses.State().second.find("heading is not known") != std::string::npos; }));
  EXPECT_NEAR(fused->HeadingSigma(), Pi, 1e-9);
  EXPECT_THROW(fused->Align({0, 0, 1}, 3.0), Error); // upright
  SimulatedTrackerParameters p;
  p.motion = SimulatedMotion::Sweep;
  fused->Align(SimulatedTruth(p, 0, latest().time).linear().col(0), 1.0);
  ASSERT_TRUE(WaitUntil([&] { return latest().status == TransformStatus::Valid; }));
  ASSERT_TRUE(WaitUntil([&] { return poses.State().second.find("known to 1 degrees") != std::string::npos; }));
  for (int n = 0; n < 20; ++n) {
    const double before = latest().time;
    ASSERT_TRUE(WaitUntil([&] { return latest().time > before; }));
    const ToolPose pose = latest();
    const Pose truth = SimulatedTruth(p, 0, pose.time);
    EXPECT_LT((pose.pose.translation() - truth.translation()).norm(), 1.5);
    EXPECT_LT(DegreesBetween(pose.pose, truth), 3.0);
  }
  EXPECT_THROW(fused->AlignBySlide(0.01, 5.0), Error); // less than 10 mm
  EXPECT_THROW(fused->AlignBySlide(30.0, 5.0), Error); // nobody remembers
  fused->Stop();
  EXPECT_EQ(poses.State().first, DeviceState::Idle);
}

TEST_F(FusedTrackerTest, ASlideAlongTheArraySaysTheHeading)
{
  PoseStream poses;
  const auto fused = Make(BothSimulated);
  fused->Start(poses, nullptr);
  const auto latest = [&] { return poses.Latest("ProbeToTracker"); };
  // The sweep goes to and fro in 5 s: by 20 mm in the middle of the way to, and back half a round later.
  const auto waitForRound = [&](double part) {
    return WaitUntil([&] {
      const double at = latest().time / 5.0 - part;
      return at - std::floor(at) < 0.04;
    });
  };
  SimulatedTrackerParameters p;
  p.motion = SimulatedMotion::Sweep;
  const auto off = [&] {
    const ToolPose pose = latest();
    return DegreesBetween(pose.pose, SimulatedTruth(p, 0, pose.time));
  };
  ASSERT_TRUE(WaitUntil([&] { return !poses.Tools().empty(); }));
  const double begun = latest().time;
  ASSERT_TRUE(WaitUntil([&] { return latest().time > begun + 0.5; }));
  ASSERT_TRUE(waitForRound(0.02));
  fused->AlignBySlide(0.4, 5.0);
  ASSERT_TRUE(WaitUntil([&] { return latest().status == TransformStatus::Valid; }));
  EXPECT_LT(off(), 6.0);
  EXPECT_NEAR(fused->HeadingSigma() * DegreesPerRadian, 5.0, 0.5);
}

TEST_F(FusedTrackerTest, WhatStopsIsNamedWithTheSeconds)
{
  for (const bool imu : {true, false}) {
    const std::string lasting = "simulated:?rate=100", stopping = "simulated:?rate=100&unplugAfter=0.5";
    PoseStream poses;
    const auto fused = Make("fused:" + (imu ? lasting + "|" + stopping : stopping + "|" + lasting) + "|alignTo=1 0 0");
    fused->Start(poses, nullptr);
    const auto says = [&](const std::string& text) { return poses.State().second.find(text) != std::string::npos; };
    ASSERT_TRUE(WaitUntil([&] { return poses.State().first == DeviceState::Lost && SilentSeconds(poses.State().second) > 1.0; }))
        << poses.State().second;
    EXPECT_TRUE(says(imu ? "the orientation: simulated: unplugged" : "the position: simulated: unplugged"))
        << poses.State().second;
    EXPECT_LT(SilentSeconds(poses.State().second), ClockNow() - poses.Latest("ProbeToTracker").arrival + 1.0);
    EXPECT_GT(ClockNow() - poses.Latest("ProbeToTracker").arrival, 0.5); // nothing old comes as if it were new
  }
  // A tool that is not seen any more is as silent as a line that is cut.
  PoseStream poses;
  const auto hidden = Make("fused:simulated:?dropout=1|simulated:|alignTo=1 0 0");
  hidden->Start(poses, nullptr);
  EXPECT_TRUE(WaitUntil([&] { return SilentSeconds(poses.State().second) > 0.7; })) << poses.State().second;
  EXPECT_EQ(poses.State().second.find("the position: silent"), 0u) << poses.State().second;
  EXPECT_EQ(poses.State().first, DeviceState::Running);
  EXPECT_TRUE(poses.Tools().empty());
}

TEST_F(FusedTrackerTest, AnImuAloneTurnsAProbeWhosePlaceIsTold)
{
  PoseStream poses;
  const auto fused = Make("fused:|simulated:?rate=200&tools=1|alignTo=1 0 0");
  fused->SetPlace({10, 20, 30}, std::nullopt);
  EXPECT_THROW(fused->SetPlace({std::nan(""), 0, 0}, std::nullopt), Error);
  EXPECT_THROW(fused->SetPlace({0, 0, 0}, Vector3d(0, 0, 0)), Error);
  fused->Start(poses, nullptr);
  const auto latest = [&] { return poses.Latest("ProbeToTracker"); };
  ASSERT_TRUE(WaitUntil([&] { return latest().status == TransformStatus::Valid; }));
  EXPECT_EQ(latest().pose.translation(), Vector3d(10, 20, 30));
  // Its tilt is that of the IMU: where up is, as the probe sees it.
  const ToolPose pose = latest();
  const Pose truth = SimulatedTruth({}, 0, pose.time);
  EXPECT_LT((pose.pose.linear().row(2) - truth.linear().row(2)).norm(), 1e-6);
  fused->SetPlace({-1, 0, 0}, Vector3d(0, 0, 1));
  EXPECT_TRUE(WaitUntil([&] { return latest().pose.translation() == Vector3d(-1, 0, 0); }));
}

TEST_F(FusedTrackerTest, NormalsOfTheProgramCorrectTheHeading)
{
  // Neither moves; the program tells the normal at that place.
  PoseStream poses;
  const Pose truth = [] {
    SimulatedTrackerParameters p;
    p.motion = SimulatedMotion::Still;
    return SimulatedTruth(p, 0, 0.0);
  }();
  const Vector3d wanted = Vector3d(1, 0.1, 0.3).normalized();
  const auto fused =
      Make("fused:simulated:?tools=1&rate=100&motion=still|simulated:?tools=1&rate=100&motion=still|"
           "mounting=90 0 0&up=0 1 0&alignDegrees=20&alignTo=1 0 0&heldSeconds=0.01&heldDegrees=2"); // ends before these
  fused->SetNormals([&](const Vector3d& place) -> std::optional<Vector3d> {
    if ((place - truth.translation()).norm() > 1e-6)
      return std::nullopt;
    return wanted;
  });
  fused->Start(poses, nullptr);
  const auto lying = [](const Vector3d& v) { return Vector3d(v[0], 0, v[2]).normalized(); };
  const auto latest = [&]() -> Vector3d { return poses.Latest("ProbeToTracker").pose.linear().col(2); };
  // Seen along "up", the probe's axis comes to point against the normal, wherever the array was said to point at first.
  ASSERT_TRUE(WaitUntil([&] { return poses.Tools().size() == 1; }));
  EXPECT_TRUE(WaitUntil([&] { return lying(latest()).dot(-lying(wanted)) > 0.99; }, 5.0)) << latest();
}

TEST_F(FusedTrackerTest, ClocksThatDoNotAgreeAreNamed)
{
  const std::string lines = "fused:simulated:?start=0|simulated:";
  {
    PoseStream poses;
    const auto fused = Make(lines);
    fused->Start(poses, nullptr);
    EXPECT_TRUE(WaitUntil([&] { return poses.State().second.find("clock=arrival") != std::string::npos; }))
        << poses.State().second;
    EXPECT_TRUE(poses.Tools().empty());
  }
  PoseStream poses;
  const auto fused = Make(lines + "|clock=arrival&alignTo=1 0 0");
  fused->Start(poses, nullptr);
  EXPECT_TRUE(WaitUntil([&] { return poses.Latest("ProbeToTracker").status == TransformStatus::Valid; }));
  EXPECT_NEAR(poses.Latest("ProbeToTracker").time, ClockNow(), 5.0);
}

TEST_F(FusedTrackerTest, TheToolsThatCountCanBeNamed)
{
  PoseStream poses;
  const auto fused = Make("fused:simulated:?tools=3|simulated:?tools=3|positionTool=StylusToTracker&orientationTool=Reference");
  fused->Start(poses, nullptr);
  ASSERT_TRUE(WaitUntil([&] { return poses.Tools().size() == 1; }));
  EXPECT_EQ(poses.Tools().front(), "StylusToTracker");
  const ToolPose pose = poses.Latest("StylusToTracker");
  EXPECT_LT((pose.pose.translation() - SimulatedTruth({}, 2, pose.time).translation()).norm(), 1.0);
  EXPECT_LT((pose.pose.linear().row(2) - SimulatedTruth({}, 1, pose.time).linear().row(2)).norm(), 0.01);
}

TEST_F(FusedTrackerTest, LinesThatAreNoneAreRefusedByName)
{
  const auto reason = [](const std::string& line) -> std::string {
    try {
      PoseStream poses;
      MakeTracker(line)->Start(poses, nullptr);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(reason("fused:simulated:").find("fused:POSITION-LINE|ORIENTATION-LINE"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|").find("no line of an orientation"), std::string::npos);
  EXPECT_NE(reason("fused:nowhere|simulated:").find("nowhere: a tracker is named as SCHEME:PLACE"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|simulated:|imuDelays=1").find("there is no option imuDelays"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|simulated:|imuDelay=11").find("ImuDelay"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|simulated:|up=0 0 0").find("Up has no length"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|simulated:?rates=3").find("there is no option rates"), std::string::npos);
  EXPECT_NE(reason("fused:simulated:|replay:" + Path("nowhere.igs.mha")).find("nowhere.igs.mha"), std::string::npos);
  // A file with a bar in its name is none of two lines.
  EXPECT_NE(reason("replay:" + Path("a|b|c.igs.mha")).find("a|b|c.igs.mha"), std::string::npos);
}
