// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Base/Worker.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/PoseStream.h"
#include <atomic>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double Infinity = std::numeric_limits<double>::infinity();

// Of a tool that goes along x by 10 mm per second.
ToolPose Along(double time, double arrival, const std::string& name = "ProbeToTracker")
{
  ToolPose pose{name, time, arrival, Pose::Identity(), TransformStatus::Valid};
  pose.pose.translation().x() = 10.0 * time;
  return pose;
}

ToolPose Along(double time)
{
  return Along(time, time);
}

ToolStatistics StatisticsOf(const PoseStream& stream)
{
  const StreamStatistics statistics = stream.Statistics();
  EXPECT_EQ(statistics.tools.size(), 1u);
  return statistics.tools.empty() ? ToolStatistics() : statistics.tools[0];
}

} // namespace

TEST(PoseStream, LatestAndHistory)
{
  PoseStream stream;
  EXPECT_EQ(stream.Latest("ProbeToTracker").status, TransformStatus::Missing);
  EXPECT_TRUE(std::isnan(stream.Latest("ProbeToTracker").time));
  EXPECT_TRUE(stream.Tools().empty());
  stream.Add(Along(1.0));
  stream.Add(Along(1.1));
  EXPECT_EQ(stream.Latest("ProbeToTracker").time, 1.1);
  EXPECT_EQ(stream.Latest("ProbeToTracker").name, "ProbeToTracker");
  EXPECT_EQ(stream.History("ProbeToTracker").size(), 2u);
  EXPECT_TRUE(stream.History("Nobody").empty());
  EXPECT_EQ(stream.Tools(), std::vector<std::string>{"ProbeToTracker"});
}

TEST(PoseStream, InterpolatesWithinGapsOnly)
{
  PoseStream stream;
  ToolPose turned = Along(0.2);
  turned.pose.linear() = ExpRotation({0.0, 0.0, 0.4});
  stream.Add(Along(0.0));
  stream.Add(turned);
  stream.Add(Along(1.0));
  const ToolPose between = stream.At("ProbeToTracker", 0.05);
  EXPECT_EQ(between.status, TransformStatus::Valid);
  EXPECT_EQ(between.time, 0.05);
  EXPECT_NEAR(between.pose.translation().x(), 0.5, 1e-12);
  EXPECT_NEAR(RotationAngle(between.pose), 0.1, 1e-12);
  EXPECT_EQ(stream.At("ProbeToTracker", 0.2).status, TransformStatus::Valid);
  EXPECT_EQ(stream.At("ProbeToTracker", 0.2).pose.translation().x(), 2.0);
  for (const double time : {-1.0, 0.5, 1.0 + 1e-9, NaN, Infinity, -Infinity}) {
    EXPECT_EQ(stream.At("ProbeToTracker", time).status, TransformStatus::Missing) << time;
    EXPECT_TRUE(stream.At("ProbeToTracker", time).pose.matrix().isIdentity()) << time;
  }
  EXPECT_EQ(stream.At("Nobody", 0.1).status, TransformStatus::Missing);
}

TEST(PoseStream, StatusOfNeighbours)
{
  PoseStream stream;
  const TransformStatus statuses[] = {TransformStatus::Valid, TransformStatus::OutOfRange, TransformStatus::Missing,
                                      TransformStatus::Valid};
  for (int i = 0; i < 4; ++i) {
    ToolPose pose = Along(0.1 * i);
    pose.status = statuses[i];
    stream.Add(pose);
  }
  EXPECT_EQ(stream.At("ProbeToTracker", 0.05).status, TransformStatus::OutOfRange);
  EXPECT_NEAR(stream.At("ProbeToTracker", 0.05).pose.translation().x(), 0.5, 1e-12);
  EXPECT_EQ(stream.At("ProbeToTracker", 0.15).status, TransformStatus::Missing);
  EXPECT_EQ(stream.At("ProbeToTracker", 0.25).status, TransformStatus::Missing);
  EXPECT_EQ(stream.At("ProbeToTracker", 0.2).status, TransformStatus::Missing);
  const ToolStatistics statistics = StatisticsOf(stream);
  EXPECT_EQ(statistics.valid, 2u);
  EXPECT_EQ(statistics.outOfRange, 1u);
  EXPECT_EQ(statistics.missing, 1u);
  EXPECT_DOUBLE_EQ(statistics.DropoutShare(), 0.5);
}

