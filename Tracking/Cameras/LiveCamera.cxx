// SPDX-License-Identifier: BSD-3-Clause
// Cameras take what they like of what they are told, without a word: so everything is read back. Lost frames are known by the
// gaps of the driver's time stamps.
#include "Tracking/Cameras/LiveCamera.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Tracking/Stream/Clock.h"
#include <chrono>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr std::int64_t ManualExposure = 1; // of Video4Linux's auto_exposure
constexpr double OldestStamp = 1.0;        // s; an older one is of another clock, unless an earlier one was of ours

} // namespace

ParameterList Describe(LiveCameraParameters& p)
{
  return {
      Parameter("Width", p.width, {16, 16384}, "pixels", "Of the picture; it must be that of the calibration."),
      Parameter("Height", p.height, {16, 16384}, "pixels", "The same."),
      Parameter("FrameRate", p.frameRate, {1, 1000}, "Hz", "Frames per second."),
      Parameter("ExposureMs", p.exposureMs, {0.1, 1000}, "ms", "How long a row takes light; not longer than a frame."),
      Parameter("FixedExposure", p.fixedExposure,
                "Whether a camera without a control of its exposure is known to have ExposureMs, always."),
      Parameter("RowUs", p.rowUs, {0, 1000}, "us",
                "How much later each row begins, from the sensor's data sheet: 0 is a global shutter."),
      Parameter("Gain", p.gain, {-1, 65535}, "", "In the camera's own unit; -1: as it is."),
      Parameter("StampMs", p.stampMs, {-1, 1000}, "ms",
                "From the begin of an exposure to the time stamp that the driver gives it; -1: one exposure."),
  };
}

LiveCameraParameters LiveCameraParameters::Of(const TrackerAddress& address)
{
  LiveCameraParameters p;
  p.device = address.place;
  if (p.device.empty())
    throw Error(Error::Kind::InvalidParameter, address.text + ": which camera? Say " + address.scheme + ":0, or " +
                                                   address.scheme + ":/dev/video2; v4l2-ctl --list-devices lists them");
  if (p.device.find_first_not_of("0123456789") == std::string::npos)
    p.device = "/dev/video" + p.device;
  address.Set(Describe(p));
  return p;
}

LiveCamera::LiveCamera(const LiveCameraParameters& parameters, VideoCalls calls)
  : parameters_(parameters), device_(std::move(calls))
{
  CheckRanges(parameters_);
  if (parameters_.exposureMs * parameters_.frameRate > 1000.0)
    throw Error(Error::Kind::InvalidParameter,
                parameters_.device + ": the exposure, " + NumberText(parameters_.exposureMs) + " ms, is longer than a frame");
}

void LiveCamera::Refuse(const std::string& reason)
{
  device_.Close();
  throw Error(Error::Kind::NotPossible, parameters_.device + ": " + reason);
}

void LiveCamera::CheckMode(const VideoMode& mode)
{
  const LiveCameraParameters& p = parameters_;
  const char* const hint = "; v4l2-ctl -d %s --list-formats-ext lists what it can do";
  if (mode.width != p.width || mode.height != p.height)
    Refuse(Format("the camera delivers %d x %d pixels, not %d x %d", mode.width, mode.height, p.width, p.height) +
           Format(hint, p.device.c_str()));
  if (!(std::abs(mode.frameRate - p.frameRate) < 0.02 * p.frameRate))
    Refuse(Format("the camera delivers %.3g frames/s, not %.3g", mode.frameRate, p.frameRate) + Format(hint, p.device.c_str()));
}

void LiveCamera::Fix(CameraControl automatic, std::int64_t off, const char* what)
{
  const auto before = device_.Get(automatic);
  if (!before || before->value == off)
    return;
  device_.Set(automatic, off);
  const auto after = device_.Get(automatic);
  if (!after || after->value != off)
    Refuse(std::string(what) + " is automatic, and stays so; it must be fixed. Another program may hold it; try: v4l2-ctl -d " +
           parameters_.device + " -c " + before->name + "=" + std::to_string(off));
}

