// SPDX-License-Identifier: BSD-3-Clause
// Over loopback: our client, listener and server, and the library's own sockets as an outside peer.
#include "Core/Base/Error.h"
#include "Testing/Sanitized.h"
#include "Tracking/Devices/OpenIgtLinkClient.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Tracking/Devices/OpenIgtLinkListener.h"
#include "Tracking/Devices/OpenIgtLinkReceiver.h"
#include "Tracking/Devices/OpenIgtLinkServer.h"
#include "Tracking/Devices/TcpSocket.h"
#include "Tracking/Stream/Clock.h"
#include <cmath>
#include <ctime>
#include <functional>
#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

using namespace echorama;
using Bytes = std::vector<unsigned char>;

namespace {

constexpr double Patience = 30.0; // s: only a failure waits that long

bool Eventually(const std::function<bool()>& condition)
{
  const double until = ClockNow() + Patience;
  while (!condition()) {
    if (ClockNow() > until)
      return false;
    WaitForSockets({}, {}, 0.005);
  }
  return true;
}

ToolPose At(const std::string& name, double time, TransformStatus status = TransformStatus::Valid)
{
  ToolPose pose;
  pose.name = name;
  pose.time = time;
  pose.pose.translation() << time, 2.0, 3.0;
  pose.status = status;
  return pose;
}

std::uint64_t Valid(const PoseStream& poses, const std::string& name)
{
  for (const ToolStatistics& tool : poses.Statistics().tools)
    if (tool.name == name)
      return tool.valid;
  return 0;
}

OpenIgtLinkServerParameters AnyPort()
{
  OpenIgtLinkServerParameters parameters;
  parameters.port = 0;
  return parameters;
}

TrackerAddress To(int port, const std::string& options = "")
{
  return TrackerAddress::Parse("igtl://127.0.0.1:" + std::to_string(port) + "?retry=0.05" + options);
}

bool SendAll(TcpSocket& socket, const Bytes& bytes)
{
  SendQueue queue(bytes.size() + 1);
  queue.Push(std::make_shared<const Bytes>(bytes));
  const double until = ClockNow() + Patience;
  while (!queue.Empty() && ClockNow() < until)
    if (!queue.Flush(socket))
      return false;
  return queue.Empty();
}

StreamedImage SomeImage(const std::string& name, int size)
{
  StreamedImage image;
  image.name = name;
  image.time = 5.0;
  image.geometry.dimensions = {size, size, size};
  image.geometry.origin << 1, 2, 3;
  image.voxels = std::make_shared<Bytes>(image.geometry.VoxelCount(), static_cast<unsigned char>(size));
  return image;
}

double Now()
{
  static const double start = std::floor(ClockNow());
  return start;
}

} // namespace

TEST(TcpSocket, SaysWhyItCannotConnect)
{
  int port = 0;
  {
    const TcpSocket listener = TcpSocket::Listen("127.0.0.1", 0);
    port = listener.Port();
  }
  try {
    TcpSocket::Connect("127.0.0.1", port, 2.0, nullptr);
    FAIL() << "nobody listens there";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
    EXPECT_NE(std::string(error.what()).find("127.0.0.1:" + std::to_string(port)), std::string::npos);
  }
  EXPECT_THROW(TcpSocket::Connect("no.such.host.invalid", 80, 3.0, nullptr), Error);
}

TEST(TcpSocket, FindsNamesAndListensWhereItIsTold)
{
  const TcpSocket listener = TcpSocket::Listen("localhost", 0);
  TcpSocket client = TcpSocket::Connect("localhost", listener.Port(), 5.0, nullptr);
  TcpSocket server;
  ASSERT_TRUE(Eventually([&] { return (server = listener.Accept()).IsOpen(); }));
  EXPECT_EQ(server.Peer().find("127.0.0.1:"), 0u);
  EXPECT_THROW(TcpSocket::Listen("127.0.0.1", listener.Port()), Error);
  unsigned char byte = 0;
  EXPECT_EQ(client.Receive(&byte, 1), std::optional<std::size_t>(0));
  server.Close();
  ASSERT_TRUE(Eventually([&] { return !client.Receive(&byte, 1); }));
  EXPECT_EQ(client.EndReason(), "closed by the peer");
  EXPECT_TRUE(Eventually([&] { return !client.Send({{&byte, 1}}); })); // and no signal
}

