// SPDX-License-Identifier: BSD-3-Clause
// Masks of known fans, whole and damaged, on grids that follow them or not; and regions that no fan explains.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbeFit.h"
#include "Core/Imaging/RegionOutline.h"
#include "Core/Imaging/ScanConversion.h"
#include "Testing/Sanitized.h"
#include <functional>
#include <gtest/gtest.h>
#include <vector>

using namespace echorama;

namespace {

constexpr double degree = RadiansPerDegree;

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

// A fit that must succeed.
ProbeFit Fitted(const Case& c)
{
  try {
    return FitProbe(c.mask.View(), c.grid);
  } catch (const Error& error) {
    ADD_FAILURE() << error.what();
    return {};
  }
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

using NamedProbe = std::pair<const char*, ProbeGeometry>;

// All of them; under the sanitizers the first two.
std::vector<NamedProbe> Chosen(const std::vector<NamedProbe>& probes)
{
  return IsSanitized() ? std::vector<NamedProbe>{probes[0], probes[1]} : probes;
}

const std::vector<NamedProbe> planes{
    {"convex", ProbeGeometry::Convex(65 * degree, 60, 0, 0, 2, 150)},
    {"micro-convex", ProbeGeometry::Convex(90 * degree, 12, 0, 0, 0, 90)},
    {"phased", ProbeGeometry::Phased(90 * degree, 0, 0, 160)},
    {"phased with a virtual apex", ProbeGeometry::Convex(75 * degree, 14, 0, 0, 0, 120)},
    {"linear", ProbeGeometry::Linear(38, 0, 0, 80)},
    {"slightly convex", ProbeGeometry::Convex(12 * degree, 200, 0, 0, 0, 90)},
    {"endocavity", ProbeGeometry::Convex(150 * degree, 10, 0, 0, 3, 60)},
    {"beyond half a turn", ProbeGeometry::Convex(200 * degree, 10, 0, 0, 3, 60)},
};

const std::vector<NamedProbe> volumes{
    {"convex", ProbeGeometry::Convex(65 * degree, 40, 60 * degree, 30, 2, 120)},
    {"convex, wide sweep radius", ProbeGeometry::Convex(65 * degree, 20, 40 * degree, 60, 2, 120)},
    {"convex, small sweep radius", ProbeGeometry::Convex(60 * degree, 60, 70 * degree, 10, 2, 120)},
    {"abdominal of a mechanical probe", ProbeGeometry::Convex(34 * degree, 24.67, 39.8 * degree, 18.0, 0, 43.1)},
    {"endocavity", ProbeGeometry::Convex(150 * degree, 10, 90 * degree, 6, 2, 70)},
    {"phased", ProbeGeometry::Phased(80 * degree, 50 * degree, 0, 150)},
    {"linear with a turning sweep", {0.0, 44.0, 30 * degree, 12.0, 0.0, 60.0}},
};

// The fan in a grid that follows it, or one that does not: other axes, voxels of other lengths.
Case VolumeCase(const ProbeGeometry& probe, bool oblique, int voxelsDeep = 80)
{
  Case c;
  c.probe = probe;
  const double voxel = (probe.depthMax - probe.depthMin) / voxelsDeep;
  c.pose.linear() = ExpRotation(Eigen::Vector3d(0.3, -0.5, 0.9));
  c.pose.translation() = Eigen::Vector3d(110, -40, 25);
  c.grid = ScanConversionGrid(probe, c.pose, voxel, 1u << 26);
  if (oblique) {
    Eigen::AlignedBox3d box; // around the grid, along other axes
    const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(-0.7, 1.1, 0.2));
    for (int corner = 0; corner < 8; ++corner)
      box.extend(axes.transpose() * (c.grid.IndexToWorld() * Eigen::Vector3d(corner & 1 ? c.grid.dimensions[0] : 0,
                                                                             corner & 2 ? c.grid.dimensions[1] : 0,
                                                                             corner & 4 ? c.grid.dimensions[2] : 0)));
    c.grid.spacing = Eigen::Vector3d(1.0, 0.7, 1.6) * voxel;
    c.grid.direction = axes;
    c.grid.origin = axes * box.min();
    for (int a = 0; a < 3; ++a)
      c.grid.dimensions[a] = static_cast<int>(box.sizes()[a] / c.grid.spacing[a]) + 1;
  }
  FillMask(c);
  return c;
}

// The truth with fan and sweep exchanged where that is the same solid, so that the fit may take either.
void ExpectFound(const Case& c, const ProbeFit& fit, double degrees, double millimetres)
{
  ProbeGeometry found = fit.geometry;
  ProbeFit turned = fit;
  if (c.probe.fanAngle == 0.0 && std::abs(fit.probeToWorld.linear().col(0).dot(c.pose.linear().col(0))) < 0.5) {
    std::swap(found.fanAngle, found.sweepAngle);
    std::swap(found.fanWidth, found.sweepWidth);
    turned.geometry = found;
    turned.probeToWorld.linear() *= ExpRotation(Eigen::Vector3d(0, 0, 1.5707963267948966));
    EXPECT_TRUE(HasNote(fit, "exchanged"));
  }
  EXPECT_NO_THROW(fit.geometry.Check());
  EXPECT_TRUE(IsRotation(fit.probeToWorld.linear(), 1e-9));
  EXPECT_EQ(found.depthMin, 0.0);
  EXPECT_NEAR(found.fanAngle, c.probe.fanAngle, degrees * degree);
  EXPECT_NEAR(found.sweepAngle, c.probe.sweepAngle, degrees * degree);
  EXPECT_NEAR(found.fanWidth, c.probe.Fan().Span(c.probe.depthMin), millimetres);
  EXPECT_NEAR(found.sweepWidth, c.probe.Sweep().Span(c.probe.depthMin), millimetres);
  EXPECT_LT(FarthestApart(c, turned), millimetres);
}

} // namespace

