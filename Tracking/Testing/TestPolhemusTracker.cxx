// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "PolhemusEmulator.h"
#include "Tracking/Devices/PolhemusTracker.h"
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

bool WaitFor(double seconds, const std::function<bool()>& condition)
{
  for (const double begin = ClockNow(); ClockNow() - begin < seconds;) {
    if (condition())
      return true;
    usleep(5000);
  }
  return condition();
}

std::uint64_t Valid(const PoseStream& poses)
{
  std::uint64_t sum = 0;
  for (const ToolStatistics& tool : poses.Statistics().tools)
    sum += tool.valid;
  return sum;
}

/// Whether a pose is one that the emulator has, at any time.
bool IsEmulated(const ToolPose& pose, int station)
{
  const double t = pose.pose.translation().x() - 200.0;
  const Pose truth = EmulatedPose(station, static_cast<std::uint32_t>(std::lround(1000.0 * t)));
  return (pose.pose.translation() - truth.translation()).norm() < 0.2 && RotationAngle(pose.pose.inverse() * truth) < 0.005;
}

std::unique_ptr<TrackerDevice> Tracker(const EmulatedPolhemus& device, const std::string& options = "")
{
  return MakeTracker("polhemus:" + device.Path() + options);
}

void ExpectPoses(const PoseStream& poses, std::uint64_t more = 30)
{
  const std::uint64_t before = Valid(poses);
  EXPECT_TRUE(WaitFor(20.0, [&] { return Valid(poses) >= before + more; }))
      << DeviceStateText(poses.Statistics().state) << ": " << poses.Statistics().message << "; "
      << poses.Statistics().lastRejection;
}

TEST(PolhemusTracker, SpeaksWithEveryModelInEveryForm)
{
  for (const PolhemusModel model : {PolhemusModel::Patriot, PolhemusModel::Liberty})
    for (const char* format : {"binary", "ascii"})
      for (const char* record : {"twofold", "single", "bare"}) {
        EmulatedPolhemus::Character character;
        character.model = model;
        character.framesPerSecond = model == PolhemusModel::Patriot ? 60.0 : 240.0;
        EmulatedPolhemus device(character);
        PoseStream poses;
        const auto tracker = Tracker(device, std::string("?names=Probe,stylus&format=") + format + "&record=" + record);
        tracker->Start(poses, nullptr);
        ExpectPoses(poses);
        EXPECT_EQ(poses.Statistics().state, DeviceState::Running);
        EXPECT_NE(poses.Statistics().message.find(PolhemusModelText(model)), std::string::npos);
        EXPECT_NE(poses.Statistics().message.find(record), std::string::npos) << poses.Statistics().message;
        EXPECT_EQ(poses.Tools(), (std::vector<std::string>{"ProbeToTracker", "StylusToTracker"}));
        for (const ToolPose& pose : poses.History("StylusToTracker")) {
          EXPECT_TRUE(IsEmulated(pose, 2)) << pose.pose.matrix();
          EXPECT_LT(std::fabs(pose.time - pose.arrival), 1.0);
        }
        EXPECT_EQ(poses.Statistics().Rejected(Rejection::Malformed), 0u) << poses.Statistics().lastRejection;
        tracker->Stop();
        EXPECT_TRUE(WaitFor(5.0, [&] { return !device.Talks(); })); // it was told to be quiet
      }
}

TEST(PolhemusTracker, TheConversationAsItIs)
{
  EmulatedPolhemus device({});
  PoseStream poses;
  const auto tracker = Tracker(device, "?hemisphere=-z");
  tracker->Start(poses, nullptr);
  ExpectPoses(poses, 4);
  tracker->Stop();
  EXPECT_TRUE(WaitFor(5.0, [&] { return !device.Talks(); }));
  std::size_t at = 0; // in this order; a busy machine may have to ask again
  for (const char* command : {"/P", "F1/", "^V/", "^U0/", "U1/", "U/", "H*,0,0,-1/", "/P", "O*,8,9,11,3,7,2,5,1/", "C/", "P"}) {
    at = device.Commands().find(command, at);
    ASSERT_NE(at, std::string::npos) << device.Commands() << " lacks " << command;
    at += std::string(command).size();
  }
}

