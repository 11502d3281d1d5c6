// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/LatticeMultigrid.h"
#include "Filters/Physics/TissueElement.h"
#include <optional>

namespace echorama {

/// Contact of tissue with tissue across empty cells, without friction: of two bodies, or of a body that is folded. Nodes of the
/// skin may not enter faces of the skin that looked at them at rest, from either side.
///
/// Nodes of the softer side are kept out by an augmented Lagrangian, as that of ProbeContact; of the stiffer one by a stiffness
/// alone, so that no two forces hold the same place. Which face a node is before is looked up where the tissue is now, and then
/// is left alone, with its normal, until the next Find(): so a distance is linear in the displacements, and what pushes derives
/// from a convex energy. Forces are in balance to the last digit. All in the frame of the lattice.
class BodyContact {
public:
  BodyContact() = default;
  /// Where no line of the lattice leads from tissue to tissue across empty cells nothing is computed, and nothing watched.
  BodyContact(const TissueCells&, const LatticeShape&, const Eigen::Vector3d& spacing);

  bool IsPossible() const { return !points_.empty(); }
  /// Looks for the face before each node.
  void Find(const LatticeField<double>& displacement);

  double Energy(const LatticeField<double>& displacement) const;
  /// Adds the derivative of the energy, and returns the energy.
  double AddForce(const LatticeField<double>& displacement, LatticeField<double>& force) const;
  /// The second derivative of the energy, and \a grip times what keeps tissue from going farther along a face that it is pressed
  /// to in one step than the face, which turns meanwhile, makes good.
  std::vector<LatticeLink> Stiffness(const LatticeField<double>& displacement, double grip);
  /// By how many mm nodes of the softer side are too deep, and those with a force too far from where it comes from.
  struct Open {
    double entered = 0.0, apart = 0.0;
  };
  /// Takes over the forces at \a displacement, but not those of nodes that were not pushed at the last Stiffness().
  Open Update(const LatticeField<double>& displacement);

  /// What the last Update() found, mN: how nodes are pushed.
  std::vector<double>& Forces() { return forces_; }
  const std::vector<double>& Forces() const { return forces_; }

  /// The empty cell before a node that lies in other tissue, deeper than a twentieth of a cell, if there is one.
  std::optional<std::array<int, 3>> EnteredCell(const TissueCells& cells, const LatticeField<double>& displacement) const;

private:
  struct Face {
    std::array<std::array<int, 3>, 4> corners;
    std::array<std::ptrdiff_t, 4> at; ///< the corners, in fields
    int side = 0;                     ///< of its cell: the axis, times two, plus one where it looks up along it
    double shear = 0.0;
  };
  /// A node, as a part of the faces of one side.
  struct Point {
    std::array<int, 3> index{};
    std::ptrdiff_t at = 0;
    int side = 0;
    double area = 0.0, shear = 0.0;
    std::array<int, 3> front{}; ///< an empty cell before it
    // As of the last Find(). The weights are those of the corners of the face.
    std::ptrdiff_t face = -1;
    double weights[4] = {};
    double stiffness = 0.0; ///< mN/mm
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool isSoft = true;  ///< the softer of the two; of equals, the one that looks down its axis
    bool pushed = false; ///< at the last Stiffness()
  };
  double Distance(const Point& point, const LatticeField<double>& displacement) const;
  Eigen::Vector3d Place(const std::array<int, 3>& index, std::ptrdiff_t at, const LatticeField<double>& displacement) const
  {
    return spacing_.cwiseProduct(Eigen::Vector3d(index[0], index[1], index[2])) + displacement.Get(at);
  }

  Eigen::Vector3d spacing_ = Eigen::Vector3d::Ones();
  std::vector<Face> faces_;
  std::vector<std::array<std::ptrdiff_t, 4>> pointsOf_; ///< by face, of its corners
  std::vector<Point> points_;
  std::vector<double> forces_;
};

} // namespace echorama
