// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Shell/ShellRig.h"
#include "Filters/Shell/Testing/Ball.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

ShellParameters RigShell()
{
  ShellParameters p;
  p.resolutionMm = 1.0;
  p.openingMm = 50.0;
  p.baffleMm = 4.0;
  p.markMm = 3.0;
  return p;
}

std::string WhyNot(const ShellParameters& shell, const RigParameters& rig, int points)
{
  try {
    MakeRig(BodySurface(Ball(60.0, 5)), shell, rig, points);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ShellRig, DomesAreSpheresAboutTheCameraWithHolesInTheSameDirections)
{
  ECHORAMA_SKIP_SANITIZED();
  const ShellParameters p = RigShell();
  const BodySurface body(Ball(60.0, 5));
  const CalibrationRig rig = MakeRig(body, p, {}, 80);
  const Vector3d camera = rig.bodyToCamera.inverse().translation();
  EXPECT_NEAR((camera - Vector3d(0.0, 0.0, -10.0 - 5.0 + 3.0 + 8.0)).norm(), 0.0, 1e-3);
  const double plate = -10.0 + 4.0 + 0.3 + 3.0; // its upper side, in the body's frame
  ASSERT_EQ(rig.domes[0].marks.size(), rig.domes[1].marks.size());
  ASSERT_GE(rig.domes[0].marks.size(), 40u);
  for (const auto& dome : rig.domes) {
    EXPECT_TRUE(dome.part.check.IsSound()) << dome.part.check.Faults();
    EXPECT_EQ(dome.part.check.components, 1);
    // Ways through: the holes of marks and of 8 screws.
    const auto points = static_cast<std::int64_t>(dome.part.surface.points.size()),
               faces = static_cast<std::int64_t>(dome.part.surface.triangles.size());
    EXPECT_EQ((2 - (points - faces / 2)) / 2, static_cast<std::int64_t>(dome.marks.size()) + 8);
    std::size_t outer = 0, inner = 0;
    const double bound = 0.025; // points keep 0.02 of a cell off the lattice's nodes
    for (const Eigen::Vector3f& point : dome.part.surface.points) {
      const double radius = (point.cast<double>() - camera).norm();
      if (static_cast<double>(point.z()) < plate + 1.0) // the corner at its foot is filled
        continue;
      ASSERT_LT(radius, dome.radiusMm + bound);
      ASSERT_GT(radius, dome.radiusMm - p.thicknessMm - bound);
      outer += radius > dome.radiusMm - bound;
      inner += radius < dome.radiusMm - p.thicknessMm + bound;
    }
    EXPECT_GT(outer, 1000u);
    EXPECT_GT(inner, 1000u);
    for (const ShellMark& mark : dome.marks)
      EXPECT_NEAR((mark.place - camera).norm(), dome.radiusMm, 1e-6);
  }
  for (std::size_t i = 0; i < rig.domes[0].marks.size(); ++i)
    EXPECT_NEAR((rig.domes[0].marks[i].normal - rig.domes[1].marks[i].normal).norm(), 0.0, 1e-9);
}

// The foot of a dome is the skin's: what holds one holds the other.
TEST(ShellRig, StandsOnTheBaseOfTheShell)
{
  ECHORAMA_SKIP_SANITIZED();
  const ShellParameters p = RigShell();
  const BodySurface body(Ball(60.0, 5));
  const CalibrationRig rig = MakeRig(body, p, {}, 40);
  const Shell shell = MakeShell(body, p);
  const BodySurface skin(shell.skin.surface), base(shell.base.surface);
  for (const auto& dome : rig.domes) {
    const BodySurface solid(dome.part.surface);
    int foot = 0;
    for (const Eigen::Vector3f& single : shell.skin.surface.points) {
      const Vector3d point = single.cast<double>();
      if (point.z() > -10.0 + p.flangeThicknessMm - 1.0)
        continue;
      ASSERT_LT(std::abs(solid.Distance(point)), 0.5) << point.transpose(); // on another lattice: edges are broken otherwise
      ++foot;
    }
    EXPECT_GT(foot, 1000);
    // Nothing of the base, nor its lip, is within the dome.
    int lip = 0;
    for (const Eigen::Vector3f& point : shell.base.surface.points) {
      ASSERT_GT(solid.Distance(point.cast<double>()), -0.05);
      lip += point.z() > -10.0f + 3.0f;
    }
    EXPECT_GT(lip, 200);
  }
}

TEST(ShellRig, WhatTheBaseHasNoRoomForIsRefused)
{
  ECHORAMA_SKIP_SANITIZED();
  RigParameters rig;
  rig.largeDomeMm = 80.0;
  EXPECT_NE(WhyNot(RigShell(), rig, 40).find("LargeDomeMm is 80 mm; the base has room for a dome of 5"), std::string::npos)
      << WhyNot(RigShell(), rig, 40);
  rig.largeDomeMm = 40.0;
  rig.smallDomeMm = 38.0;
  EXPECT_NE(WhyNot(RigShell(), rig, 40).find("SmallDomeMm is 38 mm; it must be at most 0.9 of the large dome"),
            std::string::npos);
  rig.smallDomeMm = 5.0;
  EXPECT_NE(WhyNot(RigShell(), rig, 40).find("hardly reaches above the plate"), std::string::npos);
  rig.smallDomeMm = 30.0;
  ShellParameters shell = RigShell();
  shell.markMm = 15.0;
  EXPECT_NE(WhyNot(shell, rig, 40).find("has no room for 20 marks"), std::string::npos) << WhyNot(shell, rig, 40);
  rig.largeDomeMm = std::nan("");
  EXPECT_NE(WhyNot(RigShell(), rig, 40).find("LargeDomeMm is nan"), std::string::npos);
}

TEST(ShellRig, HasNoMarkerAndDoesNotAskWhetherTheSkinHasRoomForOne)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(Ball(60.0, 5));
  ShellParameters marked = RigShell();
  marked.marker = true;
  EXPECT_THROW(MakeShell(body, marked), Error); // its cells would be too small for a lattice of 1 mm
  const CalibrationRig rig = MakeRig(body, marked, {}, 30), plain = MakeRig(body, RigShell(), {}, 30);
  for (std::size_t which = 0; which < 2; ++which)
    EXPECT_TRUE(rig.domes[which].part.surface.points == plain.domes[which].part.surface.points);
}

TEST(ShellRig, IsCutWhereThePrinterIsTooSmall)
{
  ECHORAMA_SKIP_SANITIZED();
  ShellParameters p = RigShell();
  p.printerMm = Vector3d(120.0, 160.0, 100.0);
  const CalibrationRig rig = MakeRig(BodySurface(Ball(60.0, 5)), p, {}, 40);
  for (const auto& dome : rig.domes) {
    ASSERT_EQ(dome.cut.size(), 2u);
    double volume = 0.0;
    for (const PrintedPart& printed : dome.cut) {
      EXPECT_TRUE(printed.part.check.IsSound()) << printed.part.check.Faults();
      EXPECT_TRUE(printed.part.fits) << printed.part.Text();
      volume += printed.part.check.volumeMm3;
    }
    EXPECT_NEAR(volume, dome.part.check.volumeMm3, 0.01 * dome.part.check.volumeMm3);
  }
}

} // namespace
