// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Tissue/SurfaceCheck.h"
#include "Filters/Tissue/SurfaceRefinement.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// A long box, outward, and a small tetrahedron of another body.
TissueSurface BoxAndTetrahedron()
{
  TissueSurface surface;
  surface.materials = {StandardMaterial("water"), StandardMaterial("liver"), StandardMaterial("bone")};
  surface.bodies = {{"box", 1}, {"tetrahedron", 2}};
  for (int i = 0; i < 8; ++i)
    surface.points.emplace_back(i & 1 ? 40.0f : 0.0f, i & 2 ? 7.0f : 0.0f, i & 4 ? 3.0f : 0.0f);
  surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  surface.bodyOfTriangle.assign(12, 0);
  for (const auto& point :
       {Eigen::Vector3f(50, 0, 0), Eigen::Vector3f(51, 0, 0), Eigen::Vector3f(50, 1, 0), Eigen::Vector3f(50, 0, 1)})
    surface.points.push_back(point);
  for (const auto& triangle : {std::array<std::uint32_t, 3>{8, 10, 9}, {8, 9, 11}, {8, 11, 10}, {9, 10, 11}}) {
    surface.triangles.push_back(triangle);
    surface.bodyOfTriangle.push_back(1);
  }
  return surface;
}

double VolumeOf(const TissueSurface& surface, int body)
{
  double volume = 0.0;
  for (std::size_t n = 0; n < surface.triangles.size(); ++n)
    if (surface.bodyOfTriangle[n] == body) {
      const auto point = [&](std::size_t corner) { return surface.points[surface.triangles[n][corner]].cast<double>().eval(); };
      volume += point(0).dot(point(1).cross(point(2))) / 6.0;
    }
  return volume;
}

} // namespace

TEST(SurfaceRefinement, NoEdgeIsTooLongAndTheShapeStays)
{
  TissueSurface surface = BoxAndTetrahedron();
  RefineSurface(surface, 2.0);
  surface.Check();
  double longest = 0.0, area = 0.0;
  for (std::size_t n = 0; n < surface.triangles.size(); ++n) {
    const auto point = [&](std::size_t corner) { return surface.points[surface.triangles[n][corner % 3]].cast<double>().eval(); };
    for (std::size_t corner = 0; corner < 3; ++corner)
      longest = std::max(longest, (point(corner + 1) - point(corner)).norm());
    if (surface.bodyOfTriangle[n] == 0)
      area += 0.5 * (point(1) - point(0)).cross(point(2) - point(0)).norm();
  }
  EXPECT_LE(longest, 2.0);
  EXPECT_NEAR(VolumeOf(surface, 0), 40.0 * 7.0 * 3.0, 1e-3);
  EXPECT_NEAR(area, 2.0 * (40.0 * 7.0 + 40.0 * 3.0 + 7.0 * 3.0), 1e-3);
  EXPECT_LT(surface.triangles.size(), 10.0 * area / (0.433 * 2.0 * 2.0)); // ten times as many as would do, not dust
  // What was fine enough is what it was.
  EXPECT_EQ(std::count(surface.bodyOfTriangle.begin(), surface.bodyOfTriangle.end(), 1), 4);
}

TEST(SurfaceRefinement, AClosedSurfaceStaysClosed)
{
  TissueSurface refined = BoxAndTetrahedron();
  RefineSurface(refined, 1.3);
  TriangleSurface box;
  box.points = refined.points;
  for (std::size_t n = 0; n < refined.triangles.size(); ++n)
    if (refined.bodyOfTriangle[n] == 0)
      box.triangles.push_back(refined.triangles[n]);
  EXPECT_EQ(CheckSurface(box).Faults(), "");
}

TEST(SurfaceRefinement, LeavesWhatLiesOutsideOfTheRegion)
{
  TissueSurface part = BoxAndTetrahedron(), whole = part;
  const Eigen::AlignedBox3d region(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(10, 10, 10));
  RefineSurface(part, 1.0, region);
  RefineSurface(whole, 1.0);
  EXPECT_LT(part.triangles.size(), 0.6 * static_cast<double>(whole.triangles.size()));
  double longest = 0.0;
  for (const auto& corners : part.triangles)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Eigen::Vector3d from = part.points[corners[corner]].cast<double>(),
                            to = part.points[corners[(corner + 1) % 3]].cast<double>();
      if (region.contains(from) || region.contains(to))
        longest = std::max(longest, (to - from).norm());
    }
  EXPECT_LE(longest, 1.0);
  EXPECT_NEAR(VolumeOf(part, 0), 40.0 * 7.0 * 3.0, 1e-3); // no gap between what is fine and what is coarse
}

TEST(SurfaceRefinement, RefusesALengthOfNothing)
{
  TissueSurface surface = BoxAndTetrahedron();
  EXPECT_THROW(RefineSurface(surface, 0.0), Error);
  EXPECT_THROW(RefineSurface(surface, std::nan("")), Error);
}
