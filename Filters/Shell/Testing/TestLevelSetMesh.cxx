// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Shell/LevelSetMesh.h"
#include <cmath>
#include <gtest/gtest.h>
#include <set>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// A lattice on which a function of the node is sampled, everywhere.
template <class Function>
LevelSet Lattice(int cells, double cellMm, const Function& function)
{
  LevelSet levelSet;
  levelSet.origin = Vector3d(-3.0, 1.0, 2.0);
  levelSet.cellMm = cellMm;
  levelSet.cells = Eigen::Array3i(cells, cells, cells);
  levelSet.mayCross = [](const Eigen::Array3i&) { return true; };
  levelSet.sample = [function](const Eigen::Array3i& first, LevelSet::Values& values) {
    std::size_t at = 0;
    for (int k = 0; k < LevelSet::blockNodes; ++k)
      for (int j = 0; j < LevelSet::blockNodes; ++j)
        for (int i = 0; i < LevelSet::blockNodes; ++i)
          values[at++] = static_cast<float>(function(Eigen::Array3i(first + Eigen::Array3i(i, j, k))));
  };
  return levelSet;
}

// Noise: every case of a cell comes up, beside every other one.
LevelSet Noise(std::uint64_t seed)
{
  constexpr int cells = 24;
  return Lattice(cells, 0.5, [seed](const Eigen::Array3i& node) {
    if (node.minCoeff() < 1 || node.maxCoeff() > cells - 1)
      return 1.0;
    return Random(seed, static_cast<std::uint64_t>(node.x() + 100 * (node.y() + 100 * node.z()))).Uniform(-1.0, 1.0);
  });
}

TEST(LevelSetMesh, IsClosedAndFacesOutwardsWhateverTheValues)
{
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SurfaceCheckParameters parameters;
    parameters.selfIntersections = false; // cells of noise are divided without a look at it
    const TriangleSurface surface = MeshLevelSet(Noise(seed));
    const SurfaceReport report = CheckSurface(surface, parameters);
    EXPECT_GT(report.triangles, 20000);
    EXPECT_EQ(report.openEdges.count, 0);
    EXPECT_EQ(report.crowdedEdges.count, 0);
    EXPECT_EQ(report.inconsistentEdges.count, 0);
    EXPECT_EQ(report.degenerateTriangles.count, 0);
    EXPECT_GT(report.volumeMm3, 0.0);
  }
}

TEST(LevelSetMesh, CasesUseEveryCrossedEdgeAndNoOther)
{
  for (int inside = 0; inside < 256; ++inside) {
    std::set<int> used, crossed;
    for (const auto& triangle : CellCases()[static_cast<std::size_t>(inside)])
      used.insert(triangle.begin(), triangle.end());
    for (int edge = 0; edge < 12; ++edge) {
      const auto [corner, axis] = CellEdge(edge);
      if ((inside >> corner & 1) != (inside >> (corner | 1 << axis) & 1))
        crossed.insert(edge);
    }
    EXPECT_EQ(used, crossed) << inside;
  }
}

TEST(LevelSetMesh, SphereIsTrueToSecondOrder)
{
  const Vector3d centre(3.1, 7.2, 8.3);
  const double radius = 5.0;
  double previous = 0.0;
  for (const int cells : {24, 48}) {
    const double cell = 12.0 / cells;
    const TriangleSurface surface = MeshLevelSet(Lattice(cells, cell, [&](const Eigen::Array3i& node) {
      return (Vector3d(-3.0, 1.0, 2.0) + cell * node.cast<double>().matrix() - centre).norm() - radius;
    }));
    const SurfaceReport report = CheckSurface(surface);
    EXPECT_TRUE(report.IsSound()) << report.Faults();
    EXPECT_EQ(report.components, 1);
    double worst = 0.0;
    for (const Eigen::Vector3f& point : surface.points)
      worst = std::max(worst, std::abs((point.cast<double>() - centre).norm() - radius));
    EXPECT_LT(worst, cell * cell / (8.0 * radius) + 0.02 * cell);
    const double lost = 4.0 / 3.0 * 3.141592653589793 * 125.0 - report.volumeMm3;
    EXPECT_GT(lost, 0.0); // chords lie within a ball
    if (previous > 0.0) {
      EXPECT_NEAR(previous / lost, 4.0, 0.6);
    }
    previous = lost;
  }
}

TEST(LevelSetMesh, DoesNotDependOnThreads)
{
  const TriangleSurface all = MeshLevelSet(Noise(7));
  const ThreadLimit limit(1);
  const TriangleSurface one = MeshLevelSet(Noise(7));
  EXPECT_EQ(all.triangles, one.triangles);
  EXPECT_EQ(all.points, one.points);
}

TEST(LevelSetMesh, IsStopped)
{
  EXPECT_THROW(MeshLevelSet(Noise(7), Progress([](double) { return false; })), Error);
}

TEST(LevelSetMesh, PointsDoNotMoveWhereTrianglesWouldTurnOver)
{
  TriangleSurface surface;
  surface.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  surface.triangles = {{0, 1, 2}, {3, 4, 5}};
  // The first is pulled over its third point; the second is raised.
  const std::size_t stayed = MovePoints(surface, [](const Vector3d& p) {
    return p.x() > 4.0 ? Vector3d(p + 0.1 * Vector3d::UnitZ()) : p.x() > 0.5 ? Vector3d(-1.0, 0.0, 0.0) : p;
  });
  EXPECT_EQ(stayed, 3u);
  EXPECT_EQ(surface.points[1], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(surface.points[4], Eigen::Vector3f(6, 0, 0.1f));
}

// A ball of 10 cells, and a node that is inside all alone.
TEST(LevelSetMesh, CrumbsAreDroppedAndNothingElse)
{
  LevelSet levelSet;
  levelSet.cells = Eigen::Array3i::Constant(40);
  levelSet.mayCross = [](const Eigen::Array3i&) { return true; };
  levelSet.sample = [](const Eigen::Array3i& first, LevelSet::Values& values) {
    std::size_t at = 0;
    for (int k = 0; k < LevelSet::blockNodes; ++k)
      for (int j = 0; j < LevelSet::blockNodes; ++j)
        for (int i = 0; i < LevelSet::blockNodes; ++i) {
          const Eigen::Vector3d place(first.x() + i, first.y() + j, first.z() + k);
          const double ball = (place - Eigen::Vector3d::Constant(15.3)).norm() - 10.0,
                       crumb = (place - Eigen::Vector3d(30.0, 31.0, 32.0)).norm() - 0.4;
          values[at++] = static_cast<float>(std::min(ball, crumb));
        }
  };
  TriangleSurface surface = MeshLevelSet(levelSet);
  EXPECT_EQ(CheckSurface(surface).components, 2);
  EXPECT_EQ(DropCrumbs(surface, 2.0), 1u);
  const SurfaceReport report = CheckSurface(surface);
  EXPECT_EQ(report.components, 1);
  EXPECT_TRUE(report.IsSound()) << report.Faults();
  EXPECT_NEAR(report.volumeMm3, 4.0 / 3.0 * 3.14159265 * 1000.0, 40.0);
  EXPECT_EQ(DropCrumbs(surface, 2.0), 0u);
}

} // namespace