TEST(PoseStream, WhatIsNoPoseIsMissing)
{
  PoseStream stream;
  const double bad[] = {NaN, Infinity, 3.0};
  double time = 0.0;
  for (const double value : bad) {
    ToolPose pose = Along(time += 0.1);
    pose.pose.matrix()(0, 0) = value;
    stream.Add(pose);
    EXPECT_EQ(stream.Latest("ProbeToTracker").time, time);
    EXPECT_EQ(stream.Latest("ProbeToTracker").status, TransformStatus::Missing);
    EXPECT_TRUE(stream.Latest("ProbeToTracker").pose.matrix().isIdentity());
  }
  ToolPose mirror = Along(time += 0.1);
  mirror.pose.linear()(2, 2) = -1.0;
  stream.Add(mirror);
  EXPECT_EQ(stream.Statistics().Rejected(Rejection::NotRigid), 4u);
  EXPECT_EQ(StatisticsOf(stream).missing, 4u);
  // Single precision is no fault, and is made rigid.
  ToolPose single = Along(time += 0.1);
  single.pose.linear() = ExpRotation({0.3, -0.2, 0.9}).cast<float>().cast<double>();
  stream.Add(single);
  EXPECT_EQ(stream.Latest("ProbeToTracker").status, TransformStatus::Valid);
  EXPECT_TRUE(IsRotation(stream.Latest("ProbeToTracker").pose.linear(), 1e-14));
  // What is missing anyway may hold anything.
  ToolPose missing = Along(time += 0.1);
  missing.pose.matrix().setConstant(NaN);
  missing.status = TransformStatus::Missing;
  stream.Add(missing);
  EXPECT_EQ(stream.Statistics().Rejected(Rejection::NotRigid), 4u);
  EXPECT_TRUE(stream.Latest("ProbeToTracker").pose.matrix().isIdentity());
}

TEST(PoseStream, DuplicatesAndLateOnes)
{
  PoseStream stream;
  stream.Add(Along(10.0));
  stream.Add(Along(10.0, 10.01));
  stream.Add(Along(10.1));
  stream.Add(Along(10.05, 10.11));
  stream.Add(Along(10.2));
  const StreamStatistics statistics = stream.Statistics();
  EXPECT_EQ(statistics.Rejected(Rejection::Duplicate), 1u);
  EXPECT_EQ(statistics.Rejected(Rejection::OutOfOrder), 1u);
  EXPECT_EQ(statistics.Rejected(), 2u);
  EXPECT_NE(statistics.lastRejection.find("ProbeToTracker"), std::string::npos);
  EXPECT_EQ(statistics.tools[0].valid, 3u);
  EXPECT_EQ(statistics.tools[0].clockJumps, 0u);
}

TEST(PoseStream, ClockThatJumps)
{
  for (const double jump : {100.0, -100.0, 1.5, -1.5}) {
    PoseStream stream;
    for (int i = 0; i < 100; ++i)
      stream.Add(Along(0.01 * i + (i < 50 ? 0.0 : jump), 0.01 * i));
    const ToolStatistics statistics = StatisticsOf(stream);
    EXPECT_EQ(statistics.clockJumps, 1u) << jump;
    EXPECT_EQ(statistics.valid, 100u) << jump;
    EXPECT_EQ(stream.History("ProbeToTracker").size(), 50u) << jump; // nothing is interpolated across
    EXPECT_EQ(stream.At("ProbeToTracker", 0.3).status, TransformStatus::Missing) << jump;
    EXPECT_EQ(stream.At("ProbeToTracker", jump + 0.755).status, TransformStatus::Valid) << jump;
    EXPECT_EQ(stream.Statistics().Rejected(), 0u) << jump;
    EXPECT_NEAR(statistics.medianLatencySeconds, -jump, 1e-9);
  }
}

