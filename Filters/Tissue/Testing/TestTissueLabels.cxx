// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Tissue/Icosphere.h"
#include "Filters/Tissue/TissueDistance.h"
#include "Filters/Tissue/TissueLabels.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// A box whose corners lie in the world; a face is cut along one of its diagonals.
void AddBox(TissueSurface& surface, const Eigen::Vector3f& low, const Eigen::Vector3f& high, int material,
            bool isInsideOut = false)
{
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (int corner = 0; corner < 8; ++corner)
    surface.points.emplace_back(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                                corner & 4 ? high.z() : low.z());
  const std::uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& face : faces) {
    surface.triangles.push_back({first + face[0], first + face[isInsideOut ? 2 : 1], first + face[isInsideOut ? 1 : 2]});
    surface.bodyOfTriangle.push_back(static_cast<std::int32_t>(surface.bodies.size()));
  }
  surface.bodies.push_back({"", material});
}

TissueSurface Nothing()
{
  TissueSurface surface;
  surface.materials = {StandardMaterial("water"), StandardMaterial("liver"), StandardMaterial("bone")};
  return surface;
}

// Of radius 10 about (1, 2, 3); its triangles lie up to 0.03 mm within it.
TissueSurface Ball()
{
  TissueSurface surface = Nothing();
  const Icosphere sphere = Icosphere::Make(4);
  for (const Eigen::Vector3d& point : sphere.points)
    surface.points.emplace_back((10.0 * point + Eigen::Vector3d(1, 2, 3)).cast<float>());
  surface.triangles.assign(sphere.triangles.begin(), sphere.triangles.end());
  surface.bodyOfTriangle.assign(surface.triangles.size(), 0);
  surface.bodies.push_back({"ball", 1});
  return surface;
}

ImageGeometry Grid(int size, double spacing, const Eigen::Vector3d& origin)
{
  ImageGeometry grid;
  grid.dimensions = {size, size, size};
  grid.spacing.setConstant(spacing);
  grid.origin = origin;
  return grid;
}

} // namespace

// All points lie right above edges and diagonals of the boxes: none may be missed, none counted twice.
TEST(TissueLabels, NoColumnSlipsThroughAnEdge)
{
  for (const bool isInsideOut : {false, true}) {
    TissueSurface surface = Nothing();
    AddBox(surface, {0.0f, 0.0f, -0.5f}, {6.0f, 6.0f, 5.5f}, 1, isInsideOut);
    const auto labels = BodiesOn(surface, Grid(9, 1.0, {-1.0, -1.0, -1.0}));
    int inside = 0;
    for (int k = 0; k < 9; ++k)
      for (int j = 0; j < 9; ++j)
        for (int i = 0; i < 9; ++i) {
          const std::int32_t label = labels[static_cast<std::size_t>((k * 9 + j) * 9 + i)];
          inside += label == 0;
          if (i > 1 && i < 7 && j > 1 && j < 7 && k > 0 && k < 7) {
            EXPECT_EQ(label, 0) << i << " " << j << " " << k;
          }
          if (i < 1 || i > 7 || j < 1 || j > 7 || k < 1 || k > 6) {
            EXPECT_EQ(label, -1) << i << " " << j << " " << k;
          }
        }
    EXPECT_EQ(inside, 6 * 6 * 6); // of two opposite sides that hold points one counts
  }
}

TEST(TissueLabels, TheLastBodyCounts)
{
  TissueSurface surface = Nothing();
  AddBox(surface, {-10.0f, -10.0f, -10.0f}, {10.0f, 10.0f, 10.0f}, 1);
  AddBox(surface, {-3.0f, -3.0f, -3.0f}, {3.0f, 3.0f, 3.0f}, 2);
  const auto labels = BodiesOn(surface, Grid(3, 2.0, {-0.1, 0.2, 1.1})); // z: 1.1, 3.1, 5.1
  EXPECT_EQ(labels[0], 1);
  EXPECT_EQ(labels[9], 0);
}

// The share of points in a ball is its volume; in a turned grid, too.
TEST(TissueLabels, VolumeOfABall)
{
  ImageGeometry grid = Grid(60, 0.5, Eigen::Vector3d::Zero());
  grid.direction = ExpRotation(Eigen::Vector3d(0.3, -0.5, 0.7));
  grid.origin = Eigen::Vector3d(1, 2, 3) - grid.direction * Eigen::Vector3d::Constant(14.75);
  const auto labels = BodiesOn(Ball(), grid);
  const double volume = 0.125 * static_cast<double>(std::count(labels.begin(), labels.end(), 0));
  EXPECT_NEAR(volume / (4.0 / 3.0 * 3.14159265358979 * 1000.0), 1.0, 0.01);
}

