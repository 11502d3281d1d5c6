// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/SimulatedTracker.h"
#include "Tracking/Stream/Clock.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr double Degrees = DegreesPerRadian;

double Distance(const Pose& a, const Pose& b)
{
  return (a.translation() - b.translation()).norm();
}

double Turn(const Pose& a, const Pose& b)
{
  return Degrees * RotationAngle(a.inverse() * b);
}

void ExpectSame(const Pose& a, const Pose& b)
{
  EXPECT_LT(Distance(a, b), 1e-9);
  EXPECT_LT(Turn(a, b), 1e-5);
}

SimulatedTrackerParameters Parameters(const std::string& options)
{
  return SimulatedTrackerParameters::Of(TrackerAddress::Parse("simulated:?" + options));
}

// Waits until there are so many poses, or the device is not running any more.
void WaitFor(const PoseStream& stream, std::uint64_t count)
{
  const double begun = ClockNow();
  for (std::uint64_t version = 0; ClockNow() - begun < 60.0;) {
    version = stream.WaitBeyond(version, 1.0);
    const StreamStatistics statistics = stream.Statistics();
    std::uint64_t taken = 0;
    for (const ToolStatistics& tool : statistics.tools)
      taken += tool.valid + tool.missing + tool.outOfRange;
    if (taken >= count || statistics.state != DeviceState::Running)
      return;
  }
}

} // namespace

TEST(SimulatedTracker, WithoutFaultsItTellsTheTruth)
{
  for (const std::string& motion : SimulatedMotionNames()) {
    const auto p = Parameters("motion=" + motion + "&rate=50&tools=5");
    for (int tool = 0; tool < p.tools; ++tool)
      for (const std::uint64_t sample : {std::uint64_t{0}, std::uint64_t{123}, std::uint64_t{85000000000}}) {
        const ToolPose pose = SimulatedMeasurement(p, tool, sample);
        EXPECT_EQ(pose.name, SimulatedToolName(tool));
        EXPECT_EQ(pose.time, static_cast<double>(sample) / 50.0);
        EXPECT_EQ(pose.arrival, pose.time);
        EXPECT_EQ(pose.status, TransformStatus::Valid);
        EXPECT_TRUE(IsRotation(pose.pose.linear(), 1e-12));
        ExpectSame(pose.pose, SimulatedTruth(p, tool, pose.time));
      }
  }
}

TEST(SimulatedTracker, MotionIsSmooth)
{
  for (const std::string& motion : SimulatedMotionNames()) {
    const auto p = Parameters("motion=" + motion + "&tools=3");
    for (int tool = 0; tool < 3; ++tool) {
      double way = 0.0;
      Pose a = SimulatedTruth(p, tool, 0.0);
      for (int i = 0; i < 3000; ++i) { // half a minute: also where waves begin anew
        const Pose b = SimulatedTruth(p, tool, 0.01 * (i + 1));
        EXPECT_LT(Distance(a, b), 2.0) << motion << " " << i;
        EXPECT_LT(Turn(a, b), 2.0) << motion << " " << i;
        way += Distance(a, b) + Turn(a, b);
        a = b;
      }
      EXPECT_EQ(way > 1.0, motion != "still") << motion << " " << tool << " " << way;
    }
  }
}

TEST(SimulatedTracker, PivotKeepsItsTip)
{
  const auto p = Parameters("motion=pivot");
  const Eigen::Vector3d tip = SimulatedTruth(p, 0, 0.0) * SimulatedPivotTip();
  double turned = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Pose truth = SimulatedTruth(p, 0, 0.1 * i);
    EXPECT_LT((truth * SimulatedPivotTip() - tip).norm(), 1e-9);
    turned = std::max(turned, Turn(truth, SimulatedTruth(p, 0, 0.0)));
  }
  EXPECT_GT(turned, 30.0);
}

