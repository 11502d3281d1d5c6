// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Tissue/Icosphere.h"
#include "Filters/Tissue/PackedTissue.h"
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <string>

using namespace echorama;
using Eigen::Vector3d;

namespace {

PackedTissueParameters Small()
{
  PackedTissueParameters p;
  p.packing.boxMin = {-15, -15, 0};
  p.packing.boxMax = {15, 15, 40};
  p.packing.radiusMin = 0.8;
  p.packing.radiusMax = 6.0;
  return p;
}

// The volumes within the triangles of each body.
std::vector<double> Volumes(const TissueSurface& surface)
{
  std::vector<double> volumes(surface.bodies.size());
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const auto& [a, b, c] = surface.triangles[i];
    const Vector3d p = surface.points[a].cast<double>(), q = surface.points[b].cast<double>(),
                   r = surface.points[c].cast<double>();
    volumes[static_cast<std::size_t>(surface.bodyOfTriangle[i])] += p.dot(q.cross(r)) / 6.0;
  }
  return volumes;
}

std::string MessageOf(const PackedTissueParameters& p)
{
  try {
    MakePackedTissue(p);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(PackedTissue, MeshesStayWithinTheirDeviation)
{
  PackedTissueParameters p = Small();
  p.cell = {0.5, 0.05, {0, 0, -10}};
  for (const bool trueVolume : {false, true}) {
    p.trueVolume = trueVolume;
    const PackedTissue tissue = MakePackedTissue(p);
    const auto& surface = tissue.surface;
    surface.Check();
    ASSERT_EQ(surface.bodies.size(), tissue.packing.spheres.size());
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
      const Sphere& sphere = tissue.packing.spheres[static_cast<std::size_t>(surface.bodyOfTriangle[i])];
      const double allowed = p.deviation * (0.5 + 0.05 * (sphere.centre - Vector3d(0, 0, -10)).norm());
      Vector3d middle = Vector3d::Zero();
      for (const std::uint32_t corner : surface.triangles[i]) {
        middle += surface.points[corner].cast<double>() / 3.0;
        const double out = (surface.points[corner].cast<double>() - sphere.centre).norm() - sphere.radius;
        EXPECT_LE(out, (trueVolume ? 0.9 * allowed : 0.0) + 1e-4);
        EXPECT_GE(out, -1e-4);
      }
      EXPECT_GE((middle - sphere.centre).norm() - sphere.radius, -allowed - 1e-4);
    }
    const std::vector<double> volumes = Volumes(surface);
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      const double sphere = 4.0 / 3.0 * 3.141592653589793 * std::pow(tissue.packing.spheres[i].radius, 3);
      EXPECT_LT(volumes[i], 1.0001 * sphere);
      EXPECT_EQ(volumes[i] > 0.9999 * sphere, trueVolume);
    }
  }
}

TEST(PackedTissue, FartherFromTheProbeTheyAreCoarser)
{
  PackedTissueParameters p = Small();
  p.cell = {0.2, 0.0, {0, 0, 0}};
  const std::vector<Sphere> spheres{{{0, 0, 5}, 3.0}, {{0, 0, 500}, 3.0}};
  const auto near = MeshSpheres(p, {spheres[0]}), far = MeshSpheres(p, {spheres[1]});
  EXPECT_EQ(near.triangles.size(), far.triangles.size());
  p.cell.growth = 0.02;
  EXPECT_GT(MeshSpheres(p, {spheres[0]}).triangles.size(), 3 * MeshSpheres(p, {spheres[1]}).triangles.size());
}

