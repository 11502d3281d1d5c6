// SPDX-License-Identifier: BSD-3-Clause
// Regions of known fans, one and many together, and regions that are none: every voxel is inside, and the fan is not much larger.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Imaging/ScanConversion.h"
#include "Testing/Sanitized.h"
#include <functional>
#include <gtest/gtest.h>
#include <vector>

using namespace echorama;

namespace {

constexpr double degree = RadiansPerDegree;

struct Region {
  ImageGeometry grid;
  Volume<unsigned char> mask;
  double Size() const
  {
    double count = 0.0;
    for (const unsigned char voxel : mask.View())
      count += voxel;
    return count * grid.spacing.x() * grid.spacing.y() * (grid.dimensions[2] > 1 ? grid.spacing.z() : 1.0);
  }
};

ImageGeometry GridOf(int x, int y, int z, const Eigen::Vector3d& spacing = Eigen::Vector3d::Ones())
{
  ImageGeometry grid;
  grid.dimensions = {x, y, z};
  grid.spacing = spacing;
  return grid;
}

Region RegionOf(const ImageGeometry& grid, const std::function<bool(const Eigen::Vector3d&)>& isInside)
{
  Region region{grid, Volume<unsigned char>(grid.dimensions)};
  const Eigen::Affine3d toWorld = grid.IndexToWorld();
  ParallelFor(grid.dimensions[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i)
        region.mask.View()(i, j, k) = isInside(Eigen::Vector3d(toWorld * Eigen::Vector3d(i, j, k))) ? 1 : 0;
  });
  return region;
}

// What several fans see together, on a grid along \a axes.
Region UnionOf(const std::vector<PlacedProbe>& fans, const Eigen::Vector3d& spacing,
               const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity())
{
  Eigen::AlignedBox3d box;
  for (const PlacedProbe& fan : fans)
    for (const double depth : {fan.geometry.depthMin, fan.geometry.depthMax})
      for (double along = -0.5; along <= 0.5; along += 0.125)
        for (double sweep = -0.5; sweep <= 0.5; sweep += 0.125)
          box.extend(axes.transpose() * (fan.probeToWorld * PointOf(fan.geometry, {depth, along, sweep})));
  ImageGeometry grid;
  grid.spacing = spacing;
  grid.direction = axes;
  grid.origin = axes * (box.min() - 3.0 * spacing);
  for (std::size_t a = 0; a < 3; ++a)
    grid.dimensions[a] = static_cast<int>(box.sizes()[static_cast<int>(a)] / spacing[static_cast<int>(a)]) + 7;
  std::vector<Pose> toProbe;
  for (const PlacedProbe& fan : fans)
    toProbe.push_back(fan.probeToWorld.inverse());
  return RegionOf(grid, [&](const Eigen::Vector3d& at) {
    for (std::size_t i = 0; i < fans.size(); ++i)
      if (BeamPointAt(fans[i].geometry, toProbe[i] * at, 1e-6))
        return true;
    return false;
  });
}

PlacedProbe Enclosed(const Region& region, const EnclosingFanParameters& parameters = {})
{
  return EncloseRegion(region.mask.View(), region.grid, parameters);
}

// How many real voxels the fan leaves outside, or has closer than \a margin to an end in depth or to a side.
int Outside(const PlacedProbe& fan, const Region& region, double margin = 0.0)
{
  EXPECT_NO_THROW(fan.geometry.Check());
  EXPECT_TRUE(IsRotation(fan.probeToWorld.linear(), 1e-9));
  const Eigen::Affine3d toProbe = fan.probeToWorld.inverse() * region.grid.IndexToWorld();
  int count = 0;
  for (int k = 0; k < region.grid.dimensions[2]; ++k)
    for (int j = 0; j < region.grid.dimensions[1]; ++j)
      for (int i = 0; i < region.grid.dimensions[0]; ++i)
        if (region.mask.View()(i, j, k)) {
          const auto beam = BeamPointAt(fan.geometry, toProbe * Eigen::Vector3d(i, j, k));
          const ProbeGeometry& g = fan.geometry;
          const double rho = beam ? g.Fan().PointOf({beam->fan + g.fanOffset, beam->depth}).y() : 0.0;
          count += !beam || beam->depth < g.depthMin + margin || beam->depth > g.depthMax - margin ||
                   (0.5 - std::abs(beam->fan)) * g.Fan().Span(beam->depth) < margin ||
                   (!g.IsPlane() && (0.5 - std::abs(beam->sweep)) * std::abs(g.Sweep().Span(rho)) < margin);
        }
  return count;
}

