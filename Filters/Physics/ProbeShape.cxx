// SPDX-License-Identifier: BSD-3-Clause
// The head is where four things hold at once: behind the face (its bends go on beyond the last beams, and from their centres on
// straight back), within the sides, and not too far back. Where several are nearly violated the edge is rounded.
#include "ProbeShape.h"
#include "Core/Base/CheckRange.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

// How far a point lies in front of a bend.
double DepthOf(const ProbeArc& arc, double across, double outward)
{
  if (arc.angle <= 0.0 || arc.width < 1e-3)
    return outward;
  const double radius = arc.width / arc.angle, fromCentre = radius + outward;
  if (fromCentre < 0.0)
    return std::abs(across) - radius;
  // What ProbeArc::PlaceOf has as depth, without the angle: solvers ask at every node of every step.
  return (across * across + (radius + fromCentre) * outward) / (std::sqrt(across * across + fromCentre * fromCentre) + radius);
}

// The extent of a bend from \a from to \a to of its length.
std::pair<double, double> Extent(const ProbeArc& arc, double from, double to)
{
  double low = arc.PointOf({from, 0.0}).x(), high = arc.PointOf({to, 0.0}).x();
  const double quarter = 1.5707963267948966;
  if (arc.angle > 0.0 && arc.angle * from < -quarter)
    low = -arc.width / arc.angle;
  if (arc.angle > 0.0 && arc.angle * to > quarter)
    high = arc.width / arc.angle;
  return {low, high};
}

} // namespace

ParameterList Describe(ProbeHead& head)
{
  return {
      Parameter("HeadMarginMm", head.marginMm, {0.1, 1000.0}, "mm",
                "How far the head of the probe reaches beyond its outermost beams."),
      Parameter("HeadEdgeMm", head.edgeMm, {0.0, 1000.0}, "mm", "Radius of the head's edges, at most HeadMarginMm."),
      Parameter("HeadLengthMm", head.lengthMm, {1.0, 1000.0}, "mm", "How far the head reaches back.").Advanced(),
  };
}

ProbeShape::ProbeShape(const ProbeGeometry& geometry, const ProbeHead& head)
  : geometry_(geometry), edge_(head.edgeMm), length_(head.lengthMm)
{
  geometry_.Check();
  CheckRanges(head);
  CheckRange("HeadEdgeMm", head.edgeMm, 0.0, head.marginMm);
  const auto [left, right] = Extent(geometry_.Fan(), geometry_.fanOffset - 0.5, geometry_.fanOffset + 0.5);
  const auto [low, high] = Extent(geometry_.Sweep(), -0.5, 0.5);
  low_ = Eigen::Vector2d(left, low).array() - head.marginMm;
  high_ = Eigen::Vector2d(right, high).array() + head.marginMm;
}

double ProbeShape::Distance(const Eigen::Vector3d& point) const
{
  const double inSweep = DepthOf(geometry_.Sweep(), point.y(), point.z()), front = DepthOf(geometry_.Fan(), point.x(), inSweep);
  const Eigen::Array3d over(std::max(low_.x() - point.x(), point.x() - high_.x()),
                            std::max(low_.y() - point.y(), point.y() - high_.y()), std::max(front, -length_ - point.z()));
  const Eigen::Array3d rounded = over + edge_;
  return rounded.max(0.0).matrix().norm() + std::min(rounded.maxCoeff(), 0.0) - edge_;
}

Eigen::Vector3d ProbeShape::Slope(const Eigen::Vector3d& point) const
{
  constexpr double step = 1e-4;
  Eigen::Vector3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
    slope[axis] = Distance(point + offset) - Distance(point - offset);
  }
  return slope / (2.0 * step);
}

Eigen::Matrix3d ProbeShape::Bend(const Eigen::Vector3d& point) const
{
  constexpr double step = 1e-3;
  Eigen::Matrix3d bend;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
    bend.col(axis) = (Slope(point + offset) - Slope(point - offset)) / (2.0 * step);
  }
  return 0.5 * (bend + bend.transpose());
}

} // namespace echorama
