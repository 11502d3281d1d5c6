// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"

namespace echorama {

/// Scheme igtl: connects to an OpenIGTLink server, such as Plus or 3D Slicer, and takes its poses and images. Goes on
/// trying when nobody is there, and again when the connection is lost or what comes is no OpenIGTLink.
///
/// Poses keep their numbers, whatever frame their sender means; images become L, P, S (see axes).
class OpenIgtLinkClient : public TrackerDevice {
public:
  static constexpr const char* Scheme = "igtl";
  static constexpr int DefaultPort = 18944;

  /// \throws Error(InvalidParameter) that names the address and the option.
  explicit OpenIgtLinkClient(const TrackerAddress& address);
  ~OpenIgtLinkClient() override { Stop(); }

  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override { worker_.Stop(); }

private:
  void Run(const Worker::Signal& signal, PoseStream& poses, ImageStream* images) const;

  TrackerAddress::Endpoint endpoint_;
  OpenIgtLinkDecoding decoding_;
  bool trackingData_ = false;
  int header_ = 2;
  double resolutionSeconds_ = 0.0, retrySeconds_ = 1.0;
  std::string frame_;
  Worker worker_;
};

} // namespace echorama
