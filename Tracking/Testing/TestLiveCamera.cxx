// SPDX-License-Identifier: BSD-3-Clause
// No machine for tests has a camera: the system's calls are replaced by a camera that answers as real ones do, with their moods.
#include "Core/Base/Error.h"
#include "Tracking/Cameras/LiveCamera.h"
#include "Tracking/Cameras/RestUntil.h"
#include "Tracking/Stream/Clock.h"
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <limits>
#include <linux/videodev2.h>
#include <map>

namespace {

using namespace echorama;
using Outcome = CameraSource::Outcome;

double Monotonic()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct FakeCamera {
  struct Control {
    const char* name;
    int value;
    bool isStuck = false; // takes no other value
  };
  std::map<std::uint32_t, Control> controls{{V4L2_CID_EXPOSURE_AUTO, {"Exposure, Auto", 3}},
                                            {V4L2_CID_EXPOSURE_ABSOLUTE, {"Exposure Time, Absolute", 156}},
                                            {V4L2_CID_GAIN, {"Gain", 64}},
                                            {V4L2_CID_AUTO_WHITE_BALANCE, {"White Balance, Automatic", 1}},
                                            {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {"Exposure, Dynamic Framerate", 1}}};
  int openError = 0, buffersError = 0;
  bool isCamera = true, captures = true;
  VideoMode mode{640, 480, 90.0, "GREY"};
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(640 * 480, 7);
  std::deque<double> stamps; // of the frames that will come; -1: the camera is gone
  int setWhileOpen = 0;

  class Grabber : public FrameGrabber {
  public:
    explicit Grabber(FakeCamera& camera) : camera_(camera) {}
    VideoMode Open(const std::string&, const VideoMode&) override { return camera_.mode; }
    bool Grab(VideoPicture& picture, double) override
    {
      if (camera_.stamps.empty())
        return false;
      picture = {camera_.bytes.data(), camera_.bytes.size(), camera_.stamps.front()};
      camera_.stamps.pop_front();
      if (picture.stamp == -1.0)
        throw Error(Error::Kind::FileSystem, "gone");
      return true;
    }

  private:
    FakeCamera& camera_;
  };

  int Answer(unsigned long request, void* data)
  {
    const auto fail = [](int error) {
      errno = error;
      return -1;
    };
    if (request == VIDIOC_QUERYCAP) {
      if (!isCamera)
        return fail(ENOTTY);
      static_cast<v4l2_capability*>(data)->capabilities = V4L2_CAP_DEVICE_CAPS;
      static_cast<v4l2_capability*>(data)->device_caps =
          V4L2_CAP_STREAMING | (captures ? V4L2_CAP_VIDEO_CAPTURE : V4L2_CAP_META_CAPTURE);
      return 0;
    }
    if (request == VIDIOC_REQBUFS)
      return buffersError ? fail(buffersError) : 0;
    if (request == VIDIOC_QUERYCTRL) {
      auto* query = static_cast<v4l2_queryctrl*>(data);
      const auto found = controls.find(query->id);
      if (found == controls.end())
        return fail(EINVAL);
      std::strncpy(reinterpret_cast<char*>(query->name), found->second.name, sizeof query->name - 1);
      return 0;
    }
    auto* control = static_cast<v4l2_control*>(data);
    const auto found = controls.find(control->id);
    if (found == controls.end())
      return fail(EINVAL);
    if (request == VIDIOC_G_CTRL)
      control->value = found->second.value;
    else if (request == VIDIOC_S_CTRL && !found->second.isStuck)
      found->second.value = control->value;
    return 0;
  }

  VideoCalls Calls()
  {
    return {[this](const char*) {
              errno = openError;
              return openError ? -1 : ::open("/dev/null", O_RDWR);
            },
            [this](int, unsigned long request, void* data) { return Answer(request, data); },
            [this](const std::string&) { return std::make_unique<Grabber>(*this); }};
  }
};

LiveCameraParameters Line(const std::string& line = "camera:4")
{
  return LiveCameraParameters::Of(TrackerAddress::Parse(line));
}

std::string Refusal(FakeCamera& camera, const std::string& line = "camera:4")
{
  try {
    LiveCamera live(Line(line), camera.Calls());
    live.Open();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(LiveCamera, FixesWhatIsAutomaticAndReadsItBack)
{
  FakeCamera camera;
  LiveCamera live(Line("camera:4?exposureMs=7.5&gain=20&rowUs=12"), camera.Calls());
  const CameraFormat format = live.Open();
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 75);
  EXPECT_EQ(camera.controls[V4L2_CID_GAIN].value, 20);
  EXPECT_EQ(camera.controls[V4L2_CID_AUTO_WHITE_BALANCE].value, 0);
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY].value, 0);
  EXPECT_EQ(format.width, 640);
  EXPECT_EQ(format.exposureMs, 7.5);
  EXPECT_EQ(format.rowUs, 12.0);
  EXPECT_EQ(format.name, "/dev/video4");
}

