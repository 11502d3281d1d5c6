// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/Shell.h"
#include "Filters/Shell/ShellMarks.h"
#include "Filters/Shell/Testing/Ball.h"
#include "Filters/Tissue/Icosphere.h"
#include "Testing/Sanitized.h"
#include "Tracking/Optical/MarkerPattern.h"
#include "Tracking/Optical/ShellMarker.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.141592653589793;

ShellParameters Plain(double resolution = 1.0)
{
  ShellParameters p;
  p.resolutionMm = resolution;
  p.openingMm = 20.0;
  p.flangeMm = 0.0;
  return p;
}

// Ways through a surface: 0 of a ball or cup, 1 of a ring.
std::int64_t Genus(const TriangleSurface& surface)
{
  const auto points = static_cast<std::int64_t>(surface.points.size()),
             faces = static_cast<std::int64_t>(surface.triangles.size());
  return (2 - (points - faces / 2)) / 2; // closed: three edges for two faces
}

std::string MessageOf(const TriangleSurface& surface, const ShellParameters& parameters, const std::vector<Vector3d>& marks = {})
{
  try {
    const Shell shell = MakeShell(BodySurface(surface), parameters, marks);
    CheckPrinter(shell.Prints(), parameters);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Shell, SkinOfASphereHasTheThicknessAndVolumeOfOne)
{
  ECHORAMA_SKIP_SANITIZED();
  const double radius = 40.0, opening = 20.0;
  const TriangleSurface ball = Ball(radius, 6);
  const ShellParameters p = Plain();
  const Shell shell = MakeShell(BodySurface(ball), p);
  EXPECT_TRUE(shell.skin.check.IsSound()) << shell.skin.check.Faults();
  EXPECT_EQ(shell.skin.check.components, 1);
  EXPECT_EQ(Genus(shell.skin.surface), 0);
  EXPECT_GT(shell.thickness.places, 9000u);
  // Chords of up to 1.7 cells over a radius of 38 mm, and the ball's own facets.
  const double bound = 1.7 * 1.7 / (8.0 * 38.0) + radius * Icosphere::Deviation(6);
  EXPECT_NEAR(shell.thickness.leastMm, 2.0, bound);
  EXPECT_NEAR(shell.thickness.mostMm, 2.0, bound);
  // Every point lies on the ball, 2 mm below it, or near the rim.
  std::size_t outside = 0, inside = 0;
  for (const Eigen::Vector3f& point : shell.skin.surface.points) {
    const double from = point.cast<double>().norm(), height = static_cast<double>(point.z()) + radius - opening;
    EXPECT_GT(height, -1e-3);
    if (height < 1.0)
      continue;
    outside += std::abs(from - radius) < 0.012;
    inside += std::abs(from - (radius - 2.0)) < 0.012;
    ASSERT_TRUE(std::abs(from - radius) < 0.012 || std::abs(from - radius + 2.0) < 0.012) << from;
  }
  EXPECT_GT(outside, 5000u);
  EXPECT_GT(inside, 5000u);
  const auto above = [](double r, double z) { return pi * (2.0 / 3.0 * r * r * r - r * r * z + z * z * z / 3.0); };
  const double volume = above(radius, opening - radius) - above(radius - 2.0, opening - radius);
  EXPECT_NEAR(shell.skin.check.volumeMm3, volume, 0.004 * volume);
}

TEST(Shell, ThicknessMayBeMeasuredToTheCamera)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p = Plain();
  p.measured = ShellParameters::Thickness::Camera;
  const Shell shell = MakeShell(BodySurface(Ball(40.0, 6)), p);
  // In the middle of the opening, 20 mm below the centre; the lens 8 mm above a board that lies 2 mm above the base's lower side.
  EXPECT_NEAR((shell.camera - Vector3d(0.0, 0.0, -20.0 - 5.0 + 3.0 + 8.0)).norm(), 0.0, 1e-4);
  EXPECT_NEAR(shell.thickness.leastMm, 2.0, 0.05);
  EXPECT_NEAR(shell.thickness.mostMm, 2.0, 0.05);
  EXPECT_LT(shell.thickness.leastWallMm, 1.95); // rays slant
  int inner = 0;
  for (const Eigen::Vector3f& single : shell.skin.surface.points) {
    const Vector3d point = single.cast<double>();
    if (point.z() < -15.0 || point.norm() > 39.5)
      continue;
    const Vector3d ray = (point - shell.camera).normalized(); // to the sphere
    const double along = ray.dot(point), way = -along + std::sqrt(along * along - point.squaredNorm() + 1600.0);
    ASSERT_NEAR(way, 2.0, 0.03);
    ++inner;
  }
  EXPECT_GT(inner, 4000);
}

