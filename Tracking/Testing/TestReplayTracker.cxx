// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/NumberText.h"
#include "Readers/PoseLog.h"
#include "Readers/SequenceWriter.h"
#include "Tracking/Devices/ReplayTracker.h"
#include "Tracking/Devices/SimulatedTracker.h"
#include "Tracking/Stream/Clock.h"
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

class ReplayTrackerTest : public testing::Test {
protected:
  void SetUp() override
  {
    folder_ = std::filesystem::temp_directory_path() /
              ("echorama-replay-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  // 20 frames of 4 x 3 pixels, 50 ms apart from 100 s on, with two tools; frame 7 has no probe, frame 9 no image.
  std::string WriteSequence(int frames = 20)
  {
    SequenceContent content;
    content.dimensions = {4, 3, 1};
    FileReplacement files;
    SequenceWriter writer(Path("recording.igs.mha"), content, false, files);
    for (int i = 0; i < frames; ++i) {
      SequenceFrame frame;
      frame.time = 100.0 + 0.05 * i;
      for (int tool = 0; tool < 2; ++tool)
        frame.transforms.push_back({SimulatedToolName(tool), Eigen::Affine3d(SimulatedTruth({}, tool, frame.time).matrix()),
                                    tool == 0 && i == 7 ? TransformStatus::Missing : TransformStatus::Valid,
                                    tool == 0 && i == 7 ? "MISSING" : "OK"});
      Eigen::Affine3d toProbe = Eigen::Affine3d::Identity();
      toProbe.linear() = Eigen::Vector3d(0.5, 0.25, 1.0).asDiagonal();
      frame.transforms.push_back({"ImageToProbe", toProbe, TransformStatus::Valid, "OK"});
      const std::vector<unsigned char> pixels(12, static_cast<unsigned char>(i));
      writer.Append(frame, i == 9 ? nullptr : pixels.data());
    }
    writer.Finish();
    files.Commit();
    return Path("recording.igs.mha");
  }

  std::string WriteText(const std::string& name, const std::string& text)
  {
    std::ofstream(Path(name), std::ios::binary) << text;
    return Path(name);
  }

private:
  std::filesystem::path folder_;
};

void WaitUntilNotRunning(const PoseStream& stream)
{
  for (int i = 0; i < 600 && stream.Statistics().state == DeviceState::Running; ++i)
    stream.WaitBeyond(stream.Version(), 0.1);
}

template <class Function>
std::string Refusal(const Function& function, Error::Kind kind)
{
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

} // namespace

TEST_F(ReplayTrackerTest, EverythingComesOnce)
{
  PoseStream stream;
  ImageStream images(100);
  const auto subscription = stream.Subscribe();
  const auto device = MakeTracker("replay:" + WriteSequence() + "?speed=0");
  device->Start(stream, &images);
  WaitUntilNotRunning(stream);
  const StreamStatistics statistics = stream.Statistics();
  EXPECT_EQ(statistics.state, DeviceState::Ended);
  EXPECT_FALSE(statistics.live);
  EXPECT_NE(statistics.message.find("recording.igs.mha"), std::string::npos);
  EXPECT_EQ(statistics.Rejected(), 0u);
  EXPECT_EQ(stream.Tools(), (std::vector<std::string>{"ProbeToTracker", "ReferenceToTracker"}));
  EXPECT_NEAR(statistics.tools[0].rateHz, 20.0, 1e-6);
  const std::vector<ToolPose> poses = subscription->Take();
  ASSERT_EQ(poses.size(), 40u);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int frame = static_cast<int>(i / 2), tool = static_cast<int>(i % 2);
    EXPECT_EQ(poses[i].name, SimulatedToolName(tool));
    EXPECT_EQ(poses[i].time, 100.0 + 0.05 * frame);
    EXPECT_EQ(poses[i].status, tool == 0 && frame == 7 ? TransformStatus::Missing : TransformStatus::Valid);
    if (poses[i].status == TransformStatus::Valid) {
      EXPECT_LT((poses[i].pose.translation() - SimulatedTruth({}, tool, poses[i].time).translation()).norm(), 1e-9);
    }
  }
  const std::vector<StreamedImage> frames = images.Images();
  ASSERT_EQ(frames.size(), 19u); // not the one that is no image
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int frame = static_cast<int>(i < 9 ? i : i + 1);
    EXPECT_EQ(frames[i].time, 100.0 + 0.05 * frame);
    EXPECT_EQ(frames[i].voxels->at(5), frame);
    if (frame != 7) { // it lies where the probe is
      const Pose truth = SimulatedTruth({}, 1, frames[i].time).inverse() * SimulatedTruth({}, 0, frames[i].time);
      EXPECT_LT((frames[i].geometry.origin - truth.translation()).norm(), 1e-9);
      EXPECT_NEAR(frames[i].geometry.spacing[0], 0.5, 1e-9);
    }
  }
  device->Start(stream, &images); // once more, from the beginning; without images
  device->Start(stream, nullptr);
  device->Stop();
}