TEST(TcpSocket, ConnectingStopsWhenAsked)
{
  const double start = ClockNow();
  // A place that never answers (reserved for documentation), or one that this machine cannot reach at all.
  try {
    EXPECT_FALSE(TcpSocket::Connect("192.0.2.1", 9, 100.0, [&] { return ClockNow() - start > 0.05; }).IsOpen());
  } catch (const Error&) {
  }
  EXPECT_LT(ClockNow() - start, 30.0);
}

TEST(SendQueue, DropsTheOldestWholeMessagesAndKeepsTheNewestImage)
{
  const TcpSocket listener = TcpSocket::Listen("127.0.0.1", 0);
  TcpSocket client = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr), server;
  ASSERT_TRUE(Eventually([&] { return (server = listener.Accept()).IsOpen(); }));
  SendQueue queue(100);
  for (unsigned char i = 0; i < 10; ++i)
    queue.Push(std::make_shared<const Bytes>(30, i)); // three have room
  queue.PushNewest("a", std::make_shared<const Bytes>(1000, 100));
  queue.PushNewest("a", std::make_shared<const Bytes>(1000, 101));
  queue.PushNewest("b", std::make_shared<const Bytes>(1000, 102));
  EXPECT_EQ(queue.Dropped(), 8u);
  Bytes got;
  ASSERT_TRUE(Eventually([&] {
    EXPECT_TRUE(queue.Flush(server));
    unsigned char bytes[4096];
    const auto size = client.Receive(bytes, sizeof bytes);
    got.insert(got.end(), bytes, bytes + size.value_or(0));
    return got.size() >= 2090;
  }));
  Bytes expected;
  for (const auto& [count, value] : {std::pair{30, 7}, {30, 8}, {30, 9}, {1000, 101}, {1000, 102}})
    expected.insert(expected.end(), static_cast<std::size_t>(count), static_cast<unsigned char>(value));
  EXPECT_EQ(got, expected);
  EXPECT_EQ(queue.Sent(), 5u);
}

TEST(SendQueue, NewNamesOfImagesCostTheOldest)
{
  const TcpSocket listener = TcpSocket::Listen("127.0.0.1", 0);
  TcpSocket client = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr), server;
  ASSERT_TRUE(Eventually([&] { return (server = listener.Accept()).IsOpen(); }));
  SendQueue queue(100, 2);
  for (const char* name : {"a", "b", "a", "c", "d"})
    queue.PushNewest(name, std::make_shared<const Bytes>(1, static_cast<unsigned char>(*name)));
  EXPECT_EQ(queue.Dropped(), 3u); // the first a, the second, b
  Bytes got;
  ASSERT_TRUE(Eventually([&] {
    EXPECT_TRUE(queue.Flush(server));
    unsigned char bytes[16];
    got.insert(got.end(), bytes, bytes + client.Receive(bytes, sizeof bytes).value_or(0));
    return got.size() >= 2;
  }));
  EXPECT_EQ(got, (Bytes{'c', 'd'}));
}

TEST(OpenIgtLink, EveryPoseArrivesAsTransformAndAsTrackingData)
{
  PoseStream from, transforms, data;
  OpenIgtLinkServer server(AnyPort());
  server.Start(&from);
  OpenIgtLinkClient first(To(server.Port())), second(To(server.Port(), "&tdata=1"));
  first.Start(transforms, nullptr);
  second.Start(data, nullptr);
  ASSERT_TRUE(Eventually([&] { return server.Statistics().clients == 2; }));
  // Until their first messages have been understood: one is seen by TDATA, the other by poses that are not valid.
  double time = Now();
  ASSERT_TRUE(Eventually([&] {
    from.Add(At("HelloToTracker", time += 0.001, TransformStatus::Missing));
    from.Add(At("HiToTracker", time));
    return !transforms.Tools().empty() && transforms.Tools()[0] == "HelloToTracker" && !data.Tools().empty();
  }));
  const int count = 500;
  for (int i = 0; i < count; ++i)
    for (const char* tool : {"ProbeToTracker", "ReferenceToTracker", "StylusToTracker"})
      from.Add(At(tool, Now() + 10.0 + 0.004 * i));
  for (const char* tool : {"ProbeToTracker", "ReferenceToTracker", "StylusToTracker"}) {
    ASSERT_TRUE(Eventually([&] { return Valid(transforms, tool) == count; })) << Valid(transforms, tool);
    ASSERT_TRUE(Eventually([&] { return Valid(data, tool) == count; })) << Valid(data, tool);
    const ToolPose pose = data.Latest(tool);
    EXPECT_NEAR(pose.time, Now() + 10.0 + 0.004 * (count - 1), 1e-6);
    EXPECT_NEAR(pose.pose.translation()[1], 2.0, 1e-6);
  }
  EXPECT_EQ(server.Statistics().dropped, 0u);
  EXPECT_EQ(transforms.Statistics().Rejected(Rejection::Malformed), 0u);
}