TEST(Shell, AbdomenHasItsWallBetweenTheMeshesThemselves)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(InventedAbdomen(40));
  ShellParameters p;
  p.openingMm = 70.0;
  p.resolutionMm = 1.0;
  p.printerMm = Vector3d(400.0, 400.0, 400.0);
  const Shell shell = MakeShell(body, p);
  EXPECT_TRUE(shell.skin.fits && shell.base.fits);
  EXPECT_EQ(Genus(shell.skin.surface), 8); // screws
  EXPECT_EQ(Genus(shell.base.surface), 9); // and the lens
  // The printed wall: from triangles of the inner surface to the nearest of the outer one.
  const TriangleSurface& skin = shell.skin.surface;
  std::vector<double> depth;
  for (const Eigen::Vector3f& point : skin.points)
    depth.push_back(-body.Distance(point.cast<double>()));
  std::vector<std::uint32_t> outer, inner;
  for (std::uint32_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    const double least = std::min({depth[a], depth[b], depth[c]}), most = std::max({depth[a], depth[b], depth[c]});
    const double height = static_cast<double>((shell.bodyToShell * skin.points[a].cast<double>()).z());
    if (height > p.flangeThicknessMm + 3.0 && least > 1.0)
      inner.push_back(t);
    else if (most < 1.0)
      outer.push_back(t);
  }
  const TriangleTree tree(skin.points, skin.triangles, outer);
  ASSERT_GT(inner.size(), 10000u);
  double least = 1e9, most = 0.0;
  for (std::size_t i = 0; i < inner.size(); i += 7) {
    const auto& [a, b, c] = skin.triangles[inner[i]];
    const Vector3d middle = (skin.points[a] + skin.points[b] + skin.points[c]).cast<double>() / 3.0;
    const double wall = tree.NearestTo(skin.points, skin.triangles, middle)->distanceMm;
    least = std::min(least, wall);
    most = std::max(most, wall);
  }
  EXPECT_GT(least, 1.9);
  EXPECT_LT(most, 2.1);
  // The lip of the base stays off the skin by the clearance.
  int lip = 0;
  for (const Eigen::Vector3f& point : shell.base.surface.points)
    if ((shell.bodyToShell * point.cast<double>()).z() > 1.1) { // the corner at its foot is filled
      ASSERT_LT(body.Distance(point.cast<double>()), -2.0 - 0.3 + 0.06);
      ++lip;
    }
  EXPECT_GT(lip, 400);
}

TEST(Shell, UpMayPointAnywhere)
{
  ECHORAMA_SKIP_SANITIZED();
  const TriangleSurface ball = Ball(30.0, 5);
  ShellParameters p = Plain();
  const Shell upright = MakeShell(BodySurface(ball), p);
  p.up = Vector3d(0.0, -3.0, 0.0);
  const Shell turned = MakeShell(BodySurface(ball), p);
  EXPECT_NEAR(turned.camera.y(), -upright.camera.z(), 1e-3);
  EXPECT_NEAR(turned.skin.check.volumeMm3, upright.skin.check.volumeMm3, 0.002 * upright.skin.check.volumeMm3);
  for (const Eigen::Vector3f& point : turned.skin.surface.points)
    ASSERT_LT(point.y(), 10.01f);
}

