// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Optical/LightTracker.h"
#include "Tracking/Stream/Clock.h"
#include <cstring>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using Outcome = CameraSource::Outcome;

// A small camera, so that tests are quick.
SimulatedSourceParameters Small(const std::string& more = "")
{
  return SimulatedSourceParameters::Of(
      TrackerAddress::Parse("simulated:?width=320&height=240&focal=95&centreX=159.5&centreY=119.5&speed=0" + more));
}

std::string MessageOf(const std::string& line)
{
  try {
    MakeCamera(line);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SimulatedSource, FramesAreThoseOfItsCameraAndCountTheLostOnes)
{
  const SimulatedSourceParameters p = Small("&lostFrames=0.2&frames=60");
  SimulatedSource source(p);
  const CameraFormat format = source.Open();
  EXPECT_EQ(format.width, 320);
  EXPECT_EQ(format.frameRate, 90.0);
  EXPECT_FALSE(source.IsLive());

  const SimulatedCamera camera(p.camera, source.Skin(), p.CameraToShell());
  std::vector<SimulatedLight> lights;
  for (int i = 0; i < 2; ++i)
    lights.push_back(p.Light(i, [&source, i](double time) { return source.LightAt(i, time); }));
  CameraFrame frame;
  std::int64_t expected = 0, lost = 0;
  int frames = 0;
  for (; source.Next(frame, 0.0) == Outcome::Frame; ++frames) {
    SimulatedFrame truth;
    for (;; ++expected, ++lost) {
      camera.Render(expected, lights, truth);
      if (!truth.isLost)
        break;
    }
    ASSERT_EQ(frame.number, expected);
    EXPECT_EQ(frame.begin, truth.begin);
    EXPECT_EQ(frame.arrival, truth.delivered);
    EXPECT_EQ(std::memcmp(frame.grey.data, truth.pixels.data(), truth.pixels.size()), 0);
    ++expected;
  }
  EXPECT_GT(lost, 3);
  EXPECT_EQ(frames + source.Lost(), 60);
  EXPECT_EQ(source.Next(frame, 0.0), Outcome::Ended);
  source.Open(); // begins anew
  ASSERT_EQ(source.Next(frame, 0.0), Outcome::Frame);
  EXPECT_LT(frame.number, 5);
}

TEST(SimulatedSource, LightsAreFoundByTheirCodeAndLieOnTheirPaths)
{
  for (const char* path : {"still", "circle", "strokes", "wander"}) {
    SCOPED_TRACE(path);
    const SimulatedSourceParameters p = Small(std::string("&path=") + path + "&speedMmPerS=60&liftEverySeconds=3");
    SimulatedSource source(p);
    const CameraFormat format = source.Open();
    SpotTracksParameters tracks;
    tracks.frameMs = tracks.slotMs = 1000.0 / format.frameRate;
    tracks.exposureMs = format.exposureMs;
    LightTracker tracker({}, tracks, p.Code());
    CameraFrame frame;
    int seen[2] = {0, 0}, away = 0;
    Eigen::AlignedBox2d reach;
    for (int n = 0; n < 400; ++n) {
      ASSERT_EQ(source.Next(frame, 0.0), Outcome::Frame);
      for (const TrackedLight& light : tracker.Update(frame.grey, frame.begin)) {
        const LightTruth& truth = source.Truth()[static_cast<std::size_t>(light.light)];
        reach.extend(source.LightAt(0, frame.begin).point.head<2>());
        away += !truth.isVisible;
        if (light.status != TrackedLight::Status::Seen)
          continue;
        ++seen[light.light];
        EXPECT_LT((light.position - truth.pixel).norm(), 1.0) << n;
        EXPECT_NEAR(light.time, truth.time, 1e-9);
      }
    }
    EXPECT_GT(seen[0], 120); // its word is on in about half of the slots
    EXPECT_GT(seen[1], 120);
    EXPECT_NEAR(away, 135, 6); // frames: in 4.4 s one light was away twice for half a second, the other once
    EXPECT_GT(reach.sizes().maxCoeff(), std::string(path) == "still" ? -1.0 : 20.0);
    EXPECT_LT(reach.sizes().maxCoeff(), std::string(path) == "still" ? 1e-9 : 120.0);
  }
}

TEST(SimulatedSource, ADeadLightNeverShines)
{
  SimulatedSource source(Small("&deadLight=2&frames=30"));
  source.Open();
  CameraFrame frame;
  int shining = 0;
  while (source.Next(frame, 0.0) == Outcome::Frame) {
    EXPECT_FALSE(source.Truth()[1].isVisible);
    shining += source.Truth()[0].isVisible;
  }
  EXPECT_EQ(shining, 30);
}

TEST(SimulatedSource, InOurTimeFramesComeWhenACameraWouldDeliverThem)
{
  SimulatedSourceParameters p = Small("&frameRate=20&exposureMs=10&latencyMs=30");
  p.speed = 1.0;
  SimulatedSource source(p);
  source.Open();
  EXPECT_TRUE(source.IsLive());
  CameraFrame frame;
  EXPECT_EQ(source.Next(frame, 0.0), Outcome::Nothing); // it is not exposed yet
  const double begun = source.Start();
  for (int n = 0; n < 4; ++n) {
    ASSERT_EQ(source.Next(frame, 5.0), Outcome::Frame);
    EXPECT_GE(frame.arrival - frame.begin, 0.040);
    EXPECT_LE(frame.arrival, ClockNow());
    EXPECT_NEAR(frame.begin, begun + static_cast<double>(frame.number) * 0.05, 1e-6);
  }
  // Who does not ask for half a second loses what came meanwhile.
  const std::int64_t before = frame.number;
  while (ClockNow() < frame.arrival + 0.5) {
  }
  ASSERT_EQ(source.Next(frame, 5.0), Outcome::Frame);
  EXPECT_GE(frame.number, before + 6);
  EXPECT_GE(source.Lost(), 5);
  EXPECT_EQ(frame.number + 1, source.Lost() + 5);
}

TEST(SimulatedSource, LinesThatSayNothingUsefulAreRefused)
{
  EXPECT_NE(MessageOf("film:x").find("there is no camera source film; there are: "), std::string::npos);
  EXPECT_NE(MessageOf("simulated:?colour=red").find("there is no option colour"), std::string::npos);
  EXPECT_NE(MessageOf("simulated:?lights=5").find("[1, 4]"), std::string::npos);
  EXPECT_NE(MessageOf("simulated:here").find("has no place"), std::string::npos);
  EXPECT_NE(MessageOf("simulated:?exposureMs=20").find("longer than a frame"), std::string::npos);
  EXPECT_NE(MessageOf("simulated:?cameraMm=0 0 500").find("sees nothing"), std::string::npos);
}

} // namespace