TEST(OpenIgtLink, TrackingDataComeNoFasterThanAskedFor)
{
  PoseStream from, data;
  OpenIgtLinkServer server(AnyPort());
  server.Start(&from);
  OpenIgtLinkClient client(To(server.Port(), "&tdata=1&resolution=20"));
  client.Start(data, nullptr);
  double time = Now();
  ASSERT_TRUE(Eventually([&] {
    from.Add(At("HiToTracker", time += 0.001));
    return !data.Tools().empty();
  }));
  for (int i = 0; i < 1000; ++i) // 4 ms apart: every fifth
    from.Add(At("ProbeToTracker", Now() + 10.0 + 0.004 * i));
  from.Add(At("EndToTracker", Now() + 20.0));
  ASSERT_TRUE(Eventually([&] { return Valid(data, "EndToTracker") == 1; }));
  EXPECT_EQ(Valid(data, "ProbeToTracker"), 200u);
}

TEST(OpenIgtLink, TheClientComesBackWhenTheServerDoes)
{
  PoseStream from, poses;
  auto server = std::make_unique<OpenIgtLinkServer>(AnyPort());
  server->Start(&from);
  const int port = server->Port();
  OpenIgtLinkClient client(To(port));
  client.Start(poses, nullptr);
  ASSERT_TRUE(Eventually([&] { return server->Statistics().clients == 1; }));
  from.Add(At("ProbeToTracker", Now()));
  ASSERT_TRUE(Eventually([&] { return Valid(poses, "ProbeToTracker") == 1; }));
  server.reset();
  ASSERT_TRUE(Eventually([&] { return poses.Statistics().state == DeviceState::Lost; }));
  EXPECT_NE(poses.Statistics().message.find(std::to_string(port)), std::string::npos);
  OpenIgtLinkServerParameters parameters;
  parameters.port = port;
  server = std::make_unique<OpenIgtLinkServer>(parameters);
  server->Start(&from);
  ASSERT_TRUE(Eventually([&] { return server->Statistics().clients == 1; }));
  from.Add(At("ProbeToTracker", Now() + 0.1));
  ASSERT_TRUE(Eventually([&] { return Valid(poses, "ProbeToTracker") == 2; }));
  EXPECT_EQ(poses.Statistics().state, DeviceState::Running);
}

TEST(OpenIgtLink, AClientStopsAtOnceWhateverItDoes)
{
  PoseStream poses;
  const TcpSocket silent = TcpSocket::Listen("127.0.0.1", 0);
  for (const std::string& place : {std::string("127.0.0.1:") + std::to_string(silent.Port()), std::string("127.0.0.1:1"),
                                   std::string("192.0.2.1:9"), std::string("no.such.host.invalid:9")}) {
    OpenIgtLinkClient client(TrackerAddress::Parse("igtl://" + place + "?retry=600"));
    client.Start(poses, nullptr);
    WaitForSockets({}, {}, 0.05);
    const double start = ClockNow();
    client.Stop();
    EXPECT_LT(ClockNow() - start, 30.0) << place; // 0.25 s on a machine that is not busy
    EXPECT_EQ(poses.Statistics().state, DeviceState::Idle);
  }
}

