// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Readers/PoseLog.h"
#include "Testing/TemporaryFolder.h"
#include "Tracking/Stream/StreamRecorder.h"
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

using namespace echorama;
using namespace echorama::testing;

namespace {

class StreamRecorderTest : public TemporaryFolder {};

ToolPose RandomPose(Random& random, const std::string& name, double time)
{
  ToolPose pose;
  pose.name = name;
  pose.time = time;
  pose.arrival = time + 0.001 * random.Uniform();
  Twist twist;
  for (Eigen::Index i = 0; i < 6; ++i)
    twist[i] = random.Normal() * (i < 3 ? 100.0 : 1.0);
  pose.pose = Exp(twist);
  const double kind = random.Uniform();
  pose.status = kind < 0.1 ? TransformStatus::Missing : kind < 0.2 ? TransformStatus::OutOfRange : TransformStatus::Valid;
  return pose;
}

bool WaitFor(const std::function<bool()>& holds)
{
  for (int i = 0; i < 2000; ++i) {
    if (holds())
      return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

} // namespace

TEST_F(StreamRecorderTest, ComesBackToTheLastBit)
{
  const std::string path = Path("a.igs.mha");
  PoseStream stream;
  const auto all = stream.Subscribe();
  StreamRecorder recorder(path, stream.Subscribe());
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const double time = 1.7e9 + i / 60.0; // a clock since 1970
    stream.Add(RandomPose(random, "ProbeToTracker", time));
    if (i % 2 == 0)
      stream.Add(RandomPose(random, "ReferenceToTracker", time));
    if (i > 100) // one that was switched on later, and has a clock of its own
      stream.Add(RandomPose(random, "StylusToTracker", time + 0.003));
  }
  const std::vector<ToolPose> truth = all->Take();
  recorder.Stop();
  recorder.Stop();
  const RecordingState state = recorder.State();
  EXPECT_EQ(state.poses, truth.size());
  EXPECT_GE(state.frames, 200u + 99u); // a frame for each moment ...
  EXPECT_LE(state.frames, 320u);       // ... unless this thread was held up in the middle of one
  EXPECT_EQ(state.safe, state.frames);
  EXPECT_EQ(state.lost, 0u);
  EXPECT_EQ(state.problem, "");

  const PoseLog log = ReadPoseLog(path);
  ASSERT_EQ(log.poses.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(log.poses[i].name, truth[i].name);
    EXPECT_EQ(log.poses[i].time, truth[i].time);
    EXPECT_EQ(log.poses[i].arrival, truth[i].arrival);
    EXPECT_EQ(log.poses[i].status, truth[i].status);
    if (truth[i].status != TransformStatus::Missing) {
      EXPECT_EQ(log.poses[i].pose.matrix(), truth[i].pose.matrix());
    }
  }
}

TEST_F(StreamRecorderTest, SafeWithoutAnotherPose)
{
  PoseStream stream;
  StreamRecorder recorder(Path("a.igs.mha"), stream.Subscribe(), {false, 0.2, false});
  Random random(2);
  for (int i = 0; i < 5; ++i)
    stream.Add(RandomPose(random, "ProbeToTracker", i));
  EXPECT_TRUE(WaitFor([&] { return recorder.State().safe == 5; })); // though nothing more comes
  EXPECT_EQ(ReadPoseLog(Path("a.igs.mha")).poses.size(), 5u);
}

TEST_F(StreamRecorderTest, NamesThatCannotBeRecordedAreLeftOut)
{
  PoseStream stream;
  StreamRecorder recorder(Path("a.igs.mha"), stream.Subscribe(), {false, 0.0, false});
  Random random(2);
  const std::string bad[] = {"AToBToC", "Probe", "A=BToTracker", "AToBTransform", "A\nSeq_Frame0000_BToTracker"};
  for (int i = 0; i < 20; ++i) {
    stream.Add(RandomPose(random, "ProbeToTracker", i));
    for (const std::string& name : bad)
      stream.Add(RandomPose(random, name, i));
    stream.Add(RandomPose(random, "StylusToTracker", i));
  }
  recorder.Stop();
  const RecordingState state = recorder.State();
  EXPECT_EQ(state.problem, "");
  EXPECT_EQ(state.poses, 40u);
  EXPECT_EQ(state.leftOut, 100u);
  EXPECT_NE(state.lastLeftOut.find("BToTracker"), std::string::npos) << state.lastLeftOut;
  EXPECT_EQ(ReadPoseLog(Path("a.igs.mha")).poses.size(), 40u);
}

TEST_F(StreamRecorderTest, StopsWhileTheSourceGoesOn)
{
  PoseStream stream;
  StreamRecorder recorder(Path("a.igs.mha"), stream.Subscribe());
  std::atomic<bool> goesOn{true};
  std::thread source([&] { // faster than poses are written
    Random random(2);
    const ToolPose pose = RandomPose(random, "ProbeToTracker", 0.0);
    for (double time = 0.0; goesOn; time += 0.001) {
      ToolPose next = pose;
      next.time = time;
      stream.Add(next);
    }
  });
  EXPECT_TRUE(WaitFor([&] { return recorder.State().frames > 100; }));
  recorder.Stop(); // or the test is ended from outside: it takes as long as writing what waits
  goesOn = false;
  source.join();
}

TEST_F(StreamRecorderTest, NothingCame)
{
  PoseStream stream;
  StreamRecorder recorder(Path("a.igs.mha"), stream.Subscribe());
  ExpectRefused([&] { recorder.Stop(); }, Error::Kind::BadInput, "a.igs.mha", "nothing was recorded");
  EXPECT_EQ(FileCount(), 0);
  ExpectRefused([&] { StreamRecorder(Path("none/a.igs.mha"), stream.Subscribe()); }, Error::Kind::FileSystem, "none/a.igs.mha",
                "");
}

TEST_F(StreamRecorderTest, FullDisk)
{
  PoseStream stream;
  StreamRecorder recorder(Path("a.igs.mha"), stream.Subscribe(), {false, 0.0, false});
  Random random(2);
  {
    const class FullDisk full(5000);
    for (int i = 0; i < 50; ++i)
      stream.Add(RandomPose(random, "ProbeToTracker", i));
    EXPECT_TRUE(WaitFor([&] { return !recorder.State().problem.empty(); }));
  }
  ExpectRefused([&] { recorder.Stop(); }, Error::Kind::FileSystem, "a.igs.mha", "frames are kept");
  const RecordingState state = recorder.State();
  EXPECT_GT(state.safe, 3u);
  EXPECT_EQ(ReadPoseLog(Path("a.igs.mha")).poses.size(), state.safe);
}
