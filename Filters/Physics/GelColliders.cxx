// SPDX-License-Identifier: BSD-3-Clause
// Solids act on the nodes of the grid that lie inside them: there gel has the velocity that contact leaves it. A node further
// from a solid than its distance says is never asked, block by block, since no distance falls faster than one moves.
#include "GelColliders.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {

Eigen::Vector3d GelShape::Normal(const Eigen::Vector3d& point, double when) const
{
  constexpr double step = 1e-3;
  Eigen::Vector3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
    slope[axis] = Distance(point + offset, when) - Distance(point - offset, when);
  }
  const double length = slope.norm();
  return length > 0.0 ? Eigen::Vector3d(slope / length) : Eigen::Vector3d::UnitZ();
}

double GelPlane::Distance(const Eigen::Vector3d& point, double) const
{
  return point.z();
}

Eigen::Vector3d GelPlane::Normal(const Eigen::Vector3d&, double) const
{
  return Eigen::Vector3d::UnitZ();
}

GelDistanceGrid::GelDistanceGrid(const ImageGeometry& geometry, std::vector<float> distances)
  : GelDistanceGrid(geometry, std::move(distances), {})
{
}

GelDistanceGrid::GelDistanceGrid(const ImageGeometry& geometry, std::vector<float> atBegin, std::vector<float> atEnd,
                                 std::vector<Eigen::Vector3f> shifts)
  : geometry_(geometry), begin_(std::move(atBegin)), end_(std::move(atEnd)), shifts_(std::move(shifts))
{
  geometry_.Check("the grid of distances");
  toIndex_ = geometry_.WorldToIndex();
  if (begin_.size() != geometry_.VoxelCount() || (!end_.empty() && end_.size() != begin_.size()) ||
      (!shifts_.empty() && shifts_.size() != begin_.size()))
    throw Error(Error::Kind::BadInput, "the grid of distances has " + std::to_string(geometry_.VoxelCount()) + " points, but " +
                                           std::to_string(begin_.size()) + " distances");
  for (const std::vector<float>* values : {&begin_, &end_})
    if (!std::all_of(values->begin(), values->end(), [](float value) { return std::isfinite(value); }))
      throw Error(Error::Kind::BadInput, "the grid of distances: a distance is not finite");
}

GelDistanceGrid::Corners GelDistanceGrid::CornersOf(const Eigen::Vector3d& point) const
{
  const Eigen::Vector3d index = toIndex_ * point;
  std::size_t base = 0, step[3];
  double part[3];
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = geometry_.dimensions[static_cast<std::size_t>(axis)] - 1;
    const double at = std::min(std::max(index[axis], 0.0), static_cast<double>(last));
    const int cell = std::min(static_cast<int>(at), std::max(last - 1, 0));
    part[axis] = at - cell;
    base += static_cast<std::size_t>(cell) * stride;
    step[axis] = last > 0 ? stride : 0;
    stride *= static_cast<std::size_t>(last + 1);
  }
  Corners corners{};
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::size_t at = base;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1u) != 0;
      weight *= upper ? part[axis] : 1.0 - part[axis];
      at += upper ? step[axis] : 0;
    }
    corners.at[corner] = at;
    corners.weight[corner] = weight;
  }
  return corners;
}

double GelDistanceGrid::Distance(const Eigen::Vector3d& point, double when) const
{
  const Corners corners = CornersOf(point);
  const double first = ValueAt(begin_, corners);
  return end_.empty() ? first : first + when * (ValueAt(end_, corners) - first);
}

// Along the normal distances have the last word, or gel would be pressed into the solid, or torn off.
Eigen::Vector3d GelDistanceGrid::Shift(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const
{
  if (end_.empty())
    return Eigen::Vector3d::Zero();
  const Corners corners = CornersOf(point);
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  if (!shifts_.empty())
    for (std::size_t n = 0; n < 8; ++n)
      along += corners.weight[n] * shifts_[corners.at[n]].cast<double>();
  return along + (ValueAt(begin_, corners) - ValueAt(end_, corners) - along.dot(normal)) * normal;
}

ParameterList Describe(GelContact& p)
{
  return {
      Parameter("Stick", p.stick, "Gel keeps to the solid, as it does to skin and to a probe."),
      Parameter("Friction", p.friction, {0, 100}, "", "Coulomb's coefficient of gel that slides; 0 is a free slip.")
          .When("Stick", "off"),
  };
}

GelColliders::GelColliders(const std::vector<GelCollider>& colliders, double seconds)
  : colliders_(colliders), seconds_(seconds), toShape_(colliders.size()), motion_(colliders.size())
{
  for (std::size_t n = 0; n < colliders_.size(); ++n) {
    const std::string name = "collider " + std::to_string(n + 1);
    const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, name + ": " + reason); };
    if (!colliders_[n].shape)
      fail("it has no shape");
    CheckRanges(colliders_[n].contact, name);
    for (const Pose* pose : {&colliders_[n].begin, &colliders_[n].end})
      if (!pose->matrix().allFinite() || !IsRotation(pose->linear()))
        fail("its pose is not a rigid one");
  }
}

void GelColliders::SetStep(double from, double to)
{
  when_ = from;
  step_ = (to - from) * seconds_;
  for (std::size_t n = 0; n < colliders_.size(); ++n) {
    const GelCollider& collider = colliders_[n];
    const Pose first = Interpolate(collider.begin, collider.end, from), last = Interpolate(collider.begin, collider.end, to);
    toShape_[n] = first.inverse();
    motion_[n] = last * toShape_[n];
  }
}

double GelColliders::Distance(std::size_t n, const Eigen::Vector3d& point) const
{
  return colliders_[n].shape->Distance(toShape_[n] * point, when_);
}

Eigen::Vector3d GelColliders::Normal(std::size_t n, const Eigen::Vector3d& point) const
{
  return toShape_[n].linear().transpose() * colliders_[n].shape->Normal(toShape_[n] * point, when_);
}

Eigen::Vector3d GelColliders::Velocity(std::size_t n, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const
{
  const Pose& toShape = toShape_[n];
  const Eigen::Vector3d shift = colliders_[n].shape->Shift(toShape * point, toShape.linear() * normal);
  return (motion_[n] * point - point) / step_ + toShape.linear().transpose() * shift / seconds_;
}

Eigen::Vector3d GelColliders::Collide(std::size_t n, const Eigen::Vector3d& point, const Eigen::Vector3d& velocity) const
{
  const GelContact& contact = colliders_[n].contact;
  const Eigen::Vector3d normal = Normal(n, point), solid = Velocity(n, point, normal);
  if (contact.stick)
    return solid;
  const Eigen::Vector3d relative = velocity - solid;
  const double into = relative.dot(normal);
  if (into >= 0.0)
    return velocity;
  const Eigen::Vector3d along = relative - into * normal;
  const double slide = along.norm(), held = -contact.friction * into;
  return slide > held ? Eigen::Vector3d(solid + (1.0 - held / slide) * along) : solid;
}

} // namespace echorama