TEST(OpenIgtLink, PosesThatAreNotValidGoToThoseWhoUnderstandThem)
{
  PoseStream from, knows, old;
  OpenIgtLinkServer server(AnyPort());
  server.Start(&from);
  OpenIgtLinkClient first(To(server.Port())), second(To(server.Port(), "&header=1"));
  first.Start(knows, nullptr);
  second.Start(old, nullptr);
  double time = Now();
  ASSERT_TRUE(Eventually([&] {
    from.Add(At("HelloToTracker", time += 0.001, TransformStatus::OutOfRange));
    from.Add(At("HiToTracker", time));
    return knows.Latest("HelloToTracker").status == TransformStatus::OutOfRange && Valid(old, "HiToTracker") > 0;
  }));
  EXPECT_EQ(old.Tools(), std::vector<std::string>{"HiToTracker"});
}

TEST(OpenIgtLink, ImagesGoToThoseWhoAreThereAndThoseWhoComeLater)
{
  OpenIgtLinkServer server(AnyPort());
  server.Start();
  PoseStream poses;
  ImageStream early, late;
  OpenIgtLinkClient first(To(server.Port()));
  first.Start(poses, &early);
  ASSERT_TRUE(server.WaitForClient(Patience));
  const StreamedImage image = SomeImage("Volume", 100);
  server.SendImage(SomeImage("Other", 4));
  server.SendImage(image);
  ASSERT_TRUE(Eventually([&] { return early.Version() == 2; }));
  EXPECT_TRUE(server.Flush(Patience));
  PoseStream others;
  OpenIgtLinkClient second(To(server.Port()));
  second.Start(others, &late);
  ASSERT_TRUE(Eventually([&] { return late.Version() == 2; }));
  for (const ImageStream* stream : {&early, &late}) {
    const StreamedImage got = stream->Latest();
    EXPECT_EQ(got.name, "Volume");
    EXPECT_TRUE(got.geometry.AgreesWith(image.geometry));
    EXPECT_EQ(*got.voxels, *image.voxels);
    EXPECT_EQ(got.time, 5.0);
  }
}

TEST(OpenIgtLink, AClientThatNeverReadsHoldsUpNobody)
{
  PoseStream from, poses;
  OpenIgtLinkServerParameters parameters = AnyPort();
  parameters.queuedBytes = 4096;
  OpenIgtLinkServer server(parameters);
  server.Start(&from);
  const TcpSocket deaf = TcpSocket::Connect("127.0.0.1", server.Port(), 5.0, nullptr);
  OpenIgtLinkClient client(To(server.Port()));
  client.Start(poses, nullptr);
  ASSERT_TRUE(Eventually([&] { return server.Statistics().clients == 2; }));
  server.SendImage(SomeImage("Volume", 250)); // fills the system's own buffers for the deaf one
  std::uint64_t sent = 0;
  ASSERT_TRUE(Eventually([&] {
    for (int i = 0; i < 10; ++i)
      from.Add(At("ProbeToTracker", Now() + 0.001 * static_cast<double>(++sent)));
    return server.Statistics().dropped > 100;
  }));
  // The deaf one has lost its own; the other gets what comes now. (It, too, may have lost some behind the image.)
  const std::uint64_t before = Valid(poses, "ProbeToTracker");
  from.Add(At("EndToTracker", Now() + 1000.0));
  ASSERT_TRUE(Eventually([&] { return Valid(poses, "EndToTracker") == 1; }));
  EXPECT_GE(Valid(poses, "ProbeToTracker"), before);
  const double start = ClockNow();
  server.Stop();
  EXPECT_LT(ClockNow() - start, 30.0);
}

TEST(OpenIgtLink, WhatWasFlushedOutlivesTheServer)
{
  for (int round = 0; round < 3; ++round) {
    PoseStream from, poses;
    OpenIgtLinkServer server(AnyPort());
    server.Start(&from);
    OpenIgtLinkClient client(To(server.Port(), "&header=1"));
    client.Start(poses, nullptr);
    ASSERT_TRUE(server.WaitForClient(Patience));
    const std::uint64_t count = 3000;
    for (std::uint64_t i = 0; i < count; ++i)
      from.Add(At("ProbeToTracker", Now() + 0.004 * static_cast<double>(i)));
    ASSERT_TRUE(server.Flush(Patience));
    server.Stop();
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().state == DeviceState::Lost; }));
    EXPECT_EQ(Valid(poses, "ProbeToTracker"), count);
    EXPECT_FALSE(server.Flush(0.0));
  }
}

