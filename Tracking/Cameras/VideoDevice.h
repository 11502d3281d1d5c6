// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace echorama {

/// How a camera delivers.
struct VideoMode {
  int width = 0, height = 0;
  double frameRate = 0.0;
  std::string pixels; ///< "GREY", "YUYV", "UYVY", "BGR3"
};

struct VideoPicture {
  const std::uint8_t* data = nullptr; ///< until the next call
  std::size_t bytes = 0;
  double stamp = 0.0; ///< of the driver, s on the machine's monotonic clock; NaN: it gives none
};

/// Frames by OpenCV, from a library of its own that is loaded when the first camera is opened: OpenCV brings two hundred
/// libraries.
class FrameGrabber {
public:
  virtual ~FrameGrabber() = default;
  /// \returns the mode that the camera took, which need not be \a wanted
  virtual VideoMode Open(const std::string& device, const VideoMode& wanted) = 0;
  /// \returns whether a picture came in time. \throws Error(FileSystem) when the camera is gone
  virtual bool Grab(VideoPicture& picture, double seconds) = 0;
};

/// What the system does for a VideoDevice. Tests put something else in its place.
struct VideoCalls {
  std::function<int(const char* path)> open;                                    ///< a file, or -1 and errno
  std::function<int(int file, unsigned long request, void* data)> control;      ///< ioctl
  std::function<std::unique_ptr<FrameGrabber>(const std::string& device)> grab; ///< throws Error(FileSystem)
  static VideoCalls OfTheSystem();
};

/// Controls of a camera.
enum class CameraControl { AutoExposure, Exposure, AutoGain, Gain, AutoWhiteBalance, DynamicRate };

/// A camera by Video4Linux (controls) and OpenCV (frames).
class VideoDevice {
public:
  explicit VideoDevice(VideoCalls calls = VideoCalls::OfTheSystem()) : calls_(std::move(calls)) {}
  ~VideoDevice() { Close(); }
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;

  /// As FrameGrabber::Open. \throws Error(FileSystem) that says why not: there is none, no permission, in use, no camera
  VideoMode Open(const std::string& device, const VideoMode& wanted);
  /// What v4l2-ctl calls it, and its value; nothing when the camera has no such control.
  struct Value {
    std::string name;
    std::int64_t value = 0;
  };
  std::optional<Value> Get(CameraControl control) const;
  /// Whether it worked is for Get to say.
  void Set(CameraControl control, std::int64_t value) const;
  bool Grab(VideoPicture& picture, double seconds) { return grabber_->Grab(picture, seconds); } ///< while it is open
  void Close();

private:
  int Ask(unsigned long request, void* data) const;

  VideoCalls calls_;
  int file_ = -1;
  std::unique_ptr<FrameGrabber> grabber_;
};

} // namespace echorama