TEST(RegionOutline, StraightEdgesKeepTheirPlace)
{
  // A half space, and one of blocks of several voxels: points on the plane to a small part of a cell.
  ImageGeometry grid = GridOf(90, 70, 50, {0.5, 0.7, 1.1});
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, 0.3, 0.8).normalized();
  const auto mask = MaskOf(grid, [&](const Eigen::Vector3d& at) { return normal.dot(at) < 33.3; });
  for (const int cells : {1 << 20, 20000}) {
    const RegionOutline outline = OutlineRegion(mask.View(), grid, cells);
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (const RegionOutline::Point& point : outline.points)
      if (!point.atGrid) {
        const double off = normal.dot(point.position) - 33.3;
        sum += off;
        squares += off * off;
        ++count;
      }
    ASSERT_GT(count, 500);
    EXPECT_NEAR(sum / count, 0.0, 0.02 * outline.cellMm);
    EXPECT_LT(std::sqrt(squares / count), 0.35 * outline.cellMm);
    EXPECT_FALSE(outline.coversGrid);
    EXPECT_EQ(outline.largestPart, 1.0);
    EXPECT_LE(outline.filled.View().Size(), cells);
  }
}

TEST(RegionOutline, FillsHolesAndDropsStrayPieces)
{
  const ImageGeometry grid = GridOf(40, 40, 40);
  const auto mask = MaskOf(grid, [](const Eigen::Vector3d& at) {
    const double r = (at - Eigen::Vector3d(20, 20, 20)).cwiseAbs().maxCoeff();
    return (r < 12.5 && r > 4.5) || (at - Eigen::Vector3d(3, 3, 3)).cwiseAbs().maxCoeff() < 2.5 || at.x() > 38.5;
  });
  const RegionOutline outline = OutlineRegion(mask.View(), grid, 1 << 20);
  EXPECT_NEAR(outline.holesPart, 729.0 / (12167.0 + 27.0), 1e-9); // less a rim of one voxel
  EXPECT_NEAR(outline.validMm, 15625.0 + 125.0 + 1600.0, 1e-6);
  EXPECT_NEAR(outline.largestPart, 15625.0 / (15625.0 + 125.0 + 1600.0), 1e-9);
  EXPECT_EQ(outline.points.size(), 6u * 625u);
  for (const RegionOutline::Point& point : outline.points)
    EXPECT_NEAR((point.position - Eigen::Vector3d(20, 20, 20)).cwiseAbs().maxCoeff(), 12.5, 1e-9);
}

TEST(ProbeFit, FindsKnownFansOnGridsOfAnyOrientation)
{
  for (const auto& [name, probe] : Chosen(volumes))
    for (const bool oblique : {false, true}) {
      SCOPED_TRACE(std::string(name) + (oblique ? ", oblique" : ", along the axes"));
      const Case c = VolumeCase(probe, oblique);
      const ProbeFit fit = Fitted(c);
      const double voxel = std::cbrt(c.grid.spacing.prod());
      const bool tip = probe.fanWidth == 0.0; // where it begins is known to some voxels
      ExpectFound(c, fit, 0.5, (tip ? 3.0 : 1.5) * voxel);
      EXPECT_LT(fit.residualMm, voxel);
      EXPECT_GT(fit.overlap, 0.95);
    }
}

