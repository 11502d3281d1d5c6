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

GelDistanceGrid::GelDistanceGrid(const ImageGeometry& geometry, std::vector<float> atBegin, std::vector<float> atEnd)
  : geometry_(geometry), begin_(std::move(atBegin)), end_(std::move(atEnd))
{
  geometry_.Check("the grid of distances");
  toIndex_ = geometry_.WorldToIndex();
  if (begin_.size() != geometry_.VoxelCount() || (!end_.empty() && end_.size() != begin_.size()))
    throw Error(Error::Kind::BadInput, "the grid of distances has " + std::to_string(geometry_.VoxelCount()) + " points, but " +
                                           std::to_string(begin_.size()) + " distances");
  for (const std::vector<float>* values : {&begin_, &end_})
    if (!std::all_of(values->begin(), values->end(), [](float value) { return std::isfinite(value); }))
      throw Error(Error::Kind::BadInput, "the grid of distances: a distance is not finite");
}

double GelDistanceGrid::Interpolate(const std::vector<float>& values, const Eigen::Vector3d& point) const
{
  const Eigen::Vector3d index = toIndex_ * point;
  std::size_t low[3], step[3];
  double part[3];
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = geometry_.dimensions[static_cast<std::size_t>(axis)] - 1;
    const double at = std::min(std::max(index[axis], 0.0), static_cast<double>(last));
    const int cell = std::min(static_cast<int>(at), std::max(last - 1, 0));
    part[axis] = at - cell;
    low[axis] = static_cast<std::size_t>(cell) * stride;
    step[axis] = last > 0 ? stride : 0;
    stride *= static_cast<std::size_t>(last + 1);
  }
  const std::size_t base = low[0] + low[1] + low[2];
  double sum = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::size_t at = base;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1u) != 0;
      weight *= upper ? part[axis] : 1.0 - part[axis];
      at += upper ? step[axis] : 0;
    }
    sum += weight * static_cast<double>(values[at]);
  }
  return sum;
}

double GelDistanceGrid::Distance(const Eigen::Vector3d& point, double when) const
{
  const double first = Interpolate(begin_, point);
  return end_.empty() ? first : first + when * (Interpolate(end_, point) - first);
}

double GelDistanceGrid::Change(const Eigen::Vector3d& point) const
{
  return end_.empty() ? 0.0 : Interpolate(end_, point) - Interpolate(begin_, point);
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

bool GelColliders::Reaches(std::size_t n, const Eigen::Vector3d& centre, double radius) const
{
  return colliders_[n].shape->Distance(toShape_[n] * centre, when_) <= radius;
}

Eigen::Vector3d GelColliders::ToSurface(std::size_t n, const Eigen::Vector3d& point) const
{
  const GelShape& shape = *colliders_[n].shape;
  const Eigen::Vector3d inShape = toShape_[n] * point;
  return toShape_[n].linear().transpose() * (-shape.Distance(inShape, when_) * shape.Normal(inShape, when_));
}

bool GelColliders::Collide(std::size_t n, const Eigen::Vector3d& point, Eigen::Vector3d& velocity) const
{
  const GelCollider& collider = colliders_[n];
  const Eigen::Vector3d inShape = toShape_[n] * point;
  if (collider.shape->Distance(inShape, when_) > 0.0)
    return false;
  Eigen::Vector3d solid = (motion_[n] * point - point) / step_;
  const Eigen::Vector3d normal = toShape_[n].linear().transpose() * collider.shape->Normal(inShape, when_);
  solid -= collider.shape->Change(inShape) / seconds_ * normal;
  if (collider.contact.stick) {
    velocity = solid;
    return true;
  }
  const Eigen::Vector3d relative = velocity - solid;
  const double into = relative.dot(normal);
  if (into >= 0.0)
    return true;
  const Eigen::Vector3d along = relative - into * normal;
  const double slide = along.norm(), held = -collider.contact.friction * into;
  velocity = solid;
  if (slide > held)
    velocity += (1.0 - held / slide) * along;
  return true;
}

} // namespace echorama