TEST(PoseStream, ClockThatJumpsByLittleBackIsOutOfOrder)
{
  PoseStream stream;
  for (int i = 0; i < 200; ++i)
    stream.Add(Along(0.01 * i - (i < 50 ? 0.0 : 0.3), 0.01 * i));
  EXPECT_EQ(StatisticsOf(stream).clockJumps, 0u);
  EXPECT_NEAR(static_cast<double>(stream.Statistics().Rejected()), 30.0, 1.0); // until the clock is where it was
  const std::vector<ToolPose> history = stream.History("ProbeToTracker");
  for (std::size_t i = 1; i < history.size(); ++i)
    EXPECT_LT(history[i - 1].time, history[i].time);
}

TEST(PoseStream, HeldUpPosesAreNoJump)
{
  // The network stands still for 5 s; what was sent meanwhile arrives at once.
  PoseStream stream;
  for (int i = 0; i < 1000; ++i) {
    const double time = 0.01 * i;
    stream.Add(Along(time, time < 2.0 || time > 7.0 ? time + 0.002 : 7.0 + 1e-6 * i));
  }
  EXPECT_EQ(StatisticsOf(stream).clockJumps, 0u);
  EXPECT_EQ(stream.History("ProbeToTracker").size(), 1000u);
  // And when only the newest were kept.
  PoseStream other;
  for (int i = 0; i < 1000; ++i) {
    const double time = 0.01 * i;
    if (time < 2.0 || time > 7.0)
      other.Add(Along(time, time + 0.002));
    else if (time < 2.5)
      other.Add(Along(time, 7.0 + 1e-6 * i));
  }
  EXPECT_EQ(StatisticsOf(other).clockJumps, 0u);
}

TEST(PoseStream, ClockThatDriftsDoesNotJump)
{
  for (const double rate : {1.0 + 2e-4, 1.0 - 2e-4}) {
    PoseStream stream;
    for (int i = 0; i < 40000; ++i) // more than five hours
      stream.Add(Along(rate * 0.5 * i, 0.5 * i));
    EXPECT_EQ(StatisticsOf(stream).clockJumps, 0u) << rate;
    stream.Add(Along(rate * 20000.0 + 5.0, 20000.0));
    EXPECT_EQ(StatisticsOf(stream).clockJumps, 1u) << rate;
  }
}

TEST(PoseStream, RecordingsMayRunAtAnySpeed)
{
  PoseStream stream;
  stream.SetLive(false);
  EXPECT_FALSE(stream.Live());
  for (int i = 0; i < 100; ++i)
    stream.Add(Along(10.0 * i, 1e-3 * i));
  const ToolStatistics statistics = StatisticsOf(stream);
  EXPECT_EQ(statistics.clockJumps, 0u);
  EXPECT_NEAR(statistics.rateHz, 0.1, 1e-12); // the recording's
  EXPECT_TRUE(std::isnan(statistics.medianLatencySeconds));
  stream.Add(Along(0.0, 1.0));
  EXPECT_EQ(StatisticsOf(stream).clockJumps, 1u);
}