TEST_F(ReplayTrackerTest, StepByStep)
{
  PoseStream stream;
  ImageStream images;
  ReplayTracker device(ReplayParameters::Of(TrackerAddress::Parse("replay:" + WriteSequence() + "?step=1")));
  EXPECT_FALSE(device.Step());
  device.Start(stream, &images);
  EXPECT_TRUE(stream.Tools().empty());
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(stream.Statistics().state, DeviceState::Running);
    EXPECT_TRUE(device.Step());
    EXPECT_EQ(stream.Latest("ProbeToTracker").time, 100.0 + 0.05 * i);
    EXPECT_EQ(stream.Latest("ReferenceToTracker").time, 100.0 + 0.05 * i);
    if (i != 9) {
      EXPECT_EQ(images.Latest().time, 100.0 + 0.05 * i);
    }
  }
  EXPECT_EQ(stream.Statistics().state, DeviceState::Ended);
  EXPECT_FALSE(device.Step());
  device.Stop();
  EXPECT_FALSE(device.Step());
  EXPECT_EQ(stream.State().first, DeviceState::Ended); // it has been, whoever stops it
  device.Start(stream, nullptr);
  EXPECT_TRUE(device.Step());
  device.Stop();
  EXPECT_EQ(stream.State().first, DeviceState::Idle);
}

TEST_F(ReplayTrackerTest, PartsAndRounds)
{
  PoseStream stream;
  ReplayTracker device(
      ReplayParameters::Of(TrackerAddress::Parse("replay:" + WriteSequence() + "?step=1&loop=1&from=0.199&to=0.301")));
  device.Start(stream, nullptr);
  for (int i = 0; i < 300; ++i) // three moments a round, times go on
    EXPECT_TRUE(device.Step());
  const std::vector<ToolPose> history = stream.History("ReferenceToTracker");
  ASSERT_EQ(history.size(), 300u);
  for (std::size_t i = 0; i < history.size(); ++i)
    EXPECT_NEAR(history[i].time, 100.2 + 0.05 * static_cast<double>(i), 1e-9);
  EXPECT_EQ(stream.Statistics().Rejected(), 0u);
  EXPECT_EQ(stream.Statistics().tools[0].clockJumps, 0u);
}

// Recorders write when each pose came: that was on our clock, but long ago.
TEST_F(ReplayTrackerTest, SinceTheLastIsSinceItWasReplayedAndArrivalsGoOnFromRoundToRound)
{
  SequenceContent content;
  FileReplacement files;
  SequenceWriter writer(Path("arrivals.igs.mha"), content, false, files);
  for (int i = 0; i < 3; ++i) {
    SequenceFrame frame;
    frame.time = 100.0 + 0.05 * i;
    frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d::Identity(), TransformStatus::Valid, "OK"});
    frame.fields.emplace_back(std::string("ProbeToTracker") + ArrivalField, NumberText(500.0 + 0.05 * i));
    writer.Append(frame, nullptr);
  }
  writer.Finish();
  files.Commit();
  PoseStream stream;
  ReplayTracker device(ReplayParameters::Of(TrackerAddress::Parse("replay:" + Path("arrivals.igs.mha") + "?step=1&loop=1")));
  device.Start(stream, nullptr);
  const double begun = ClockNow();
  for (int i = 0; i < 9; ++i)
    EXPECT_TRUE(device.Step());
  const double since = stream.Statistics().tools[0].secondsSinceLast;
  EXPECT_GE(since, 0.0);
  EXPECT_LE(since, ClockNow() - begun);
  const std::vector<ToolPose> history = stream.History("ProbeToTracker");
  ASSERT_EQ(history.size(), 9u);
  for (std::size_t i = 0; i < history.size(); ++i)
    EXPECT_NEAR(history[i].arrival, 500.0 + 0.05 * static_cast<double>(i), 1e-9);
}