TEST(PolhemusTracker, ADeviceThatTalksAlreadyInTextAndInches)
{
  EmulatedPolhemus::Character character;
  character.talksAlready = true;
  EmulatedPolhemus device(character);
  PoseStream poses;
  const auto tracker = Tracker(device);
  tracker->Start(poses, nullptr);
  ExpectPoses(poses);
  for (const ToolPose& pose : poses.History("Station1ToTracker"))
    EXPECT_TRUE(IsEmulated(pose, 1));
}

TEST(PolhemusTracker, FirmwareThatKnowsFewerItems)
{
  struct {
    std::set<int> unknown;
    const char* record;
  } const cases[] = {{{11}, "twofold"}, {{5}, "single"}, {{8}, "bare"}};
  for (const auto& test : cases) {
    EmulatedPolhemus::Character character;
    character.unknownItems = test.unknown;
    EmulatedPolhemus device(character);
    PoseStream poses;
    const auto tracker = Tracker(device);
    tracker->Start(poses, nullptr);
    ExpectPoses(poses);
    EXPECT_NE(poses.Statistics().message.find(test.record), std::string::npos) << poses.Statistics().message;
    for (const ToolPose& pose : poses.History("Station1ToTracker"))
      EXPECT_TRUE(IsEmulated(pose, 1));
  }
}

TEST(PolhemusTracker, ANoisyLine)
{
  EmulatedPolhemus::Character character;
  character.noise = {1e-3, 1e-3, 1e-3};
  EmulatedPolhemus device(character);
  PoseStream poses;
  const auto tracker = Tracker(device);
  tracker->Start(poses, nullptr);
  ExpectPoses(poses, 250);
  EXPECT_EQ(poses.Statistics().state, DeviceState::Running);
  EXPECT_GT(poses.Statistics().Rejected(Rejection::Malformed), 0u);
  for (int station = 1; station <= 2; ++station)
    for (const ToolPose& pose : poses.History("Station" + std::to_string(station) + "ToTracker"))
      EXPECT_TRUE(pose.status == TransformStatus::Missing || IsEmulated(pose, station)) << pose.pose.matrix();
}

TEST(PolhemusTracker, UnpluggedInTheMiddleAndBack)
{
  EmulatedPolhemus device({});
  PoseStream poses;
  const auto tracker = Tracker(device);
  tracker->Start(poses, nullptr);
  ExpectPoses(poses);
  device.Unplug();
  EXPECT_TRUE(WaitFor(10.0, [&] { return poses.Statistics().state == DeviceState::Lost; }));
  EXPECT_TRUE(WaitFor(10.0, [&] { return poses.Statistics().message.find("no such device") != std::string::npos; }))
      << poses.Statistics().message;
  EXPECT_NE(poses.Statistics().message.find(device.Path()), std::string::npos);
  device.PlugIn(); // as after power-up: text, inches, silent
  ExpectPoses(poses);
  EXPECT_EQ(poses.Statistics().state, DeviceState::Running);
  for (const ToolPose& pose : poses.History("Station1ToTracker"))
    EXPECT_TRUE(IsEmulated(pose, 1));
}

TEST(PolhemusTracker, SwitchedOffWhileTheLineStays)
{
  EmulatedPolhemus device({});
  PoseStream poses;
  const auto tracker = Tracker(device);
  tracker->Start(poses, nullptr);
  ExpectPoses(poses);
  device.SwitchOff();
  EXPECT_TRUE(WaitFor(15.0, [&] { return poses.Statistics().state == DeviceState::Lost; }));
  EXPECT_NE(poses.Statistics().message.find("no record has come"), std::string::npos) << poses.Statistics().message;
  device.SwitchOn();
  ExpectPoses(poses);
}

TEST(PolhemusTracker, AClockThatJumpsIsMappedAnew)
{
  EmulatedPolhemus::Character character;
  character.milliseconds = 4294967295u - 1000; // and it wraps a second after the start
  EmulatedPolhemus device(character);
  PoseStream poses;
  const auto tracker = Tracker(device);
  tracker->Start(poses, nullptr);
  ExpectPoses(poses, 240);
  EXPECT_EQ(poses.Statistics().message.find("jumped"), std::string::npos) << poses.Statistics().message;
  device.SetClockAhead(-3600.0);
  std::string message;
  const std::string words = "jumped by ";
  EXPECT_TRUE(WaitFor(15.0, [&] { return (message = poses.Statistics().message).find(words) != std::string::npos; })) << message;
  EXPECT_NEAR(std::atof(message.c_str() + message.find(words) + words.size()), -3600.0, 0.5) << message;
  ExpectPoses(poses, 100);
  double before = 0.0;
  for (const ToolPose& pose : poses.History("Station1ToTracker")) {
    EXPECT_GT(pose.time, before);
    EXPECT_LT(std::fabs(pose.time - pose.arrival), 1.0);
    before = pose.time;
  }
}