TEST(PoseStream, WithoutTimesArrivalStandsForThem)
{
  PoseStream stream;
  stream.Add(Along(1.0, NaN));
  const ToolPose first = stream.Latest("ProbeToTracker");
  EXPECT_EQ(first.time, 1.0);
  EXPECT_NEAR(first.arrival, ClockNow(), 10.0);
  PoseStream silent;
  ToolPose pose = Along(0.0);
  pose.time = NaN;
  for (int i = 0; i < 1000; ++i) { // all within one tick
    pose.arrival = 1.7e9;
    silent.Add(pose);
  }
  EXPECT_EQ(StatisticsOf(silent).valid, 1000u);
  EXPECT_EQ(silent.Statistics().Rejected(), 0u);
  EXPECT_NEAR(silent.Latest("ProbeToTracker").time, 1.7e9, 1e-3);
  // How late such poses are was never measured, and those that have times are not mixed with them.
  EXPECT_TRUE(std::isnan(StatisticsOf(silent).medianLatencySeconds));
  EXPECT_TRUE(std::isnan(StatisticsOf(silent).latencySpreadSeconds));
  silent.Add(Along(1.7e9 + 0.1, 1.7e9 + 0.13));
  EXPECT_NEAR(StatisticsOf(silent).medianLatencySeconds, 0.03, 1e-6);
}

TEST(PoseStream, State)
{
  PoseStream stream;
  EXPECT_EQ(stream.State(), std::make_pair(DeviceState::Idle, std::string()));
  stream.SetState(DeviceState::Lost, "gone");
  EXPECT_EQ(stream.State(), std::make_pair(DeviceState::Lost, std::string("gone")));
}

TEST(PoseStream, Statistics)
{
  // 100 Hz, 20 ms late by the clocks, up to 4 ms more; every fifth pose is missing; ten are lost in the middle.
  PoseStream stream;
  Random random(3);
  std::vector<double> arrivals, latencies;
  for (int i = 0; i < 1000; ++i) {
    if (i >= 500 && i < 510)
      continue;
    const double latency = 0.02 + random.Uniform(0.0, 0.004);
    ToolPose pose = Along(0.01 * i, 0.01 * i + latency);
    pose.status = i % 5 == 0 ? TransformStatus::Missing : TransformStatus::Valid;
    stream.Add(pose);
    arrivals.push_back(pose.arrival);
    latencies.push_back(latency);
  }
  const ToolStatistics statistics = StatisticsOf(stream);
  EXPECT_EQ(statistics.remembered, 990u);
  EXPECT_EQ(statistics.gaps, 1u);
  EXPECT_NEAR(statistics.longestGapSeconds, 0.11, 1e-9);
  EXPECT_NEAR(statistics.rateHz, 989.0 / (arrivals.back() - arrivals.front()), 1e-9);
  EXPECT_NEAR(statistics.DropoutShare(), 0.2, 1e-9);
  double squares = 0.0;
  const double mean = (arrivals.back() - arrivals.front()) / 989.0;
  for (std::size_t i = 1; i < arrivals.size(); ++i)
    squares += std::pow(arrivals[i] - arrivals[i - 1] - mean, 2.0);
  EXPECT_NEAR(statistics.jitterSeconds, std::sqrt(squares / 989.0), 1e-12);
  std::sort(latencies.begin(), latencies.end());
  EXPECT_NEAR(statistics.medianLatencySeconds, latencies[495], 1e-9);
  EXPECT_NEAR(statistics.latencySpreadSeconds, latencies[989 * 95 / 100] - latencies[0], 1e-9);
}

TEST(PoseStream, StatisticsOfFew)
{
  PoseStream stream;
  EXPECT_TRUE(stream.Statistics().tools.empty());
  stream.Add(Along(1.0));
  const ToolStatistics one = StatisticsOf(stream);
  EXPECT_EQ(one.rateHz, 0.0);
  EXPECT_EQ(one.remembered, 1u);
  EXPECT_EQ(ToolStatistics().DropoutShare(), 0.0);
}

