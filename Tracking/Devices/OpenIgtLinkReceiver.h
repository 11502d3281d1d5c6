// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/TcpSocket.h"
#include "Tracking/Devices/TrackerAddress.h"
#include <map>
#include <string>

namespace echorama {

class OpenIgtLinkReceiver;

/// Whose tools are whose, where several peers send: two tools of one name would become one that jumps from place to place.
class ToolOwners {
public:
  /// Whether \a tool may come from that \a peer \a now (s): nobody else has sent it in the last two seconds.
  bool Owns(const OpenIgtLinkReceiver* peer, const std::string& tool, double now);
  void Forget(const OpenIgtLinkReceiver* peer); ///< it has gone

private:
  static constexpr std::size_t MostTools = 4096; // a peer may send any number
  struct Owner {
    const OpenIgtLinkReceiver* peer;
    double last;
  };
  std::map<std::string, Owner> owners_;
};

/// One connection whose poses and images go into streams: what client and listener have in common.
class OpenIgtLinkReceiver {
public:
  OpenIgtLinkReceiver(TcpSocket socket, const OpenIgtLinkDecoding& decoding) : socket_(std::move(socket)), decoder_(decoding) {}

  /// Takes what has come, and sends what waits. \returns false when the connection has ended or must: EndReason() says why.
  /// \a owners: poses of tools that belong to another peer are rejected.
  bool Serve(PoseStream& poses, ImageStream* images, ToolOwners* owners = nullptr);

  const TcpSocket& Socket() const { return socket_; }
  SendQueue& Replies() { return replies_; }
  const std::string& EndReason() const { return end_; }
  /// What the peer's last STATUS said when it was not that all is well; else empty.
  const std::string& PeerComplaint() const { return complaint_; }

private:
  void Take(OpenIgtLinkMessage message, double arrival, PoseStream& poses, ImageStream* images, ToolOwners* owners);

  TcpSocket socket_;
  OpenIgtLinkDecoder decoder_;
  SendQueue replies_;
  std::string end_, complaint_;
};

/// Reads the options that igtl and igtl-listen have in common (check=0, axes=sender, image-mb=N), and sets \a others.
/// \throws Error(InvalidParameter) that names the option.
OpenIgtLinkDecoding OpenIgtLinkDecodingOf(const TrackerAddress& address, ParameterList others);

} // namespace echorama