TEST(SimulatedTracker, NoiseIsWhatWasAskedFor)
{
  const auto p = Parameters("motion=still&noiseMm=0.7&noiseDegrees=0.25&seed=5");
  constexpr int Count = 8000;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = mean, turns = mean;
  double product = 0.0;
  for (int i = 0; i < Count; ++i) {
    const ToolPose pose = SimulatedMeasurement(p, 0, static_cast<std::uint64_t>(i));
    const Pose truth = SimulatedTruth(p, 0, pose.time);
    const Eigen::Vector3d off = pose.pose.translation() - truth.translation();
    const Eigen::Vector3d turn = Degrees * LogRotation(truth.linear().transpose() * pose.pose.linear());
    mean += off;
    squares += off.cwiseProduct(off);
    turns += turn.cwiseProduct(turn);
    const ToolPose other = SimulatedMeasurement(p, 1, static_cast<std::uint64_t>(i));
    product += off.x() * (other.pose.translation() - SimulatedTruth(p, 1, other.time).translation()).x();
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(mean[axis] / Count, 0.0, 4.0 * 0.7 / std::sqrt(Count));
    EXPECT_NEAR(std::sqrt(squares[axis] / Count), 0.7, 4.0 * 0.7 / std::sqrt(2.0 * Count));
    EXPECT_NEAR(std::sqrt(turns[axis] / Count), 0.25, 4.0 * 0.25 / std::sqrt(2.0 * Count));
  }
  EXPECT_NEAR(product / Count, 0.0, 4.0 * 0.49 / std::sqrt(Count)); // tools do not share their noise
}

TEST(SimulatedTracker, SameSeedSamePoses)
{
  const auto a = Parameters("noiseMm=1&dropout=0.2&seed=7"), b = Parameters("noiseMm=1&dropout=0.2&seed=8");
  int differ = 0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const ToolPose one = SimulatedMeasurement(a, 0, i), again = SimulatedMeasurement(a, 0, i);
    EXPECT_EQ(one.status, again.status);
    EXPECT_EQ(Distance(one.pose, again.pose), 0.0);
    differ += Distance(one.pose, SimulatedMeasurement(b, 0, i).pose) > 0.0 ? 1 : 0;
  }
  EXPECT_GT(differ, 50);
}

TEST(SimulatedTracker, DropoutsAndLatency)
{
  const auto p = Parameters("dropout=0.25&latencyMs=20&jitterMs=5");
  constexpr int Count = 8000;
  int missing = 0;
  double late = 0.0;
  for (int i = 0; i < Count; ++i) {
    const ToolPose pose = SimulatedMeasurement(p, 0, static_cast<std::uint64_t>(i));
    missing += pose.status == TransformStatus::Missing ? 1 : 0;
    EXPECT_GE(pose.arrival - pose.time, 0.02 - 1e-9);
    late += pose.arrival - pose.time;
  }
  EXPECT_NEAR(static_cast<double>(missing) / Count, 0.25, 4.0 * std::sqrt(0.25 * 0.75 / Count));
  EXPECT_NEAR(late / Count, 0.025, 4.0 * 0.005 / std::sqrt(Count));
}

TEST(SimulatedTracker, DistortionIsThatOfOneField)
{
  const auto p = Parameters("distortionMm=3");
  const auto seen = [&p](const Eigen::Vector3d& x) {
    Pose pose = Pose::Identity();
    pose.translation() = x;
    return SimulatedDistortion(p, pose);
  };
  EXPECT_NEAR((seen({300.0, 0.0, 0.0}).translation() - Eigen::Vector3d(300.0, 0.0, 0.0)).norm(), 3.0, 1e-9);
  EXPECT_NEAR((seen({0.0, 600.0, 0.0}).translation() - Eigen::Vector3d(0.0, 600.0, 0.0)).norm(), 12.0, 1e-9);
  EXPECT_LT(seen({0.0, 0.0, 0.0}).translation().norm(), 1e-12);
  // Turned by half the curl of the displacement, here by differences.
  const Eigen::Vector3d x(120.0, -80.0, 200.0);
  Eigen::Matrix3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = 0.01 * Eigen::Vector3d::Unit(axis);
    slope.col(axis) = (seen(x + step).translation() - seen(x - step).translation()) / 0.02;
  }
  const Eigen::Vector3d curl(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1));
  EXPECT_LT((LogRotation(seen(x).linear()) - 0.5 * curl).norm(), 1e-8);
  EXPECT_GT(curl.norm(), 1e-3);
  // And it is in what is measured.
  const auto bent = Parameters("motion=still&distortionMm=3");
  const ToolPose measured = SimulatedMeasurement(bent, 0, 5);
  const Pose truth = SimulatedTruth(bent, 0, measured.time);
  EXPECT_TRUE(measured.pose.isApprox(SimulatedDistortion(bent, truth), 1e-12));
  EXPECT_GT((measured.pose.translation() - truth.translation()).norm(), 0.01);
}