TEST(PoseStream, MemoryIsBounded)
{
  StreamLimits limits;
  limits.posesPerTool = 100;
  limits.tools = 3;
  PoseStream stream(limits);
  const auto subscription = stream.Subscribe(50);
  for (int i = 0; i < 20000; ++i)
    stream.Add(Along(0.01 * i, 0.01 * i, "Tool" + std::to_string(i % 5) + "ToTracker"));
  EXPECT_EQ(stream.Tools().size(), 3u);
  EXPECT_EQ(stream.Statistics().Rejected(Rejection::TooManyTools), 8000u);
  for (int tool = 0; tool < 3; ++tool) {
    const std::vector<ToolPose> history = stream.History("Tool" + std::to_string(tool) + "ToTracker");
    ASSERT_EQ(history.size(), 100u);
    for (std::size_t i = 0; i < 100; ++i)
      EXPECT_NEAR(history[i].time, 0.01 * (19900 - 400 + tool + 5 * static_cast<int>(i)), 1e-9);
    const double middle = history[40].time + 0.01;
    EXPECT_NEAR(stream.At(history[0].name, middle).pose.translation().x(), 10.0 * middle, 1e-6);
  }
  EXPECT_EQ(subscription->Take().size(), 50u);
  EXPECT_EQ(subscription->Lost(), 12000u - 50u);
  stream.Add(Along(1.0, 1.0, std::string(1000000, 'A') + "ToTracker"));
  stream.Add(Along(1.0, 1.0, ""));
  stream.Reject(Rejection::Malformed, std::string(1000000, 'A'));
  EXPECT_EQ(stream.Statistics().Rejected(Rejection::Malformed), 3u);
  EXPECT_LT(stream.Statistics().lastRejection.size(), 1000u);
}

TEST(PoseStream, WaitsForPosesOfAllTools)
{
  PoseStream stream;
  EXPECT_TRUE(stream.WaitForPoses(0, 0.0));
  EXPECT_FALSE(stream.WaitForPoses(1, 0.0));
  Worker worker;
  worker.Start([&stream](const Worker::Signal&) {
    stream.Add(Along(1.0, 1.0, "ProbeToTracker"));
    stream.Add(Along(1.0, 1.0, "StylusToTracker"));
  });
  EXPECT_TRUE(stream.WaitForPoses(2, 60.0));
  const StreamStatistics statistics = stream.Statistics();
  ASSERT_NE(statistics.Find("Stylus"), nullptr);
  EXPECT_EQ(statistics.Find("Stylus"), statistics.Find("StylusToTracker"));
  EXPECT_EQ(statistics.Find("Stylus")->Taken(), 1u);
  EXPECT_EQ(statistics.Find("Needle"), nullptr);
  stream.SetState(DeviceState::Ended);
  EXPECT_FALSE(stream.WaitForPoses(3, 3600.0)); // nothing will come any more
}

TEST(PoseStream, Limits)
{
  StreamLimits limits;
  limits.posesPerTool = 1;
  EXPECT_THROW(PoseStream{limits}, Error);
  limits = {};
  limits.longestGapSeconds = NaN;
  EXPECT_THROW(PoseStream{limits}, Error);
  limits = {};
  limits.jumpSeconds = 0.0;
  EXPECT_THROW(PoseStream{limits}, Error);
  limits = {};
  limits.tools = 0;
  EXPECT_THROW(PoseStream{limits}, Error);
}

TEST(PoseStream, SubscribersGetEveryPoseOnceInOrder)
{
  PoseStream stream;
  stream.Add(Along(0.0));
  const auto subscription = stream.Subscribe();
  for (int i = 1; i < 10; ++i)
    stream.Add(Along(0.1 * i));
  stream.Add(Along(0.9)); // again: not taken
  const std::vector<ToolPose> poses = subscription->Take();
  ASSERT_EQ(poses.size(), 9u);
  EXPECT_EQ(poses.front().time, 0.1);
  EXPECT_TRUE(subscription->Take().empty());
  EXPECT_TRUE(subscription->Take(NaN).empty());
  EXPECT_TRUE(subscription->Take(0.01).empty());
}