TEST(ProbeFit, FindsAFanThatIsNotCentredOnItsArray)
{
  ECHORAMA_SKIP_SANITIZED();
  ProbeGeometry probe = ProbeGeometry::Convex(34 * degree, 10, 40 * degree, 10, 14, 57);
  for (const double offset : {0.4, -0.6}) {
    probe.fanOffset = offset;
    for (const bool oblique : {false, true}) {
      const Case c = VolumeCase(probe, oblique);
      const ProbeFit fit = Fitted(c);
      const double side = c.pose.linear().col(0).dot(fit.probeToWorld.linear().col(0)) < 0.0 ? -1.0 : 1.0;
      EXPECT_NEAR(fit.geometry.fanOffset, side * offset, 0.03);
      EXPECT_TRUE(HasNote(fit, "not centred"));
      ExpectFound(c, fit, 0.7, 1.5 * std::cbrt(c.grid.spacing.prod()));
    }
  }
}

TEST(ProbeFit, FindsTheFanOfAScanConversion)
{
  Case c = VolumeCase(volumes[0].second, false);
  const std::array<int, 3> samples{60, 40, 30};
  Volume<unsigned char> beams(samples, 7), intensity(c.grid.dimensions);
  ScanConvert<unsigned char>(beams.View(), c.probe, c.pose, c.grid, intensity.View(), c.mask.View());
  ExpectFound(c, Fitted(c), 0.5, 1.5);
}

TEST(ProbeFit, SurvivesRaggedEdgesHolesAndAMissingCorner)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const auto& [name, probe] : Chosen(volumes)) {
    SCOPED_TRACE(name);
    Case c = VolumeCase(probe, true);
    const Eigen::Affine3d toProbe = c.pose.inverse() * c.grid.IndexToWorld();
    Random random(8);
    for (int k = 0; k < c.grid.dimensions[2]; ++k)
      for (int j = 0; j < c.grid.dimensions[1]; ++j)
        for (int i = 0; i < c.grid.dimensions[0]; ++i) {
          const auto beam = BeamPointAt(probe, toProbe * Eigen::Vector3d(i, j, k), 1e-6);
          if (!beam)
            continue;
          const double deep = (beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin);
          const double rim = std::max({std::abs(beam->fan), std::abs(beam->sweep), deep - 0.5});
          const bool dropped = random.Uniform() < (rim > 0.46 ? 0.35 : 0.04);
          const bool hole = std::hypot(deep - 0.5, beam->fan + 0.1, beam->sweep) < 0.15;
          // A fifth of the far end, as when a corner has no contact.
          const bool corner = deep + beam->fan + 0.8 * beam->sweep > 1.15;
          if (dropped || hole || corner)
            c.mask.View()(i, j, k) = 0;
        }
    const ProbeFit fit = Fitted(c);
    const double voxel = std::cbrt(c.grid.spacing.prod());
    ExpectFound(c, fit, 2.0, 4.0 * voxel); // the rim of 4% is a third thinner
  }
}

TEST(ProbeFit, GoesOnBeyondTheGrid)
{
  ECHORAMA_SKIP_SANITIZED();
  // The bottom is cut flat by the grid, and a bit of each side.
  for (const int which : {0, 1, 4}) {
    SCOPED_TRACE(volumes[which].first);
    Case c = VolumeCase(volumes[which].second, false);
    for (int a = 0; a < 3; ++a) {
      const int cut = c.grid.dimensions[a] / 20;
      c.grid.origin += c.grid.direction.col(a) * (a < 2 ? cut * c.grid.spacing[a] : 0.0);
      c.grid.dimensions[a] -= a < 2 ? 2 * cut : cut;
    }
    c.mask = Volume<unsigned char>(c.grid.dimensions);
    FillMask(c);
    const ProbeFit fit = Fitted(c);
    ExpectFound(c, fit, 0.7, 2.0 * c.grid.spacing.x());
    EXPECT_GT(fit.overlap, 0.97);
  }
}