double LiveCamera::FixedExposure()
{
  const double asked = parameters_.exposureMs;
  const auto ticks = static_cast<std::int64_t>(std::llround(10.0 * asked)); // of 0.1 ms
  device_.Set(CameraControl::Exposure, ticks);
  const auto took = device_.Get(CameraControl::Exposure);
  if (!took) {
    if (!parameters_.fixedExposure)
      Refuse("the camera does not tell its exposure, which may be automatic; if it is known to be " + NumberText(asked) +
             " ms, always, say so: fixedExposure=1");
    return asked;
  }
  const double exposure = 0.1 * static_cast<double>(took->value);
  if (!(std::abs(exposure - asked) <= std::max(0.1, 0.1 * asked)))
    Refuse(Format("the exposure is %.3g ms, not the %.3g ms that it was set to; v4l2-ctl -d %s -L lists what it can be", exposure,
                  asked, parameters_.device.c_str()));
  return exposure;
}

CameraFormat LiveCamera::Open()
{
  Close();
  const LiveCameraParameters& p = parameters_;
  const VideoMode mode = device_.Open(p.device, {p.width, p.height, p.frameRate, "GREY"});
  CheckMode(mode);
  Fix(CameraControl::AutoExposure, ManualExposure, "the exposure");
  Fix(CameraControl::DynamicRate, 0, "the frame rate in the dark");
  Fix(CameraControl::AutoGain, 0, "the gain");
  Fix(CameraControl::AutoWhiteBalance, 0, "the white balance");
  const double exposure = FixedExposure();
  if (p.gain >= 0) {
    device_.Set(CameraControl::Gain, p.gain);
    const auto took = device_.Get(CameraControl::Gain);
    if (!took || took->value != p.gain)
      Refuse(took ? Format("the gain is %lld, not the %d that it was set to; v4l2-ctl -d %s -L lists what it can be",
                           static_cast<long long>(took->value), p.gain, p.device.c_str())
                  : std::string("the camera has no gain to be set; leave it out"));
  }
  isOpen_ = true;
  number_ = -1;
  lost_ = 0;
  stamp_ = std::numeric_limits<double>::infinity();
  format_ = {mode.width, mode.height, mode.frameRate, exposure, p.rowUs, mode.pixels, p.device};
  return format_;
}

CameraSource::Outcome LiveCamera::Next(CameraFrame& frame, double seconds)
{
  if (!isOpen_)
    return Outcome::Ended;
  const double until = ClockNow() + seconds;
  VideoPicture picture;
  for (;;) {
    if (!device_.Grab(picture, std::max(0.0, until - ClockNow())))
      return Outcome::Nothing;
    const double now = ClockNow();
    const double age = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() - picture.stamp;
    const double delay = 1e-3 * (parameters_.stampMs < 0.0 ? format_.exposureMs : parameters_.stampMs);
    // Without a stamp, or with one of another clock, the moment of arrival has to do.
    const bool isStamped = age >= 0.0 && (age < OldestStamp || picture.stamp >= stamp_);
    const double begin = now - (isStamped ? age : 0.0) - delay;
    if (number_ >= 0 && (!(begin > last_) || (isStamped && picture.stamp == stamp_))) // a frame that came twice
      continue;
    if (isStamped)
      stamp_ = picture.stamp;
    const double period = 1.0 / format_.frameRate;
    const std::int64_t missed = number_ < 0 ? 0 : std::max<std::int64_t>(0, std::llround((begin - last_) / period) - 1);
    lost_ += missed;
    number_ += 1 + missed;
    last_ = begin;

    const std::size_t pixels = static_cast<std::size_t>(format_.width) * static_cast<std::size_t>(format_.height);
    const auto row = static_cast<std::ptrdiff_t>(format_.width);
    if (picture.bytes == pixels)
      frame.grey = GreyFrame::Mono(picture.data, format_.width, format_.height);
    else if (picture.bytes == 2 * pixels) // brightness and colour in turn
      frame.grey = {picture.data + (format_.pixels == "UYVY" ? 1 : 0), format_.width, format_.height, 2 * row, 2};
    else if (picture.bytes == 3 * pixels)
      frame.grey = GreyFrame::Green(picture.data, format_.width, format_.height);
    else
      throw Error(Error::Kind::NotPossible, parameters_.device + ": a frame has " + std::to_string(picture.bytes) +
                                                " bytes, which is " +
                                                "none of 1, 2 or 3 for each pixel (pixels: " + format_.pixels + ")");
    frame.begin = begin;
    frame.arrival = now;
    frame.number = number_;
    return Outcome::Frame;
  }
}

void LiveCamera::Close()
{
  device_.Close();
  isOpen_ = false;
}

} // namespace echorama
