// SPDX-License-Identifier: BSD-3-Clause
// Handles are made in the world, at a size that is measured in pixels at the depth of their centre, and kept as they are seen:
// drawing and taking hold of them then use the same few numbers, and both are exact at any zoom and in any projection.
#include "AlignmentHandles.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr int RingPieces = 96;
constexpr double ShortestArrow = 0.15; // share of its length that must be seen
constexpr double FlattestSquare = 0.2; // sine of the angle between sight and plane

double DistanceToPiece(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b)
{
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::min(1.0, std::max(0.0, (p - a).dot(along) / length2)) : 0.0;
  return (p - a - t * along).norm();
}

bool IsInside(const Eigen::Vector2d& p, const std::vector<Eigen::Vector2d>& convex)
{
  bool left = false, right = false;
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Eigen::Vector2d a = convex[i], b = convex[(i + 1) % convex.size()];
    const double side = (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
    left = left || side > 0.0;
    right = right || side < 0.0;
  }
  return !(left && right);
}

// Adds a point as it is seen; false when it is behind the viewer.
bool AddPoint(const MouseView& view, const Eigen::Vector3d& point, Handle& handle)
{
  const auto pixel = view.PixelOf(point);
  if (pixel)
    handle.line.push_back(*pixel);
  return pixel.has_value();
}

} // namespace

HandleSizes HandleSizes::Times(double factor) const
{
  HandleSizes sizes = *this;
  for (double* size : {&sizes.arrowStart, &sizes.arrowEnd, &sizes.squareStart, &sizes.squareEnd, &sizes.ring, &sizes.viewRing,
                       &sizes.centre, &sizes.reach})
    *size *= factor;
  return sizes;
}

std::vector<Handle> MakeHandles(const MouseView& view, const Eigen::Vector3d& centre, const Eigen::Matrix3d& frame, bool slice,
                                const HandleSizes& sizes)
{
  std::vector<Handle> handles;
  if (!view.Usable() || !centre.allFinite() || !frame.allFinite() || !view.PixelOf(centre))
    return handles;
  const Eigen::Vector2d middle = *view.PixelOf(centre);
  const double mm = view.MmPerPixelAt(centre);
  const Eigen::Vector3d sight = view.RayAt(middle).direction;

  const auto addRing = [&](int axis, const Eigen::Vector3d& normal, double radius) {
    Handle ring{Handle::Kind::Ring, axis, normal, {}, {}};
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    for (int i = 0; i < RingPieces; ++i) {
      const double angle = 2.0 * Pi * i / RingPieces;
      const Eigen::Vector3d away = radius * mm * (std::cos(angle) * u + std::sin(angle) * v);
      if (!AddPoint(view, centre + away, ring))
        return;
      ring.behind.push_back(away.dot(sight) > 1e-6 * radius * mm);
    }
    handles.push_back(std::move(ring));
  };
  const auto addSquare = [&](int axis) {
    const Eigen::Vector3d u = frame.col((axis + 1) % 3), v = frame.col((axis + 2) % 3);
    Handle square{Handle::Kind::Square, axis, frame.col(axis), {}, {}};
    bool seen = std::abs(sight.dot(frame.col(axis))) > FlattestSquare;
    for (const auto& [a, b] : std::array<std::pair<double, double>, 4>{{{sizes.squareStart, sizes.squareStart},
                                                                        {sizes.squareEnd, sizes.squareStart},
                                                                        {sizes.squareEnd, sizes.squareEnd},
                                                                        {sizes.squareStart, sizes.squareEnd}}})
      seen = AddPoint(view, centre + mm * (a * u + b * v), square) && seen;
    if (seen)
      handles.push_back(std::move(square));
  };
  const auto addArrow = [&](int axis) {
    Handle arrow{Handle::Kind::Arrow, axis, frame.col(axis), {}, {}};
    bool seen = frame.col(axis).cross(sight).norm() > ShortestArrow;
    for (const double at : {sizes.arrowStart, sizes.arrowEnd})
      seen = AddPoint(view, centre + at * mm * frame.col(axis), arrow) && seen;
    if (seen)
      handles.push_back(std::move(arrow));
  };

  // From the back to the front, as they are drawn.
  if (!slice)
    addRing(3, view.towards, sizes.viewRing);
  for (int axis = slice ? 2 : 0; axis < 3; ++axis)
    addRing(axis, frame.col(axis), sizes.ring);
  for (int axis = slice ? 2 : 0; axis < 3; ++axis)
    addSquare(axis);
  for (int axis = 0; axis < (slice ? 2 : 3); ++axis)
    addArrow(axis);
  Handle dot{Handle::Kind::Centre, 3, view.towards, {middle}, {}};
  handles.push_back(std::move(dot));
  return handles;
}

