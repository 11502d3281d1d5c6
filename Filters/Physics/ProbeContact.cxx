// SPDX-License-Identifier: BSD-3-Clause
// Only nodes of the skin are looked at, which are few, so that this costs nothing beside the tissue. The stiffness is some ten
// times that of the tissue below a node: more would spoil the linear systems, less takes more updates.
#include "ProbeContact.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Eigenvalues>
#include <limits>

namespace echorama {
namespace {

constexpr double ContactStiffness = 30.0; // in shear moduli of the stiffest cell at the node
constexpr double DragStiffness = 1.0;

// The part of a symmetric matrix that has eigenvalues in [0, limit].
Eigen::Matrix3d Limited(const Eigen::Matrix3d& matrix, double limit)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseMin(limit).asDiagonal() *
         solver.eigenvectors().transpose();
}

} // namespace

struct ProbeContact::Push {
  double force = 0.0; // max(0, f - s d)
  double energy = 0.0;
  Eigen::Vector3d normal;
  Eigen::Vector3d drag = Eigen::Vector3d::Zero();
  double dragStiffness = 0.0;
};

ProbeContact::ProbeContact(const TissueCells& cells, const LatticeShape& shape, const Eigen::Vector3d& spacing,
                           const std::vector<float>& live)
{
  ForNodes(shape.nodes, [&](int i, int j, int k) {
    if (live[static_cast<std::size_t>(shape.At(i, j, k))] == 0.0f)
      return;
    Node node;
    double stiffest = 0.0;
    Eigen::Vector3d area = Eigen::Vector3d::Zero(); // of faces between tissue and nothing, by axis
    for (int corner = 0; corner < 8; ++corner) {
      const int ci = i - (corner & 1), cj = j - (corner >> 1 & 1), ck = k - (corner >> 2);
      if (!cells.IsTissue(ci, cj, ck))
        continue;
      stiffest = std::max(stiffest, static_cast<double>(cells.shear[cells.At(ci, cj, ck)]));
      // The neighbours across this node.
      const int across[3] = {corner & 1 ? ci + 1 : ci - 1, corner & 2 ? cj + 1 : cj - 1, corner & 4 ? ck + 1 : ck - 1};
      area[0] += cells.IsTissue(across[0], cj, ck) ? 0.0 : 0.25 * spacing[1] * spacing[2];
      area[1] += cells.IsTissue(ci, across[1], ck) ? 0.0 : 0.25 * spacing[0] * spacing[2];
      area[2] += cells.IsTissue(ci, cj, across[2]) ? 0.0 : 0.25 * spacing[0] * spacing[1];
    }
    if (stiffest <= 0.0 || area.isZero())
      return;
    node.at = shape.At(i, j, k);
    node.index = {i, j, k};
    node.rest = spacing.cwiseProduct(Eigen::Vector3d(i, j, k));
    node.area = area.norm();
    node.stiffness = ContactStiffness * stiffest * node.area / spacing.minCoeff();
    nodes_.push_back(node);
  });
  const std::ptrdiff_t strides[3] = {1, shape.row, shape.slice};
  ForNodes(cells.cells, [&](int i, int j, int k) {
    for (std::size_t axis = 0; axis < 3 && cells.IsTissue(i, j, k); ++axis)
      for (const int side : {0, 1}) {
        std::array<int, 3> beyond{i, j, k};
        beyond[axis] += side ? 1 : -1;
        if (cells.IsTissue(beyond[0], beyond[1], beyond[2]))
          continue;
        Eigen::Vector3d middle(i + 0.5, j + 0.5, k + 0.5);
        middle[static_cast<int>(axis)] += side - 0.5;
        Face face;
        face.middle = spacing.cwiseProduct(middle);
        for (int corner = 0; corner < 4; ++corner)
          face.at[static_cast<std::size_t>(corner)] = shape.At(i, j, k) + side * strides[axis] +
                                                      (corner & 1) * strides[(axis + 1) % 3] +
                                                      (corner >> 1) * strides[(axis + 2) % 3];
        faces_.push_back(face);
      }
  });
}

void ProbeContact::Place(std::shared_ptr<const ProbeShape> shape, const Pose& probeToLattice, double friction)
{
  shape_ = std::move(shape);
  toLattice_ = probeToLattice;
  toProbe_ = probeToLattice.inverse();
  friction_ = friction;
}

void ProbeContact::BeginStep(const LatticeField<double>& displacement)
{
  for (Node& node : nodes_)
    node.anchor = toProbe_ * (node.rest + displacement.Get(node.at));
}

