// SPDX-License-Identifier: BSD-3-Clause
// The fan and the sweep are the same map, used twice: (beam, depth) to a point (x, rho) of the fan's plane, then (plane of
// the sweep, rho) to (y, z). Written with the radius, the map loses all digits as a face becomes flat (the centre moves
// to infinity); written with the curvature, as it becomes a point. So each is used where its number is at most 1, and the
// depth in the curved form is (h^2 - 1) / (k (h + 1)) with the 1 cancelled by hand, h being the distance from the centre
// in radii.
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double twoPi = 6.283185307179586;

// A face that bends by less is straight to all digits, and dividing by its angle could underflow.
constexpr double straight = 1e-100;

double Sinc(double a)
{
  return a == 0.0 ? 1.0 : std::sin(a) / a;
}

// The lengths of a geometry are small or large beside this, mm.
double SizeOf(const ProbeGeometry& g)
{
  return std::abs(g.depthMin) + std::abs(g.depthMax) + g.fanWidth + g.sweepWidth;
}

// Clamps a place to the face; false when it is further than \a slack mm off it.
bool ClampToFace(const ProbeArc& arc, ProbeArc::Place& place, double slack)
{
  const double limited = std::min(std::max(place.along, -0.5), 0.5);
  const bool inside = std::abs(place.along - limited) * std::abs(arc.Span(place.depth)) <= slack;
  place.along = limited;
  return inside;
}

} // namespace

Eigen::Vector2d ProbeArc::PointOf(const Place& place) const
{
  const double turn = angle * place.along, half = 0.5 * turn, arc = width * place.along;
  return {arc * Sinc(turn) + place.depth * std::sin(turn), -arc * std::sin(half) * Sinc(half) + place.depth * std::cos(turn)};
}

ProbeArc::Place ProbeArc::PlaceOf(double across, double outward, bool behind) const
{
  const double side = behind ? -1.0 : 1.0;
  if (width > angle) {
    const double k = angle / width;
    const double a = k * across, b = 1.0 + k * outward, h = std::hypot(a, b);
    Place place;
    place.along = angle < straight ? across / width : std::atan2(side * a, side * b) / angle;
    place.depth = behind ? -(h + 1.0) / k : (k * across * across + (2.0 + k * outward) * outward) / (1.0 + h);
    return place;
  }
  if (angle == 0.0) // neither angle nor width: a single normal
    return {0.0, outward};
  const double radius = width / angle;
  const double h = std::hypot(across, radius + outward);
  return {std::atan2(side * across, side * (radius + outward)) / angle, side * h - radius};
}

ProbeGeometry ProbeGeometry::Convex(double fanAngle, double fanRadius, double sweepAngle, double sweepRadius, double depthMin,
                                    double depthMax)
{
  return {fanAngle, fanAngle * fanRadius, sweepAngle, sweepAngle * sweepRadius, depthMin, depthMax};
}

ProbeGeometry ProbeGeometry::Linear(double fanWidth, double sweepWidth, double depthMin, double depthMax)
{
  return {0.0, fanWidth, 0.0, sweepWidth, depthMin, depthMax};
}

ProbeGeometry ProbeGeometry::Phased(double fanAngle, double sweepAngle, double depthMin, double depthMax)
{
  return {fanAngle, 0.0, sweepAngle, 0.0, depthMin, depthMax};
}

void ProbeGeometry::Check() const
{
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, "probe geometry: " + reason); };
  const auto checkAngle = [&fail](const char* name, double angle) {
    if (!(angle >= 0.0 && angle < twoPi))
      fail(std::string(name) + " is " + std::to_string(angle) + " radians; it must be in [0, 2 pi)");
  };
  const auto checkWidth = [&fail](const char* name, double width) {
    if (!(width >= 0.0) || !std::isfinite(width))
      fail(std::string(name) + " is " + std::to_string(width) + " mm; it must be at least 0");
  };
  checkAngle("the fan angle", fanAngle);
  checkWidth("the fan width", fanWidth);
  checkAngle("the sweep angle", sweepAngle);
  checkWidth("the sweep width", sweepWidth);
  if (!std::isfinite(depthMin) || !std::isfinite(depthMax) || !(depthMax > depthMin))
    fail("the depths go from " + std::to_string(depthMin) + " to " + std::to_string(depthMax) +
         " mm; the last must be greater than the first");
  if (fanAngle == 0.0 && fanWidth == 0.0)
    fail("angle and width of the fan are both 0; that leaves a single beam");
  const double slack = 1e-9 * SizeOf(*this);
  if (Fan().Span(depthMin) < -slack)
    fail("the first depth, " + std::to_string(depthMin) + " mm, lies behind the centre of the fan's arc, where beams cross");
  // Below half a turn the plane that reaches a point is told by its angle alone.
  if (sweepAngle >= 0.5 * twoPi) {
    const double lowest = std::min(Fan().PointOf({0.5, depthMin}).y(), Fan().PointOf({0.5, depthMax}).y());
    if (Sweep().Span(lowest) < -slack)
      fail("the fan reaches behind the sweep axis and the sweep is half a turn or more, so that beams cross");
  }
}

Eigen::Vector3d PointOf(const ProbeGeometry& geometry, const BeamPoint& beam)
{
  const Eigen::Vector2d inFan = geometry.Fan().PointOf({beam.fan, beam.depth});
  const Eigen::Vector2d inSweep = geometry.Sweep().PointOf({beam.sweep, inFan.y()});
  return {inFan.x(), inSweep.x(), inSweep.y()};
}

Eigen::Vector3d DirectionOf(const ProbeGeometry& geometry, const BeamPoint& beam)
{
  const double phi = geometry.fanAngle * beam.fan, psi = geometry.sweepAngle * beam.sweep;
  return {std::sin(phi), std::cos(phi) * std::sin(psi), std::cos(phi) * std::cos(psi)};
}

std::optional<BeamPoint> BeamPointAt(const ProbeGeometry& geometry, const Eigen::Vector3d& point, double tolerance)
{
  if (!point.allFinite())
    return {};
  const ProbeArc fan = geometry.Fan(), sweep = geometry.Sweep();
  const double slack = tolerance * SizeOf(geometry);
  if (geometry.IsPlane() && std::abs(point.y()) > slack)
    return {};
  for (const bool behind : {false, true}) {
    if (behind && geometry.sweepAngle < straight)
      break;
    ProbeArc::Place plane = sweep.PlaceOf(point.y(), point.z(), behind);
    if (!ClampToFace(sweep, plane, slack))
      continue;
    ProbeArc::Place beam = fan.PlaceOf(point.x(), plane.depth);
    const double depth = std::min(std::max(beam.depth, geometry.depthMin), geometry.depthMax);
    if (std::abs(beam.depth - depth) <= slack && ClampToFace(fan, beam, slack))
      return BeamPoint{depth, beam.along, plane.along};
  }
  return {};
}

} // namespace echorama
