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
///
/// | option     | meaning                                                                         | default |
/// | ---------- | ------------------------------------------------------------------------------- | ------- |
/// | tdata      | 1: asks for TDATA (STT_TDATA)                                                   | 0       |
/// | resolution | shortest time between two poses that is asked for with tdata=1, ms, in [0, 1e6] | 0       |
/// | frame      | name of the coordinate system that is asked for with tdata=1                    | (none)  |
/// | header     | 2: says that we read meta data, so that poses that are not valid come too; 1: an old server | 2 |
/// | retry      | seconds between two attempts, in [0.05, 3600]                                   | 1       |
/// | check      | 0: does not look at check sums                                                  | 1       |
/// | axes       | sender: the numbers of images stay as they are, and match those of the poses    | patient |
/// | image-mb   | largest image, MiB, in [1, 2047]                                                | 64      |
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