TEST(PolhemusTracker, SaysWhatIsTheMatter)
{
  const auto message = [](const EmulatedPolhemus::Character& character, const std::string& options, const std::string& words,
                          DeviceState state) {
    EmulatedPolhemus device(character);
    PoseStream poses;
    const auto tracker = Tracker(device, options);
    tracker->Start(poses, nullptr);
    EXPECT_TRUE(WaitFor(20.0, [&] { return poses.Statistics().message.find(words) != std::string::npos; }))
        << poses.Statistics().message << " lacks " << words;
    EXPECT_EQ(poses.Statistics().state, state);
    EXPECT_EQ(Valid(poses), 0u);
  };
  EmulatedPolhemus::Character character;
  character.deaf = true;
  message(character, "", "answers like a Polhemus", DeviceState::Connecting);
  character.talksAlready = true;
  message(character, "", "stop sending", DeviceState::Connecting);
  character = {};
  message(character, "?model=liberty", "it is a Patriot, not a Liberty", DeviceState::Failed);
  character.sensors = 0;
  message(character, "", "no sensor", DeviceState::Connecting);
  character = {};
  character.knowsCentimetres = false;
  message(character, "", "centimetres", DeviceState::Connecting);
  character = {};
  character.unknownItems = {7};
  message(character, "", "records cannot be read", DeviceState::Connecting);
}

TEST(PolhemusTracker, StopsSoonWhateverTheDeviceDoes)
{
  EmulatedPolhemus::Character deaf;
  deaf.deaf = true;
  EmulatedPolhemus::Character talking = deaf;
  talking.talksAlready = true;
  for (const EmulatedPolhemus::Character& character : {EmulatedPolhemus::Character(), deaf, talking})
    for (const int milliseconds : {0, 30, 250, 700}) {
      EmulatedPolhemus device(character);
      PoseStream poses;
      poses.SetLive(false); // a recording was there before
      const auto tracker = Tracker(device);
      tracker->Start(poses, nullptr);
      EXPECT_TRUE(poses.Live());
      usleep(static_cast<unsigned>(1000 * milliseconds));
      const double begin = ClockNow();
      tracker->Stop();
      EXPECT_LT(ClockNow() - begin, 30.0); // 0.25 s where the machine is not busy
      tracker->Stop();
      EXPECT_EQ(poses.Statistics().state, DeviceState::Idle);
      tracker->Start(poses, nullptr); // and again
    }
}

TEST(PolhemusTracker, RefusesWhatItCannotDo)
{
  const auto refused = [](const std::string& address, const std::string& words) {
    try {
      MakeTracker(address);
      ADD_FAILURE() << "accepted " << address;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what() << " lacks " << words;
    }
  };
  refused("polhemus:", "line is missing");
  refused("polhemus:/dev/x?model=fastrak", "Model is 'fastrak'; it must be one of auto, patriot, liberty");
  refused("polhemus:/dev/x?format=hex", "Format is 'hex'");
  refused("polhemus:/dev/x?record=triple", "Record is 'triple'");
  refused("polhemus:/dev/x?hemisphere=x", "Hemisphere is 'x'; it must be one of as-set, +x");
  refused("polhemus:/dev/x?baud=31337", "speed must be one of");
  refused("polhemus:/dev/x?names=A,B,A", "twice");
  refused("polhemus:/dev/x?model=patriot&names=A,B,C", "3 names for at most 2 stations");
  refused("polhemus:/dev/x?range=-1", "Range is -1 mm; it must be in (0, 20000]");
  refused("polhemus:/dev/x?colour=red", "there is no option colour");
  PoseStream poses;
  const auto tracker = MakeTracker("polhemus:/dev/echorama-has-no-such-line");
  try {
    tracker->Start(poses, nullptr);
    ADD_FAILURE() << "started";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
    EXPECT_NE(std::string(error.what()).find("no such device"), std::string::npos);
  }
  tracker->Stop();
}

} // namespace
