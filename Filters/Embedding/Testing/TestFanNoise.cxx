// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/FanNoise.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace echorama {
namespace {

constexpr double degree = RadiansPerDegree;

// In many parts as in one, near the common start of all beams too, and on a grid that is a part of the fan.
TEST(FanNoise, PartsAreThoseOfTheWhole)
{
  const Pose turned = MotionAbout({3, 5, 7}, {0.2, -0.4, 0.3}, {20, -10, 5});
  std::vector<ProbeGeometry> probes{
      ProbeGeometry::Convex(70 * degree, 40, 60 * degree, 25, 0, 60), ProbeGeometry::Linear(50, 40, 0, 60),
      ProbeGeometry::Phased(60 * degree, 50 * degree, 0, 60), ProbeGeometry::Convex(70 * degree, 40, 0, 0, 0, 60),
      ProbeGeometry::Convex(140 * degree, 40, 60 * degree, 20, 0, 60)}; // the last one looks behind its axis
  if (IsSanitized())
    probes.erase(probes.begin(), probes.end() - 2);
  for (const ProbeGeometry& probe : probes) {
    SCOPED_TRACE(probe.fanAngle);
    BeamNoiseParameters p;
    p.depthCorrelationMm = 4.0;
    p.fanCorrelation = p.sweepCorrelation = 0.1;
    p = ResolvingCounts(p, probe);
    ImageGeometry grid = ScanConversionGrid(probe, turned, 3.3, 1u << 24);
    grid.origin = grid.IndexToWorld() * Eigen::Vector3d(3, 2, 0);
    Volume<float> whole(grid.dimensions), parts(grid.dimensions, 7.0f);
    Volume<unsigned char> inside(grid.dimensions), inParts(grid.dimensions, 7);
    FillFanWithNoise(p, {probe, turned}, grid, whole.View(), inside.View());
    FillFanWithNoise(p, {probe, turned}, grid, parts.View(), inParts.View(), {}, 8000.0);
    std::ptrdiff_t other = 0, shown = 0;
    double worst = 0.0;
    for (std::ptrdiff_t at = 0; at < whole.View().Size(); ++at) {
      other += inside.View()[at] != inParts.View()[at];
      shown += inside.View()[at];
      worst = std::max(worst, static_cast<double>(std::abs(whole.View()[at] - parts.View()[at])));
    }
    EXPECT_EQ(other, 0);
    EXPECT_GT(shown, 300);
    EXPECT_LT(worst, 0.5); // of 255 greys, between samples that differ by up to all of them
    // A small part of the grid, which lies between few of the samples.
    ImageGeometry corner = grid;
    for (std::size_t axis = 0; axis < 3; ++axis)
      corner.dimensions[axis] = (grid.dimensions[axis] + 2) / 3;
    const std::array<int, 3> first{grid.dimensions[0] / 3, grid.dimensions[1] / 3, grid.dimensions[2] / 2};
    corner.origin = grid.IndexToWorld() * Eigen::Vector3d(first[0], first[1], first[2]);
    corner.dimensions[2] = std::min(corner.dimensions[2], grid.dimensions[2] - first[2]);
    Volume<float> some(corner.dimensions);
    Volume<unsigned char> inSome(corner.dimensions);
    FillFanWithNoise(p, {probe, turned}, corner, some.View(), inSome.View());
    for (int k = 0; k < corner.dimensions[2]; ++k)
      for (int j = 0; j < corner.dimensions[1]; ++j)
        for (int i = 0; i < corner.dimensions[0]; ++i) {
          EXPECT_EQ(inSome.View()(i, j, k), inside.View()(i + first[0], j + first[1], k + first[2]));
          EXPECT_NEAR(some.View()(i, j, k), whole.View()(i + first[0], j + first[1], k + first[2]), 0.5f);
        }
  }
}

TEST(FanNoise, StopsOnRequest)
{
  const ProbeGeometry probe = ProbeGeometry::Linear(50, 40, 0, 60);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 2.0, 1u << 24);
  Volume<float> noise(grid.dimensions);
  Volume<unsigned char> inside(grid.dimensions);
  int asked = 0;
  const Progress stop([&asked](double) { return ++asked < 3; });
  EXPECT_THROW(FillFanWithNoise({}, {probe, Pose::Identity()}, grid, noise.View(), inside.View(), stop, 2e4), Error);
  EXPECT_EQ(asked, 3);
}

} // namespace
} // namespace echorama
