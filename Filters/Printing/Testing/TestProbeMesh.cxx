// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Printing/ProbeMesh.h"
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <set>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double degree = 0.017453292519943295;
using Triangle = std::array<std::uint32_t, 3>;

// Whether the segment from a to b passes through the triangle, away from its border.
bool Pierces(const Vector3d& a, const Vector3d& b, const Vector3d& p, const Vector3d& q, const Vector3d& r)
{
  const Vector3d normal = (q - p).cross(r - p);
  const double from = normal.dot(a - p), to = normal.dot(b - p);
  if (from * to >= 0.0)
    return false;
  const Vector3d hit = a + from / (from - to) * (b - a);
  const double slack = 1e-9 * normal.squaredNorm();
  return normal.dot((q - p).cross(hit - p)) > slack && normal.dot((r - q).cross(hit - q)) > slack &&
         normal.dot((p - r).cross(hit - r)) > slack;
}

bool CutsItself(const ProbeMesh& mesh)
{
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Triangle& triangle : mesh.triangles) {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t corner : triangle)
      box.extend(mesh.points[corner]);
    boxes.push_back(box);
  }
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (!boxes[i].intersects(boxes[j]))
        continue;
      for (const auto& [edges, other] :
           {std::pair(mesh.triangles[i], mesh.triangles[j]), std::pair(mesh.triangles[j], mesh.triangles[i])})
        for (int k = 0; k < 3; ++k)
          if (Pierces(mesh.points[edges[k]], mesh.points[edges[(k + 1) % 3]], mesh.points[other[0]], mesh.points[other[1]],
                      mesh.points[other[2]]))
            return true;
    }
  return false;
}