// Voxels all inside, and the volume at most \a most times that of the region.
void ExpectEncloses(const PlacedProbe& fan, const Region& region, double most, double margin = 0.0)
{
  EXPECT_EQ(Outside(fan, region, margin), 0);
  const double ratio = FanVolume(fan.geometry) / region.Size();
  EXPECT_LT(ratio, most);
  EXPECT_GT(ratio, 0.99);
  if (const char* tell = std::getenv("ECHORAMA_TEST_VERBOSE"); tell)
    std::printf("ratio %.3f: fan %.1f deg %.1f mm, sweep %.1f deg %.1f mm, depth %.1f to %.1f, offset %.3f\n", ratio,
                fan.geometry.fanAngle / degree, fan.geometry.fanWidth, fan.geometry.sweepAngle / degree, fan.geometry.sweepWidth,
                fan.geometry.depthMin, fan.geometry.depthMax, fan.geometry.fanOffset);
}

Error::Kind RefusalOf(const Region& region, const EnclosingFanParameters& parameters = {})
{
  try {
    Enclosed(region, parameters);
  } catch (const Error& error) {
    return error.GetKind();
  }
  ADD_FAILURE() << "accepted";
  return Error::Kind::FileSystem;
}

const ProbeGeometry convex = ProbeGeometry::Convex(65 * degree, 40.0, 55 * degree, 30.0, 5.0, 100.0);

PlacedProbe Placed(const ProbeGeometry& geometry, double x, double y, double z, double aboutX = 0.0, double aboutY = 0.0,
                   double aboutZ = 0.0)
{
  PlacedProbe placed{geometry, Pose::Identity()};
  placed.probeToWorld.linear() = ExpRotation(degree * Eigen::Vector3d(aboutX, aboutY, aboutZ));
  placed.probeToWorld.translation() = Eigen::Vector3d(x, y, z);
  return placed;
}

// A probe that slides along a convex body: it turns as it goes.
std::vector<PlacedProbe> Views(const ProbeGeometry& geometry, int count, double stepMm, double stepDegrees)
{
  std::vector<PlacedProbe> views;
  for (int i = 0; i < count; ++i) {
    const double at = i - 0.5 * (count - 1);
    views.push_back(Placed(geometry, at * stepMm, 3.0 * at, 1.5 * at * at, 4.0 * at, at * stepDegrees, 5.0 * at));
  }
  return views;
}

const std::vector<std::pair<const char*, ProbeGeometry>> probes{
    {"convex", convex},
    {"small sweep radius", ProbeGeometry::Convex(60 * degree, 60, 70 * degree, 10, 2, 120)},
    {"mechanical", ProbeGeometry::Convex(34 * degree, 24.67, 39.8 * degree, 18.0, 0, 43.1)},
    {"phased", ProbeGeometry::Phased(80 * degree, 50 * degree, 0, 150)},
    {"linear, turned", {0.0, 44.0, 30 * degree, 12.0, 0.0, 60.0}},
    {"linear", ProbeGeometry::Linear(38, 50, 0, 60)},
    {"off centre", {34.07 * degree, 14.66, 39.75 * degree, 17.12, 0.0, 43.15, 0.402}},
};

} // namespace

