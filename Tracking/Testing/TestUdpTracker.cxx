// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Tracking/Devices/UdpTracker.h"
#include "Tracking/Stream/Clock.h"
#include <functional>
#include <gtest/gtest.h>
#include <unistd.h>

using namespace echorama;

namespace {

bool WaitFor(double seconds, const std::function<bool()>& condition)
{
  for (const double begin = ClockNow(); ClockNow() - begin < seconds;) {
    if (condition())
      return true;
    usleep(2000);
  }
  return condition();
}

ToolPose PoseAt(const std::string& name, double x)
{
  ToolPose pose;
  pose.name = name;
  pose.pose.translation() = Eigen::Vector3d(x, 2.0, 3.0);
  return pose;
}

/// A tracker at any free port.
struct Receiver {
  explicit Receiver(const std::string& options = "") : tracker(TrackerAddress::Parse("udp://127.0.0.1:0" + options))
  {
    tracker.Start(poses, nullptr);
  }
  std::uint64_t Taken() const
  {
    std::uint64_t sum = 0;
    for (const ToolStatistics& tool : poses.Statistics().tools)
      sum += tool.valid;
    return sum;
  }
  std::uint64_t Rejected(Rejection reason) const { return poses.Statistics().Rejected(reason); }

  PoseStream poses;
  UdpTracker tracker;
};

TEST(UdpTracker, PosesArriveOnceAndInOrder)
{
  Receiver receiver;
  EXPECT_TRUE(receiver.poses.Live());
  EXPECT_EQ(receiver.poses.Statistics().state, DeviceState::Connecting);
  UdpSender sender("127.0.0.1", receiver.tracker.Port());
  for (int i = 0; i < 500; ++i) {
    EXPECT_TRUE(sender.Send(100.0 + 0.004 * i, {PoseAt("Probe", i), PoseAt("StylusToReference", -i)}));
    const std::uint64_t sent = 2 * static_cast<std::uint64_t>(i + 1); // the system keeps only so many for one who is held up
    ASSERT_TRUE(WaitFor(30.0, [&] { return receiver.Taken() + 100 >= sent; })) << receiver.Taken();
  }
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.Taken() == 1000; })) << receiver.Taken();
  EXPECT_EQ(receiver.poses.Statistics().state, DeviceState::Running);
  const auto history = receiver.poses.History("ProbeToTracker");
  ASSERT_EQ(history.size(), 500u);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(history[static_cast<std::size_t>(i)].time, 100.0 + 0.004 * i);
    EXPECT_EQ(history[static_cast<std::size_t>(i)].pose.translation().x(), i);
  }
  EXPECT_EQ(receiver.poses.Latest("StylusToReference").pose.translation().x(), -499);
  EXPECT_EQ(receiver.poses.Statistics().Rejected(), 0u);
}

TEST(UdpTracker, BadPacketsAreCountedAndDropped)
{
  Receiver receiver("?silence=2");
  UdpSocket socket = UdpSocket::SendingTo("127.0.0.1", receiver.tracker.Port());
  PosePacket packet;
  packet.session = 5;
  packet.poses = {PoseAt("Probe", 1.0)};
  const auto encoded = [&packet](std::uint64_t sequence) {
    packet.sequence = sequence;
    packet.time = static_cast<double>(sequence);
    return EncodePosePacket(packet);
  };
  socket.Send({'x'});
  socket.Send(std::vector<unsigned char>(3000, 'x'));
  auto damaged = encoded(1);
  damaged[50] ^= 4;
  socket.Send(damaged);
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.Rejected(Rejection::Malformed) == 2; }));
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.Rejected(Rejection::TooLarge) == 1; }));
  EXPECT_EQ(receiver.Taken(), 0u);

  socket.Send(encoded(10));
  socket.Send(encoded(10));
  socket.Send(encoded(9));
  UdpSender stranger("127.0.0.1", receiver.tracker.Port());
  stranger.Send(1.0, {PoseAt("Probe", 66.0)});
  socket.Send(encoded(11));
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.Taken() == 2; }));
  EXPECT_EQ(receiver.Rejected(Rejection::Replayed), 2u);
  EXPECT_EQ(receiver.Rejected(Rejection::Foreign), 1u);
  EXPECT_NE(receiver.poses.Statistics().lastRejection.find("another session"), std::string::npos);

  // The sender is gone; whoever is next is heard, and the old session is over.
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.poses.Statistics().state == DeviceState::Lost; }));
  stranger.Send(2.0, {PoseAt("Other", 66.0)});
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.poses.Statistics().state == DeviceState::Running; }));
  socket.Send(encoded(12));
  EXPECT_TRUE(WaitFor(30.0, [&] { return receiver.Rejected(Rejection::Foreign) == 2; }));
  EXPECT_EQ(receiver.Taken(), 3u);
}