TEST(OpenIgtLink, PosesThatNobodyServesAreCounted)
{
  OpenIgtLinkServer server(AnyPort());
  for (int i = 0; i < 65536 + 10; ++i)
    server.Send(At("ProbeToTracker", i));
  EXPECT_EQ(server.Statistics().lost, 10u);
  server.Start();
  EXPECT_TRUE(server.Flush(Patience));
  EXPECT_EQ(server.Statistics().lost, 10u);
}

TEST(OpenIgtLink, TheServerTurnsAwayTooManyAndDisconnectsGarbage)
{
  OpenIgtLinkServerParameters parameters = AnyPort();
  parameters.clients = 1;
  OpenIgtLinkServer server(parameters);
  server.Start();
  TcpSocket first = TcpSocket::Connect("127.0.0.1", server.Port(), 5.0, nullptr);
  ASSERT_TRUE(server.WaitForClient(Patience));
  TcpSocket second = TcpSocket::Connect("127.0.0.1", server.Port(), 5.0, nullptr);
  unsigned char byte = 0;
  ASSERT_TRUE(Eventually([&] { return !second.Receive(&byte, 1); }));
  EXPECT_EQ(server.Statistics().turnedAway, 1u);
  const std::string text = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUser-Agent: something that is no tracker at all\r\n\r\n";
  ASSERT_TRUE(SendAll(first, Bytes(text.begin(), text.end())));
  ASSERT_TRUE(Eventually([&] { return !first.Receive(&byte, 1); }));
  ASSERT_TRUE(Eventually([&] { return server.Statistics().clients == 0; }));
  EXPECT_EQ(server.Statistics().refused, 1u);
}

TEST(OpenIgtLink, TheClientCountsGarbageHalfMessagesAndLengthsThatCannotBe)
{
  const TcpSocket listener = TcpSocket::Listen("127.0.0.1", 0);
  PoseStream poses;
  OpenIgtLinkClient client(To(listener.Port()));
  client.Start(poses, nullptr);
  const auto accept = [&] {
    TcpSocket socket;
    EXPECT_TRUE(Eventually([&] { return (socket = listener.Accept()).IsOpen(); }));
    return socket;
  };
  const Bytes good = OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now()));
  { // garbage after a good message
    TcpSocket peer = accept();
    Bytes bytes = good;
    bytes.insert(bytes.end(), 300, 0xaa);
    ASSERT_TRUE(SendAll(peer, bytes));
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().Rejected(Rejection::Malformed) == 1; }));
    EXPECT_EQ(Valid(poses, "ProbeToTracker"), 1u);
  }
  { // 2 GB
    TcpSocket peer = accept();
    Bytes bytes = good;
    bytes[46] = 0x80;
    ASSERT_TRUE(SendAll(peer, bytes));
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().Rejected(Rejection::TooLarge) == 1; }));
  }
  { // unplugged in the middle of a message
    TcpSocket peer = accept();
    ASSERT_TRUE(SendAll(peer, Bytes(good.begin(), good.begin() + 80)));
    WaitForSockets({}, {}, 0.05);
    peer.Close();
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().Rejected(Rejection::Malformed) == 2; }));
    EXPECT_NE(poses.Statistics().lastRejection.find("middle of a message"), std::string::npos);
  }
  { // a check sum that is wrong costs one message and not the connection
    TcpSocket peer = accept();
    Bytes bytes = OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now() + 1.0));
    bytes[60] ^= 1;
    const Bytes next = OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now() + 2.0));
    bytes.insert(bytes.end(), next.begin(), next.end());
    ASSERT_TRUE(SendAll(peer, bytes));
    ASSERT_TRUE(Eventually([&] { return Valid(poses, "ProbeToTracker") == 2; }));
    EXPECT_EQ(poses.Statistics().Rejected(Rejection::Malformed), 3u);
    // What its status says is passed on.
    ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().Status(13, "warming up")));
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().message.find("warming up") != std::string::npos; }));
    ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().Status(5, "\xc2\x9b" + std::string(1000000, 'x'))));
    ASSERT_TRUE(Eventually([&] { return poses.Statistics().message.find("xxx") != std::string::npos; }));
    EXPECT_NE(poses.Statistics().message.find("\\xc2\\x9bxxx"), std::string::npos) << "as it would end up in a terminal";
    EXPECT_LT(poses.Statistics().message.size(), 1000u);
  }
}