TEST(ProbeFit, OfABoxTheGridDecides)
{
  const ImageGeometry grid = GridOf(60, 50, 70, {0.6, 0.8, 0.5});
  const auto mask = MaskOf(grid, [](const Eigen::Vector3d& at) {
    return at.x() > 5.7 && at.x() < 29.7 && at.y() > 6 && at.y() < 33.2 && at.z() > 4.75 && at.z() < 30.25;
  });
  const ProbeFit fit = FitProbe(mask.View(), grid);
  EXPECT_GT(fit.probeToWorld.linear()(2, 2), 0.999);
  EXPECT_GT(fit.probeToWorld.linear()(0, 0), 0.999);
  EXPECT_NEAR(fit.geometry.fanAngle, 0.0, 0.2 * degree);
  EXPECT_NEAR(fit.geometry.sweepAngle, 0.0, 0.2 * degree);
  EXPECT_NEAR(fit.geometry.fanWidth, 24.0, 0.3);
  EXPECT_NEAR(fit.geometry.sweepWidth, 27.2, 0.5);
  EXPECT_NEAR(fit.geometry.depthMax, 25.5, 0.3);
  EXPECT_TRUE(HasNote(fit, "another axis"));

  const Volume<unsigned char> full(grid.dimensions, 1);
  const ProbeFit box = FitProbe(full.View(), grid);
  EXPECT_TRUE(HasNote(box, "Every voxel is valid"));
  EXPECT_NEAR(box.geometry.depthMax, 35.0, 0.1);
  EXPECT_EQ(FitProbe({}, grid).notes, box.notes); // no mask: every voxel is valid
  EXPECT_NEAR(box.geometry.fanWidth, 36.0, 0.1);
}

TEST(ProbeFit, SaysThatASlabIsThin)
{
  Case c = VolumeCase({60 * degree, 42.0, 0.0, 3.0, 0.0, 80.0}, true);
  const ProbeFit fit = Fitted(c);
  EXPECT_TRUE(HasNote(fit, "thick along the sweep"));
  EXPECT_NEAR(fit.geometry.fanAngle, c.probe.fanAngle, 1.0 * degree);
}

TEST(ProbeFit, RefusesWhatIsNoFan)
{
  ECHORAMA_SKIP_SANITIZED();
  const ImageGeometry grid = GridOf(64, 64, 64);
  const auto refusal = [&grid](const std::function<bool(const Eigen::Vector3d&)>& isInside) {
    const auto mask = MaskOf(grid, [&](const Eigen::Vector3d& at) { return isInside(at - Eigen::Vector3d::Constant(32)); });
    return RefusalOf(mask.View(), grid);
  };
  using Eigen::Vector3d;
  EXPECT_EQ(refusal([](const Vector3d& p) { return p.norm() < 25; }), Error::Kind::NotPossible);
  EXPECT_EQ(refusal([](const Vector3d& p) { return p.cwiseQuotient(Vector3d(1.5, 1.0, 0.8)).norm() < 19; }),
            Error::Kind::NotPossible);
  EXPECT_EQ(refusal([](const Vector3d& p) { return p.head<2>().norm() < 20 && std::abs(p.z()) < 25; }), Error::Kind::NotPossible);
  EXPECT_EQ(refusal([](const Vector3d& p) {
              return std::min((p - Vector3d(14, 14, 14)).norm(), (p + Vector3d(14, 14, 14)).norm()) < 14;
            }),
            Error::Kind::NotPossible);
  EXPECT_EQ(refusal([](const Vector3d& p) { return p.sum() < -40; }), Error::Kind::NotPossible); // a corner of the grid
  EXPECT_EQ(refusal([](const Vector3d& p) { return p == Vector3d(3, 4, 5); }), Error::Kind::NotPossible);
  for (const double density : {0.05, 0.3, 0.5, 0.6}) {
    const auto noise = [&](const Vector3d& p) {
      return Random(5, static_cast<std::uint64_t>(p.x() + 100) * 1000000 + static_cast<std::uint64_t>(p.y() + 100) * 1000 +
                           static_cast<std::uint64_t>(p.z() + 100))
                 .Uniform() < density;
    };
    EXPECT_EQ(refusal(noise), Error::Kind::NotPossible);
  }
}

TEST(ProbeFit, TheThresholdsDecide)
{
  ECHORAMA_SKIP_SANITIZED();
  const ImageGeometry grid = GridOf(64, 64, 64);
  const auto ball = MaskOf(grid, [](const Eigen::Vector3d& at) { return (at - Eigen::Vector3d::Constant(32)).norm() < 25; });
  ProbeFitParameters anything;
  anything.minimumOverlap = 0.0;
  anything.maximumDistance = 10.0;
  const ProbeFit fit = FitProbe(ball.View(), grid, anything);
  EXPECT_LT(fit.overlap, 0.8);
  EXPECT_GT(fit.meanDistance, 0.04);
  EXPECT_GT(fit.residualMm, 1.0);
  anything.minimumOverlap = fit.overlap + 1e-6;
  EXPECT_EQ(RefusalOf(ball.View(), grid, anything), Error::Kind::NotPossible);
  anything.minimumOverlap = 0.0;
  anything.maximumDistance = 0.99 * fit.meanDistance;
  EXPECT_EQ(RefusalOf(ball.View(), grid, anything), Error::Kind::NotPossible);
}

