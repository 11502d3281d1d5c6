// SPDX-License-Identifier: BSD-3-Clause
// Masks of known fans, whole and damaged, on grids that follow them or not; and regions that no fan explains.
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbeFit.h"
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr double degree = 0.017453292519943295;

struct Case {
  ProbeGeometry probe;
  Pose pose = Pose::Identity();
  ImageGeometry grid;
  Volume<unsigned char> mask;
};

template <class Function>
Volume<unsigned char> MaskOf(const ImageGeometry& grid, const Function& isInside)
{
  Volume<unsigned char> mask(grid.dimensions);
  const Eigen::Affine3d toWorld = grid.IndexToWorld();
  ParallelFor(grid.dimensions[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i)
        mask.View()(i, j, k) = isInside(Eigen::Vector3d(toWorld * Eigen::Vector3d(i, j, k))) ? 1 : 0;
  });
  return mask;
}

void FillMask(Case& c)
{
  const Pose worldToProbe = c.pose.inverse();
  c.mask = MaskOf(c.grid, [&](const Eigen::Vector3d& at) { return BeamPointAt(c.probe, worldToProbe * at, 1e-6).has_value(); });
}

// A plane whose middle beam is turned by an angle from the second axis of an image, with all of it in the image.
Case PlaneCase(const ProbeGeometry& probe, double angle, double spacing)
{
  Case c;
  c.probe = probe;
  const double turned = angle * degree;
  const Eigen::Vector3d x(std::cos(turned), std::sin(turned), 0.0), z(-std::sin(turned), std::cos(turned), 0.0);
  c.pose.linear() << x, z.cross(x), z;
  c.pose.translation() = Eigen::Vector3d(12.0, -7.0, 30.0);
  Eigen::AlignedBox3d box;
  for (double fan = -0.5; fan <= 0.5; fan += 0.05)
    for (const double depth : {probe.depthMin, probe.depthMax})
      box.extend(c.pose * PointOf(probe, {depth, fan, 0.0}));
  c.grid.spacing = Eigen::Vector3d(spacing, 0.8 * spacing, 1.0);
  c.grid.origin = box.min() - 6.0 * c.grid.spacing;
  c.grid.origin.z() = 30.0;
  for (int a = 0; a < 2; ++a)
    c.grid.dimensions[a] = static_cast<int>(box.sizes()[a] / c.grid.spacing[a]) + 13;
  c.grid.dimensions[2] = 1;
  FillMask(c);
  return c;
}

// How far the surfaces of the truth and the fit are apart: the greatest distance between the same places of both, mm.
double FarthestApart(const Case& c, const ProbeFit& fit)
{
  // Turned by half about the middle beam a fan is the same.
  const double side = (c.pose.linear().col(0)).dot(fit.probeToWorld.linear().col(0)) < 0.0 ? -1.0 : 1.0;
  double farthest = 0.0;
  for (const double depth : {0.0, 0.5, 1.0})
    for (const double fan : {-0.5, 0.0, 0.5})
      for (const double sweep : {-0.5, 0.0, 0.5}) {
        const auto at = [&](const ProbeGeometry& g, double sign) {
          return PointOf(g, {g.depthMin + depth * (g.depthMax - g.depthMin), sign * fan, sign * sweep});
        };
        farthest = std::max(farthest, (c.pose * at(c.probe, 1.0) - fit.probeToWorld * at(fit.geometry, side)).norm());
      }
  return farthest;
}

bool HasNote(const ProbeFit& fit, const std::string& words)
{
  for (const std::string& note : fit.notes)
    if (note.find(words) != std::string::npos)
      return true;
  return false;
}

Error::Kind RefusalOf(VolumeView<const unsigned char> mask, const ImageGeometry& grid, const ProbeFitParameters& parameters = {})
{
  try {
    const ProbeFit fit = FitProbe(mask, grid, parameters);
    ADD_FAILURE() << "accepted: overlap " << fit.overlap << ", residual " << fit.residualMm << " mm";
  } catch (const Error& error) {
    return error.GetKind();
  }
  return Error::Kind::FileSystem;
}

ImageGeometry GridOf(int x, int y, int z, const Eigen::Vector3d& spacing = Eigen::Vector3d::Ones())
{
  ImageGeometry grid;
  grid.dimensions = {x, y, z};
  grid.spacing = spacing;
  return grid;
}