// With a ball inside that bounds nothing outside of tissue; in a turned grid of unequal spacings.
TEST(TissueDistance, OfABall)
{
  TissueSurface ball = Ball();
  AddBox(ball, {-1.0f, 0.0f, 1.0f}, {3.0f, 4.0f, 5.0f}, 2);
  ImageGeometry grid = Grid(32, 1.0, Eigen::Vector3d::Zero());
  grid.spacing = Eigen::Vector3d(0.9, 1.0, 0.8);
  grid.direction = ExpRotation(Eigen::Vector3d(0.3, -0.5, 0.7));
  grid.origin = Eigen::Vector3d(1, 2, 3) - grid.direction * (15.3 * grid.spacing);
  std::vector<std::int32_t> nearest;
  const auto distances = DistancesOn(ball, grid, 4.0, {}, &nearest);
  const Eigen::Affine3d toWorld = grid.IndexToWorld();
  double worst = 0.0;
  for (int n = 0; n < 32 * 32 * 32; ++n) {
    const Eigen::Vector3d place = toWorld * Eigen::Vector3d(n % 32, n / 32 % 32, n / 1024);
    const double exact = std::clamp((place - Eigen::Vector3d(1, 2, 3)).norm() - 10.0, -4.0, 4.0);
    worst = std::max(worst, std::abs(distances[static_cast<std::size_t>(n)] - exact));
    const std::int32_t triangle = nearest[static_cast<std::size_t>(n)];
    ASSERT_EQ(triangle >= 0, std::abs(distances[static_cast<std::size_t>(n)]) < 4.0f);
    if (triangle >= 0) { // its corners lie around the point that is nearest, not on the ball's other side
      const Eigen::Vector3d foot = Eigen::Vector3d(1, 2, 3) + 10.0 * (place - Eigen::Vector3d(1, 2, 3)).normalized();
      for (const std::uint32_t corner : ball.triangles[static_cast<std::size_t>(triangle)])
        EXPECT_LT((ball.points[corner].cast<double>() - foot).norm(), 3.0);
    }
  }
  EXPECT_LT(worst, 0.05);
  EXPECT_THROW(DistancesOn(ball, grid, 0.0), Error);
}

// In front of a face, an edge and a corner.
TEST(TissueDistance, OfABox)
{
  TissueSurface box = Nothing();
  AddBox(box, {0.0f, 0.0f, 0.0f}, {4.0f, 4.0f, 4.0f}, 1);
  const auto distances = DistancesOn(box, Grid(10, 1.0, {-2.5, -2.5, -2.5}), 3.0);
  const auto at = [&distances](int i, int j, int k) { return distances[static_cast<std::size_t>((k * 10 + j) * 10 + i)]; };
  EXPECT_FLOAT_EQ(at(4, 4, 1), 1.5f);
  EXPECT_FLOAT_EQ(at(4, 1, 1), std::sqrt(4.5f));
  EXPECT_FLOAT_EQ(at(1, 1, 1), std::sqrt(6.75f));
  EXPECT_FLOAT_EQ(at(4, 4, 3), -0.5f);
  EXPECT_FLOAT_EQ(at(0, 0, 0), 3.0f);
}

// A layer of a third of a spacing over a block: inside of both, the surface is the layer's outer one.
TEST(TissueDistance, OfAThinLayer)
{
  TissueSurface box = Nothing();
  AddBox(box, {-6.0f, -6.0f, -6.0f}, {6.0f, 6.0f, 6.0f}, 1);
  AddBox(box, {-5.7f, -5.7f, -5.7f}, {5.7f, 5.7f, 5.7f}, 2);
  const auto distances = DistancesOn(box, Grid(16, 1.0, {-7.5, -7.5, -7.5}), 4.0);
  const auto at = [&distances](int i, int j, int k) { return distances[static_cast<std::size_t>((k * 16 + j) * 16 + i)]; };
  for (int k = 1; k < 15; ++k)
    for (int j = 2; j < 14; ++j)
      for (int i = 2; i < 14; ++i) {
        const double outside = std::max({std::abs(i - 7.5), std::abs(j - 7.5), std::abs(k - 7.5)}) - 6.0;
        EXPECT_NEAR(at(i, j, k), std::max(outside, -4.0), 1e-5) << i << " " << j << " " << k;
      }
}