TEST(PoseStream, StateAndVersion)
{
  PoseStream stream;
  const std::uint64_t seen = stream.Version();
  EXPECT_EQ(stream.WaitBeyond(seen, 0.01), seen);
  EXPECT_EQ(stream.WaitBeyond(seen, NaN), seen);
  stream.SetState(DeviceState::Running, "connected");
  EXPECT_NE(stream.WaitBeyond(seen, Infinity), seen);
  EXPECT_EQ(stream.Statistics().state, DeviceState::Running);
  EXPECT_EQ(stream.Statistics().message, "connected");
  EXPECT_STREQ(DeviceStateText(DeviceState::Lost), "lost");
  for (int i = 0; i < RejectionCount; ++i)
    EXPECT_NE(RejectionText(static_cast<Rejection>(i)), nullptr);
}

TEST(PoseStream, ManyThreads)
{
  constexpr int Writers = 4, Poses = 5000;
  PoseStream stream;
  const auto subscription = stream.Subscribe(Writers * Poses);
  std::atomic<int> writing{Writers};
  {
    Worker writers[Writers], readers[3];
    for (int w = 0; w < Writers; ++w)
      writers[w].Start([&stream, &writing, w](const Worker::Signal&) {
        for (int i = 0; i < Poses; ++i)
          stream.Add(Along(1e-3 * i, 1e-3 * i, "Tool" + std::to_string(w) + "ToTracker"));
        --writing;
      });
    for (int r = 0; r < 3; ++r)
      readers[r].Start([&stream, r](const Worker::Signal& signal) {
        const std::string name = "Tool" + std::to_string(r) + "ToTracker";
        for (std::uint64_t version = 0; !signal.Stopped();) {
          version = stream.WaitBeyond(version, 0.01);
          const ToolPose latest = stream.Latest(name);
          stream.At(name, latest.time - 0.0005);
          stream.Statistics();
          stream.Poses(NaN);
        }
      });
    while (writing > 0)
      stream.WaitBeyond(stream.Version(), 0.001);
  }
  std::vector<double> last(Writers, -1.0);
  std::size_t count = 0;
  for (const ToolPose& pose : subscription->Take()) {
    double& before = last[static_cast<std::size_t>(pose.name[4] - '0')];
    EXPECT_GT(pose.time, before);
    before = pose.time;
    ++count;
  }
  EXPECT_EQ(count, static_cast<std::size_t>(Writers * Poses));
  EXPECT_EQ(subscription->Lost(), 0u);
}

TEST(Worker, StopsAtOnce)
{
  Worker worker;
  EXPECT_FALSE(worker.Running());
  const double begun = ClockNow();
  worker.Start([](const Worker::Signal& signal) { EXPECT_FALSE(signal.Sleep(Infinity)); });
  EXPECT_TRUE(worker.Running());
  worker.Stop();
  worker.Stop();
  EXPECT_FALSE(worker.Running());
  EXPECT_LT(ClockNow() - begun, 60.0); // not the hour
}

TEST(Worker, WhatTheJobThrowsIsTold)
{
  Worker worker;
  worker.Start([](const Worker::Signal&) { throw std::runtime_error("the job failed"); });
  while (worker.Running()) {
  }
  EXPECT_EQ(worker.Failure(), "the job failed");
  worker.Start([](const Worker::Signal&) {});
  EXPECT_EQ(worker.Failure(), "");
}

TEST(ImageStream, HoldsTheNewest)
{
  ImageStream stream(2);
  EXPECT_EQ(stream.Latest().voxels, nullptr);
  for (int i = 0; i < 5; ++i) {
    StreamedImage image;
    image.time = i;
    image.voxels = std::make_shared<std::vector<unsigned char>>(10);
    stream.Add(image);
  }
  EXPECT_EQ(stream.Latest().time, 4.0);
  EXPECT_EQ(stream.Images().size(), 2u);
  EXPECT_EQ(stream.Images()[0].time, 3.0);
  EXPECT_EQ(stream.Version(), 5u);
  EXPECT_TRUE(std::isfinite(stream.Latest().arrival));
}