TEST(PackedTissue, MaterialsComeByTheirWeights)
{
  PackedTissueParameters p = Small();
  p.packing.radiusMin = p.packing.radiusMax = 0.5;
  p.packing.count = 4000;
  p.packing.fillFraction = 1.0;
  p.cell.mm = 10.0;
  p.materials = {{StandardMaterial("bone"), 1.0}, {StandardMaterial("air"), 0.0}, {StandardMaterial("liver"), 3.0}};
  const TissueSurface surface = MakePackedTissue(p).surface;
  std::vector<int> counts(surface.materials.size());
  for (const auto& body : surface.bodies)
    ++counts[static_cast<std::size_t>(body.material)];
  ASSERT_EQ(surface.materials.size(), 4u);
  EXPECT_EQ(surface.materials[0].name, "tissue");
  EXPECT_EQ(counts[0] + counts[2], 0); // background, air
  EXPECT_NEAR(counts[1] / 4000.0, 0.25, 0.025);
  EXPECT_NEAR(counts[3] / 4000.0, 0.75, 0.025);
}

TEST(PackedTissue, AMaterialThatIsTheBackgroundsIsListedOnce)
{
  PackedTissueParameters p = Small();
  p.materials = {{p.background, 1.0}, {StandardMaterial("liver"), 1.0}};
  EXPECT_EQ(MakePackedTissue(p).surface.materials.size(), 2u);
}

TEST(PackedTissue, SameOnAnyThreads)
{
  const PackedTissueParameters p = Small();
  const TissueSurface first = MakePackedTissue(p).surface;
  const ThreadLimit one(1);
  const TissueSurface again = MakePackedTissue(p).surface;
  EXPECT_EQ(first.points, again.points);
  EXPECT_EQ(first.triangles, again.triangles);
  EXPECT_EQ(first.bodyOfTriangle, again.bodyOfTriangle);
}

TEST(PackedTissue, TurningChangesNoSphere)
{
  PackedTissueParameters p = Small();
  const std::vector<Sphere> spheres{{{1, 2, 20}, 3.0}, {{-8, 2, 20}, 3.0}};
  const TissueSurface turned = MeshSpheres(p, spheres);
  p.turned = false;
  const TissueSurface straight = MeshSpheres(p, spheres);
  ASSERT_EQ(turned.points.size(), straight.points.size());
  EXPECT_GT((turned.points[0] - straight.points[0]).norm(), 0.01f);
  const std::size_t half = turned.points.size() / 2;
  EXPECT_LT((straight.points[half] - straight.points[0] - Eigen::Vector3f(-9, 0, 0)).norm(), 1e-5f);
  EXPECT_GT((turned.points[half] - turned.points[0] - Eigen::Vector3f(-9, 0, 0)).norm(), 0.01f);
}

TEST(PackedTissue, NothingIsTissueToo)
{
  PackedTissueParameters p = Small();
  p.packing.count = 0;
  const TissueSurface surface = MakePackedTissue(p).surface;
  surface.Check();
  EXPECT_TRUE(surface.triangles.empty());
  EXPECT_EQ(surface.materials[0].name, "tissue");
}

TEST(PackedTissue, RefusesWithTheNameOfTheNumber)
{
  const auto expect = [](const char* words, const auto& spoil) {
    PackedTissueParameters p = Small();
    spoil(p);
    EXPECT_NE(MessageOf(p).find(words), std::string::npos) << MessageOf(p);
  };
  expect("MaxTriangles (1000)", [](auto& p) { p.maxTriangles = 1000; });
  expect("weight of \"liver\"", [](auto& p) { p.materials[1].weight = -1.0; });
  expect("no material with a weight", [](auto& p) { p.materials.clear(); });
  expect("no material with a weight", [](auto& p) { p.materials = {{StandardMaterial("liver"), 0.0}}; });
  expect("Density is ", [](auto& p) { p.materials[0].material.density = -1.0; });
  expect("SoundSpeed is ", [](auto& p) { p.background.soundSpeed = 0.0; });
  expect("CellMm is ", [](auto& p) { p.cell.mm = 0.0; });
  expect("CellGrowth is ", [](auto& p) { p.cell.growth = -0.1; });
  expect("Deviation is ", [](auto& p) { p.deviation = 0.0; });
  expect("RadiusMin is ", [](auto& p) { p.packing.radiusMin = -1.0; });
}