TEST(LiveCamera, SaysHowToSwitchOffWhatStaysAutomatic)
{
  FakeCamera camera;
  camera.controls[V4L2_CID_EXPOSURE_AUTO].isStuck = true;
  EXPECT_SAYS(Refusal(camera), "/dev/video4: the exposure is automatic");
  EXPECT_SAYS(Refusal(camera), "v4l2-ctl -d /dev/video4 -c exposure_auto=1");
  FakeCamera balance;
  balance.controls[V4L2_CID_AUTO_WHITE_BALANCE].isStuck = true;
  EXPECT_SAYS(Refusal(balance), "-c white_balance_automatic=0");
  FakeCamera rate;
  rate.controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY].isStuck = true;
  EXPECT_SAYS(Refusal(rate), "-c exposure_dynamic_framerate=0");
}

TEST(LiveCamera, WhatACameraTakesOtherwiseThanToldIsRefused)
{
  FakeCamera exposure;
  exposure.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {"Exposure", 156, true};
  EXPECT_SAYS(Refusal(exposure), "the exposure is 15.6 ms, not the 8 ms");
  FakeCamera gain;
  gain.controls[V4L2_CID_GAIN].isStuck = true;
  EXPECT_EQ(Refusal(gain), ""); // nobody asked for another
  EXPECT_SAYS(Refusal(gain, "camera:4?gain=10"), "the gain is 64, not the 10");
  FakeCamera none;
  none.controls.erase(V4L2_CID_GAIN);
  EXPECT_SAYS(Refusal(none, "camera:4?gain=10"), "no gain");
  FakeCamera silent; // it may do with its exposure what it likes
  silent.controls.erase(V4L2_CID_EXPOSURE_ABSOLUTE);
  EXPECT_SAYS(Refusal(silent), "does not tell its exposure");
  EXPECT_SAYS(Refusal(silent), "fixedExposure=1");
  EXPECT_EQ(Refusal(silent, "camera:4?fixedExposure=1"), "");
  FakeCamera size;
  size.mode.width = 800;
  EXPECT_SAYS(Refusal(size), "800 x 480 pixels, not 640 x 480");
  FakeCamera rate;
  rate.mode.frameRate = 30.0;
  EXPECT_SAYS(Refusal(rate), "30 frames/s, not 90");
}

TEST(LiveCamera, ReasonsWhyThereIsNoneAreTold)
{
  FakeCamera absent, forbidden, busy, other, twin;
  absent.openError = ENOENT;
  EXPECT_SAYS(Refusal(absent), "/dev/video4: there is no such camera");
  forbidden.openError = EACCES;
  EXPECT_SAYS(Refusal(forbidden), "group video");
  busy.buffersError = EBUSY; // it opens, but somebody has its buffers
  EXPECT_SAYS(Refusal(busy), "another program uses the camera");
  other.isCamera = false;
  EXPECT_SAYS(Refusal(other), "this is no camera");
  twin.captures = false;
  EXPECT_SAYS(Refusal(twin), "delivers no frames");
  // With the system's own calls.
  EXPECT_THROW(MakeCamera("camera:/dev/video-that-is-not")->Open(), Error);
  try {
    MakeCamera("camera:/dev/null")->Open();
    FAIL();
  } catch (const Error& error) {
    EXPECT_SAYS(std::string(error.what()), "/dev/null: this is no camera");
  }
  EXPECT_THROW(MakeCamera("camera:"), Error);
  EXPECT_THROW(MakeCamera("camera:0?exposureMs=12"), Error); // longer than a frame
}

TEST(LiveCamera, FramesComeByOpenCvWhereItIs)
{
  std::string said;
  try {
    VideoCalls::OfTheSystem().grab("/dev/null")->Open("/dev/null", {640, 480, 90.0, "GREY"});
  } catch (const Error& error) {
    said = error.what();
  }
#ifdef ECHORAMA_WITH_OPENCV_VIDEO
  EXPECT_SAYS(said, "/dev/null: OpenCV cannot open the camera"); // its library was found and loaded
#else
  EXPECT_SAYS(said, "built without");
#endif
}