// A closed, outward sphere-like surface without slivers of no area, all of whose points are used once.
void ExpectSolid(const ProbeMesh& mesh)
{
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::set<std::uint32_t> used;
  for (const Triangle& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k)
      ++edges[{triangle[k], triangle[(k + 1) % 3]}];
    used.insert(triangle.begin(), triangle.end());
    const Vector3d normal =
        (mesh.points[triangle[1]] - mesh.points[triangle[0]]).cross(mesh.points[triangle[2]] - mesh.points[triangle[0]]);
    ASSERT_GT(normal.norm(), 1e-9);
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(edges.count({edge.second, edge.first}), 1u) << "an edge is open";
  }
  EXPECT_EQ(used.size(), mesh.points.size());
  EXPECT_EQ(static_cast<int>(mesh.points.size()) - static_cast<int>(edges.size() / 2) + static_cast<int>(mesh.triangles.size()),
            2);
  EXPECT_GT(mesh.Volume(), 0.0);
  EXPECT_EQ(mesh.part.size(), mesh.triangles.size());
  // The face looks along its beams, and lies at depth 0.
  for (std::size_t i = 0; i < mesh.facePoints; ++i) {
    const auto beam = BeamPointAt(mesh.face, mesh.points[i], 1e-6);
    ASSERT_TRUE(beam);
    ASSERT_NEAR(beam->depth, 0.0, 1e-6);
  }
  for (std::size_t i = 0; i < mesh.triangles.size() && mesh.part[i] == ProbeMesh::Face; ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vector3d normal = (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
    const Vector3d middle = (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3.0;
    const auto beam = BeamPointAt(mesh.face, middle, 0.2);
    ASSERT_TRUE(beam);
    ASSERT_GT(normal.dot(DirectionOf(mesh.face, *beam)), 0.0);
  }
}

ProbeHousing Coarse(double resolution)
{
  ProbeHousing housing;
  housing.resolutionMm = resolution;
  return housing;
}

std::string ReasonAgainst(const ProbeGeometry& geometry, const ProbeHousing& housing = {})
{
  try {
    MakeProbeMesh(geometry, housing);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(ProbeMesh, PresetsAreSolids)
{
  for (const ProbePreset& preset : ProbePresets())
    for (const double resolution : {5.0, 2.5}) {
      SCOPED_TRACE(preset.name + " at " + std::to_string(resolution));
      const ProbeMesh mesh = MakeProbeMesh(preset.probe, Coarse(resolution));
      ExpectSolid(mesh);
      EXPECT_FALSE(CutsItself(mesh));
      EXPECT_LT(mesh.triangles.size(), 60000u);
    }
}

TEST(ProbeMesh, FindsACut)
{
  // The test itself must be able to fail: a point of the handle pulled through the face.
  ProbeMesh mesh = MakeProbeMesh(ProbePresetOf("mechanical-3d").probe, Coarse(6.0));
  EXPECT_FALSE(CutsItself(mesh));
  mesh.points[mesh.points.size() - 1].z() = 20.0;
  EXPECT_TRUE(CutsItself(mesh));
}

TEST(ProbeMesh, AnyHeadThatCanBeBuiltIsASolid)
{
  Random random(5);
  int built = 0;
  for (int i = 0; i < 60; ++i) {
    const double fan = random.Uniform(0.0, 180.0), sweep = random.Uniform(0.0, 170.0);
    const double fanRadius = std::exp(random.Uniform(std::log(3.0), std::log(200.0)));
    const double sweepRadius = std::exp(random.Uniform(std::log(3.0), std::log(200.0)));
    SCOPED_TRACE(testing::Message() << fan << " degrees at " << fanRadius << ", " << sweep << " degrees at " << sweepRadius);
    const auto geometry = ProbeGeometry::Convex(fan * degree, fanRadius, sweep * degree, sweepRadius, 0.0, 100.0);
    ProbeHousing housing = Coarse(std::max(3.0, 0.05 * geometry.Size()));
    housing.rimMm = random.Uniform(0.5, 10.0);
    const double edge = fanRadius * (1.0 - std::cos(0.5 * fan * degree));
    if (sweep * degree * (sweepRadius - edge) < 0.1) {
      EXPECT_NE(ReasonAgainst(geometry, housing).find("axis of the sweep"), std::string::npos);
      continue;
    }
    const ProbeMesh mesh = MakeProbeMesh(geometry, housing);
    ExpectSolid(mesh);
    EXPECT_FALSE(CutsItself(mesh));
    ++built;
  }
  EXPECT_GT(built, 20);
}

TEST(ProbeMesh, AHalfCylinderHasItsVolume)
{
  // A head that is an upright half cylinder of radius 30 and length 40, on a handle of its own cross-section.
  ProbeHousing housing;
  housing.rimMm = 0.1;
  housing.skirtMm = 10.0;
  housing.resolutionMm = 0.5;
  const auto geometry = ProbeGeometry::Convex(180.0 * degree, 30.0, 0.0, 0.0, 0.0, 50.0);
  housing.faceThicknessMm = 40.0;
  const ProbeMesh mesh = MakeProbeMesh(geometry, housing);
  // What lies above the bottom of the wall, 10 mm below the lowest point of the face: half a cylinder and a block.
  double head = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const double floor = -30.0 - 10.0 - 1e-4 - 1e-6;
    const Vector3d a = mesh.points[t[0]], b = mesh.points[t[1]], c = mesh.points[t[2]];
    if (std::min({a.z(), b.z(), c.z()}) < floor - 1e-9)
      continue;
    // Volume between the triangle and the floor.
    const double area = 0.5 * ((b - a).head<2>().x() * (c - a).head<2>().y() - (b - a).head<2>().y() * (c - a).head<2>().x());
    head += area * ((a.z() + b.z() + c.z()) / 3.0 - floor);
  }
  const double wanted = 0.5 * 3.141592653589793 * 30.0 * 30.0 * 40.0 + 60.0 * 40.0 * 10.0;
  EXPECT_NEAR(head, wanted, 0.01 * wanted);
}

TEST(ProbeMesh, SmallFacesOfBeamsThatStartInOnePoint)
{
  ProbeHousing housing = Coarse(3.0);
  housing.faceWidthMm = 21.0;
  housing.faceThicknessMm = 14.0;
  const ProbeMesh mesh = MakeProbeMesh(ProbeGeometry::Phased(90.0 * degree, 60.0 * degree, 0.0, 100.0), housing);
  ExpectSolid(mesh);
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < mesh.facePoints; ++i)
    box.extend(mesh.points[i]);
  EXPECT_TRUE(box.sizes().isApprox(Vector3d(21, 14, 0)));
}

TEST(ProbeMesh, AFanThatIsPartOfItsArrayShowsTheArray)
{
  ProbeGeometry geometry = ProbeGeometry::Convex(40.0 * degree, 40.0, 40.0 * degree, 40.0, 0.0, 100.0);
  geometry.fanOffset = 0.25;
  const ProbeMesh mesh = MakeProbeMesh(geometry, Coarse(3.0));
  ExpectSolid(mesh);
  EXPECT_NEAR(mesh.face.fanAngle, 60.0 * degree, 1e-12);
  for (const double fan : {-0.5, 0.0, 0.5}) // beams leave from the face
    EXPECT_NEAR(BeamPointAt(mesh.face, PointOf(geometry, {0.0, fan, 0.3}), 1e-6)->depth, 0.0, 1e-9);
}

TEST(ProbeMesh, SaysWhyItCannotBeBuilt)
{
  EXPECT_NE(ReasonAgainst(ProbeGeometry::Convex(200.0 * degree, 10.0, 0.0, 0.0, 0.0, 50.0)).find("the fan is 200 degrees wide"),
            std::string::npos);
  EXPECT_NE(
      ReasonAgainst(ProbeGeometry::Convex(60.0 * degree, 10.0, 179.0 * degree, 40.0, 0.0, 50.0)).find("the sweep is 179 degrees"),
      std::string::npos);
  // The ends of this fan lie 40 (1 - cos 65) = 23 mm behind the middle, the axis of the sweep 20.
  EXPECT_NE(
      ReasonAgainst(ProbeGeometry::Convex(130.0 * degree, 40.0, 40.0 * degree, 20.0, 0.0, 50.0)).find("axis of the sweep, 20"),
      std::string::npos);
  EXPECT_NE(ReasonAgainst(ProbeGeometry::Linear(300.0, 300.0, 0.0, 50.0), Coarse(0.1)).find("5 million triangles"),
            std::string::npos);
  EXPECT_NE(ReasonAgainst(ProbeGeometry{}).find("probe geometry"), std::string::npos);
  ProbeHousing housing;
  housing.handleMm = std::nan("");
  EXPECT_NE(ReasonAgainst(ProbePresetOf("linear").probe, housing).find("HandleMm is nan mm; it must be in [1, 1000]"),
            std::string::npos);
}

TEST(ProbeMesh, ElementsLieOnTheFaceAndLookAlongTheirBeams)
{
  for (const ProbePreset& preset : ProbePresets()) {
    SCOPED_TRACE(preset.name);
    const ProbeGeometry& geometry = preset.probe;
    const int elements = 7, steps = geometry.IsPlane() ? 1 : 5;
    const std::vector<Pose> poses = ElementPoses(geometry, elements, steps);
    ASSERT_EQ(poses.size(), static_cast<std::size_t>(elements * steps));
    for (int j = 0; j < steps; ++j)
      for (int i = 0; i < elements; ++i) {
        const Pose& pose = poses[static_cast<std::size_t>(j * elements + i)];
        EXPECT_TRUE(IsRotation(pose.linear(), 1e-12));
        const BeamPoint deep{30.0, PositionOf(i, elements), PositionOf(j, steps)};
        EXPECT_LT((pose * Vector3d(0, 0, 30) - PointOf(geometry, deep)).norm(), 1e-9);
        if (i > 0 && geometry.fanWidth > 0.0) { // +x leads to the next element
          const Vector3d last = poses[static_cast<std::size_t>(j * elements + i - 1)].translation();
          EXPECT_GT(pose.linear().col(0).dot(pose.translation() - last), 0.0);
        }
      }
  }
  EXPECT_THROW(ElementPoses(ProbePresetOf("linear").probe, 0, 1), Error);
  EXPECT_THROW(ElementPoses(ProbePresetOf("linear").probe, 65536, 65536), Error);
}