TEST(Shell, HolesGoThroughAtTheirMarksAndBumpsStandOut)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(Ball(40.0, 5));
  std::vector<Vector3d> marks = DomeMarks(12, 41.0, 3.0, 10.0); // 1 mm above: they are moved down
  marks.emplace_back(0.0, 40.0, -19.5);                         // too near to the opening
  ShellParameters p = Plain();
  p.marks = ShellParameters::MarkKind::Holes;
  const Shell holes = MakeShell(body, p, marks);
  EXPECT_EQ(Genus(holes.skin.surface), 12);
  ASSERT_EQ(holes.marks.size(), 12u);
  EXPECT_EQ(holes.left, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  for (const ShellMark& mark : holes.marks) {
    EXPECT_NEAR(mark.place.norm(), 40.0, 0.05);
    double nearest = 1e9;
    for (const Eigen::Vector3f& point : holes.skin.surface.points) {
      const Vector3d from = point.cast<double>() - mark.place;
      if (from.dot(mark.normal) > -10.0)
        nearest = std::min(nearest, (from - from.dot(mark.normal) * mark.normal).norm());
    }
    EXPECT_NEAR(nearest, 2.6, 0.2); // half of the cell of 1 mm at most, where edges are broken
  }
  p.marks = ShellParameters::MarkKind::Bumps;
  p.markMm = 3.0;
  p.resolutionMm = 0.5;
  const Shell bumps = MakeShell(body, p, marks);
  EXPECT_EQ(Genus(bumps.skin.surface), 0);
  for (const ShellMark& mark : bumps.marks) {
    double highest = 0.0;
    for (const Eigen::Vector3f& point : bumps.skin.surface.points)
      if ((point.cast<double>() - mark.place).norm() < 2.5)
        highest = std::max(highest, (point.cast<double>() - mark.place).dot(mark.normal));
    EXPECT_NEAR(highest, 1.5, 0.07);
  }
}

