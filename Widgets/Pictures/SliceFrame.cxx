// SPDX-License-Identifier: BSD-3-Clause
#include "SliceFrame.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/RigidTransform.h"
#include <algorithm>
#include <cmath>

namespace echorama {

using Eigen::Vector2d;
using Eigen::Vector3d;

const std::array<SliceAxis, 4>& SliceAxes()
{
  static const auto rgb = [](int r, int g, int b) { return std::array<double, 3>{r / 255.0, g / 255.0, b / 255.0}; };
  static const std::array<SliceAxis, 4> axes{
      {{"x", Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::UnitX(), {"A", "P", "I", "S"}, rgb(235, 110, 95)},
       {"y", Vector3d::UnitX(), Vector3d::UnitZ(), Vector3d::UnitY(), {"R", "L", "I", "S"}, rgb(120, 205, 110)},
       {"z", Vector3d::UnitX(), -Vector3d::UnitY(), Vector3d::UnitZ(), {"R", "L", "P", "A"}, rgb(105, 160, 245)},
       {"oblique", Vector3d::UnitX(), -Vector3d::UnitY(), -Vector3d::UnitZ(), {"", "", "", ""}, rgb(240, 205, 90)}}};
  return axes;
}

Vector3d SliceFrame::WorldOf(double x, double y) const
{
  const Vector2d d = mmPerPixel * (Vector2d(x, y) - 0.5 * Vector2d(width - 1, height - 1));
  return focus + d.x() * right + d.y() * up;
}

Vector2d SliceFrame::PixelOf(const Vector3d& world) const
{
  const Vector3d d = (world - focus) / mmPerPixel;
  return 0.5 * Vector2d(width - 1, height - 1) + Vector2d(d.dot(right), d.dot(up));
}

std::array<Vector3d, 4> SliceFrame::Corners() const
{
  const double x = width - 0.5, y = height - 0.5;
  return {WorldOf(-0.5, -0.5), WorldOf(x, -0.5), WorldOf(x, y), WorldOf(-0.5, y)};
}

SlicePlane SliceFrame::Plane() const
{
  return {WorldOf(0.0, 0.0), mmPerPixel * right, mmPerPixel * up, width, height};
}

void SliceFrame::SetAxis(std::size_t place)
{
  axis = place;
  if (place == Oblique) {
    along = Towards();
    return;
  }
  right = SliceAxes()[place].right;
  up = SliceAxes()[place].up;
  along = SliceAxes()[place].along;
  FollowCursor();
}

bool SliceFrame::SetNormalAndUp(const Vector3d& normal, const Vector3d& wantedUp)
{
  const Vector3d across = wantedUp.cross(normal);
  if (!(across.norm() > 1e-9 * normal.norm() * wantedUp.norm() && across.allFinite()))
    return false;
  axis = Oblique;
  right = across.normalized();
  along = normal.normalized();
  up = along.cross(right);
  FollowCursor();
  return true;
}

void SliceFrame::Turn(double degreesAboutRight, double degreesAboutUp)
{
  const Eigen::Matrix3d turn =
      ExpRotation(RadiansPerDegree * degreesAboutRight * right) * ExpRotation(RadiansPerDegree * degreesAboutUp * up);
  focus = cursor + turn * (focus - cursor);
  SetNormalAndUp(turn * Towards(), turn * up);
}

std::optional<std::array<Vector2d, 2>> SliceFrame::CutBy(const SliceFrame& other) const
{
  const Vector3d line = Towards().cross(other.Towards());
  if (line.norm() < 1e-6)
    return {};
  const Vector2d point = PixelOf(cursor), direction = Vector2d(line.dot(right), line.dot(up)).normalized();
  double from = -1e30, to = 1e30;
  for (int i = 0; i < 2; ++i) {
    const double size = (i == 0 ? width : height) - 1;
    if (std::fabs(direction[i]) < 1e-12) {
      if (point[i] < 0.0 || point[i] > size)
        return {};
      continue;
    }
    const double a = -point[i] / direction[i], b = (size - point[i]) / direction[i];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (!(from < to))
    return {};
  return std::array<Vector2d, 2>{point + from * direction, point + to * direction};
}

std::optional<std::array<Vector2d, 2>> SliceFrame::PartNear(const Vector3d& from, const Vector3d& to, double depthMm) const
{
  const double a = DepthOf(from), b = DepthOf(to);
  double begin = 0.0, end = 1.0; // of the way
  if (a == b) {
    if (!(std::fabs(a) <= depthMm))
      return {};
  } else {
    const double one = (-depthMm - a) / (b - a), other = (depthMm - a) / (b - a);
    begin = std::max(begin, std::min(one, other));
    end = std::min(end, std::max(one, other));
  }
  if (!(begin <= end))
    return {};
  return std::array<Vector2d, 2>{PixelOf(from + begin * (to - from)), PixelOf(from + end * (to - from))};
}

std::vector<Vector2d> SliceFrame::CutOf(const Vector3d& middle, double radiusMm) const
{
  constexpr int Sides = 64;
  const double off = (middle - focus).dot(Towards()), square = radiusMm * radiusMm - off * off;
  std::vector<Vector2d> circle;
  if (!(square > 0.0))
    return circle;
  const double radius = std::sqrt(square) / mmPerPixel;
  for (int i = 0; i <= Sides; ++i) {
    const double angle = 2.0 * Pi * i / Sides;
    circle.emplace_back(PixelOf(middle) + radius * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return circle;
}

double SliceFrame::ScaleBarMm() const
{
  const double most = 0.25 * width * mmPerPixel, ten = std::pow(10.0, std::floor(std::log10(most)));
  return (5.0 * ten <= most ? 5.0 : 2.0 * ten <= most ? 2.0 : 1.0) * ten;
}

} // namespace echorama
