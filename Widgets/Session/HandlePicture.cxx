// SPDX-License-Identifier: BSD-3-Clause
// Everything has a dark shade below, so that it is seen on bright tissue too. The hidden half of a ring is faint.
#include "Widgets/Session/HandlePicture.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <cmath>

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace echorama {
namespace {

using HandleColour = HandlePicture::Colour;

constexpr HandleColour Shade{0, 0, 0, 130};
constexpr HandleColour Marked{255, 220, 60, 255};
constexpr HandleColour WorldColours[4] = {{235, 75, 65, 255}, {95, 205, 85, 255}, {90, 145, 255, 255}, {225, 225, 225, 255}};
constexpr HandleColour ViewColours[4] = {{255, 150, 60, 255}, {70, 210, 220, 255}, {225, 225, 225, 255}, {225, 225, 225, 255}};

void DrawRing(const Handle& ring, const HandleColour& colour, bool isMarked, double width, HandlePicture& picture)
{
  const bool quiet = ring.axis == 3 && !isMarked;
  std::vector<HandleColour> front, shade;
  for (std::size_t i = 0; i < ring.line.size(); ++i) {
    const auto part = static_cast<unsigned char>(ring.behind[i] ? 70 : (quiet ? 140 : 255));
    front.push_back({colour[0], colour[1], colour[2], part});
    shade.push_back({0, 0, 0, static_cast<unsigned char>(ring.behind[i] || quiet ? 0 : Shade[3])});
  }
  picture.AddLine(ring.line, shade, width + 2.0, true);
  picture.AddLine(ring.line, front, width, true);
}

void DrawArrow(const Handle& arrow, const HandleColour& colour, double width, HandlePicture& picture)
{
  const Vector2d tail = arrow.line[0], tip = arrow.line[1];
  const Vector2d along = (tip - tail).normalized(), across(-along.y(), along.x());
  const Vector2d neck = tip - std::min(16.0, 0.5 * (tip - tail).norm()) * along;
  picture.AddLine({tail - along, neck}, {Shade, Shade}, width + 2.0, false);
  picture.AddPolygon({neck - 7.5 * across - 1.5 * along, tip + 2.5 * along, neck + 7.5 * across - 1.5 * along}, Shade);
  picture.AddLine({tail, neck}, {colour, colour}, width, false);
  picture.AddPolygon({neck - 6.0 * across, tip, neck + 6.0 * across}, colour);
}

} // namespace

void HandlePicture::AddPolygon(const std::vector<Vector2d>& corners, const Colour& colour)
{
  std::vector<int>& polygon = polygons.emplace_back();
  for (const Vector2d& corner : corners) {
    polygon.push_back(static_cast<int>(points.size()));
    points.push_back(corner);
    colours.push_back(colour);
  }
}

void HandlePicture::AddDisc(const Vector2d& centre, double radius, const Colour& colour)
{
  std::vector<Vector2d> corners;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2.0 * Pi * i / 24;
    corners.push_back(centre + radius * Vector2d(std::cos(angle), std::sin(angle)));
  }
  AddPolygon(corners, colour);
}

void HandlePicture::AddLine(const std::vector<Vector2d>& line, const std::vector<Colour>& lineColours, double width, bool closed)
{
  const int first = static_cast<int>(points.size()), n = static_cast<int>(line.size());
  for (std::size_t i = 0, last = line.size() - 1; i <= last; ++i) {
    const Vector2d before = line[i > 0 ? i - 1 : (closed ? last : 0)], after = line[i < last ? i + 1 : (closed ? 0 : last)];
    Vector2d along = after - before;
    if (along.norm() < 1e-6)
      along = line[i] - before; // where a ring that is seen edge-on turns back
    along = along.norm() < 1e-6 ? Vector2d(1.0, 0.0) : along.normalized();
    const Vector2d across = 0.5 * width * Vector2d(-along.y(), along.x());
    points.insert(points.end(), {line[i] - across, line[i] + across});
    colours.insert(colours.end(), 2, lineColours[i]);
  }
  for (int i = 0; i + (closed ? 0 : 1) < n; ++i) {
    const int a = first + 2 * i, b = first + 2 * ((i + 1) % n);
    polygons.push_back({a, b, b + 1, a + 1});
  }
}

void DrawHandles(const std::vector<Handle>& handles, int marked, bool alongWorld, const HandleSizes& sizes,
                 HandlePicture& picture)
{
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const Handle& handle = handles[i];
    const bool isMarked = static_cast<int>(i) == marked;
    HandleColour colour = isMarked ? Marked : (alongWorld ? WorldColours : ViewColours)[AxisOf(handle, alongWorld)];
    const double width = isMarked ? 4.0 : 2.5;
    switch (handle.kind) {
    case Handle::Kind::Ring:
      DrawRing(handle, colour, isMarked, width, picture);
      break;
    case Handle::Kind::Square:
      colour[3] = isMarked ? 220 : 120;
      picture.AddPolygon(handle.line, colour);
      break;
    case Handle::Kind::Arrow:
      DrawArrow(handle, colour, width, picture);
      break;
    case Handle::Kind::Centre:
      picture.AddDisc(handle.line[0], sizes.centre + 1.5, Shade);
      picture.AddDisc(handle.line[0], sizes.centre, isMarked ? Marked : HandleColour{250, 250, 250, 255});
      picture.AddDisc(handle.line[0], 0.4 * sizes.centre, {40, 40, 40, 255});
      break;
    }
  }
}

void DrawConstraint(const MouseView& view, const MotionConstraint& constraint, const Vector3d& centre, HandlePicture& picture)
{
  for (int axis = 0; axis < 3 && constraint.kind != MotionConstraint::Kind::Free; ++axis) {
    const bool along = std::abs(constraint.axis[axis]) > 0.5;
    if (along != (constraint.kind == MotionConstraint::Kind::Axis))
      continue;
    const Vector3d reach = 400.0 * view.MmPerPixelAt(centre) * Vector3d::Unit(axis);
    const auto a = view.PixelOf(centre - reach), b = view.PixelOf(centre + reach);
    if (a && b && (*a - *b).norm() > 1.0) {
      HandleColour colour = WorldColours[axis];
      colour[3] = 150;
      picture.AddLine({*a, *b}, {colour, colour}, 1.5, false);
    }
  }
}

} // namespace echorama
