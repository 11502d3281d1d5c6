// SPDX-License-Identifier: BSD-3-Clause
// Shapes as signed distances: a union is the smaller of two, a cut the larger of one and minus the other. What comes out is one
// closed surface whatever overlaps, which a printer needs and meshes of single bodies are not. The handle's outline is a
// superellipse, whose distance has no closed form: it is that of a polygon of 360 sides, 0.002 mm off at most.
#include "PrintableSolid.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <vector>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double SphereDistance(const Vector3d& p, const Vector3d& centre, double radius)
{
  return (p - centre).norm() - radius;
}

// Upright, from the height \a low to \a high.
double Cylinder(const Vector3d& p, const Vector2d& axis, double radius, double low, double high)
{
  const Vector2d beyond((p.head<2>() - axis).norm() - radius, std::abs(p.z() - 0.5 * (low + high)) - 0.5 * (high - low));
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

double BoxDistance(const Vector3d& p, const Eigen::AlignedBox3d& box)
{
  const Vector3d beyond = (p - box.center()).cwiseAbs() - 0.5 * box.sizes();
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

// A bar of a square section along a line, ends included.
double Bar(const Vector3d& p, const Vector3d& from, const Vector3d& to, double width)
{
  const double length = (to - from).norm();
  const Vector3d along = length > 1e-9 ? Vector3d((to - from) / length) : Vector3d::UnitZ(), side = Vector3d::UnitX();
  const Vector3d local(side.dot(p - from), along.cross(side).dot(p - from), along.dot(p - from));
  const double h = 0.5 * width;
  return BoxDistance(local, {Vector3d(-h, -h, -h), Vector3d(h, h, length + h)});
}

// The outline of a handle, and distances from it.
class Outline {
public:
  Outline(double width, double thickness) : half_(0.5 * width, 0.5 * thickness)
  {
    constexpr int sides = 90; // of one quarter; the others mirror it
    for (int i = 0; i <= sides; ++i) {
      const double angle = 1.5707963267948966 * i / sides;
      const Vector2d away(std::cos(angle), std::sin(angle));
      corners_.push_back(away / std::pow(Level(away), 1.0 / handleRoundness));
    }
  }

  double Distance(const Vector2d& point) const
  {
    const Vector2d p = point.cwiseAbs();
    double nearest = 1e300;
    for (std::size_t i = 1; i < corners_.size(); ++i) {
      const Vector2d &a = corners_[i - 1], edge = corners_[i] - a;
      const double t = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (p - a - t * edge).squaredNorm());
    }
    return Level(p) < 1.0 ? -std::sqrt(nearest) : std::sqrt(nearest);
  }

private:
  // 1 on the outline, less inside.
  double Level(const Vector2d& p) const
  {
    return std::pow(std::abs(p.x()) / half_.x(), handleRoundness) + std::pow(std::abs(p.y()) / half_.y(), handleRoundness);
  }

  Vector2d half_;
  std::vector<Vector2d> corners_;
};

} // namespace

Vector3d PrintableSolid::Snapped(const Vector3d& point, double limitMm) const
{
  Vector3d moved = point;
  for (int round = 0; round < 3; ++round) {
    const double d = distance(moved);
    constexpr double h = 1e-4;
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] = (distance(moved + h * Vector3d::Unit(axis)) - distance(moved - h * Vector3d::Unit(axis))) / (2.0 * h);
    if (gradient.squaredNorm() < 0.25) // on an edge, where it is not defined
      break;
    moved -= d * gradient / gradient.squaredNorm();
  }
  const double shift = (moved - point).norm();
  return shift <= limitMm ? moved : point + (moved - point) * (limitMm / shift);
}

Pose PrintToWorld(const CalibrationRigParameters& p)
{
  return Pose(Eigen::Translation3d(0.0, 0.0, p.plateDepthMm) * Eigen::AngleAxisd(3.141592653589793, Vector3d::UnitX()));
}