TEST(FanVolume, IsThatOfItsVoxels)
{
  EXPECT_DOUBLE_EQ(FanVolume(ProbeGeometry::Linear(30, 20, 5, 45)), 30.0 * 20.0 * 40.0);
  // A sector of a disc, and of a ball: the part of a full turn of a sweep about its edge.
  EXPECT_NEAR(FanVolume(ProbeGeometry::Convex(1.0, 20, 0, 0, 0, 30)), 0.5 * (50.0 * 50.0 - 20.0 * 20.0), 1e-9);
  EXPECT_NEAR(FanVolume(ProbeGeometry::Phased(1.5, 0.8, 0, 60)), 0.8 * 2.0 * std::sin(0.75) * std::pow(60.0, 3) / 3.0, 1e-3);
  for (const auto& [name, probe] : probes) {
    SCOPED_TRACE(name);
    const double voxel = 0.012 * probe.Size();
    const Region region = UnionOf({Placed(probe, 3, 4, 5, 10, 20, 30)}, Eigen::Vector3d::Constant(voxel));
    EXPECT_NEAR(region.Size() / FanVolume(probe), 1.0, 0.01);
  }
}

TEST(EnclosingFan, OfTheRegionOfOneFanIsThatFan)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const auto& [name, probe] : probes) {
    SCOPED_TRACE(name);
    const double voxel = (probe.depthMax - probe.depthMin) / 60.0;
    const Region region = UnionOf({Placed(probe, 30, -20, 50, 20, -30, 50)}, {voxel, 0.8 * voxel, 1.3 * voxel},
                                  ExpRotation(Eigen::Vector3d(-0.7, 1.1, 0.2)));
    ExpectEncloses(Enclosed(region), region, 1.16);
    EnclosingFanParameters wider;
    wider.marginMm = voxel;
    ExpectEncloses(Enclosed(region, wider), region, 1.32, voxel);
  }
}

TEST(EnclosingFan, EnclosesSeveralViews)
{
  ECHORAMA_SKIP_SANITIZED();
  const double spacing = 1.7;
  for (const auto& [count, step, turn] : {std::tuple{2, 30.0, 10.0}, {3, 30.0, 10.0}, {4, 25.0, 15.0}, {3, 60.0, 0.0}}) {
    SCOPED_TRACE(std::to_string(count) + " views, each " + std::to_string(step) + " mm on");
    const auto views = Views(convex, count, step, turn);
    const Region region = UnionOf(views, Eigen::Vector3d::Constant(spacing));
    ExpectEncloses(Enclosed(region), region, 1.6);
    EnclosingFanParameters machine;
    machine.shape = views[0];
    const PlacedProbe fan = Enclosed(region, machine);
    ExpectEncloses(fan, region, 1.6);
    // Nowhere less than the machine's, and not more bent.
    EXPECT_LE(fan.geometry.depthMin, convex.depthMin);
    EXPECT_GE(fan.geometry.depthMax, convex.depthMax);
    EXPECT_GE(fan.geometry.fanWidth, convex.fanWidth);
    EXPECT_GE(fan.geometry.Fan().Span(convex.depthMax), convex.Fan().Span(convex.depthMax));
    EXPECT_LE(fan.geometry.fanAngle / fan.geometry.fanWidth, convex.fanAngle / convex.fanWidth * (1 + 1e-9));
    EXPECT_LE(fan.geometry.sweepAngle / fan.geometry.sweepWidth, convex.sweepAngle / convex.sweepWidth * (1 + 1e-9));
  }
}

TEST(EnclosingFan, AShapeThatHoldsAllStaysAsItIs)
{
  const PlacedProbe truth = Placed(convex, 30, -20, 50, 20, -30, 50);
  const Region region = UnionOf({truth}, Eigen::Vector3d::Constant(3.0));
  EnclosingFanParameters machine;
  machine.shape = truth;
  machine.shape->geometry.fanAngle *= 1.001;
  const PlacedProbe same = Enclosed(region, machine);
  EXPECT_EQ(same.geometry.fanAngle, machine.shape->geometry.fanAngle);
  EXPECT_EQ(same.geometry.depthMin, 5.0);
  EXPECT_EQ(same.probeToWorld.matrix(), truth.probeToWorld.matrix());
  machine.marginMm = 2.0; // no longer
  const PlacedProbe larger = Enclosed(region, machine);
  ExpectEncloses(larger, region, 1.4, 2.0 - 1e-6);
  machine.shape->geometry = ProbeGeometry::Convex(80 * degree, 40.0, 70 * degree, 30.0, 0.0, 110.0);
  EXPECT_EQ(Enclosed(region, machine).geometry.depthMax, 110.0);
}

