// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/TcpSocket.h"
#include "Tracking/Devices/TrackerAddress.h"

namespace echorama {

/// One connection whose poses and images go into streams: what client and listener have in common.
class OpenIgtLinkReceiver {
public:
  OpenIgtLinkReceiver(TcpSocket socket, const OpenIgtLinkDecoding& decoding) : socket_(std::move(socket)), decoder_(decoding) {}

  /// Takes what has come, and sends what waits. \returns false when the connection has ended or must: EndReason() says why.
  bool Serve(PoseStream& poses, ImageStream* images);

  const TcpSocket& Socket() const { return socket_; }
  SendQueue& Replies() { return replies_; }
  const std::string& EndReason() const { return end_; }
  /// What the peer's last STATUS said when it was not that all is well; else empty.
  const std::string& PeerComplaint() const { return complaint_; }

private:
  void Take(OpenIgtLinkMessage message, double arrival, PoseStream& poses, ImageStream* images);

  TcpSocket socket_;
  OpenIgtLinkDecoder decoder_;
  SendQueue replies_;
  std::string end_, complaint_;
};

/// Reads the options that igtl and igtl-listen have in common (check=0, axes=sender, image-mb=N), and sets \a others.
/// \throws Error(InvalidParameter) that names the option.
OpenIgtLinkDecoding OpenIgtLinkDecodingOf(const TrackerAddress& address, ParameterList others);

} // namespace echorama