TEST(SimulatedTracker, BeyondItsRange)
{
  const auto near = Parameters("rangeMm=100"), far = Parameters("rangeMm=1000"), none = Parameters("rangeMm=0");
  EXPECT_EQ(SimulatedMeasurement(near, 0, 5).status, TransformStatus::OutOfRange);
  EXPECT_EQ(SimulatedMeasurement(far, 0, 5).status, TransformStatus::Valid);
  EXPECT_EQ(SimulatedMeasurement(none, 0, 5).status, TransformStatus::Valid);
}

TEST(SimulatedTracker, SendsWhatItMeasures)
{
  PoseStream stream;
  const auto device = MakeTracker("simulated:?rate=500&tools=3&noiseMm=0.5&dropout=0.1&start=1000");
  const auto p = Parameters("rate=500&tools=3&noiseMm=0.5&dropout=0.1&start=1000");
  device->Start(stream, nullptr);
  WaitFor(stream, 300);
  device->Stop();
  device->Stop();
  EXPECT_EQ(stream.Tools(), (std::vector<std::string>{"ProbeToTracker", "ReferenceToTracker", "StylusToTracker"}));
  for (int tool = 0; tool < 3; ++tool) {
    const std::vector<ToolPose> history = stream.History(SimulatedToolName(tool));
    ASSERT_GE(history.size(), 90u);
    for (std::size_t i = 0; i < history.size(); ++i) { // every one, from the first
      const ToolPose expected = SimulatedMeasurement(p, tool, 500000 + i);
      EXPECT_EQ(history[i].time, expected.time);
      EXPECT_EQ(history[i].status, expected.status);
      if (history[i].status == TransformStatus::Valid)
        ExpectSame(history[i].pose, expected.pose);
    }
  }
  EXPECT_EQ(stream.Statistics().Rejected(), 0u);
  const std::uint64_t version = stream.Version();
  EXPECT_EQ(stream.WaitBeyond(version, 0.05), version); // it is quiet now
}

TEST(SimulatedTracker, Unplugged)
{
  PoseStream stream;
  SimulatedTracker device(Parameters("rate=1000&tools=1&unplugAfter=0.1&start=0"));
  device.Start(stream, nullptr);
  for (int i = 0; i < 600 && stream.Statistics().state == DeviceState::Running; ++i)
    stream.WaitBeyond(stream.Version(), 0.1);
  const StreamStatistics statistics = stream.Statistics();
  EXPECT_EQ(statistics.state, DeviceState::Lost);
  EXPECT_NE(statistics.message.find("unplugged"), std::string::npos);
  EXPECT_EQ(statistics.tools[0].valid, 100u);
  device.Stop();
  EXPECT_EQ(stream.State().first, DeviceState::Idle);
  SimulatedTracker other(Parameters("rate=1000"));
  for (int i = 0; i < 2; ++i) {
    other.Start(stream, nullptr);
    EXPECT_EQ(stream.State().first, DeviceState::Running);
  }
  other.Stop();
  EXPECT_EQ(stream.State().first, DeviceState::Idle);
}

TEST(SimulatedTracker, BadAddresses)
{
  for (const char* options : {"rate=0", "rate=nan", "rate=", "tools=0", "tools=1.5", "tools=65", "motion=wild", "dropout=1.1",
                              "noiseMm=-1", "seed=-1", "seed=0.5", "colour=red", "rate=5&rate=6", "rate"})
    EXPECT_THROW(MakeTracker(std::string("simulated:?") + options), Error) << options;
  EXPECT_THROW(MakeTracker("simulated:place"), Error);
  EXPECT_NO_THROW(MakeTracker("simulated:"));
  EXPECT_EQ(Parameters("noise-mm=0.5").noiseMm, 0.5); // as the command line spells names
  SimulatedTrackerParameters p;
  p.noiseDegrees = std::nan("");
  EXPECT_THROW(SimulatedTracker{p}, Error);
}