TEST(EnclosingFan, HasTheMargin)
{
  const Region region = UnionOf({Placed(convex, 0, 0, 0)}, Eigen::Vector3d::Constant(3.0));
  EnclosingFanParameters parameters;
  for (const double margin : {0.0, 4.0, 10.0}) {
    parameters.marginMm = margin;
    ExpectEncloses(Enclosed(region, parameters), region, 1.3 + 0.08 * margin, margin);
  }
}

TEST(EnclosingFan, OfRegionsThatAreNoFan)
{
  ECHORAMA_SKIP_SANITIZED();
  const auto expect = [](const ImageGeometry& grid, double most, const std::function<bool(const Eigen::Vector3d&)>& isInside) {
    const Region region = RegionOf(grid, isInside);
    ExpectEncloses(Enclosed(region), region, most);
    EnclosingFanParameters machine; // that looks elsewhere, from within, and upwards
    machine.shape = Placed(ProbeGeometry::Convex(65 * degree, 40.0, 55 * degree, 30.0, 5.0, 60.0), 20, 20, 10, 170, 5, 0);
    EXPECT_EQ(Outside(Enclosed(region, machine), region), 0);
    machine.shape = Placed(ProbeGeometry::Phased(60 * degree, 40 * degree, 0.0, 60.0), 20, 20, 20, 0, 80, 0);
    EXPECT_EQ(Outside(Enclosed(region, machine), region), 0);
  };
  const ImageGeometry grid = GridOf(40, 40, 40);
  const Eigen::Vector3d middle(20, 20, 20);
  expect(grid, 1.2, [](const Eigen::Vector3d& at) { return at == Eigen::Vector3d(7, 8, 9); });
  expect(grid, 3.0, [](const Eigen::Vector3d& at) { return at.x() == 7.0 && at.y() == 8.0; });                // a line
  expect(grid, 3.0, [](const Eigen::Vector3d& at) { return at.x() == 7.0; });                                 // a sheet
  expect(grid, 12.0, [&](const Eigen::Vector3d& at) { return std::abs((at - middle).norm() - 15.0) < 0.7; }); // a shell
  expect(grid, 2.2, [&](const Eigen::Vector3d& at) { return (at - middle).norm() < 15.0; });                  // a ball
  expect(grid, 1.1, [](const Eigen::Vector3d&) { return true; });                                             // a box
  expect(grid, 40.0, [](const Eigen::Vector3d& at) { return at.norm() < 3.0 || (at.array() > 36.0).all(); }); // islands
  expect(GridOf(60, 30, 12, {0.3, 0.9, 2.5}), 1.8, [](const Eigen::Vector3d& at) { return at.x() + at.z() > 20.0; });
}

TEST(EnclosingFan, LeavesNoIslandOut)
{
  Region region = UnionOf({Placed(convex, 0, 0, 0)}, Eigen::Vector3d::Constant(3.0));
  const auto& n = region.grid.dimensions;
  region.mask.View()(0, 0, 0) = 1;
  region.mask.View()(n[0] - 1, n[1] / 2, n[2] - 1) = 1;
  ExpectEncloses(Enclosed(region), region, 3.0);
}

TEST(EnclosingFan, OfNothingMissingTheGridIsTheRegion)
{
  const ImageGeometry grid = GridOf(30, 20, 25, {1.0, 1.5, 0.5});
  const PlacedProbe fan = EncloseRegion({}, grid);
  const Region region = RegionOf(grid, [](const Eigen::Vector3d&) { return true; });
  ExpectEncloses(fan, region, 1.15);
}