const std::pair<const char*, ProbeGeometry> planes[] = {
    {"convex", ProbeGeometry::Convex(65 * degree, 60, 0, 0, 2, 150)},
    {"micro-convex", ProbeGeometry::Convex(90 * degree, 12, 0, 0, 0, 90)},
    {"phased", ProbeGeometry::Phased(90 * degree, 0, 0, 160)},
    {"phased with a virtual apex", ProbeGeometry::Convex(75 * degree, 14, 0, 0, 0, 120)},
    {"linear", ProbeGeometry::Linear(38, 0, 0, 80)},
    {"slightly convex", ProbeGeometry::Convex(12 * degree, 200, 0, 0, 0, 90)},
    {"endocavity", ProbeGeometry::Convex(150 * degree, 10, 0, 0, 3, 60)},
    {"beyond half a turn", ProbeGeometry::Convex(200 * degree, 10, 0, 0, 3, 60)},
};

} // namespace

TEST(ProbeFitOfPlane, FindsKnownSectorsAtAnyAngle)
{
  for (const auto& [name, probe] : planes)
    for (const double angle : {0.0, 20.0, 45.0, 115.0, 180.0, -77.0}) {
      SCOPED_TRACE(std::string(name) + " at " + std::to_string(angle));
      if (probe.fanAngle == 0.0 && std::abs(angle) > 40.0)
        continue; // a rectangle does not tell its ends apart
      const Case c = PlaneCase(probe, angle, 0.4);
      const ProbeFit fit = FitProbe(c.mask.View(), c.grid);
      EXPECT_TRUE(fit.geometry.IsPlane());
      EXPECT_NO_THROW(fit.geometry.Check());
      EXPECT_TRUE(IsRotation(fit.probeToWorld.linear(), 1e-9));
      EXPECT_EQ(fit.geometry.depthMin, 0.0);
      EXPECT_NEAR(fit.geometry.fanAngle, probe.fanAngle, 0.3 * degree);
      EXPECT_NEAR(fit.geometry.fanWidth, probe.Fan().Span(probe.depthMin), 0.8);
      EXPECT_NEAR(fit.geometry.depthMax, probe.depthMax - probe.depthMin, 0.5);
      EXPECT_LT(FarthestApart(c, fit), 0.8);
      EXPECT_LT(fit.residualMm, 0.4);
      EXPECT_GT(fit.overlap, 0.97);
      EXPECT_NEAR(fit.probeToWorld.translation().z(), 30.0, 1e-9); // in the plane of the image
      EXPECT_TRUE(HasNote(fit, "Depth 0"));
    }
}

TEST(ProbeFitOfPlane, SurvivesDropOutsHolesAMissingCornerAndStrayLines)
{
  for (const auto& [name, probe] : planes) {
    SCOPED_TRACE(name);
    Case c = PlaneCase(probe, 12.0, 0.4);
    const Pose worldToProbe = c.pose.inverse();
    Random random(4);
    const VolumeView<unsigned char> mask = c.mask.View();
    for (int j = 0; j < c.grid.dimensions[1]; ++j)
      for (int i = 0; i < c.grid.dimensions[0]; ++i) {
        const Eigen::Vector3d at = worldToProbe * (c.grid.IndexToWorld() * Eigen::Vector3d(i, j, 0));
        const auto beam = BeamPointAt(probe, at, 1e-6);
        if (!beam)
          continue;
        const double deep = (beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin);
        const bool dropped = random.Uniform() < (std::abs(beam->fan) > 0.45 || deep > 0.95 ? 0.35 : 0.05);
        const bool hole = std::hypot(deep - 0.5, beam->fan + 0.1) < 0.12;
        const bool corner = deep + 1.5 * (beam->fan + 0.5) > 1.0 + 1.5 * 0.8;
        if (dropped || hole || corner)
          mask(i, j, 0) = 0;
      }
    for (int i = 0; i < c.grid.dimensions[0]; ++i)
      mask(i, c.grid.dimensions[1] - 1, 0) = 1; // as some scanners write
    const ProbeFit fit = FitProbe(mask, c.grid);
    EXPECT_NEAR(fit.geometry.fanAngle, probe.fanAngle, 1.0 * degree);
    EXPECT_LT(FarthestApart(c, fit), 1.6);
  }
}