TEST(ProbeFit, DoesNotDependOnThreads)
{
  const Case c = VolumeCase(volumes[0].second, true, 50);
  ProbeFit fits[2];
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    fits[threads / 2] = Fitted(c);
  }
  EXPECT_EQ(fits[0].geometry.fanAngle, fits[1].geometry.fanAngle);
  EXPECT_EQ(fits[0].geometry.sweepWidth, fits[1].geometry.sweepWidth);
  EXPECT_EQ(fits[0].probeToWorld.matrix(), fits[1].probeToWorld.matrix());
  EXPECT_EQ(fits[0].overlap, fits[1].overlap);
  EXPECT_EQ(fits[0].residualMm, fits[1].residualMm);
  EXPECT_EQ(fits[0].notes, fits[1].notes);
}

TEST(ProbeFit, SurvivesAnyGrid)
{
  // Whatever comes in, a fit that passes Check or an Error comes out.
  Random random(11);
  for (int round = 0; round < 25; ++round) {
    ImageGeometry grid;
    for (int a = 0; a < 3; ++a) {
      grid.dimensions[a] = round % 5 == 0 && a == round % 3 ? 1 : 1 + static_cast<int>(random.Below(30));
      grid.spacing[a] = std::exp(random.Uniform(-4, 4));
    }
    grid.origin = 1e4 * random.Direction();
    grid.direction = ExpRotation(random.Uniform(0, 3) * random.Direction());
    const double density = random.Uniform();
    const Eigen::Vector3d normal = random.Direction();
    Volume<unsigned char> mask(grid.dimensions);
    for (unsigned char& voxel : mask.View())
      voxel = random.Uniform() < density;
    if (round % 2)
      mask = MaskOf(grid, [&](const Eigen::Vector3d& at) { return normal.dot(at - grid.Centre()) < 1.0; });
    ProbeFitParameters anything;
    anything.minimumOverlap = 0.0;
    anything.maximumDistance = 100.0;
    try {
      const ProbeFit fit = FitProbe(mask.View(), grid, anything);
      EXPECT_NO_THROW(fit.geometry.Check());
      EXPECT_TRUE(fit.probeToWorld.matrix().allFinite() && std::isfinite(fit.residualMm) && std::isfinite(fit.overlap));
    } catch (const Error& error) {
      EXPECT_GT(std::string(error.what()).size(), 20u);
    }
  }
}

TEST(ProbeFit, RefusesBadInput)
{
  const ImageGeometry grid = GridOf(40, 30, 20);
  const Volume<unsigned char> empty(grid.dimensions, 0), full(grid.dimensions, 1);
  EXPECT_EQ(RefusalOf(empty.View(), grid), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf(full.View(), GridOf(30, 40, 20)), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf(full.View(), GridOf(40, 30, 20, {1, 0, 1})), Error::Kind::BadInput);
  ProbeFitParameters wrong;
  wrong.minimumOverlap = 1.5;
  EXPECT_EQ(RefusalOf(full.View(), grid, wrong), Error::Kind::InvalidParameter);
  wrong = {};
  wrong.maximumDistance = 0.0;
  EXPECT_EQ(RefusalOf(full.View(), grid, wrong), Error::Kind::InvalidParameter);
  wrong = {};
  wrong.outlinePoints = 10;
  EXPECT_EQ(RefusalOf(full.View(), grid, wrong), Error::Kind::InvalidParameter);
  for (const double stop : {0.0, 0.2, 0.35, 0.9})
    EXPECT_THROW(FitProbe(full.View(), grid, {}, Progress([stop](double done) { return done < stop; })), Error);
}

TEST(ProbeFitOfPlane, FindsKnownSectorsAtAnyAngle)
{
  for (const auto& [name, probe] : Chosen(planes))
    for (const double angle : {0.0, 20.0, 45.0, 115.0, 180.0, -77.0}) {
      SCOPED_TRACE(std::string(name) + " at " + std::to_string(angle));
      if (probe.fanAngle == 0.0 && std::abs(angle) > 40.0)
        continue; // a rectangle does not tell its ends apart
      const Case c = PlaneCase(probe, angle, 0.4);
      const ProbeFit fit = Fitted(c);
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
  for (const auto& [name, probe] : Chosen(planes)) {
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
