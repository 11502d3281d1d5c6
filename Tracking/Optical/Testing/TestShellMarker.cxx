// SPDX-License-Identifier: BSD-3-Clause
// Pictures of a marker as a camera in a shell has them: at the edge of its circle, from a camera that is turned, tilted and not
// quite in its place, blurred by the plastic, in little light, with noise.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Testing/Sanitized.h"
#include "Tracking/Optical/MarkerPattern.h"
#include "Tracking/Optical/ShellMarker.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

using Status = ShellMarkerReading::Status;

struct MarkedShell {
  std::uint32_t id = 0x0a1b2c;
  bool hasMarker = true;
  double azimuthDegrees = 6.0, wallMm = 100.0; ///< the wall is a sphere about the nominal camera, flattened across it
  Vector3d cameraOffset = Vector3d::Zero();
  double rollDegrees = 0.0, tiltDegrees = 0.0;
  double light = 60.0, shade = 0.6; ///< grey levels, and what is left of them behind a dark cell
  double blurPixels = 1.0, noise = 1.0;
  double slope = 0.0;   ///< of the light, from one side of the picture to the other
  double covered = 0.0; ///< degrees of the marker's end that something hides
  std::uint64_t seed = 1;
};

struct Picture {
  std::vector<std::uint8_t> pixels;
  FisheyeLens lens;
  GreyFrame Grey() const { return GreyFrame::Mono(pixels.data(), lens.width, lens.height); }
};

std::vector<float> Blurred(const std::vector<float>& from, int width, int height, double sigma)
{
  std::vector<float> rows(from.size()), all(from.size());
  const int reach = static_cast<int>(std::ceil(3.0 * sigma));
  const auto pass = [&](const std::vector<float>& in, std::vector<float>& out, bool isAcross) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        double sum = 0.0, weights = 0.0;
        for (int d = -reach; d <= reach; ++d) {
          const int u = std::clamp(isAcross ? x + d : x, 0, width - 1), v = std::clamp(isAcross ? y : y + d, 0, height - 1);
          const double weight = sigma > 0.0 ? std::exp(-0.5 * d * d / (sigma * sigma)) : 1.0;
          sum += weight * static_cast<double>(in[static_cast<std::size_t>(v * width + u)]);
          weights += weight;
        }
        out[static_cast<std::size_t>(y * width + x)] = static_cast<float>(sum / weights);
      }
  };
  pass(from, rows, true);
  pass(rows, all, false);
  return all;
}

Picture PictureOf(const MarkedShell& shell)
{
  Picture picture;
  const FisheyeLens& lens = picture.lens;
  const MarkerPattern pattern = MarkerPattern::Of(shell.id);
  const Eigen::Matrix3d cameraToShell = (Eigen::AngleAxisd(shell.rollDegrees / DegreesPerRadian, Vector3d::UnitZ()) *
                                         Eigen::AngleAxisd(shell.tiltDegrees / DegreesPerRadian, Vector3d::UnitX()))
                                            .toRotationMatrix();
  const Vector3d flatten(1.0, 1.0, 1.0 / 0.8);
  std::vector<float> grey(static_cast<std::size_t>(lens.width * lens.height), 4.0f);
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      double sum = 0.0;
      for (int n = 0; n < 9; ++n) {
        const auto direction = lens.Unproject(Vector2d(x + (n % 3 - 1) / 3.0, y + (n / 3 - 1) / 3.0));
        if (!direction)
          continue;
        // Where the ray meets the wall, and in which direction that is from where the camera should be.
        const Vector3d from = flatten.cwiseProduct(shell.cameraOffset), ray = flatten.cwiseProduct(cameraToShell * *direction);
        const double a = ray.squaredNorm(), b = from.dot(ray), c = from.squaredNorm() - shell.wallMm * shell.wallMm;
        const Vector3d place = shell.cameraOffset + (-b + std::sqrt(b * b - a * c)) / a * (cameraToShell * *direction);
        const double azimuth = std::remainder(std::atan2(place.y(), place.x()) * DegreesPerRadian - shell.azimuthDegrees, 360.0);
        const double elevation = std::atan2(place.z(), place.head<2>().norm()) * DegreesPerRadian;
        const int column = static_cast<int>(std::floor(azimuth / MarkerPattern::cellDegrees)),
                  row = static_cast<int>(std::floor((elevation - MarkerPattern::lowestDegrees) / MarkerPattern::cellDegrees));
        const bool isDark = shell.hasMarker && pattern.IsDark(row, column);
        double light = shell.light * (1.0 + shell.slope * (x / 640.0 - 0.5)) * (isDark ? shell.shade : 1.0);
        if (elevation < 2.0)
          light *= 0.2; // the base
        if (azimuth < shell.covered && azimuth > -20.0)
          light = 0.5 * shell.light;
        sum += light / 9.0;
      }
      grey[static_cast<std::size_t>(y * lens.width + x)] += static_cast<float>(sum);
    }
  grey = Blurred(grey, lens.width, lens.height, shell.blurPixels);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    Random random(shell.seed, i);
    const double level = static_cast<double>(grey[i]) + shell.noise * random.Normal();
    picture.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0l, 255l)));
  }
  return picture;
}

ShellMarkerReading Read(const MarkedShell& shell)
{
  const Picture picture = PictureOf(shell);
  return ReadShellMarker(picture.Grey(), picture.lens);
}

