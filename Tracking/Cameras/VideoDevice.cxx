// SPDX-License-Identifier: BSD-3-Clause
// OpenCV says of a camera that it cannot open nothing but that, and hides most controls. So the device is opened here too: its
// errors are the reasons, its controls are read and set by Video4Linux, and OpenCV delivers the frames.
#include "Tracking/Cameras/VideoDevice.h"
#include "Core/Base/Error.h"
#include <cerrno>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace echorama {
namespace {

[[noreturn]] void FailCamera(const std::string& device, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, device + ": " + reason);
}

std::unique_ptr<FrameGrabber> LoadGrabber(const std::string& device)
{
  void* const library = dlopen("libEchoramaOpenCvCamera.so", RTLD_NOW | RTLD_LOCAL); // it stays
  if (!library)
    FailCamera(device, "frames of cameras come by OpenCV, which this Echorama was built without, or which is not there: install "
                       "libopencv-videoio-dev and build again; recording: and simulated: need none");
  using Make = FrameGrabber* (*)();
  const auto make = reinterpret_cast<Make>(dlsym(library, "EchoramaMakeOpenCvGrabber"));
  if (!make)
    FailCamera(device, "the library of cameras is of another version of Echorama");
  return std::unique_ptr<FrameGrabber>(make());
}

std::uint32_t IdOf(CameraControl control)
{
  switch (control) {
  case CameraControl::AutoExposure:
    return V4L2_CID_EXPOSURE_AUTO;
  case CameraControl::Exposure:
    return V4L2_CID_EXPOSURE_ABSOLUTE;
  case CameraControl::AutoGain:
    return V4L2_CID_AUTOGAIN;
  case CameraControl::Gain:
    return V4L2_CID_GAIN;
  case CameraControl::AutoWhiteBalance:
    return V4L2_CID_AUTO_WHITE_BALANCE;
  case CameraControl::DynamicRate:
    break;
  }
  return V4L2_CID_EXPOSURE_AUTO_PRIORITY;
}

std::string ReasonOf(int error)
{
  switch (error) {
  case ENOENT:
  case ENODEV:
  case ENXIO:
    return "there is no such camera; v4l2-ctl --list-devices lists those there are";
  case EACCES:
  case EPERM:
    return "no permission; users of cameras belong to the group video: sudo usermod -aG video $USER, and log in again";
  case EBUSY:
    return "another program uses the camera; fuser -v shows which";
  default:
    return std::string("it cannot be opened: ") + std::strerror(error);
  }
}
} // namespace

VideoCalls VideoCalls::OfTheSystem()
{
  return {[](const char* path) { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); },
          [](int file, unsigned long request, void* data) { return ::ioctl(file, request, data); }, LoadGrabber};
}

VideoMode VideoDevice::Open(const std::string& device, const VideoMode& wanted)
{
  Close();
  file_ = calls_.open(device.c_str());
  if (file_ < 0)
    FailCamera(device, ReasonOf(errno));
  v4l2_capability capability{};
  if (Ask(VIDIOC_QUERYCAP, &capability) != 0)
    FailCamera(device, "this is no camera");
  const std::uint32_t can = capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
  if (!(can & V4L2_CAP_VIDEO_CAPTURE) || !(can & V4L2_CAP_STREAMING))
    FailCamera(device, "it delivers no frames: cameras have several devices, of which another one may; v4l2-ctl --list-devices");
  // Whoever holds the buffers has the camera.
  v4l2_requestbuffers buffers{};
  buffers.count = 1;
  buffers.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffers.memory = V4L2_MEMORY_MMAP;
  if (Ask(VIDIOC_REQBUFS, &buffers) != 0)
    FailCamera(device, ReasonOf(errno));
  buffers.count = 0;
  Ask(VIDIOC_REQBUFS, &buffers);
  grabber_ = calls_.grab(device);
  return grabber_->Open(device, wanted);
}

std::optional<VideoDevice::Value> VideoDevice::Get(CameraControl control) const
{
  v4l2_queryctrl query{};
  query.id = IdOf(control);
  v4l2_control value{};
  value.id = query.id;
  if (Ask(VIDIOC_QUERYCTRL, &query) != 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) || Ask(VIDIOC_G_CTRL, &value) != 0)
    return std::nullopt;
  // As v4l2-ctl spells names: "Exposure, Auto" is exposure_auto.
  Value found{"", value.value};
  bool gap = false;
  for (const char* c = reinterpret_cast<const char*>(query.name); *c; ++c)
    if (std::isalnum(static_cast<unsigned char>(*c))) {
      found.name += gap && !found.name.empty() ? "_" : "";
      found.name += static_cast<char>(std::tolower(static_cast<unsigned char>(*c)));
      gap = false;
    } else {
      gap = true;
    }
  return found;
}

void VideoDevice::Set(CameraControl control, std::int64_t value) const
{
  v4l2_control wanted{};
  wanted.id = IdOf(control);
  wanted.value = static_cast<std::int32_t>(value);
  Ask(VIDIOC_S_CTRL, &wanted);
}

int VideoDevice::Ask(unsigned long request, void* data) const
{
  int answer = 0;
  do
    answer = calls_.control(file_, request, data);
  while (answer != 0 && errno == EINTR);
  return answer;
}

void VideoDevice::Close()
{
  grabber_.reset();
  if (file_ >= 0)
    ::close(file_);
  file_ = -1;
}

} // namespace echorama
