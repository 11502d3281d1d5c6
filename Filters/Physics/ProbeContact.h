// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/ProbeShape.h"
#include "Filters/Physics/TissueElement.h"
#include <memory>
#include <optional>

namespace echorama {

/// Contact of the nodes of the skin with a probe: they may not enter it, may leave it, and slide along it with friction.
///
/// An augmented Lagrangian: a node is pushed by max(0, f - s d), where d is its distance, s a stiffness, and f the force that the
/// last Update() found; when that no longer changes, d is 0 wherever there is a force. Friction is bounded by the forces of the
/// last Update() also, so that between two of them everything derives from an energy. All in the frame of the lattice.
class ProbeContact {
public:
  /// A node of the skin.
  struct Node {
    std::ptrdiff_t at = 0; ///< in fields
    std::array<int, 3> index{};
    Eigen::Vector3d rest;                             ///< mm
    double area = 0.0;                                ///< of the skin that it stands for, mm^2
    double stiffness = 0.0;                           ///< s, mN/mm
    double force = 0.0;                               ///< f, mN
    Eigen::Vector3d drag = Eigen::Vector3d::Zero();   ///< of friction, mN
    Eigen::Vector3d anchor = Eigen::Vector3d::Zero(); ///< where it touched the probe when the step began, in the probe's frame
    Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< of the probe there, at the last Update()
    Eigen::Vector3d push = Eigen::Vector3d::Zero();   ///< what f does to the tissue, mN: at rounded edges not of the size of f
    bool pushed = false;                              ///< at the last Stiffness()
  };

  ProbeContact() = default;
  ProbeContact(const TissueCells&, const LatticeShape&, const Eigen::Vector3d& spacing, const std::vector<float>& live);

  /// Where the probe is from now on: \a probeToLattice is rigid.
  void Place(std::shared_ptr<const ProbeShape> shape, const Pose& probeToLattice, double friction);
  /// A new step begins: what sticks does so where it is.
  void BeginStep(const LatticeField<double>& displacement);

  double Energy(const LatticeField<double>& displacement) const;
  /// Adds the derivative of the energy, and returns the energy.
  double AddForce(const LatticeField<double>& displacement, LatticeField<double>& force) const;
  /// The second derivative of the energy, node by node of the skin. \a own: what the tissue has at each, of which bends of the
  /// probe may take away a part. \a tame: without bends, which make it easier to slip off.
  std::vector<Eigen::Matrix3f> Stiffness(const LatticeField<double>& displacement, const std::vector<Eigen::Matrix3f>& own,
                                         bool tame);
  /// Takes over the forces at \a displacement, but not those of nodes that were not pushed at the last Stiffness(): how far
  /// these went into the probe says nothing of how much it takes to keep them out. \returns by how many mm the constraints were
  /// still violated: depth in the probe, or distance of nodes with a force
  double Update(const LatticeField<double>& displacement);

  /// The least distance of any node of the skin from a probe.
  double Clearance(const ProbeShape& shape, const Pose& probeToLattice, const LatticeField<double>& displacement) const;
  /// How deep the middle of any face of the skin lies in the probe: where nodes gave way to both sides of it, deep.
  double DeepestFace(const LatticeField<double>& displacement) const;
  Eigen::Vector3d Total() const; ///< of the forces on the tissue, mN

  std::vector<Node>& Nodes() { return nodes_; }
  const std::vector<Node>& Nodes() const { return nodes_; }

private:
  struct Push;
  std::optional<Push> PushOf(const Node& node, const LatticeField<double>& displacement) const;

  struct Face {
    std::array<std::ptrdiff_t, 4> at; ///< its corners, in fields
    Eigen::Vector3d middle;           ///< at rest, mm
  };
  std::vector<Node> nodes_;
  std::vector<Face> faces_;
  std::shared_ptr<const ProbeShape> shape_;
  Pose toLattice_ = Pose::Identity(), toProbe_ = Pose::Identity();
  double friction_ = 0.0;
};

} // namespace echorama