PrintableSolid PrintableRig(const CalibrationRigParameters& p)
{
  p.Check();
  const auto refuse = [](const char* what) {
    throw Error(Error::Kind::InvalidParameter, std::string("calibration rig: it cannot be printed without ") + what);
  };
  if (p.baseMm <= 0.0)
    refuse("a base (baseMm)");
  if (p.stemRadiusMm <= 0.0)
    refuse("pins (stemRadiusMm)");
  struct Pin {
    Vector3d top;
    double ball, radius;
  };
  std::vector<Pin> pins;
  const Pose worldToPrint = PrintToWorld(p).inverse();
  const std::vector<Landmark> centres = CalibrationLandmarks(p);
  for (std::size_t i = 0; i < p.balls.size(); ++i)
    pins.push_back({worldToPrint * centres[i].position, p.scale * p.balls[i].radius, p.StemRadius(p.balls[i])});
  const Eigen::AlignedBox2d outline = p.BaseOutline(); // the half turn exchanges +y and -y
  const Eigen::AlignedBox3d base(Vector3d(outline.min().x(), -outline.max().y(), 0.0),
                                 Vector3d(outline.max().x(), -outline.min().y(), p.baseMm));
  PrintableSolid solid;
  solid.bounds = base;
  for (const Pin& pin : pins) {
    solid.bounds.extend(pin.top + Vector3d::Constant(pin.ball));
    solid.bounds.extend(Vector3d(pin.top - Vector3d::Constant(pin.ball)).cwiseMax(Vector3d(-1e9, -1e9, 0.0)));
  }
  solid.distance = [pins, base](const Vector3d& x) {
    double nearest = BoxDistance(x, base);
    for (const Pin& pin : pins)
      nearest =
          std::min({nearest, SphereDistance(x, pin.top, pin.ball), Cylinder(x, pin.top.head<2>(), pin.radius, 0.0, pin.top.z())});
    return nearest;
  };
  return solid;
}

ParameterList Describe(ProbeClipParameters& p)
{
  return {
      Parameter("HandleWidthMm", p.handleWidthMm, {5, 200}, "mm",
                "The handle along the fan; its outline is a rectangle with round sides."),
      Parameter("HandleThicknessMm", p.handleThicknessMm, {5, 200}, "mm", "The handle along the sweep."),
      Parameter("LengthMm", p.lengthMm, {10, 200}, "mm", "Length of the sleeve, along the handle."),
      Parameter("WallMm", p.wallMm, {1, 20}, "mm", "Thickness of all walls."),
      Parameter("ClearanceMm", p.clearanceMm, {0, 5}, "mm",
                "Between sleeve and handle: a printer's tolerance, or a coat of rubber."),
      Parameter("OpeningMm", p.openingMm, {0, 180}, "mm",
                "Width of the sleeve's open side, at most 0.9 of the handle's. 0: a ring that is pushed on."),
      Parameter("TieGrooves", p.tieGrooves, {0, 8}, "", "Number of grooves for cable ties."),
      Parameter("TieWidthMm", p.tieWidthMm, {1, 15}, "mm", "Width of a groove."),
      Parameter("ArmMm", p.armMm, {0, 300}, "mm",
                "From the middle of the sleeve to the middle of the sensor, backwards along the handle."),
      Parameter("StandOffMm", p.standOffMm, {0, 100}, "mm", "From the sleeve to the sensor, sideways."),
      Parameter("ArmWidthMm", p.armWidthMm, {3, 50}, "mm", "Width of the arm."),
      Parameter("SensorMm", p.sensorMm, {1, 80}, "mm", "The sensor: across, sideways and along the handle."),
      Parameter("SensorClearanceMm", p.sensorClearanceMm, {0, 3}, "mm", "Between pocket and sensor, on each side."),
  };
}

void ProbeClipParameters::Check() const
{
  CheckRanges(*this);
  if (openingMm > 0.9 * handleWidthMm)
    throw Error(Error::Kind::InvalidParameter, "OpeningMm is " + NumberText(openingMm) +
                                                   " mm; it must be at most 0.9 of HandleWidthMm, which is " +
                                                   NumberText(handleWidthMm) + " mm");
  const double least = armWidthMm + std::max(2.0, 1.25 * tieGrooves * tieWidthMm);
  if (lengthMm < least)
    throw Error(Error::Kind::InvalidParameter, "LengthMm is " + NumberText(lengthMm) + " mm; an arm of " +
                                                   NumberText(armWidthMm) + " mm and " + NumberText(tieGrooves) +
                                                   " grooves need at least " + NumberText(least) + " mm");
}

Vector3d ProbeClipParameters::SensorPlace() const
{
  const double outside = 0.5 * handleThicknessMm + clearanceMm + wallMm;
  return {0.0, outside + standOffMm + 0.5 * sensorMm.y(), -armMm};
}