TEST(ShellMarker, IsReadAndPlaced)
{
  for (const std::uint32_t id : {0u, 0x0a1b2cu, 0xffffffu}) {
    MarkedShell shell;
    shell.id = id;
    const ShellMarkerReading reading = Read(shell);
    ASSERT_EQ(reading.status, Status::Read);
    EXPECT_EQ(reading.id, id);
    EXPECT_NEAR(reading.azimuthDegrees, 6.0, 0.8);
    EXPECT_NEAR(reading.elevationDegrees, 0.0, 0.8);
    EXPECT_NEAR(reading.contrast, 0.4 / 1.6, 0.12); // behind a dark cell 0.6 of the light
  }
  EXPECT_EQ(Read({}).Text().substr(0, 12), "shell 0A1B2C");
}

TEST(ShellMarker, IsReadByACameraThatIsTurnedAndNotInItsPlace)
{
  for (const double roll : {0.0, 3.3, 90.0, 180.0}) {
    MarkedShell shell;
    shell.rollDegrees = roll;
    // At a quarter turn it lies above the picture, which is wider than high.
    shell.azimuthDegrees = roll == 90.0 ? 90.0 + 6.0 : 6.0;
    shell.cameraOffset = Vector3d(0.6, -0.5, 1.0);
    shell.tiltDegrees = 1.5;
    shell.wallMm = 80.0;
    const ShellMarkerReading reading = Read(shell);
    ASSERT_EQ(reading.status, Status::Read) << roll;
    EXPECT_EQ(reading.id, shell.id);
  }
}

TEST(ShellMarker, IsNotTakenForAnotherByACameraThatIsTiltedMore)
{
  ECHORAMA_SKIP_SANITIZED();
  int read = 0;
  for (const double tilt : {-15.0, -6.0, -2.5, 4.0, 8.0})
    for (const double azimuth : {6.0, 60.0}) { // higher or lower, and leaning
      MarkedShell shell;
      shell.tiltDegrees = tilt;
      shell.azimuthDegrees = azimuth;
      const ShellMarkerReading reading = Read(shell);
      const bool isRead = reading.status == Status::Read;
      EXPECT_TRUE(!isRead || reading.id == shell.id) << tilt << " " << azimuth;
      read += isRead;
      if (std::abs(tilt) > 9.5) {
        EXPECT_FALSE(isRead) << tilt << " " << azimuth;
      }
    }
  EXPECT_GE(read, 1);
}

TEST(ShellMarker, IsReadInLittleLightThroughBlurAndNoise)
{
  ECHORAMA_SKIP_SANITIZED();
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    MarkedShell shell;
    shell.light = 12.0;
    shell.noise = 1.5;
    shell.blurPixels = 1.8;
    shell.slope = 0.8;
    shell.seed = seed;
    const ShellMarkerReading reading = Read(shell);
    ASSERT_EQ(reading.status, Status::Read) << seed;
    EXPECT_EQ(reading.id, shell.id);
  }
}

TEST(ShellMarker, IsReadWhereTheLensIsNotQuiteKnown)
{
  Picture picture = PictureOf({});
  for (const double factor : {0.98, 1.02}) {
    FisheyeLens lens = picture.lens;
    lens.focal *= factor;
    const ShellMarkerReading reading = ReadShellMarker(picture.Grey(), lens);
    ASSERT_EQ(reading.status, Status::Read) << factor;
    EXPECT_EQ(reading.id, 0x0a1b2cu);
  }
}

TEST(ShellMarker, IsAbsentWhereThereIsNone)
{
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    MarkedShell shell;
    shell.hasMarker = false;
    shell.noise = 3.0;
    shell.slope = 0.5;
    shell.seed = seed;
    EXPECT_EQ(Read(shell).status, Status::Absent);
    Picture noise; // of full contrast
    for (int i = 0; i < noise.lens.width * noise.lens.height; ++i) {
      Random random(seed, static_cast<std::uint64_t>(i / 4));
      noise.pixels.push_back(static_cast<std::uint8_t>(255.0 * random.Uniform()));
    }
    EXPECT_NE(ReadShellMarker(noise.Grey(), noise.lens).status, Status::Read);
  }
  MarkedShell dark;
  dark.light = 0.0;
  EXPECT_EQ(Read(dark).status, Status::Absent);
}

TEST(ShellMarker, IsUnclearWherePartOfItIsSpoilt)
{
  MarkedShell shell;
  Picture picture = PictureOf(shell);
  // Light and dark of one cell of the middle change places.
  MarkerPattern pattern = MarkerPattern::Of(shell.id);
  const int column = 9;
  for (int y = 0; y < picture.lens.height; ++y)
    for (int x = 0; x < picture.lens.width; ++x) {
      const auto direction = picture.lens.Unproject(Vector2d(x, y));
      const double azimuth = std::atan2(direction->y(), direction->x()) * DegreesPerRadian - shell.azimuthDegrees;
      const double elevation = std::asin(direction->z()) * DegreesPerRadian;
      const int row = static_cast<int>(std::floor((elevation - MarkerPattern::lowestDegrees) / MarkerPattern::cellDegrees));
      if (static_cast<int>(std::floor(azimuth / MarkerPattern::cellDegrees)) == column && (row == 2 || row == 3))
        picture.pixels[static_cast<std::size_t>(y * picture.lens.width + x)] = pattern.IsDark(row, column) ? 64 : 40;
    }
  EXPECT_EQ(ReadShellMarker(picture.Grey(), picture.lens).status, Status::Unclear);
  shell.covered = 5.0; // its first columns: it is not known for a marker
  EXPECT_EQ(Read(shell).status, Status::Absent);
}

TEST(ShellMarker, PictureAndLensMustAgree)
{
  const Picture picture = PictureOf({});
  FisheyeLens lens = picture.lens;
  lens.width = 320;
  EXPECT_THROW(ReadShellMarker(picture.Grey(), lens), Error);
  EXPECT_THROW(ReadShellMarker({}, picture.lens), Error);
}

} // namespace
