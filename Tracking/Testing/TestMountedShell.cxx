// SPDX-License-Identifier: BSD-3-Clause
// Which shell is mounted, out of frames of a simulated camera in which lights move and blink.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/MountedShell.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>

namespace {

using namespace echorama;
using Status = ShellMarkerReading::Status;

struct Seen {
  std::optional<ShellMarkerReading> reading;
  int frames = 0, answers = 0;
};

// A light goes to and fro on the marker, another rests at its end.
std::unique_ptr<SimulatedSource> Camera(const std::string& options)
{
  const auto p = SimulatedSourceParameters::Of(TrackerAddress::Parse("simulated:?speed=0&lights=2&peak=250" + options));
  const auto skin = std::make_shared<const DomeSurface>(p.domeMm);
  std::vector<SimulatedLight> lights;
  for (const int i : {0, 1})
    lights.push_back(p.Light(i, [i, skin, p](double time) {
      const double azimuth = (i == 0 ? 19.0 + 15.0 * std::sin(6.0 * time) : 4.0) / DegreesPerRadian,
                   elevation = 12.0 / DegreesPerRadian;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                      std::sin(elevation));
      return LightOnSkin{skin->FirstHit(Eigen::Vector3d::Zero(), direction)->point, 0.0, p.peak};
    }));
  return std::make_unique<SimulatedSource>(p, skin, std::move(lights));
}

Seen Watch(const std::string& options, const FisheyeLens& lens)
{
  const auto camera = Camera(options);
  camera->Open();
  MountedShell shell(lens, MountedShell::TurnFrames(BlinkCode::Make(2, 2), 1000.0 / 90.0, 1000.0 / 90.0));
  Seen seen;
  CameraFrame frame;
  for (int frames = 400; seen.frames < frames && camera->Next(frame, 1.0) == CameraSource::Outcome::Frame; ++seen.frames)
    if (auto reading = shell.Add(frame.grey)) {
      seen.reading = std::move(reading);
      ++seen.answers;
      if (seen.reading->status == Status::Read)
        frames = seen.frames + 100; // and no second answer
    }
  return seen;
}

TEST(MountedShell, IsReadWhileLightsBlinkOverItsMarker)
{
  FisheyeLens lens;
  lens.focal *= 1.015;
  for (const char* id : {"0A1B2C", "FFFFFF", "000000"}) {
    const Seen seen = Watch(std::string("&marker=") + id, lens);
    ASSERT_TRUE(seen.reading);
    EXPECT_EQ(seen.reading->status, Status::Read);
    EXPECT_EQ(ShellNameOf(*seen.reading), id);
    EXPECT_EQ(seen.answers, 1);
    EXPECT_LT(seen.frames, 150); // in the first try
  }
  // The mean of the same frames shows no marker.
  const auto camera = Camera("&marker=0A1B2C");
  camera->Open();
  CameraFrame frame;
  std::vector<int> sum(640 * 480);
  constexpr int frames = 40;
  for (int n = 0; n < frames; ++n) {
    ASSERT_EQ(camera->Next(frame, 1.0), CameraSource::Outcome::Frame);
    for (int i = 0; i < 640 * 480; ++i)
      sum[static_cast<std::size_t>(i)] += frame.grey(i % 640, i / 640);
  }
  std::vector<std::uint8_t> mean;
  for (const int grey : sum)
    mean.push_back(static_cast<std::uint8_t>(std::min(255, 4 * grey / frames)));
  EXPECT_NE(ReadShellMarker(GreyFrame::Mono(mean.data(), 640, 480), FisheyeLens()).status, Status::Read);
}

TEST(MountedShell, WithoutAMarkerThatIsSaidOnce)
{
  const Seen seen = Watch("", FisheyeLens());
  ASSERT_TRUE(seen.reading);
  EXPECT_EQ(seen.reading->status, Status::Absent);
  EXPECT_EQ(seen.answers, 1);
  // In the dark there is none to be seen, either.
  const Seen dark = Watch("&ambient=0&marker=0A1B2C", FisheyeLens());
  ASSERT_TRUE(dark.reading);
  EXPECT_NE(dark.reading->status, Status::Read);
}

TEST(MountedShell, NamesAreThoseOfMarkersInCapitalsOrNot)
{
  ShellMarkerReading marker;
  marker.status = Status::Read;
  marker.id = 0x0a1b2c;
  EXPECT_TRUE(IsNameOf("0A1B2C", marker));
  EXPECT_TRUE(IsNameOf("0a1b2c", marker));
  EXPECT_FALSE(IsNameOf("A1B2C", marker));
  EXPECT_FALSE(IsNameOf("belly-7", marker));
  EXPECT_FALSE(IsNameOf("", marker));
}

TEST(MountedShell, APictureOfAnotherSizeIsNotRead)
{
  MountedShell shell(FisheyeLens(), 8);
  const std::vector<std::uint8_t> pixels(320 * 240, 100);
  for (int i = 0; i < 1000; ++i)
    EXPECT_FALSE(shell.Add(GreyFrame::Mono(pixels.data(), 320, 240)));
  EXPECT_THROW(MountedShell(FisheyeLens(), 0), Error);
  EXPECT_THROW(MakeCamera("simulated:?marker=0A1B2G"), Error);
  EXPECT_THROW(MakeCamera("simulated:?marker=10A1B2C"), Error);
}

} // namespace
