// SPDX-License-Identifier: BSD-3-Clause
// What a printer is too small for: the parts fit it, are sound, and together are the whole.
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/Shell.h"
#include "Filters/Shell/Testing/Ball.h"
#include "Filters/Tissue/Icosphere.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

TEST(ShellCut, PlanesAreTheFewestAndLeaveRoomForLaps)
{
  const AlignedBox3d box(Vector3d(-160.0, -130.0, 0.0), Vector3d(164.0, 130.0, 120.0));
  CutPlanes planes = PlanCuts(box, {200.0, 200.0, 200.0}, 6.0);
  ASSERT_EQ(planes.at[0].size(), 1u);
  ASSERT_EQ(planes.at[1].size(), 1u);
  EXPECT_TRUE(planes.at[2].empty());
  // The lower cell carries the lap: (324 + 6) / 2 = 165 mm each.
  EXPECT_EQ(planes.Direction(0, 0), 1.0);
  EXPECT_NEAR(planes.at[0][0], -160.0 + 165.0 - 6.0, 1e-9);
  // Turned by a quarter two parts are enough, where four would be needed as it stands.
  planes = PlanCuts(box, {265.0, 170.0, 130.0}, 6.0);
  EXPECT_EQ(planes.at[0].size(), 1u);
  EXPECT_TRUE(planes.at[1].empty());
  // Of three, the middle one carries both laps: (324 + 12) / 3 = 112 mm.
  planes = PlanCuts(box, {112.5, 300.0, 130.0}, 6.0);
  ASSERT_EQ(planes.at[0].size(), 2u);
  EXPECT_NEAR(planes.at[0][0], -160.0 + 112.0, 1e-9);
  EXPECT_NEAR(planes.at[0][1], 164.0 - 112.0, 1e-9);
  EXPECT_EQ(planes.Direction(0, 0), -1.0);
  EXPECT_EQ(planes.Direction(0, 1), 1.0);
  // The camera's place is not cut, if need be at the cost of a part.
  planes = PlanCuts(box, {200.0, 300.0, 130.0}, 6.0, {20.0, 20.0});
  ASSERT_EQ(planes.at[0].size(), 1u);
  EXPECT_GE(std::abs(planes.at[0][0]), 20.0);
  planes = PlanCuts(box, {170.0, 300.0, 130.0}, 6.0, {20.0, 20.0});
  ASSERT_EQ(planes.at[0].size(), 2u);
  EXPECT_GE(std::min(std::abs(planes.at[0][0]), std::abs(planes.at[0][1])), 20.0);
  EXPECT_THROW(PlanCuts(box, {20.0, 20.0, 20.0}, 6.0), Error);
}

// Where random places near the whole lie in its parts.
void ExpectPartsMakeTheWhole(const Shell& shell, const ShellParameters& p, const std::string& name, double mostLost)
{
  const ShellPart& whole = name == "skin" ? shell.skin : shell.base;
  const BodySurface all(whole.surface);
  std::vector<BodySurface> parts;
  double volume = 0.0;
  for (const PrintedPart& printed : shell.cut)
    if (printed.name.compare(0, name.size(), name) == 0) {
      EXPECT_TRUE(printed.part.check.IsSound()) << printed.name << ": " << printed.part.check.Faults();
      EXPECT_EQ(printed.part.check.components, 1) << printed.name;
      EXPECT_TRUE(printed.part.fits) << printed.part.Text();
      parts.emplace_back(printed.part.surface);
      volume += printed.part.check.volumeMm3;
    }
  ASSERT_GT(parts.size(), 1u);
  std::size_t inside = 0, lost = 0, doubled = 0, reaching = 0, near = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Random random(3, i);
    const auto& corner =
        whole.surface
            .points[static_cast<std::size_t>(random.Uniform() * 0.999999 * static_cast<double>(whole.surface.points.size()))];
    const Vector3d place =
        corner.cast<double>() + 8.0 * Vector3d(random.Uniform() - 0.5, random.Uniform() - 0.5, random.Uniform() - 0.5);
    std::vector<double> distances;
    for (const BodySurface& part : parts)
      distances.push_back((part.Bounds().exteriorDistance(place) > 10.0) ? 10.0 : part.Distance(place));
    std::sort(distances.begin(), distances.end());
    const double ofWhole = all.Distance(place), edge = 0.5 * p.resolutionMm; // by which edges are broken
    doubled += distances[0] < -0.02 && distances[1] < -0.02;
    inside += ofWhole < -edge;
    lost += ofWhole < -edge && distances[0] > 0.02;
    if (ofWhole < -edge && distances[0] > 0.02) // in a seam: between a peg and its socket, or at a broken edge
      near += distances[0] < p.clearanceMm + edge && distances[1] < p.clearanceMm + 2.0 * edge;
    reaching += ofWhole > edge && distances[0] < -edge; // a lap
  }
  EXPECT_EQ(doubled, 0u) << name;
  EXPECT_EQ(near, lost) << name << ": a gap is wider than the clearance";
  EXPECT_LT(static_cast<double>(lost), mostLost * static_cast<double>(inside)) << name << " " << lost << " of " << inside;
  if (name == "skin") {
    EXPECT_GT(reaching, 30u);
    EXPECT_GT(volume, whole.check.volumeMm3);
  } else {
    EXPECT_EQ(reaching, 0u);
    EXPECT_NEAR(volume, whole.check.volumeMm3, 0.01 * whole.check.volumeMm3);
  }
}