TEST(OpenIgtLink, TheListenerTakesWhatSeveralPeersPush)
{
  PoseStream poses;
  ImageStream images;
  OpenIgtLinkListener listener(TrackerAddress::Parse("igtl-listen://:0?peers=2"));
  listener.Start(poses, &images);
  TcpSocket first = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr),
            second = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr);
  ASSERT_TRUE(SendAll(first, OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now()))));
  ASSERT_TRUE(SendAll(second, OpenIgtLinkEncoder().TrackingData({At("StylusToTracker", Now())})));
  ASSERT_TRUE(SendAll(second, OpenIgtLinkEncoder().Image(SomeImage("Volume", 8))));
  ASSERT_TRUE(Eventually([&] { return poses.Tools().size() == 2 && images.Version() == 1; }));
  EXPECT_EQ(poses.Statistics().state, DeviceState::Running);
  TcpSocket third = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr);
  ASSERT_TRUE(Eventually([&] { return poses.Statistics().Rejected(Rejection::Foreign) == 1; }));
  ASSERT_TRUE(SendAll(first, OpenIgtLinkEncoder().Bare("GET_STATUS")));
  OpenIgtLinkDecoder decoder;
  ASSERT_TRUE(Eventually([&] {
    unsigned char bytes[1024];
    for (const auto& message : decoder.Feed(bytes, first.Receive(bytes, sizeof bytes).value_or(0)))
      return message.kind == OpenIgtLinkMessage::Kind::Status && message.statusCode == 1;
    return false;
  }));
  first.Close();
  second.Close();
  ASSERT_TRUE(Eventually([&] { return poses.Statistics().state == DeviceState::Lost; }));
}

TEST(OpenIgtLink, AToolComesFromOnePeerUntilItHasGone)
{
  PoseStream poses;
  OpenIgtLinkListener listener(TrackerAddress::Parse("igtl-listen://:0"));
  listener.Start(poses, nullptr);
  TcpSocket first = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr),
            second = TcpSocket::Connect("127.0.0.1", listener.Port(), 5.0, nullptr);
  ASSERT_TRUE(SendAll(first, OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now()))));
  ASSERT_TRUE(Eventually([&] { return Valid(poses, "ProbeToTracker") == 1; }));
  ASSERT_TRUE(SendAll(second, OpenIgtLinkEncoder().Transform(At("ProbeToTracker", Now() + 1.0))));
  ASSERT_TRUE(SendAll(second, OpenIgtLinkEncoder().Transform(At("StylusToTracker", Now() + 1.0))));
  ASSERT_TRUE(Eventually([&] { return Valid(poses, "StylusToTracker") == 1; }));
  EXPECT_EQ(Valid(poses, "ProbeToTracker"), 1u);
  EXPECT_EQ(poses.Statistics().Rejected(Rejection::Foreign), 1u);
  EXPECT_NE(poses.Statistics().lastRejection.find("another peer sends ProbeToTracker"), std::string::npos);
  first.Close();
  double time = Now() + 2.0;
  EXPECT_TRUE(Eventually([&] { // as soon as it is seen that it has gone
    EXPECT_TRUE(SendAll(second, OpenIgtLinkEncoder().Transform(At("ProbeToTracker", time += 1.0))));
    return Valid(poses, "ProbeToTracker") > 1;
  }));
}

TEST(OpenIgtLink, AToolGoesOnFromAnotherPeerWhenItsOwnIsSilent)
{
  const OpenIgtLinkReceiver one({}, {}), other({}, {});
  ToolOwners owners;
  EXPECT_TRUE(owners.Owns(&one, "a", 10.0));
  EXPECT_FALSE(owners.Owns(&other, "a", 11.0));
  EXPECT_TRUE(owners.Owns(&one, "a", 11.5));
  EXPECT_FALSE(owners.Owns(&other, "a", 13.0));
  EXPECT_TRUE(owners.Owns(&other, "a", 14.0)); // a connection that broke without a word
  EXPECT_FALSE(owners.Owns(&one, "a", 15.0));
  EXPECT_TRUE(owners.Owns(&one, "b", 15.0));
  owners.Forget(&other);
  EXPECT_TRUE(owners.Owns(&one, "a", 15.0));
}

