// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/OpenIgtLinkListener.h"
#include "Tracking/Devices/OpenIgtLinkClient.h"
#include "Tracking/Devices/OpenIgtLinkReceiver.h"
#include "Tracking/Devices/RunDevice.h"

namespace echorama {

OpenIgtLinkListener::OpenIgtLinkListener(const TrackerAddress& address)
{
  endpoint_ = address.HostAndPort("127.0.0.1", OpenIgtLinkClient::DefaultPort);
  decoding_ = OpenIgtLinkDecodingOf(
      address,
      {Parameter("Peers", peers_, {1, 64}, "", "How many at once; those beyond are turned away, and count as foreign.")});
}

void OpenIgtLinkListener::Start(PoseStream& poses, ImageStream* images)
{
  Stop();
  listener_ = TcpSocket::Listen(endpoint_.host, endpoint_.port);
  poses.SetLive(true);
  poses.SetState(DeviceState::Connecting, "listening on " + endpoint_.host + ":" + std::to_string(Port()));
  RunDevice(worker_, poses, [this, &poses, images](const Worker::Signal& signal) { Run(signal, poses, images); });
}

void OpenIgtLinkListener::Stop()
{
  worker_.Stop();
  listener_.Close();
}

void OpenIgtLinkListener::Run(const Worker::Signal& signal, PoseStream& poses, ImageStream* images) const
{
  std::vector<std::unique_ptr<OpenIgtLinkReceiver>> peers;
  ToolOwners owners;
  const auto tell = [&] {
    std::string list;
    for (const auto& peer : peers)
      list += (list.empty() ? "connected: " : ", ") + peer->Socket().Peer();
    poses.SetState(DeviceState::Running, list);
  };
  while (!signal.Stopped()) {
    bool starved = false; // somebody is there who cannot be taken: the listener would wake us at once
    while (true) {
      TcpSocket socket = listener_.Accept();
      if (!socket.IsOpen()) {
        starved = !socket.EndReason().empty();
        break;
      }
      if (peers.size() >= peers_) {
        poses.Reject(Rejection::Foreign, socket.Peer() + ": there are " + std::to_string(peers_) + " peers already");
        continue;
      }
      peers.push_back(std::make_unique<OpenIgtLinkReceiver>(std::move(socket), decoding_));
      tell();
    }
    for (std::size_t i = 0; i < peers.size();) {
      if (peers[i]->Serve(poses, images, &owners)) {
        ++i;
        continue;
      }
      const std::string reason = peers[i]->Socket().Peer() + ": " + peers[i]->EndReason();
      owners.Forget(peers[i].get());
      peers.erase(peers.begin() + static_cast<std::ptrdiff_t>(i));
      if (peers.empty())
        poses.SetState(DeviceState::Lost, reason + "; listening");
      else
        tell();
    }
    std::vector<const TcpSocket*> reading, writing;
    if (!starved)
      reading.push_back(&listener_);
    for (const auto& peer : peers) {
      reading.push_back(&peer->Socket());
      if (!peer->Replies().Empty())
        writing.push_back(&peer->Socket());
    }
    WaitForSockets(reading, writing, 0.1);
  }
}

} // namespace echorama