std::optional<ProbeContact::Push> ProbeContact::PushOf(const Node& node, const LatticeField<double>& displacement) const
{
  if (!shape_)
    return {};
  const Eigen::Vector3d place = node.rest + displacement.Get(node.at), local = toProbe_ * place;
  const double distance = shape_->Distance(local);
  if (node.force <= 0.0 && distance >= 0.0)
    return {};
  Push push;
  push.force = std::max(0.0, node.force - node.stiffness * distance);
  push.energy = (push.force * push.force - node.force * node.force) / (2.0 * node.stiffness);
  push.normal = toLattice_.linear() * shape_->Slope(local);
  if (friction_ > 0.0 && node.force > 0.0) {
    const double stiffness = DragStiffness / ContactStiffness * node.stiffness, bound = friction_ * node.force;
    const Eigen::Vector3d moved = place - toLattice_ * node.anchor, along = moved - node.normal * node.normal.dot(moved);
    const Eigen::Vector3d wanted = node.drag - node.normal * node.normal.dot(node.drag) - stiffness * along;
    const double size = wanted.norm(), part = size > bound ? bound / size : 1.0;
    push.drag = part * wanted;
    push.dragStiffness = part * stiffness;
    push.energy += (size > bound ? bound * (size - 0.5 * bound) : 0.5 * size * size) / stiffness;
  }
  return push;
}

double ProbeContact::Energy(const LatticeField<double>& displacement) const
{
  double energy = 0.0;
  for (const Node& node : nodes_)
    if (const auto push = PushOf(node, displacement))
      energy += push->energy;
  return energy;
}

double ProbeContact::AddForce(const LatticeField<double>& displacement, LatticeField<double>& force) const
{
  double energy = 0.0;
  for (const Node& node : nodes_)
    if (const auto push = PushOf(node, displacement)) {
      energy += push->energy;
      force.Set(node.at, force.Get(node.at) - push->force * push->normal - push->drag);
    }
  return energy;
}

std::vector<Eigen::Matrix3f> ProbeContact::Stiffness(const LatticeField<double>& displacement,
                                                     const std::vector<Eigen::Matrix3f>& own, bool tame)
{
  std::vector<Eigen::Matrix3f> blocks(nodes_.size(), Eigen::Matrix3f::Zero());
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    Node& node = nodes_[n];
    const auto push = PushOf(node, displacement);
    node.pushed = push && push->force > 0.0;
    if (!push)
      continue;
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    if (push->force > 0.0)
      block += node.stiffness * push->normal * push->normal.transpose();
    // The bend counts at the surface; deep inside, where slopes jump, there is none. It must leave the block positive.
    const Eigen::Vector3d local = toProbe_ * (node.rest + displacement.Get(node.at));
    if (push->force > 0.0 && !tame && std::abs(shape_->Distance(local)) < 0.3) {
      const auto least = static_cast<double>(own[n].diagonal().minCoeff());
      block -= toLattice_.linear() * Limited(push->force * shape_->Bend(local), 0.4 * std::max(least, 0.0)) *
               toLattice_.linear().transpose();
    }
    if (push->dragStiffness > 0.0)
      block += push->dragStiffness * (Eigen::Matrix3d::Identity() - node.normal * node.normal.transpose());
    blocks[n] = block.cast<float>();
  }
  return blocks;
}

double ProbeContact::Update(const LatticeField<double>& displacement)
{
  double worst = 0.0;
  for (Node& node : nodes_) {
    const auto push = PushOf(node, displacement);
    if (!push) {
      node.force = 0.0;
      node.push.setZero();
      node.drag.setZero();
      continue;
    }
    worst = std::max(worst, std::abs(push->force - node.force) / node.stiffness);
    if (!node.pushed && push->force > node.force)
      continue;
    if (node.force <= 0.0 && push->force > 0.0) // it touches the probe for the first time: here it sticks
      node.anchor = toProbe_ * (node.rest + displacement.Get(node.at));
    node.force = push->force;
    node.push = push->force * push->normal;
    node.normal = push->normal.normalized();
    node.drag = push->force > 0.0 ? push->drag : Eigen::Vector3d::Zero();
  }
  return worst;
}

double ProbeContact::Clearance(const ProbeShape& shape, const Pose& probeToLattice,
                               const LatticeField<double>& displacement) const
{
  const Pose toProbe = probeToLattice.inverse();
  double least = std::numeric_limits<double>::infinity();
  for (const Node& node : nodes_)
    least = std::min(least, shape.Distance(toProbe * (node.rest + displacement.Get(node.at))));
  return least;
}

double ProbeContact::DeepestFace(const LatticeField<double>& displacement) const
{
  double deepest = 0.0;
  for (std::size_t n = 0; shape_ && n < faces_.size(); ++n) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (const std::ptrdiff_t at : faces_[n].at)
      moved += 0.25 * displacement.Get(at);
    deepest = std::max(deepest, -shape_->Distance(toProbe_ * (faces_[n].middle + moved)));
  }
  return deepest;
}

Eigen::Vector3d ProbeContact::Total() const
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Node& node : nodes_)
    sum += node.push + node.drag;
  return sum;
}

} // namespace echorama