TEST(OpenIgtLink, TheListenerDoesNotSpinWhenThereAreNoDescriptors)
{
  if (IsSanitized())
    GTEST_SKIP() << "the sanitizers need descriptors of their own to look at objects";
  PoseStream poses;
  OpenIgtLinkListener listener(TrackerAddress::Parse("igtl-listen://:0"));
  listener.Start(poses, nullptr);
  const int peer = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), next = dup(peer);
  ASSERT_GE(next, 0);
  close(next);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit none = before;
  none.rlim_cur = static_cast<rlim_t>(next); // what is open goes on; nothing more can be opened
  setrlimit(RLIMIT_NOFILE, &none);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(listener.Port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int connected = connect(peer, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const double start = ClockNow();
  const std::clock_t work = std::clock();
  while (ClockNow() - start < 0.5)
    WaitForSockets({}, {}, 0.5);
  const double share = static_cast<double>(std::clock() - work) / CLOCKS_PER_SEC / (ClockNow() - start);
  const DeviceState state = poses.Statistics().state;
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(connected, 0);
  EXPECT_LT(share, 0.3);
  EXPECT_EQ(state, DeviceState::Connecting);
  EXPECT_TRUE(Eventually([&] { return poses.Statistics().state == DeviceState::Running; }));
  close(peer);
}

TEST(OpenIgtLink, TheServerAnswersRequests)
{
  PoseStream from;
  OpenIgtLinkServer server(AnyPort());
  server.Start(&from);
  server.SendImage(SomeImage("Volume", 4));
  TcpSocket peer = TcpSocket::Connect("127.0.0.1", server.Port(), 5.0, nullptr);
  OpenIgtLinkDecoder decoder;
  std::vector<OpenIgtLinkMessage> got;
  const auto receive = [&] {
    unsigned char bytes[4096];
    for (OpenIgtLinkMessage& message : decoder.Feed(bytes, peer.Receive(bytes, sizeof bytes).value_or(0)))
      got.push_back(std::move(message));
  };
  const auto wait = [&](const std::string& type) {
    got.clear();
    return Eventually([&] {
      receive();
      return !got.empty() && got.back().type == type;
    });
  };
  ASSERT_TRUE(wait("IMAGE")); // it came later
  server.Send(At("ProbeToTracker", Now()));
  ASSERT_TRUE(wait("TRANSFORM"));
  ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().Bare("GET_STATUS")));
  ASSERT_TRUE(wait("STATUS"));
  ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().Bare("STP_TDATA")));
  ASSERT_TRUE(wait("RTS_TDATA"));
  server.Send(At("ProbeToTracker", Now() + 1.0)); // it does not want any
  EXPECT_TRUE(server.Flush(Patience));
  ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().StartTrackingData(0.0, "")));
  ASSERT_TRUE(wait("RTS_TDATA"));
  server.Send(At("ProbeToTracker", Now() + 2.0));
  ASSERT_TRUE(wait("TDATA"));
  EXPECT_EQ(got.back().poses.at(0).time, Now() + 2.0);
  Bytes request = OpenIgtLinkEncoder().Bare("GET_TRANS"); // its header holds our name; of any tool
  std::fill(request.begin() + 14, request.begin() + 34, static_cast<unsigned char>(0));
  ASSERT_TRUE(SendAll(peer, request));
  ASSERT_TRUE(wait("TRANSFORM"));
  EXPECT_EQ(got.back().poses.at(0).time, Now() + 2.0);
  EXPECT_THROW(server.Send(At("ThisOneIsFarTooLongToBeTrueToTracker", Now())), Error);
}

