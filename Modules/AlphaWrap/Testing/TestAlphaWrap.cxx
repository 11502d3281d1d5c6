// SPDX-License-Identifier: GPL-3.0-or-later
// An abdomen that is torn and crossed by another surface: refused as it is, printed after it was wrapped.
#include "Core/Base/Error.h"
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/Shell.h"
#include "Filters/Tissue/Icosphere.h"
#include "Modules/AlphaWrap/AlphaWrap.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

TriangleSurface TornAbdomen(const TriangleSurface& whole)
{
  TriangleSurface torn;
  torn.points = whole.points;
  const Eigen::Vector3f top = *std::max_element(whole.points.begin(), whole.points.end(),
                                                [](const auto&a, const auto&b) { return a.z() < b.z(); }),
                        side = *std::max_element(whole.points.begin(), whole.points.end(),
                                                 [](const auto&a, const auto&b) { return a.x() < b.x(); });
  for (const auto& triangle : whole.triangles) {
    const Eigen::Vector3f middle = (whole.points[triangle[0]] + whole.points[triangle[1]] + whole.points[triangle[2]]) / 3.0f;
    if ((middle - top).norm() > 6.0f && (middle - side).norm() > 5.0f)
      torn.triangles.push_back(triangle);
  }
  // A ball that sticks half out of it.
  const Icosphere ball = Icosphere::Make(3);
  const auto first = static_cast<std::uint32_t>(torn.points.size());
  for (const Vector3d& point : ball.points)
    torn.points.push_back((side + Eigen::Vector3f(-10.0f, 20.0f, 0.0f)) + (15.0 * point).cast<float>());
  for (const auto& [a, b, c] : ball.triangles)
    torn.triangles.push_back({a + first, b + first, c + first});
  return torn;
}

TEST(AlphaWrap, WhatIsTornAndCrossedBecomesClosed)
{
  const TriangleSurface whole = InventedAbdomen(25), torn = TornAbdomen(whole);
  EXPECT_THROW(BodySurface{torn}, Error);
  AlphaWrapParameters p;
  p.alphaMm = 12.0;
  p.offsetMm = 0.5;
  const TriangleSurface closed = AlphaWrap(torn, p);
  const SurfaceReport report = CheckSurface(closed);
  EXPECT_TRUE(report.IsSound()) << report.Faults();
  EXPECT_EQ(report.components, 1);
  const BodySurface body(closed);
  // All of the input is inside, and away from the holes no further from it than the offset.
  const TriangleTree tree(torn.points, torn.triangles);
  for (const auto& triangle : torn.triangles)
    ASSERT_LT(body.Distance(torn.points[triangle[0]].cast<double>()), 0.0);
  std::vector<double> distances;
  for (const Eigen::Vector3f& point : closed.points)
    distances.push_back(tree.NearestTo(torn.points, torn.triangles, point.cast<double>())->distanceMm);
  std::sort(distances.begin(), distances.end());
  EXPECT_GT(distances.front(), 0.0);
  EXPECT_LT(distances[distances.size() * 99 / 100], 0.5 * 1.01);
  EXPECT_LT(distances.back(), 6.0); // in the holes
  // The hollow inside was not taken for outside: the volume is that of the body, and of what grew around it.
  const double volume = CheckSurface(whole).volumeMm3;
  EXPECT_GT(report.volumeMm3, volume);
  EXPECT_LT(report.volumeMm3, 1.03 * volume);
  // So it can be printed.
  ShellParameters shell;
  shell.resolutionMm = 1.0;
  shell.openingMm = 70.0;
  shell.printerMm = Vector3d(400.0, 400.0, 400.0);
  EXPECT_TRUE(MakeShell(body, shell).skin.check.IsSound());
}

TEST(AlphaWrap, WhatIsNoSurfaceIsRefused)
{
  EXPECT_THROW(AlphaWrap({}), Error);
  TriangleSurface one;
  one.points = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, std::nanf(""), 0.0f}};
  one.triangles = {{0, 1, 2}};
  EXPECT_THROW(AlphaWrap(one), Error);
  one.points[2] = {0.0f, 1.0f, 0.0f};
  one.triangles = {{0, 1, 3}};
  EXPECT_THROW(AlphaWrap(one), Error);
  one.triangles = {{0, 1, 2}};
  AlphaWrapParameters p;
  p.offsetMm = 0.0;
  EXPECT_THROW(AlphaWrap(one, p), Error);
}

} // namespace