// Seen from the camera, dark cells of the marker are twice as thick as the wall, and nothing else is.
TEST(Shell, MarkerIsRaisedWhereTheCameraSeesItsCells)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(Ball(60.0, 5));
  ShellParameters p;
  p.openingMm = 30.0;
  p.marker = true;
  p.printerMm = Vector3d(400.0, 400.0, 400.0);
  const Shell shell = MakeShell(body, p);
  EXPECT_NEAR(shell.thickness.leastMm, 2.0, 0.03); // it is no plain wall
  EXPECT_NEAR(shell.thickness.mostMm, 2.0, 0.03);
  ASSERT_TRUE(shell.markerId);
  EXPECT_NE(shell.Text().find("marker: "), std::string::npos);
  const MarkerPattern pattern = MarkerPattern::Of(*shell.markerId);
  const BodySurface skin(shell.skin.surface);
  for (int row = -1; row <= MarkerPattern::rows; ++row)
    for (int column = -1; column <= MarkerPattern::columns; ++column) {
      const double azimuth = (25.0 + (column + 0.5 - 0.5 * MarkerPattern::columns) * MarkerPattern::cellDegrees) * pi / 180.0,
                   elevation = (MarkerPattern::lowestDegrees + (row + 0.5) * MarkerPattern::cellDegrees) * pi / 180.0;
      const Vector3d ray(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const auto way = skin.Along(shell.camera, ray);
      ASSERT_TRUE(way);
      EXPECT_NEAR(-body.Distance(shell.camera + *way * ray), pattern.IsDark(row, column) ? 4.0 : 2.0, 0.06)
          << row << " " << column;
    }
  // And a camera reads it, in light that each millimetre of plastic dims by a quarter.
  const FisheyeLens lens;
  const auto width = static_cast<std::size_t>(lens.width);
  std::vector<std::uint8_t> pixels(width * static_cast<std::size_t>(lens.height), 4);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto direction = lens.Unproject({static_cast<double>(i % width), static_cast<double>(i / width)});
    const auto inner = direction ? skin.Along(shell.camera, *direction) : std::nullopt,
               outer = direction ? body.Along(shell.camera, *direction) : std::nullopt;
    if (inner && outer && *outer > *inner) {
      Random random(1, i);
      pixels[i] =
          static_cast<std::uint8_t>(std::lround(6.0 + 60.0 * std::pow(0.75, *outer - *inner) + random.Uniform(-2.0, 2.0)));
    }
  }
  const ShellMarkerReading reading = ReadShellMarker(GreyFrame::Mono(pixels.data(), lens.width, lens.height), lens);
  ASSERT_EQ(reading.status, ShellMarkerReading::Status::Read);
  EXPECT_EQ(reading.id, *shell.markerId);
  EXPECT_NEAR(reading.azimuthDegrees, 6.0, 0.6);
  // Another body, or another wall, has another number; where it is cut it has the same.
  EXPECT_NE(MarkerIdOf(p, Ball(60.0, 4)), *shell.markerId);
  p.printerMm = Vector3d(150.0, 150.0, 150.0);
  EXPECT_EQ(MarkerIdOf(p, body.Surface()), *shell.markerId);
  p.thicknessMm = 2.2;
  EXPECT_NE(MarkerIdOf(p, body.Surface()), *shell.markerId);
  p.resolutionMm = 1.0;
  EXPECT_NE(MessageOf(Ball(60.0, 4), p).find("ResolutionMm is 1 mm; it must be at most a third of the marker's cells"),
            std::string::npos)
      << MessageOf(Ball(60.0, 4), p);
  p.resolutionMm = 0.5;
  p.baffleMm = 40.0;
  EXPECT_NE(MessageOf(Ball(60.0, 4), p).find("there is no place for the marker (Marker): it would lie behind the lip"),
            std::string::npos)
      << MessageOf(Ball(60.0, 4), p);
}

// Where it is cut as well: the marker lies in one part, off the seams.
TEST(Shell, MarkerKeepsOffTheSeams)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p;
  p.openingMm = 40.0;
  p.resolutionMm = 0.8;
  p.marker = true;
  const BodySurface body(Ball(80.0, 5));
  p.printerMm = Vector3d(130.0, 130.0, 130.0);
  const Shell cut = MakeShell(body, p);
  p.marker = false;
  const Shell plain = MakeShell(body, p);
  ASSERT_EQ(cut.cut.size(), plain.cut.size());
  int changed = 0;
  for (std::size_t i = 0; i < cut.cut.size(); ++i)
    changed += std::abs(cut.cut[i].part.check.volumeMm3 - plain.cut[i].part.check.volumeMm3) > 100.0;
  EXPECT_EQ(changed, 1);
}

TEST(Shell, DoesNotDependOnThreads)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(Ball(25.0, 4));
  ShellParameters p;
  p.resolutionMm = 1.0;
  const Shell all = MakeShell(body, p);
  const ThreadLimit limit(1);
  const Shell one = MakeShell(body, p);
  EXPECT_EQ(all.skin.surface.points, one.skin.surface.points);
  EXPECT_EQ(all.skin.surface.triangles, one.skin.surface.triangles);
  EXPECT_EQ(all.base.surface.points, one.base.surface.points);
  EXPECT_EQ(all.thickness.meanMm, one.thickness.meanMm);
}