PrintableSolid PrintableClip(const ProbeClipParameters& p)
{
  p.Check();
  const Outline handle(p.handleWidthMm, p.handleThicknessMm);
  // In the frame of the print: x and -y the probe's x and y (so that a half turn about x leads from one to the other), z up.
  const Vector3d place = p.SensorPlace();
  const Vector3d sensor(place.x(), -place.y(), 0.5 * p.lengthMm - place.z());
  const double outside = p.clearanceMm + p.wallMm; // of the handle's outline
  const double wallY = -(0.5 * p.handleThicknessMm + p.clearanceMm + 0.5 * p.wallMm);
  const Vector3d half = 0.5 * p.sensorMm + Vector3d::Constant(p.sensorClearanceMm);
  const Eigen::AlignedBox3d pocket(sensor - half, sensor + half);
  // The pocket's box has walls all around but on the far side, where the sensor goes in, and a slit for its cable at the back.
  const Vector3d wall = Vector3d::Constant(p.wallMm);
  const Eigen::AlignedBox3d holder(pocket.min() - Vector3d(p.wallMm, 0.0, p.wallMm), pocket.max() + wall);
  const Eigen::AlignedBox3d entry(pocket.min() - Vector3d(0.0, 1.0, 0.0), pocket.max());
  const double slit = std::min(0.25 * p.sensorMm.x(), 2.0);
  const Eigen::AlignedBox3d cable(Vector3d(-slit, pocket.min().y() - 1.0, pocket.max().z() - 1.0),
                                  Vector3d(slit, pocket.max().y(), holder.max().z() + 1.0));
  // The arm: from the sleeve's wall out to the pocket's floor, then back along the handle. It keeps off the handle.
  const double floorY = std::min(holder.max().y() - 0.5 * p.wallMm, wallY + 0.5 * p.wallMm - 0.5 * p.armWidthMm);
  const double armZ = p.lengthMm - 0.5 * p.armWidthMm;
  const Vector3d root(0.0, wallY + 0.5 * p.wallMm - 0.5 * p.armWidthMm, armZ), bend(0.0, floorY, armZ);
  const Vector3d end(0.0, floorY, std::max(armZ, sensor.z()));
  std::vector<double> grooves; // in front of the arm, which would be in the way of a tie
  for (int i = 0; i < p.tieGrooves; ++i)
    grooves.push_back((i + 0.5) * (p.lengthMm - p.armWidthMm) / p.tieGrooves);

  PrintableSolid solid;
  const double wide = 0.5 * p.handleWidthMm + outside, thick = 0.5 * p.handleThicknessMm + outside, arm = 0.5 * p.armWidthMm;
  solid.bounds = Eigen::AlignedBox3d(Vector3d(-wide, -thick, 0.0), Vector3d(wide, thick, p.lengthMm));
  solid.bounds.extend(holder.min().cwiseMax(Vector3d(-1e9, -1e9, 0.0)));
  solid.bounds.extend(holder.max());
  solid.bounds.extend(Vector3d(-arm, floorY - arm, 0.0));
  solid.bounds.extend(Vector3d(arm, floorY, end.z() + arm));
  solid.distance = [=](const Vector3d& x) {
    const double outline = handle.Distance(x.head<2>());
    const double ends = std::abs(x.z() - 0.5 * p.lengthMm) - 0.5 * p.lengthMm;
    double sleeve = std::max(outline - outside, ends);
    for (const double at : grooves) // where both the depth and the width are a groove's
      sleeve = std::max(sleeve, std::min(outline - outside + p.wallMm / 3.0, 0.5 * p.tieWidthMm - std::abs(x.z() - at)));
    double solidHere =
        std::min({sleeve, Bar(x, root, bend, p.armWidthMm), Bar(x, bend, end, p.armWidthMm), BoxDistance(x, holder)});
    // Cuts: the handle, all along it; the open side; the pocket.
    solidHere = std::max(solidHere, p.clearanceMm - outline);
    if (p.openingMm > 0.0)
      solidHere = std::max(solidHere, -std::max(std::abs(x.x()) - 0.5 * p.openingMm, -x.y()));
    return std::max({solidHere, -BoxDistance(x, entry), -BoxDistance(x, cable), -x.z()});
  };
  return solid;
}

} // namespace echorama