TEST(ProbeFitOfPlane, GoesOnBeyondTheGrid)
{
  // As most scanners show it: the deepest arc and the outer corners are beyond the image.
  Case c = PlaneCase(planes[0].second, 0.0, 0.5);
  const auto cut = [&c](int left, int right, int rows) {
    ImageGeometry grid = c.grid;
    grid.origin.x() += left * grid.spacing.x();
    grid.dimensions[0] -= left + right;
    grid.dimensions[1] -= rows;
    const Pose worldToProbe = c.pose.inverse();
    const auto mask =
        MaskOf(grid, [&](const Eigen::Vector3d& at) { return BeamPointAt(c.probe, worldToProbe * at, 1e-6).has_value(); });
    return FitProbe(mask.View(), grid);
  };
  const double pixel = c.grid.spacing.y();
  const ProbeFit partly = cut(0, 0, 6 + static_cast<int>(12.0 / pixel)); // the arc's middle is cut flat
  EXPECT_LT(FarthestApart(c, partly), 1.0);
  EXPECT_GT(partly.overlap, 0.97);

  const ProbeFit sides = cut(70, 90, 0);
  EXPECT_LT(FarthestApart(c, sides), 1.0);

  const ProbeFit wholly = cut(0, 0, 6 + static_cast<int>(60.0 / pixel)); // nothing is left of the arc
  EXPECT_NEAR(wholly.geometry.fanAngle, c.probe.fanAngle, 0.5 * degree);
  EXPECT_GT(wholly.geometry.depthMax, 148.0 - 61.0);
  EXPECT_TRUE(HasNote(wholly, "the depth may be greater"));
}

TEST(ProbeFitOfPlane, OfARectangleTheGridDecides)
{
  const ImageGeometry grid = GridOf(200, 150, 1, {0.3, 0.3, 1.0});
  const auto mask =
      MaskOf(grid, [](const Eigen::Vector3d& at) { return std::abs(at.x() - 30) < 20 && std::abs(at.y() - 20) < 15; });
  const ProbeFit fit = FitProbe(mask.View(), grid);
  EXPECT_NEAR(fit.geometry.fanAngle, 0.0, 1e-6);
  EXPECT_NEAR(fit.geometry.fanWidth, 40.0, 0.3);
  EXPECT_NEAR(fit.geometry.depthMax, 30.0, 0.3);
  EXPECT_GT(fit.probeToWorld.linear()(1, 2), 0.999);
  EXPECT_GT(fit.probeToWorld.linear()(0, 0), 0.999);
  EXPECT_TRUE(HasNote(fit, "another axis"));

  const Volume<unsigned char> full({200, 150, 1}, 1);
  const ProbeFit box = FitProbe(full.View(), grid);
  EXPECT_NEAR(box.geometry.fanWidth, 60.0, 0.1);
  EXPECT_NEAR(box.geometry.depthMax, 45.0, 0.1);
  EXPECT_TRUE(HasNote(box, "Every voxel is valid"));
}

TEST(ProbeFitOfPlane, RefusesWhatIsNoSector)
{
  const ImageGeometry grid = GridOf(160, 160, 1);
  const auto refusal = [&grid](const std::function<bool(double, double)>& isInside) {
    const auto mask = MaskOf(grid, [&](const Eigen::Vector3d& at) { return isInside(at.x() - 80, at.y() - 80); });
    return RefusalOf(mask.View(), grid);
  };
  EXPECT_EQ(refusal([](double x, double y) { return std::hypot(x, y) < 60; }), Error::Kind::NotPossible);       // disc
  EXPECT_EQ(refusal([](double x, double y) { return std::hypot(x / 1.5, y) < 45; }), Error::Kind::NotPossible); // ellipse
  EXPECT_EQ(refusal([](double x, double y) { return x < 0 || y < 0; }), Error::Kind::NotPossible);              // an L
  EXPECT_EQ(refusal([](double x, double y) { return std::abs(x) < 20 || std::abs(y) < 20; }), Error::Kind::NotPossible); // cross
  EXPECT_EQ(refusal([](double x, double y) { return std::min(std::hypot(x - 40, y), std::hypot(x + 40, y)) < 35; }),
            Error::Kind::NotPossible);                                                        // two discs
  EXPECT_EQ(refusal([](double x, double y) { return x + y < 0; }), Error::Kind::NotPossible); // one edge, all else is the grid's
  EXPECT_EQ(refusal([](double x, double y) { return x == 3 && y == 4; }), Error::Kind::NotPossible);
  for (const double density : {0.05, 0.5, 0.6})
    EXPECT_EQ(refusal([random = Random(3), density](double, double) mutable { return random.Uniform() < density; }),
              Error::Kind::NotPossible);
}
