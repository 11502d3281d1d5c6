// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Devices/PosePacket.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Devices/UdpSocket.h"
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// Scheme udp: receives pose packets (PosePacket.h) at udp://HOST:PORT. HOST is ours, and says who can reach us: without it,
/// this machine alone; 0.0.0.0, everybody.
///
/// | option  | meaning                                                                                    | default |
/// | ------- | ------------------------------------------------------------------------------------------ | ------- |
/// | from    | host that packets must come from; those of others are foreign                              | (any)   |
/// | silence | seconds without a packet after which the session is over and another one may begin, in [0.1, 3600] | 2 |
///
/// Packets that are malformed, from elsewhere, of another session, or not newer than the newest are counted and dropped. The
/// state is Lost while the session is silent.
class UdpTracker : public TrackerDevice {
public:
  static constexpr const char* Scheme = "udp";
  static constexpr int DefaultPort = 18950;

  /// \throws Error(InvalidParameter) that names the address and the option.
  explicit UdpTracker(const TrackerAddress& address);
  ~UdpTracker() override { Stop(); }

  /// \throws Error(FileSystem) when the port is taken, HOST is not ours, or a name that is not known. The name behind from is
  /// looked up later, and again and again; the state says so.
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override { worker_.Stop(); }
  /// That packets are received at, while it is started: of use when the address says 0.
  int Port() const { return port_; }

private:
  TrackerAddress::Endpoint endpoint_;
  std::string from_;
  double silence_ = 2.0;
  int port_ = 0;
  Worker worker_;
};

/// What a probe does to be tracked by a UdpTracker.
class UdpSender {
public:
  /// \a session: 0 draws one from the clock and the process. \throws Error(FileSystem), see UdpSocket::SendingTo.
  UdpSender(const std::string& host, int port, std::uint64_t session = 0);

  /// Sends the poses as the next packet. \returns whether the system took it. \throws Error(InvalidParameter), see
  /// EncodePosePacket.
  bool Send(double time, const std::vector<ToolPose>& poses);
  std::uint64_t Session() const { return session_; }

private:
  UdpSocket socket_;
  std::uint64_t session_ = 0, sequence_ = 0;
};

} // namespace echorama