TEST_F(ReplayTrackerTest, SpeedIsKept)
{
  const std::string path = WriteSequence(); // 0.95 s
  PoseStream stream;
  const auto device = MakeTracker("replay:" + path + "?speed=5");
  const double begun = ClockNow();
  device->Start(stream, nullptr);
  WaitUntilNotRunning(stream);
  EXPECT_GE(ClockNow() - begun, 0.19 - 1e-6); // never earlier, whatever else the machine does
  EXPECT_EQ(stream.History("ProbeToTracker").size(), 20u);
  const auto slow = MakeTracker("replay:" + path + "?speed=0.001"); // stops in the middle at once
  slow->Start(stream, nullptr);
  slow->Stop();
  EXPECT_EQ(stream.State().first, DeviceState::Idle);
}

TEST_F(ReplayTrackerTest, AsFastAsItIsTaken)
{
  std::string text = "time,tx,ty,tz,qw,qx,qy,qz\n";
  const std::size_t count = 20000;
  for (std::size_t i = 0; i < count; ++i)
    text += std::to_string(i) + ",1,2,3,1,0,0,0\n";
  const std::string path = WriteText("long.csv", text);
  PoseStream stream;
  const auto subscription = stream.Subscribe(1000);
  auto idle = stream.Subscribe(100);
  const auto device = MakeTracker("replay:" + path + "?speed=0");
  device->Start(stream, nullptr);
  for (int i = 0; i < 100 && stream.Backlog() <= 0.5; ++i)
    stream.WaitBeyond(stream.Version(), 0.1);
  EXPECT_GT(stream.Backlog(), 0.5);
  EXPECT_LT(stream.Backlog(), 0.6);
  EXPECT_EQ(stream.Statistics().state, DeviceState::Running); // it waits for the one that takes nothing
  idle.reset();                                               // and no more
  std::size_t taken = 0;
  for (std::size_t last = 1; last > 0 && taken < count; taken += last) // the reader is slower than the file
    last = subscription->Take(5.0).size();
  WaitUntilNotRunning(stream);
  EXPECT_EQ(taken, count);
  EXPECT_EQ(subscription->Lost(), 0u);
  EXPECT_EQ(stream.Statistics().state, DeviceState::Ended);

  device->Start(stream, nullptr); // stops while it waits
  while (stream.Backlog() <= 0.5)
    stream.WaitBeyond(stream.Version(), 0.1);
  const double begun = ClockNow();
  device->Stop();
  EXPECT_LT(ClockNow() - begun, 8.0); // before it would take the reader for dead
}

TEST_F(ReplayTrackerTest, Tables)
{
  const std::string path = WriteText("log.csv", "time,tool,tx,ty,tz,qw,qx,qy,qz\n0,Probe,1,2,3,1,0,0,0\n0,Stylus,4,5,6,1,0,0,0\n"
                                                "0.1,Probe,7,8,9,1,0,0,0\n");
  PoseStream stream;
  const auto device = MakeTracker("replay:" + path + "?speed=0&unitMm=10");
  device->Start(stream, nullptr);
  WaitUntilNotRunning(stream);
  EXPECT_EQ(stream.Tools(), (std::vector<std::string>{"ProbeToTracker", "StylusToTracker"}));
  EXPECT_EQ(stream.Latest("ProbeToTracker").pose.translation(), Eigen::Vector3d(70.0, 80.0, 90.0));
}

