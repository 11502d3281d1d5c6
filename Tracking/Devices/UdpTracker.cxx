// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/UdpTracker.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Tracking/Devices/HostLookup.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cstring>
#include <memory>
#include <unistd.h>

namespace echorama {
namespace {

constexpr const char* NothingYet = ": nothing has come yet";

// The numbers that packets may come from; any when there are none. A name that is not known (yet) is asked for again and again,
// and nobody is heard meanwhile.
std::vector<std::string> Senders(const std::string& from, const std::string& here, const Worker::Signal& signal,
                                 PoseStream& poses)
{
  std::vector<std::string> numbers;
  while (!from.empty() && numbers.empty() && !signal.Stopped()) {
    try {
      for (const in_addr& address : LookUpHost(from, here + ": from=" + from, 30.0, [&signal] { return signal.Stopped(); }))
        numbers.push_back(HostNumber(address));
      if (!numbers.empty())
        poses.SetState(DeviceState::Connecting, here + NothingYet);
    } catch (const Error& error) {
      poses.SetState(DeviceState::Connecting, error.what());
      signal.Sleep(1.0);
    }
  }
  return numbers;
}

} // namespace

UdpTracker::UdpTracker(const TrackerAddress& address)
{
  address.CheckOptions({"from", "silence"});
  endpoint_ = address.HostAndPort("127.0.0.1", DefaultPort);
  from_ = address.Text("from", "");
  silence_ = address.Number("silence", silence_, 0.1, 3600.0);
}

void UdpTracker::Start(PoseStream& poses, ImageStream*)
{
  Stop();
  const auto socket = std::make_shared<UdpSocket>(UdpSocket::Receiving(endpoint_.host, endpoint_.port));
  port_ = socket->Port();
  const std::string here = "udp://" + endpoint_.host + ":" + std::to_string(port_);
  poses.SetLive(true);
  poses.SetState(DeviceState::Connecting, here + NothingYet);

  RunDevice(worker_, poses, [socket, from = from_, here, silence = silence_, &poses](const Worker::Signal& signal) {
    const auto senders = Senders(from, here, signal, poses);
    PosePacketOrder order(silence);
    PosePacket packet;
    std::vector<unsigned char> bytes;
    std::string sender;
    double last = 0.0;
    bool running = false;
    while (!signal.Stopped()) {
      bytes.resize(PosePacket::MostBytes + 1);
      const bool came = socket->Receive(bytes, sender, 0.05);
      const double now = ClockNow();
      if (running && now - last > silence) {
        running = false;
        poses.SetState(DeviceState::Lost, here + ": the sender is silent");
      }
      if (!came)
        continue;
      if (!senders.empty() && std::find(senders.begin(), senders.end(), sender) == senders.end()) {
        poses.Reject(Rejection::Foreign, here + ": a packet from " + sender);
        continue;
      }
      const std::string complaint = DecodePosePacket(bytes.data(), bytes.size(), packet);
      if (!complaint.empty()) {
        poses.Reject(bytes.size() > PosePacket::MostBytes ? Rejection::TooLarge : Rejection::Malformed,
                     here + ": a packet from " + sender + ": " + complaint);
        continue;
      }
      const auto verdict = order.Judge(packet, now);
      if (verdict != PosePacketOrder::Verdict::New) {
        const bool foreign = verdict == PosePacketOrder::Verdict::Foreign;
        poses.Reject(foreign ? Rejection::Foreign : Rejection::Replayed,
                     here + ": a packet from " + sender + (foreign ? " of another session" : " that is not newer than the last"));
        continue;
      }
      last = now;
      if (!running) {
        running = true;
        poses.SetState(DeviceState::Running, here + ": packets from " + sender);
      }
      for (ToolPose& pose : packet.poses) {
        pose.name = ToolTransformName(pose.name);
        pose.arrival = now;
        poses.Add(pose);
      }
    }
  });
}

UdpSender::UdpSender(const std::string& host, int port, std::uint64_t session)
  : socket_(UdpSocket::SendingTo(host, port)), session_(session)
{
  if (session_ != 0)
    return;
  const double now = ClockNow();
  std::uint64_t seed;
  std::memcpy(&seed, &now, 8);
  Random random(seed, static_cast<std::uint64_t>(getpid()));
  while (session_ == 0) {
    const std::uint64_t high = random.Bits();
    session_ = high << 32 | random.Bits();
  }
}

bool UdpSender::Send(double time, const std::vector<ToolPose>& poses)
{
  return socket_.Send(EncodePosePacket({session_, ++sequence_, time, poses}));
}

} // namespace echorama