TEST(Shell, WhatCannotBeMadeIsRefusedWithTheReason)
{
  const TriangleSurface ball = Ball(30.0, 4);
  ShellParameters p = Plain();
  p.resolutionMm = 1.5;
  EXPECT_NE(MessageOf(ball, p).find("ResolutionMm is 1.5 mm; it must be at most half of ThicknessMm, which is 2 mm"),
            std::string::npos);
  p = Plain();
  p.openingMm = 59.0;
  EXPECT_NE(MessageOf(ball, p).find("OpeningMm is 59 mm; the body is only 60 mm high"), std::string::npos) << MessageOf(ball, p);
  p = Plain();
  p.printerMm = Vector3d(200.0, 59.0, 59.0);
  p.cutToFit = false;
  EXPECT_NE(
      MessageOf(ball, p).find(
          "the skin is 60.0 x 60.0 x 40.0 mm and does not fit the printer (PrinterMm), which makes 200 x 59 x 59 mm; CutToFit "
          "would cut it into parts"),
      std::string::npos)
      << MessageOf(ball, p);
  p = Plain();
  p.openingMm = 1.0;
  EXPECT_NE(MessageOf(Ball(1.9, 3), p).find("the body is too thin: a wall of ThicknessMm, 2 mm, leaves no room inside"),
            std::string::npos)
      << MessageOf(Ball(1.9, 3), p);
  p = Plain();
  p.up.setZero();
  EXPECT_NE(MessageOf(ball, p).find("Up has no length"), std::string::npos);
  p = Plain();
  p.boardMm.z() = 4.5;
  EXPECT_NE(MessageOf(ball, p).find("BoardMm's pocket is 4.5 mm deep"), std::string::npos);
  p = Plain();
  p.lensHoleMm = 24.0;
  EXPECT_NE(MessageOf(ball, p).find("the board would fall through"), std::string::npos);
  p = Plain();
  p.thicknessMm = std::nan("");
  EXPECT_NE(MessageOf(ball, p).find("ThicknessMm is nan"), std::string::npos);
  p = Plain();
  p.marks = ShellParameters::MarkKind::Bumps;
  EXPECT_NE(MessageOf(ball, p).find("MarkMm is 5.2 mm"), std::string::npos);
  p.marks = ShellParameters::MarkKind::Holes;
  EXPECT_NE(
      MessageOf(ball, p, {Vector3d(0.0, 0.0, 30.0), Vector3d(0.0, std::nan(""), 30.0)}).find("calibration point 1 is not finite"),
      std::string::npos);
}

TEST(Shell, TwoBodiesAreRefused)
{
  TriangleSurface two = Ball(20.0, 4);
  const auto first = static_cast<std::uint32_t>(two.points.size());
  for (const Eigen::Vector3f& point : std::vector<Eigen::Vector3f>(two.points))
    two.points.push_back(point + Eigen::Vector3f(60.0f, 0.0f, 0.0f));
  for (const auto& [a, b, c] : std::vector<std::array<std::uint32_t, 3>>(two.triangles))
    two.triangles.push_back({a + first, b + first, c + first});
  ShellParameters p = Plain();
  EXPECT_NE(MessageOf(two, p).find("the skin falls into 2 pieces"), std::string::npos) << MessageOf(two, p);
}

TEST(Shell, CanBeStoppedAtAnyTime)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(Ball(25.0, 4));
  ShellParameters p;
  p.resolutionMm = 1.0;
  for (const double last : {0.0, 0.3, 0.6, 0.9}) {
    try {
      MakeShell(body, p, {}, Progress([last](double fraction) { return fraction < last; }));
      FAIL() << last;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
    }
  }
}