TEST_F(ReplayTrackerTest, FilesThatCannotBeReplayed)
{
  PoseStream stream;
  const auto start = [&stream](const std::string& address) {
    return [&stream, address] { MakeTracker("replay:" + address)->Start(stream, nullptr); };
  };
  Refusal(start(Path("nothing.csv")), Error::Kind::FileSystem);
  Refusal(start(WriteText("empty.csv", "")), Error::Kind::BadFile);
  Refusal(start(WriteText("columns.csv", "time,tool,tx,ty,tz,qw,qx,qy,qz\n")), Error::Kind::BadFile);
  Refusal(start(WriteText("noise.csv", std::string("\0\1\2\3\377garbage", 12))), Error::Kind::BadFile);
  const std::string sequence = WriteSequence();
  EXPECT_NE(Refusal(start(sequence + "?from=50"), Error::Kind::BadFile).find("0.95"), std::string::npos);
  EXPECT_NE(Refusal(start(sequence + "?from=50"), Error::Kind::BadFile).find("no poses from 50 s on;"), std::string::npos);
  EXPECT_NE(Refusal(start(sequence + "?from=50&to=60"), Error::Kind::BadFile).find("from 50 s to 60 s;"), std::string::npos);
  const auto size = std::filesystem::file_size(sequence);
  std::filesystem::resize_file(sequence, size - 30);
  Refusal(start(sequence), Error::Kind::BadFile);
  EXPECT_EQ(stream.Statistics().state, DeviceState::Idle); // nothing was begun
}

TEST_F(ReplayTrackerTest, DamagedPixelsEndIt)
{
  SequenceContent content;
  content.dimensions = {64, 64, 1};
  FileReplacement files;
  SequenceWriter writer(Path("packed.igs.mha"), content, true, files);
  for (int i = 0; i < 10; ++i) {
    SequenceFrame frame;
    frame.time = i;
    frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d::Identity(), TransformStatus::Valid, "OK"});
    std::vector<unsigned char> pixels(64 * 64);
    for (std::size_t k = 0; k < pixels.size(); ++k)
      pixels[k] = static_cast<unsigned char>(k * k * static_cast<std::size_t>(i + 3) >> 5);
    writer.Append(frame, pixels.data());
  }
  writer.Finish();
  files.Commit();
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(Path("packed.igs.mha")));
  std::fstream file(Path("packed.igs.mha"), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(size - 200);
  file << std::string(100, '\xff');
  file.close();
  PoseStream stream;
  ImageStream images;
  const auto device = MakeTracker("replay:" + Path("packed.igs.mha") + "?speed=0");
  device->Start(stream, &images);
  WaitUntilNotRunning(stream);
  EXPECT_EQ(stream.Statistics().state, DeviceState::Failed);
  EXPECT_NE(stream.Statistics().message.find("packed.igs.mha"), std::string::npos);
}

TEST_F(ReplayTrackerTest, BadAddresses)
{
  for (const char* address : {"replay:", "replay:a.csv?speed=-1", "replay:a.csv?loop=2", "replay:a.csv?loop=1&speed=0",
                              "replay:a.csv?from=3&to=2", "replay:a.csv?rate=5", "replay:a.csv?step=0.5"})
    EXPECT_THROW(MakeTracker(address), Error) << address;
}

// Recordings of others, where they are.
TEST_F(ReplayTrackerTest, RecordingsOfOthers)
{
  const std::string data = ECHORAMA_SOURCE_DIR "/../shared/data/";
  const std::string aurora = data + "aurora/NDIdata_snakeravenTest_2_2_21.csv", pairs = data + "handeye_ethz/paired_vicon_1.csv";
  if (!std::filesystem::exists(aurora) || !std::filesystem::exists(pairs))
    GTEST_SKIP() << "the recordings are not there";
  for (const std::string& path : {aurora, pairs}) {
    PoseStream stream;
    const auto subscription = stream.Subscribe(1000000);
    const auto device = MakeTracker("replay:" + path + "?speed=0");
    device->Start(stream, nullptr);
    WaitUntilNotRunning(stream);
    const StreamStatistics statistics = stream.Statistics();
    EXPECT_EQ(statistics.state, DeviceState::Ended) << statistics.message;
    EXPECT_GE(statistics.tools.size(), 1u);
    EXPECT_EQ(subscription->Take().size() + statistics.Rejected(Rejection::Duplicate), ReadPoseLog(path).poses.size());
  }
}