TEST(ShellCut, PartsOfABallFitAndMakeTheWhole)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p;
  p.resolutionMm = 1.0;
  p.openingMm = 30.0;
  p.printerMm = Vector3d(100.0, 100.0, 60.0);
  const Shell shell = MakeShell(BodySurface(Ball(60.0, 5)), p);
  EXPECT_NO_THROW(CheckPrinter(shell.Prints(), p));
  EXPECT_FALSE(shell.skin.fits);
  EXPECT_EQ(std::count_if(shell.cut.begin(), shell.cut.end(), [](const PrintedPart& part) { return part.name[0] == 's'; }), 8);
  EXPECT_EQ(std::count_if(shell.cut.begin(), shell.cut.end(), [](const PrintedPart& part) { return part.name[0] == 'b'; }), 4);
  ExpectPartsMakeTheWhole(shell, p, "skin", 0.03);
  ExpectPartsMakeTheWhole(shell, p, "base", 0.03);
  // Their outside is that of the ball; near seams points do not move, and keep 0.02 of a cell off the lattice's nodes.
  for (const PrintedPart& printed : shell.cut)
    for (const Eigen::Vector3f& point : printed.part.surface.points)
      ASSERT_TRUE(printed.name[0] == 'b' || point.z() < -24.0f || point.norm() < 60.022f);
}

TEST(ShellCut, LapsHaveTheirPlaceBehindTheWall)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p;
  p.resolutionMm = 1.0;
  p.openingMm = 30.0;
  p.printerMm = Vector3d(100.0, 200.0, 200.0);
  const Shell shell = MakeShell(BodySurface(Ball(60.0, 5)), p);
  std::vector<const PrintedPart*> skins;
  for (const PrintedPart& printed : shell.cut)
    if (printed.name[0] == 's')
      skins.push_back(&printed);
  ASSERT_EQ(skins.size(), 2u);
  // Printed alike long: the plane is half of SeamMm below the middle, and the lap ends as far above it.
  EXPECT_NEAR(skins[0]->part.sizeMm.x(), skins[1]->part.sizeMm.x(), 1.0);
  int tongue = 0;
  for (const Eigen::Vector3f& point : skins[0]->part.surface.points) {
    ASSERT_LT(point.x(), 3.0f + 0.1f);
    if (point.z() > 0.0f && point.x() > -2.0f) { // beyond the plane, in front of what breaks its edge
      ASSERT_LT(point.norm(), 60.0 - 2.0 - 0.3 + 0.03);
      ASSERT_GT(point.norm(), 60.0 - 4.0 - 0.3 - 60.0 * Icosphere::Deviation(5) - 0.03);
      ++tongue;
    }
  }
  EXPECT_GT(tongue, 500);
  for (const Eigen::Vector3f& point : skins[1]->part.surface.points)
    ASSERT_GT(point.x(), -3.0f - 0.1f);
}