TEST(UdpTracker, OnlyTheSenderThatWasNamed)
{
  Receiver friendly("?from=localhost"), strict("?from=192.0.2.1");
  UdpSender one("127.0.0.1", friendly.tracker.Port()), two("127.0.0.1", strict.tracker.Port());
  one.Send(1.0, {PoseAt("Probe", 1.0)});
  two.Send(1.0, {PoseAt("Probe", 1.0)});
  EXPECT_TRUE(WaitFor(30.0, [&] { return friendly.Taken() == 1; }));
  EXPECT_TRUE(WaitFor(30.0, [&] { return strict.Rejected(Rejection::Foreign) == 1; }));
  EXPECT_EQ(strict.Taken(), 0u);
  EXPECT_NE(strict.poses.Statistics().lastRejection.find("127.0.0.1"), std::string::npos);
}

TEST(UdpTracker, ASenderThatIsNotKnownYetHoldsUpNobody)
{
  PoseStream poses;
  poses.SetLive(false); // a recording was there before
  UdpTracker tracker(TrackerAddress::Parse("udp://127.0.0.1:0?from=no.such.host.invalid"));
  tracker.Start(poses, nullptr);
  EXPECT_TRUE(poses.Live());
  EXPECT_TRUE(WaitFor(60.0, [&] { return poses.Statistics().message.find("no.such.host.invalid") != std::string::npos; }));
  EXPECT_EQ(poses.Statistics().state, DeviceState::Connecting);
  const double begin = ClockNow();
  tracker.Stop();
  EXPECT_LT(ClockNow() - begin, 30.0);
}

TEST(UdpTracker, SaysWhatIsTheMatterAndStopsSoon)
{
  Receiver first;
  PoseStream poses;
  UdpTracker second(TrackerAddress::Parse("udp://127.0.0.1:" + std::to_string(first.tracker.Port())));
  const auto fails = [&poses](TrackerDevice& tracker, const std::string& words) {
    try {
      tracker.Start(poses, nullptr);
      ADD_FAILURE() << "started";
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  fails(second, std::to_string(first.tracker.Port()));
  UdpTracker elsewhere(TrackerAddress::Parse("udp://192.0.2.1:0"));
  fails(elsewhere, "192.0.2.1");
  EXPECT_THROW(MakeTracker("udp://?silence=0"), Error);
  EXPECT_THROW(MakeTracker("udp://?to=me"), Error);

  const double begin = ClockNow();
  first.tracker.Stop();
  EXPECT_LT(ClockNow() - begin, 30.0);
  first.tracker.Stop();
  EXPECT_EQ(first.poses.Statistics().state, DeviceState::Idle);
  second.Start(poses, nullptr); // the port is free again
  EXPECT_EQ(second.Port(), first.tracker.Port());
}

TEST(UdpSender, DrawsASessionOfItsOwn)
{
  UdpSender a("127.0.0.1", 9), b("127.0.0.1", 9);
  EXPECT_NE(a.Session(), 0u);
  EXPECT_NE(a.Session(), b.Session());
  EXPECT_EQ(UdpSender("127.0.0.1", 9, 77).Session(), 77u);
}

} // namespace