TEST(EnclosingFan, OfASliceIsAPlane)
{
  ImageGeometry grid = GridOf(120, 90, 1, {0.5, 0.7, 1.0});
  grid.direction = ExpRotation(Eigen::Vector3d(0.4, -0.9, 0.3));
  grid.origin = Eigen::Vector3d(10, 20, 30);
  const Eigen::Affine3d toIndex = grid.WorldToIndex();
  const auto inPlane = [&](const Eigen::Vector3d& at) { return Eigen::Vector3d((toIndex * at).cwiseProduct(grid.spacing)); };
  const Region sector = RegionOf(grid, [&](const Eigen::Vector3d& at) {
    const Eigen::Vector3d p = inPlane(at) - Eigen::Vector3d(30, -10, 0);
    return p.norm() > 18.0 && p.norm() < 65.0 && std::abs(p.x()) < 0.4 * p.y();
  });
  const PlacedProbe fan = Enclosed(sector);
  EXPECT_TRUE(fan.geometry.IsPlane());
  ExpectEncloses(fan, sector, 1.1);
  const Region dot =
      RegionOf(grid, [&](const Eigen::Vector3d& at) { return (inPlane(at) - Eigen::Vector3d(5, 7, 0)).norm() < 0.1; });
  ExpectEncloses(Enclosed(dot), dot, 1.3);
  const Region two = RegionOf(grid, [&](const Eigen::Vector3d& at) {
    const Eigen::Vector3d p = inPlane(at);
    return (p - Eigen::Vector3d(20, 20, 0)).norm() < 12.0 || (p - Eigen::Vector3d(40, 35, 0)).norm() < 15.0;
  });
  ExpectEncloses(Enclosed(two), two, 1.8);
  EnclosingFanParameters machine;
  machine.shape = fan;
  EXPECT_EQ(Outside(Enclosed(two, machine), two), 0);
  EXPECT_TRUE(Enclosed(two, machine).geometry.IsPlane());
  machine.shape = Placed(convex, 30, 30, -20); // a probe that sweeps
  EXPECT_EQ(Outside(Enclosed(two, machine), two), 0);
  machine.shape = fan; // and a plane that is to become a volume
  const Region ball =
      RegionOf(GridOf(20, 20, 20), [](const Eigen::Vector3d& at) { return (at - Eigen::Vector3d(9, 9, 9)).norm() < 8; });
  EXPECT_EQ(Outside(Enclosed(ball, machine), ball), 0);
}

TEST(EnclosingFan, SurvivesAnyRegion)
{
  Random random(5);
  for (int round = 0; round < 12; ++round) {
    ImageGeometry grid = GridOf(static_cast<int>(random.Below(25)) + 1, static_cast<int>(random.Below(25)) + 1,
                                static_cast<int>(random.Below(25)) + 1);
    for (int a = 0; a < 3; ++a)
      grid.spacing[a] = std::exp(random.Uniform(-3, 3));
    grid.origin = 1e4 * random.Direction();
    grid.direction = ExpRotation(random.Uniform(0, 3) * random.Direction());
    const double density = 0.3 * random.Uniform();
    Region region{grid, Volume<unsigned char>(grid.dimensions)};
    for (unsigned char& voxel : region.mask.View())
      voxel = random.Uniform() < density;
    region.mask.View()[0] = 1;
    EnclosingFanParameters parameters;
    if (round % 2)
      parameters.shape = Placed(convex, grid.origin.x(), grid.origin.y(), grid.origin.z(), 90.0 * round, 10.0, 20.0);
    if (round % 3)
      parameters.marginMm = random.Uniform(0.0, 20.0);
    const PlacedProbe fan = Enclosed(region, parameters);
    EXPECT_EQ(Outside(fan, region), 0);
    EXPECT_LT(fan.geometry.fanAngle, 181 * degree);
  }
}

TEST(EnclosingFan, DoesNotDependOnThreads)
{
  ECHORAMA_SKIP_SANITIZED();
  const Region region = UnionOf(Views(convex, 2, 30.0, 10.0), Eigen::Vector3d::Constant(4.0));
  PlacedProbe fans[2];
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    fans[threads / 2] = Enclosed(region);
  }
  EXPECT_EQ(fans[0].geometry.fanAngle, fans[1].geometry.fanAngle);
  EXPECT_EQ(fans[0].geometry.depthMax, fans[1].geometry.depthMax);
  EXPECT_EQ(fans[0].probeToWorld.matrix(), fans[1].probeToWorld.matrix());
}