int HandleAt(const std::vector<Handle>& handles, const Eigen::Vector2d& pixel, const HandleSizes& sizes)
{
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const Handle& handle = handles[i];
    double distance = std::numeric_limits<double>::infinity();
    switch (handle.kind) {
    case Handle::Kind::Centre:
      if ((pixel - handle.line[0]).norm() <= sizes.centre + 0.5 * sizes.reach)
        return static_cast<int>(i);
      break;
    case Handle::Kind::Square:
      if (IsInside(pixel, handle.line))
        distance = 0.0;
      break;
    case Handle::Kind::Arrow:
      distance = DistanceToPiece(pixel, handle.line[0], handle.line[1]);
      break;
    case Handle::Kind::Ring:
      for (std::size_t p = 0; p < handle.line.size(); ++p) {
        // What lies behind yields to what lies in front.
        const double yield = handle.behind[p] ? 0.5 * sizes.reach : 0.0;
        distance = std::min(distance, DistanceToPiece(pixel, handle.line[p], handle.line[(p + 1) % handle.line.size()]) + yield);
      }
      break;
    }
    if (distance <= sizes.reach && distance < least) {
      least = distance;
      best = static_cast<int>(i);
    }
  }
  return best;
}

Eigen::Matrix3d SliceFrame(const MouseView& view, bool& alongWorld)
{
  Eigen::Matrix3d frame;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(std::abs(view.towards[axis]) - 1.0) < 1e-9) {
      alongWorld = true;
      // The first two columns in a right-handed order around the normal, which is the world's axis.
      frame.col(0) = Eigen::Vector3d::Unit((axis + 1) % 3);
      frame.col(1) = Eigen::Vector3d::Unit((axis + 2) % 3);
      frame.col(2) = Eigen::Vector3d::Unit(axis);
      return frame;
    }
  }
  alongWorld = false;
  frame.col(0) = view.right;
  frame.col(1) = view.up;
  frame.col(2) = view.towards;
  return frame;
}

int AxisOf(const Handle& handle, bool alongWorld)
{
  int axis = handle.axis;
  if (alongWorld && axis < 3)
    handle.direction.cwiseAbs().maxCoeff(&axis);
  return axis;
}

std::optional<Eigen::Vector2d> GripOf(const std::vector<Handle>& handles, std::size_t index, const HandleSizes& sizes)
{
  const std::vector<Eigen::Vector2d>& line = handles[index].line;
  switch (handles[index].kind) {
  case Handle::Kind::Arrow:
    return line[1];
  case Handle::Kind::Square:
    return 0.25 * (line[0] + line[1] + line[2] + line[3]);
  case Handle::Kind::Ring: {
    const auto seen = std::find_if(line.begin(), line.end(), [&](const Eigen::Vector2d& point) {
      return HandleAt(handles, point, sizes) == static_cast<int>(index);
    });
    return seen == line.end() ? std::nullopt : std::optional<Eigen::Vector2d>(*seen);
  }
  default:
    return line.front();
  }
}

} // namespace echorama
