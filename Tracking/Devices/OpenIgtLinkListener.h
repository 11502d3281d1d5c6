// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/TcpSocket.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"

namespace echorama {

/// Scheme igtl-listen: peers such as 3D Slicer connect to us and push poses and images. On this machine alone unless the
/// address names a host: igtl-listen://0.0.0.0:18944 takes everybody who can reach it, and OpenIGTLink knows no passwords.
class OpenIgtLinkListener : public TrackerDevice {
public:
  static constexpr const char* Scheme = "igtl-listen";

  /// \throws Error(InvalidParameter) that names the address and the option.
  explicit OpenIgtLinkListener(const TrackerAddress& address);
  ~OpenIgtLinkListener() override { Stop(); }

  /// \throws Error(FileSystem) when the port is taken.
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override;

  /// Where it listens: of meaning with port 0.
  int Port() const { return listener_.Port(); }

private:
  void Run(const Worker::Signal& signal, PoseStream& poses, ImageStream* images) const;

  TrackerAddress::Endpoint endpoint_;
  OpenIgtLinkDecoding decoding_;
  std::size_t peers_ = 8;
  TcpSocket listener_;
  Worker worker_;
};

} // namespace echorama