TEST(OpenIgtLink, WhoAsksAThousandTimesAtOnceIsAnsweredSeldom)
{
  OpenIgtLinkServer server(AnyPort());
  server.Start(nullptr);
  TcpSocket peer = TcpSocket::Connect("127.0.0.1", server.Port(), 5.0, nullptr);
  OpenIgtLinkDecoder decoder;
  int answers = 0;
  bool isLast = false;
  const auto receive = [&] {
    unsigned char bytes[4096];
    for (const OpenIgtLinkMessage& message : decoder.Feed(bytes, peer.Receive(bytes, sizeof bytes).value_or(0))) {
      answers += message.type == "TRANSFORM";
      isLast = isLast || message.type == "RTS_TDATA";
    }
  };
  server.Send(At("ProbeToTracker", Now()));
  ASSERT_TRUE(Eventually([&] {
    receive();
    return answers == 1;
  }));
  Bytes request = OpenIgtLinkEncoder().Bare("GET_TRANS"), requests;
  std::fill(request.begin() + 14, request.begin() + 34, static_cast<unsigned char>(0)); // of any tool
  for (int i = 0; i < 1000; ++i)
    requests.insert(requests.end(), request.begin(), request.end());
  ASSERT_TRUE(SendAll(peer, requests));
  ASSERT_TRUE(SendAll(peer, OpenIgtLinkEncoder().Bare("STP_TDATA")));
  ASSERT_TRUE(Eventually([&] {
    receive();
    return isLast;
  }));
  EXPECT_TRUE(server.Flush(Patience));
  EXPECT_TRUE(Eventually([&] { // the answer of the last turn may follow the reply
    receive();
    return answers > 1;
  }));
  EXPECT_LT(answers, 100);
}

TEST(OpenIgtLink, TheLibrarysClientUnderstandsOurServer)
{
  PoseStream from;
  OpenIgtLinkServer server(AnyPort());
  server.Start(&from);
  igtl::ClientSocket::Pointer socket = igtl::ClientSocket::New();
  ASSERT_EQ(socket->ConnectToServer("127.0.0.1", server.Port()), 0);
  socket->SetReceiveTimeout(5000);
  ASSERT_TRUE(server.WaitForClient(Patience));
  from.Add(At("ProbeToTracker", Now() + 0.5, TransformStatus::Missing)); // not for the old
  from.Add(At("ProbeToTracker", Now() + 1.0));
  igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  header->InitPack();
  ASSERT_EQ(socket->Receive(header->GetPackPointer(), header->GetPackSize()), header->GetPackSize());
  header->Unpack();
  EXPECT_STREQ(header->GetDeviceType(), "TRANSFORM");
  EXPECT_STREQ(header->GetDeviceName(), "ProbeToTracker");
  igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  socket->Receive(message->GetPackBodyPointer(), message->GetPackBodySize());
  ASSERT_TRUE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY);
  igtl::Matrix4x4 matrix;
  message->GetMatrix(matrix);
  EXPECT_EQ(matrix[2][3], 3.0f);
  unsigned int seconds = 0, fraction = 0;
  header->GetTimeStamp(&seconds, &fraction);
  EXPECT_EQ(static_cast<double>(seconds), Now() + 1.0);
  socket->CloseSocket();
}

TEST(OpenIgtLink, OptionsThatAreWrongAreNamed)
{
  const auto complaint = [](const std::string& text) {
    try {
      MakeTracker(text);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint("igtl://localhost:18944?tdata=1&resolution=20&header=1&axes=sender"), "");
  EXPECT_EQ(complaint("igtl-listen:"), "");
  EXPECT_NE(complaint("igtl://localhost?speed=2").find("speed"), std::string::npos);
  EXPECT_NE(complaint("igtl://localhost?axes=up").find("axes"), std::string::npos);
  EXPECT_NE(complaint("igtl://localhost?retry=0").find("retry"), std::string::npos);
  EXPECT_NE(complaint("igtl://localhost:99999").find("port"), std::string::npos);
  EXPECT_NE(complaint("igtl-listen:?peers=0").find("peers"), std::string::npos);
  OpenIgtLinkServerParameters parameters;
  parameters.clients = 0;
  EXPECT_THROW(OpenIgtLinkServer{parameters}, Error);
  const TcpSocket taken = TcpSocket::Listen("127.0.0.1", 0);
  PoseStream poses;
  OpenIgtLinkListener listener(TrackerAddress::Parse("igtl-listen://127.0.0.1:" + std::to_string(taken.Port())));
  EXPECT_THROW(listener.Start(poses, nullptr), Error);
}
