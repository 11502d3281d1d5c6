// SPDX-License-Identifier: BSD-3-Clause
// The fan and the sweep are the same map, used twice: (beam, depth) to a point (x, rho) of the fan's plane, then (plane of
// the sweep, rho) to (y, z). Written with the radius, the map loses all digits as a face becomes flat (the centre moves
// to infinity); written with the curvature, as it becomes a point. So the curvature is a quotient c / u with neither
// above 1. From the centre of curvature, in units of the radius times u, a point lies at (c x, u + c z), and its distance
// h = hypot(c x, u + c z) gives the depth (h - u) / c = (h^2 - u^2) / (c (h + u)), in which c cancels by hand.
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double twoPi = 6.283185307179586;

// A face that bends by less is straight to all digits, and dividing by its angle would lose some.
constexpr double straight = 1e-100;

double SineOver(double a)
{
  return a == 0.0 ? 1.0 : std::sin(a) / a;
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
  return {arc * SineOver(turn) + place.depth * std::sin(turn),
          -arc * std::sin(half) * SineOver(half) + place.depth * std::cos(turn)};
}

ProbeArc::Bend ProbeArc::GetBend() const
{
  if (width > angle)
    return {angle / width, 1.0};
  return {1.0, angle > 0.0 ? width / angle : 0.0};
}

ProbeArc::Place ProbeArc::PlaceOf(double across, double outward, bool behind) const
{
  if (angle < straight)
    return {width > 0.0 ? across / width : 0.0, outward};
  const auto [c, u] = GetBend();
  const double a = c * across, b = u + c * outward, h = std::sqrt(a * a + b * b);
  if (behind)
    return {std::atan2(-a, -b) / angle, -(h + u) / c};
  const double depth = h + u > 0.0 ? (a * across + (u + b) * outward) / (h + u) : 0.0;
  return {std::atan2(a, b) / angle, depth};
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

bool ProbeGeometry::IsPlane() const
{
  return sweepWidth == 0.0 && sweepAngle < straight;
}

bool ProbeGeometry::ReachesBehindAxis() const
{
  const double outermost = std::abs(fanOffset) + 0.5;
  const double lowest = std::min(Fan().PointOf({outermost, depthMin}).y(), Fan().PointOf({outermost, depthMax}).y());
  return Sweep().Span(lowest) < -1e-9 * Size(); // a fan that ends on the axis does not
}

double ProbeGeometry::Size() const
{
  return std::abs(depthMin) + std::abs(depthMax) + fanWidth + sweepWidth;
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
  if (fanWidth == 0.0 && fanAngle < straight)
    fail("angle and width of the fan are both 0; that leaves a single beam");
  if (!std::isfinite(fanOffset) || !(fanAngle * (std::abs(fanOffset) + 0.5) <= 0.5 * twoPi))
    fail("the offset of the fan is " + std::to_string(fanOffset) + " fans; no beam may be turned by more than half a turn");
  if (Fan().Span(depthMin) < -1e-9 * Size())
    fail("the first depth, " + std::to_string(depthMin) + " mm, lies behind the centre of the fan's arc, where beams cross");
  // Below half a turn the plane that reaches a point is told by its angle alone.
  if (sweepAngle >= 0.5 * twoPi && ReachesBehindAxis())
    fail("the fan reaches behind the sweep axis and the sweep is half a turn or more, so that beams cross");
}

Eigen::Vector3d PointOf(const ProbeGeometry& geometry, const BeamPoint& beam)
{
  const Eigen::Vector2d inFan = geometry.Fan().PointOf({beam.fan + geometry.fanOffset, beam.depth});
  const Eigen::Vector2d inSweep = geometry.Sweep().PointOf({beam.sweep, inFan.y()});
  return {inFan.x(), inSweep.x(), inSweep.y()};
}

Eigen::Vector3d DirectionOf(const ProbeGeometry& geometry, const BeamPoint& beam)
{
  const double phi = geometry.fanAngle * (beam.fan + geometry.fanOffset), psi = geometry.sweepAngle * beam.sweep;
  return {std::sin(phi), std::cos(phi) * std::sin(psi), std::cos(phi) * std::cos(psi)};
}

std::optional<BeamPoint> BeamPointAt(const ProbeGeometry& geometry, const Eigen::Vector3d& point, double tolerance)
{
  if (!point.allFinite())
    return {};
  const ProbeArc fan = geometry.Fan(), sweep = geometry.Sweep();
  const double slack = tolerance * geometry.Size();
  if (geometry.IsPlane() && std::abs(point.y()) > slack)
    return {};
  for (const bool behind : {false, true}) {
    ProbeArc::Place plane = sweep.PlaceOf(point.y(), point.z(), behind);
    if (!ClampToFace(sweep, plane, slack))
      continue;
    ProbeArc::Place beam = fan.PlaceOf(point.x(), plane.depth);
    beam.along -= geometry.fanOffset;
    const double depth = std::min(std::max(beam.depth, geometry.depthMin), geometry.depthMax);
    if (std::abs(beam.depth - depth) <= slack && ClampToFace(fan, beam, slack))
      return BeamPoint{depth, beam.along, plane.along};
  }
  return {};
}

} // namespace echorama