TEST(LiveCamera, TimesAreOfTheExposureOnOurClockAndGapsAreLostFrames)
{
  FakeCamera camera;
  LiveCamera live(Line(), camera.Calls());
  live.Open();
  const double now = ClockNow(), stamp = Monotonic() - 0.1, period = 1.0 / 90.0;
  camera.stamps = {stamp, stamp + period, stamp + 4.0 * period + 0.001, stamp + 4.0 * period + 0.001, stamp + 5.0 * period};
  CameraFrame frame;
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
  EXPECT_NEAR(frame.begin, now - 0.1 - 0.008, 0.005);
  EXPECT_NEAR(frame.arrival, now, 0.005);
  EXPECT_EQ(frame.number, 0);
  const double first = frame.begin;
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
  EXPECT_NEAR(frame.begin - first, period, 1e-4);
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
  EXPECT_EQ(frame.number, 4);
  EXPECT_EQ(live.Lost(), 2);
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame); // the one that came twice was passed over
  EXPECT_EQ(frame.number, 5);
  EXPECT_EQ(live.Lost(), 2);
  EXPECT_EQ(live.Next(frame, 0.01), Outcome::Nothing);
}

TEST(LiveCamera, StampsThatWereOfOurClockStaySoHoweverLateAPictureComes)
{
  FakeCamera camera;
  LiveCamera live(Line(), camera.Calls());
  live.Open();
  const double stamp = Monotonic(), period = 1.0 / 90.0;
  camera.stamps = {stamp};
  CameraFrame frame;
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
  const double first = frame.begin;
  ASSERT_TRUE(RestUntil(ClockNow() + 1.2, 10.0)); // nobody asks for pictures, and the driver keeps them
  camera.stamps = {stamp + period, stamp + period, stamp + 2.0 * period};
  for (int i = 1; i <= 2; ++i) {
    ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame); // the one that came twice is passed over
    EXPECT_LT(frame.begin - first, 0.6);              // by its arrival it would be twice that
  }
  EXPECT_EQ(live.Next(frame, 0.0), Outcome::Nothing);
  camera.stamps = {stamp - 100.0, stamp - 100.0 + period}; // a clock that went back is ours no more
  for (int i = 1; i <= 2; ++i) {
    ASSERT_TRUE(RestUntil(ClockNow() + 0.01, 1.0));
    ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
    EXPECT_GT(frame.begin - first, 0.6);
  }
}

TEST(LiveCamera, WithoutAUsableStampTheArrivalHasToDo)
{
  for (const double stamp : {std::numeric_limits<double>::quiet_NaN(), 12.0, Monotonic() + 3600.0}) {
    FakeCamera camera;
    LiveCamera live(Line("camera:4?stampMs=3"), camera.Calls());
    live.Open();
    camera.stamps = {stamp};
    CameraFrame frame;
    ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
    EXPECT_NEAR(frame.begin, frame.arrival - 0.003, 1e-6) << stamp;
  }
}

TEST(LiveCamera, BrightnessIsReadOutOfEveryLayout)
{
  const auto pixel = [](const char* pixels, std::size_t perPixel, std::size_t offset) {
    FakeCamera camera;
    camera.mode.pixels = pixels;
    camera.bytes.assign(640 * 480 * perPixel, 0);
    camera.bytes[(20 * 640 + 10) * perPixel + offset] = 99;
    camera.stamps = {Monotonic()};
    LiveCamera live(Line(), camera.Calls());
    live.Open();
    CameraFrame frame;
    EXPECT_EQ(live.Next(frame, 1.0), Outcome::Frame);
    return static_cast<int>(frame.grey(10, 20));
  };
  EXPECT_EQ(pixel("GREY", 1, 0), 99);
  EXPECT_EQ(pixel("YUYV", 2, 0), 99);
  EXPECT_EQ(pixel("UYVY", 2, 1), 99);
  EXPECT_EQ(pixel("BGR3", 3, 1), 99);
  FakeCamera camera;
  camera.bytes.resize(1000);
  camera.stamps = {Monotonic()};
  LiveCamera live(Line(), camera.Calls());
  live.Open();
  CameraFrame frame;
  EXPECT_THROW(live.Next(frame, 1.0), Error);
}

TEST(LiveCamera, OneThatIsUnpluggedThrowsAndClosedEnds)
{
  FakeCamera camera;
  camera.stamps = {Monotonic(), -1.0};
  LiveCamera live(Line(), camera.Calls());
  CameraFrame frame;
  EXPECT_EQ(live.Next(frame, 0.0), Outcome::Ended); // nobody opened it
  live.Open();
  ASSERT_EQ(live.Next(frame, 1.0), Outcome::Frame);
  EXPECT_THROW(live.Next(frame, 1.0), Error);
  live.Close();
  EXPECT_EQ(live.Next(frame, 0.0), Outcome::Ended);
}

} // namespace