// A box of parallel beams, however its angle is hidden: nearly parallel beams, a ragged border, the end of the grid.
TEST(EnclosingFan, OfALinearProbeIsABox)
{
  const ProbeGeometry array = ProbeGeometry::Linear(38, 24, 0, 40);
  const auto expect = [](const Region& region, double most, const char* what) {
    SCOPED_TRACE(what);
    const PlacedProbe fan = Enclosed(region);
    EXPECT_EQ(FamilyOf(fan.geometry), OutlineFamily::Linear);
    ExpectEncloses(fan, region, most);
  };
  const Eigen::Matrix3d oblique = ExpRotation(Eigen::Vector3d(-0.2, 0.1, 0.3));
  expect(UnionOf({Placed(array, 5, 6, 7, 0, 0, 20)}, {1, 1, 1}, oblique), 1.13, "one view");
  // Three views side by side, the outer ones turned a little, as a hand does.
  const std::vector<PlacedProbe> views{Placed(array, -6, 0, 0, 0, 2, 0), Placed(array, 0, 4, 0),
                                       Placed(array, 6, -3, 0, 1, -2, 0)};
  expect(UnionOf(views, {1, 1, 1}), 1.35, "three views");
  const double slight = 1.5 * degree;
  expect(UnionOf({Placed({slight, 38.0, slight, 24.0, 0.0, 40.0}, 0, 0, 0)}, {1, 1, 1}), 1.15, "beams that hardly spread");
  Region ragged = UnionOf({Placed(array, 0, 0, 0)}, {1, 1, 1});
  const Volume<unsigned char> whole = ragged.mask;
  Random random(3);
  for (int k = 1; k + 1 < ragged.grid.dimensions[2]; ++k)
    for (int j = 1; j + 1 < ragged.grid.dimensions[1]; ++j)
      for (int i = 1; i + 1 < ragged.grid.dimensions[0]; ++i)
        if (!(whole.View()(i - 1, j, k) && whole.View()(i + 1, j, k) && whole.View()(i, j - 1, k) && whole.View()(i, j + 1, k) &&
              whole.View()(i, j, k - 1) && whole.View()(i, j, k + 1)))
          ragged.mask.View()(i, j, k) &= random.Uniform() < 0.6;
  expect(ragged, 1.25, "a ragged border");
  const Region views3 = UnionOf(views, {1, 1, 1});
  ImageGeometry cut = views3.grid; // the grid ends within the data
  cut.dimensions[0] -= 12;
  cut.dimensions[2] -= 9;
  Region end{cut, Volume<unsigned char>(cut.dimensions)};
  for (int k = 0; k < cut.dimensions[2]; ++k)
    for (int j = 0; j < cut.dimensions[1]; ++j)
      std::copy_n(views3.mask.View().Row(j, k), cut.dimensions[0], end.mask.View().Row(j, k));
  expect(end, 1.3, "cut by the grid");
}

TEST(EnclosingFan, OfAPhasedProbeBeginsAtAPoint)
{
  const ProbeGeometry sector = ProbeGeometry::Phased(80 * degree, 60 * degree, 0.0, 90.0);
  const PlacedProbe truth = Placed(sector, 10, -20, 5, 15, -20, 40);
  const Region region = UnionOf({truth}, Eigen::Vector3d::Constant(1.5));
  EnclosingFanParameters parameters;
  for (const OutlineFamily family : {OutlineFamily::Automatic, OutlineFamily::Phased}) {
    parameters.outline = family;
    const PlacedProbe fan = Enclosed(region, parameters);
    EXPECT_EQ(FamilyOf(fan.geometry), OutlineFamily::Phased);
    ExpectEncloses(fan, region, 1.16);
    EXPECT_EQ(fan.geometry.depthMin, 0.0);
    EXPECT_LT((fan.probeToWorld.translation() - truth.probeToWorld.translation()).norm(), 5.0);
  }
  parameters.marginMm = 4.0;
  // To have it at its sides the tip moves back by (4 + 0.75) / sin(30 degrees): (90 + 9.5 + 4.75)^3 / 90^3 is 1.55.
  ExpectEncloses(Enclosed(region, parameters), region, 1.6, 4.0 - 1e-6);
  // A curved array stays one: a point would have to lie far behind it.
  const Region other = UnionOf({Placed(convex, 0, 0, 0)}, Eigen::Vector3d::Constant(2.0));
  EXPECT_EQ(FamilyOf(Enclosed(other).geometry), OutlineFamily::Curved);
}

