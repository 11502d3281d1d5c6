// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/OpenIgtLinkClient.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Tracking/Devices/OpenIgtLinkReceiver.h"
#include "Tracking/Devices/RunDevice.h"

namespace echorama {

OpenIgtLinkClient::OpenIgtLinkClient(const TrackerAddress& address)
{
  endpoint_ = address.HostAndPort("localhost", DefaultPort);
  double milliseconds = 0.0;
  decoding_ = OpenIgtLinkDecodingOf(
      address,
      {Parameter("Tdata", trackingData_, "Whether TDATA is asked for (STT_TDATA)."),
       Parameter("Resolution", milliseconds, {0, 1e6}, "ms", "Shortest time between two poses that is asked for with TDATA."),
       Parameter("Frame", frame_, "Name of the coordinate system that is asked for with TDATA."),
       Parameter("Header", header_, {1, 2}, "",
                 "2 says that we read meta data, so that poses that are not valid come too; 1 is for an old server."),
       Parameter("Retry", retrySeconds_, {0.05, 3600}, "s", "Time between two attempts.")});
  resolutionSeconds_ = milliseconds / 1000.0;
}

void OpenIgtLinkClient::Start(PoseStream& poses, ImageStream* images)
{
  Stop();
  poses.SetLive(true);
  poses.SetState(DeviceState::Connecting, "to " + endpoint_.host + ":" + std::to_string(endpoint_.port));
  RunDevice(worker_, poses, [this, &poses, images](const Worker::Signal& signal) { Run(signal, poses, images); });
}

void OpenIgtLinkClient::Run(const Worker::Signal& signal, PoseStream& poses, ImageStream* images) const
{
  const std::string place = endpoint_.host + ":" + std::to_string(endpoint_.port);
  const auto stopped = [&signal] { return signal.Stopped(); };
  const OpenIgtLinkEncoder encoder(header_);
  const auto send = [](OpenIgtLinkReceiver& connection, OpenIgtLinkEncoder::Bytes bytes) {
    connection.Replies().Push(std::make_shared<const std::vector<unsigned char>>(std::move(bytes)));
  };
  bool before = false; // it was there before
  do {
    std::string reason;
    try {
      OpenIgtLinkReceiver connection(TcpSocket::Connect(endpoint_.host, endpoint_.port, 5.0, stopped), decoding_);
      if (!connection.Socket().IsOpen())
        return;
      before = true;
      poses.SetState(DeviceState::Running, "connected to " + place);
      if (trackingData_)
        send(connection, encoder.StartTrackingData(resolutionSeconds_, frame_));
      else if (header_ >= 2)
        send(connection, encoder.Bare("GET_STATUS")); // shows the version of our header
      std::string complaint;
      bool there = true;
      while ((there = connection.Serve(poses, images)) && !signal.Stopped()) {
        if (connection.PeerComplaint() != complaint) {
          complaint = connection.PeerComplaint();
          poses.SetState(DeviceState::Running, "connected to " + place + (complaint.empty() ? "" : ", which says: " + complaint));
        }
        std::vector<const TcpSocket*> writing;
        if (!connection.Replies().Empty())
          writing.push_back(&connection.Socket());
        WaitForSockets({&connection.Socket()}, writing, 0.1);
      }
      if (there)
        return;
      reason = place + ": " + connection.EndReason();
    } catch (const Error& error) { // nobody there
      reason = error.what();
    }
    poses.SetState(before ? DeviceState::Lost : DeviceState::Connecting, reason + "; trying again");
  } while (signal.Sleep(retrySeconds_));
}

} // namespace echorama