TEST(ShellCut, PegsReachAcrossTheSeamsOfPlates)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p;
  p.resolutionMm = 0.8;
  p.openingMm = 30.0;
  p.printerMm = Vector3d(100.0, 200.0, 200.0);
  const Shell shell = MakeShell(BodySurface(Ball(60.0, 5)), p);
  const double foot = -60.0 + p.openingMm;
  const struct {
    char first;
    double height, widthMm;
    std::size_t least;
  } plates[] = {{'s', foot + 0.5 * p.flangeThicknessMm, 0.4 * p.flangeMm, 2}, {'b', foot - 0.5 * p.baseMm, 8.0, 1}};
  for (const auto& plate : plates) {
    std::vector<BodySurface> parts;
    for (const PrintedPart& printed : shell.cut)
      if (printed.name[0] == plate.first)
        parts.emplace_back(printed.part.surface);
    ASSERT_EQ(parts.size(), 2u) << plate.first;
    // The first one reaches into the second; the base's seam is where the second begins, that of the skin 3 mm below the middle.
    const double seam = plate.first == 's' ? -0.5 * p.seamMm : parts[1].Bounds().min().x();
    EXPECT_NEAR(parts[0].Bounds().max().x(), seam + p.seamMm, 0.1);
    std::vector<double> widths;
    bool wasWithin = false;
    for (double y = -80.0; y < 80.0; y += 0.05) {
      const Vector3d place(seam + 0.5 * p.seamMm, y, plate.height);
      const bool isWithin = parts[0].Distance(place) < 0.0;
      if (isWithin && !wasWithin)
        widths.push_back(0.0);
      if (isWithin) {
        widths.back() += 0.05;
        ASSERT_GT(parts[1].Distance(place), 0.5 * p.clearanceMm) << plate.first << " " << y; // its socket is there
      }
      wasWithin = isWithin;
    }
    EXPECT_GE(widths.size(), plate.least) << plate.first;
    for (const double width : widths)
      EXPECT_NEAR(width, plate.widthMm, 0.15) << plate.first;
  }
}

TEST(ShellCut, AbdomenIsCutIntoFourWithItsCameraInOne)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p;
  p.openingMm = 70.0;
  p.resolutionMm = 1.0;
  p.printerMm = Vector3d(250.0, 210.0, 210.0);
  const Shell shell = MakeShell(BodySurface(InventedAbdomen(40)), p);
  EXPECT_NO_THROW(CheckPrinter(shell.Prints(), p));
  ExpectPartsMakeTheWhole(shell, p, "skin", 0.03);
  ExpectPartsMakeTheWhole(shell, p, "base", 0.03);
  // Whole, the camera's hole makes the same way through one part of the base that it makes through the base.
  int withCamera = 0;
  for (const PrintedPart& printed : shell.cut)
    if (printed.name[0] == 'b') {
      int around = 0;
      for (const Eigen::Vector3f& point : printed.part.surface.points) {
        const Vector3d place = shell.bodyToShell * point.cast<double>();
        around += std::abs(place.head<2>().norm() - 0.5 * p.lensHoleMm) < 0.2;
      }
      withCamera += around > 50;
    }
  EXPECT_EQ(withCamera, 1);
}

TEST(ShellCut, WhatFitsIsNotCut)
{
  ShellParameters p;
  p.resolutionMm = 1.0;
  p.openingMm = 20.0;
  EXPECT_TRUE(MakeShell(BodySurface(Ball(30.0, 4)), p).cut.empty());
  p.printerMm = Vector3d(70.0, 70.0, 70.0);
  p.cutToFit = false;
  EXPECT_TRUE(MakeShell(BodySurface(Ball(30.0, 4)), p).cut.empty());
  p.cutToFit = true;
  p.printerMm = Vector3d(20.0, 20.0, 20.0);
  EXPECT_THROW(MakeShell(BodySurface(Ball(30.0, 4)), p), Error);
}

} // namespace