TEST(ShellMarks, DomesAreDenserTowardsTheHorizon)
{
  const std::vector<Vector3d> marks = DomeMarks(4000, 50.0, 3.0, 0.0);
  ASSERT_EQ(marks.size(), 4000u);
  // Heights of a sphere hold areas alike: per height the density is 1 + 2 (1 - z), which makes 2 in all.
  const auto between = [&marks](double low, double high) {
    return std::count_if(marks.begin(), marks.end(),
                         [&](const Vector3d& mark) { return mark.z() >= 50.0 * low && mark.z() < 50.0 * high; });
  };
  EXPECT_NEAR(static_cast<double>(between(0.0, 0.1)), 4000.0 * 0.1 * (1.0 + 2.0 * 0.95) / 2.0, 8.0);
  EXPECT_NEAR(static_cast<double>(between(0.9, 1.01)), 4000.0 * 0.1 * (1.0 + 2.0 * 0.05) / 2.0, 8.0);
  for (const Vector3d& mark : marks)
    ASSERT_NEAR(mark.norm(), 50.0, 1e-9);
  for (const Vector3d& mark : DomeMarks(100, 50.0, 3.0, 10.0))
    EXPECT_GT(mark.z(), 50.0 * std::sin(10.0 * pi / 180.0) - 1e-9);
  EXPECT_THROW(DomeMarks(0, 50.0), Error);
  EXPECT_THROW(DomeMarks(10, std::nan("")), Error);
}

TEST(ShellMarks, OrderLeadsToANeighbour)
{
  const std::vector<Vector3d> marks = DomeMarks(350, 100.0);
  const std::vector<std::size_t> order = OrderMarks(marks, Vector3d::UnitZ());
  EXPECT_EQ(std::set<std::size_t>(order.begin(), order.end()).size(), 350u);
  EXPECT_EQ(order.front(), 0u); // the top
  std::vector<double> ways;
  for (std::size_t i = 1; i < order.size(); ++i)
    ways.push_back((marks[order[i]] - marks[order[i - 1]]).norm());
  std::sort(ways.begin(), ways.end());
  // Mean distance of neighbours: the root of 2 pi 100^2 / 350, 13 mm.
  EXPECT_LT(ways[ways.size() / 2], 15.0);
  EXPECT_LT(ways[ways.size() * 95 / 100], 27.0);
  EXPECT_TRUE(OrderMarks({}, Vector3d::UnitZ()).empty());
}

TEST(ShellMarks, ProxyIsMeasured)
{
  const TriangleSurface ball = Ball(50.0, 5), coarse = Ball(50.0, 2);
  std::vector<Vector3d> marks;
  for (const Eigen::Vector3f& point : coarse.points)
    marks.push_back(point.cast<double>());
  const ProxyFit fit = MeasureProxy(ball, coarse, marks, Vector3d::UnitZ(), 0.0);
  EXPECT_NEAR(fit.mostMm, 50.0 * Icosphere::Deviation(2), 0.02 * fit.mostMm);
  EXPECT_GT(fit.meanMm, 0.3 * fit.mostMm);
  EXPECT_LT(fit.meanMm, 0.8 * fit.mostMm);
  double farthest = 0.0; // by trying all
  for (const Eigen::Vector3f& point : ball.points) {
    if (point.z() < 0.0f)
      continue;
    double nearest = 1e9;
    for (const Vector3d& mark : marks)
      nearest = std::min(nearest, (mark - point.cast<double>()).norm());
    farthest = std::max(farthest, nearest);
  }
  EXPECT_NEAR(fit.farthestMarkMm, farthest, 1e-4);
  EXPECT_THROW(MeasureProxy(ball, coarse, {}, Vector3d::UnitZ(), 0.0), Error);
}

TEST(ShellMarks, GuideShowsEveryMark)
{
  const std::string guide = MarksGuide(DomeMarks(42, 30.0), Vector3d::UnitZ());
  EXPECT_NE(guide.find(">42</text>"), std::string::npos);
  EXPECT_EQ(guide.find(">43</text>"), std::string::npos);
  EXPECT_NE(guide.find("<h1>Calibration points</h1>"), std::string::npos);
  EXPECT_NE(guide.find("<p>42 points"), std::string::npos);
  EXPECT_EQ(guide.find("nan"), std::string::npos);
}

} // namespace
