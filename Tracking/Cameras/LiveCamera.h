// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Cameras/CameraSource.h"
#include "Tracking/Cameras/VideoDevice.h"
#include "Tracking/Devices/TrackerAddress.h"

namespace echorama {

struct LiveCameraParameters {
  std::string device; ///< "/dev/video0"
  int width = 640, height = 480;
  double frameRate = 90.0, exposureMs = 8.0, rowUs = 0.0;
  bool fixedExposure = false;
  int gain = -1;
  double stampMs = -1.0;

  /// From "camera:0?width=640&height=480" or "camera:/dev/video2?gain=20". \throws Error(InvalidParameter)
  static LiveCameraParameters Of(const TrackerAddress& address);
};
ParameterList Describe(LiveCameraParameters& p);

/// A camera, with nothing automatic: exposure, gain and white balance are fixed, and read back, because pictures that change by
/// themselves are no measurement.
class LiveCamera : public CameraSource {
public:
  /// \throws Error(InvalidParameter)
  explicit LiveCamera(const LiveCameraParameters& parameters, VideoCalls calls = VideoCalls::OfTheSystem());

  /// \throws Error(FileSystem) absent, busy, not permitted; Error(NotPossible) for another size, rate or exposure than asked for,
  /// and for what stays automatic
  CameraFormat Open() override;
  Outcome Next(CameraFrame& frame, double seconds) override;
  void Close() override;
  bool IsLive() const override { return true; }
  std::int64_t Lost() const override { return lost_; }

private:
  void Fix(CameraControl automatic, std::int64_t off, const char* what);
  void CheckMode(const VideoMode& mode);
  double FixedExposure();
  [[noreturn]] void Refuse(const std::string& reason);

  LiveCameraParameters parameters_;
  VideoDevice device_;
  CameraFormat format_;
  bool isOpen_ = false;
  std::int64_t number_ = -1, lost_ = 0;
  double last_ = 0.0;  // begin of the newest frame
  double stamp_ = 0.0; // the newest of the driver's that was of our clock; infinite: none was
};

} // namespace echorama