// Whatever is asked for is made, encloses all, and is no smaller than what is found without asking.
TEST(EnclosingFan, FamiliesCanBeForced)
{
  const Region regions[] = {
      UnionOf({Placed(convex, 0, 0, 0, 10, 20, 0)}, Eigen::Vector3d::Constant(3.0)),
      UnionOf({Placed(ProbeGeometry::Linear(38, 24, 0, 40), 0, 0, 0)}, Eigen::Vector3d::Constant(1.5)),
      RegionOf(GridOf(60, 50, 1), [](const Eigen::Vector3d& at) { return at.x() + at.y() > 30.0; }),
      RegionOf(GridOf(30, 30, 30), [](const Eigen::Vector3d& at) { return at.norm() < 3.0 || (at.array() > 26.0).all(); })};
  for (const Region& region : regions) {
    const double found = FanVolume(Enclosed(region).geometry);
    for (const OutlineFamily family : {OutlineFamily::Linear, OutlineFamily::Phased, OutlineFamily::Curved}) {
      EnclosingFanParameters parameters;
      parameters.outline = family;
      const PlacedProbe fan = Enclosed(region, parameters);
      EXPECT_EQ(Outside(fan, region), 0);
      if (family != OutlineFamily::Curved) {
        EXPECT_EQ(FamilyOf(fan.geometry), family);
      }
      EXPECT_GT(FanVolume(fan.geometry), found / 1.05);
    }
  }
}

TEST(EnclosingFan, AMarginBelow0GrowsWithTheRegion)
{
  EnclosingFanParameters parameters;
  parameters.marginMm = -1.0;
  for (const auto& [side, margin] : {std::pair{40, 1.0}, {120, 3.0}, {400, 5.0}}) {
    const ImageGeometry grid = GridOf(5, 5, 5, Eigen::Vector3d::Constant(side / 4.0));
    Region region = RegionOf(grid, [](const Eigen::Vector3d&) { return true; });
    const PlacedProbe fan = Enclosed(region, parameters);
    EXPECT_NEAR(fan.geometry.depthMax, side * 1.25 + 2.0 * margin, 0.01 * side) << side;
  }
}

TEST(EnclosingFan, RefusesBadInput)
{
  const Region full = RegionOf(GridOf(12, 10, 8), [](const Eigen::Vector3d&) { return true; });
  const Region empty = RegionOf(GridOf(12, 10, 8), [](const Eigen::Vector3d&) { return false; });
  EXPECT_EQ(RefusalOf(empty), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf({GridOf(10, 12, 8), full.mask}), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf({GridOf(12, 10, 8, {1, 0, 1}), full.mask}), Error::Kind::BadInput);
  EnclosingFanParameters wrong;
  wrong.marginMm = -1.5;
  EXPECT_EQ(RefusalOf(full, wrong), Error::Kind::InvalidParameter);
  wrong.marginMm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(RefusalOf(full, wrong), Error::Kind::InvalidParameter);
  wrong = {};
  wrong.shape = Placed(convex, 0, 0, 0);
  wrong.shape->geometry.fanAngle = -1.0;
  EXPECT_EQ(RefusalOf(full, wrong), Error::Kind::InvalidParameter);
  wrong.shape = Placed(convex, 0, 0, 0);
  wrong.shape->probeToWorld.linear() *= 2.0;
  EXPECT_EQ(RefusalOf(full, wrong), Error::Kind::BadInput);
  for (const double stop : {0.0, 0.1, 0.4, 0.7, 0.95})
    EXPECT_THROW(EncloseRegion(full.mask.View(), full.grid, {}, Progress([stop](double done) { return done < stop; })), Error);
}
