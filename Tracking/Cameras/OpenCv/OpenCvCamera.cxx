// SPDX-License-Identifier: BSD-3-Clause
// A library of its own, which Tracking/Cameras/VideoDevice.cxx loads when the first camera is opened.
#include "Core/Base/Error.h"
#include "Tracking/Cameras/VideoDevice.h"
#include <limits>
#include <opencv2/videoio.hpp>

namespace echorama {
namespace {

class OpenCvGrabber : public FrameGrabber {
public:
  VideoMode Open(const std::string& device, const VideoMode& wanted) override
  {
    device_ = device;
    if (!capture_.open(device, cv::CAP_V4L2)) // it cannot say why
      throw Error(Error::Kind::FileSystem, device + ": OpenCV cannot open the camera");
    // Bytes of brightness alone, or brightness and colour in turn, as they come; everything else OpenCV decodes.
    for (const std::string& pixels : {wanted.pixels, std::string("YUYV")}) {
      capture_.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc(pixels[0], pixels[1], pixels[2], pixels[3]));
      if (Pixels() == pixels)
        break;
    }
    capture_.set(cv::CAP_PROP_FRAME_WIDTH, wanted.width);
    capture_.set(cv::CAP_PROP_FRAME_HEIGHT, wanted.height);
    capture_.set(cv::CAP_PROP_FPS, wanted.frameRate);
    VideoMode mode{static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH)),
                   static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT)), capture_.get(cv::CAP_PROP_FPS), Pixels()};
    const bool isRaw = mode.pixels == "GREY" || mode.pixels == "YUYV" || mode.pixels == "UYVY";
    capture_.set(cv::CAP_PROP_CONVERT_RGB, isRaw ? 0.0 : 1.0);
    if (!isRaw)
      mode.pixels = "BGR3";
    return mode;
  }
  bool Grab(VideoPicture& picture, double seconds) override
  {
    try { // at least a millisecond: 0 means for ever
      std::vector<int> ready;
      if (!cv::VideoCapture::waitAny({capture_}, ready, static_cast<std::int64_t>(1e9 * std::max(seconds, 1e-3))) ||
          ready.empty())
        return false;
      if (capture_.retrieve(frame_) && !frame_.empty())
        return Take(picture);
    } catch (const cv::Exception&) { // as below
    }
    throw Error(Error::Kind::FileSystem, device_ + ": the camera delivers no more; it may have been unplugged");
  }

private:
  bool Take(VideoPicture& picture)
  {
    if (!frame_.isContinuous())
      frame_ = frame_.clone();
    picture.data = frame_.data;
    picture.bytes = frame_.total() * frame_.elemSize();
    const double stamp = 1e-3 * capture_.get(cv::CAP_PROP_POS_MSEC);
    picture.stamp = stamp > 0.0 ? stamp : std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  std::string Pixels() const
  {
    const auto code = static_cast<unsigned>(capture_.get(cv::CAP_PROP_FOURCC));
    std::string text;
    for (unsigned shift = 0; shift < 32; shift += 8)
      text += static_cast<char>(code >> shift & 0xffu);
    return text;
  }

  std::string device_;
  cv::VideoCapture capture_;
  cv::Mat frame_;
};

} // namespace
} // namespace echorama

extern "C" echorama::FrameGrabber* EchoramaMakeOpenCvGrabber()
{
  return new echorama::OpenCvGrabber;
}
