// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/BodyContact.h"
#include "Filters/Physics/ProbeContact.h"

namespace echorama {

/// What a solution took.
struct TissueWork {
  int newtonSteps = 0, linearSteps = 0, loadSteps = 0;
  bool energyGrew = false; ///< in any Newton step: must not be

  TissueWork& operator+=(const TissueWork& other);
};

/// Tissue on one lattice and what acts on it: finds the state of rest by Newton's method. In the frame of the lattice.
class TissueSolver {
public:
  /// \param live 1 for nodes that may move, like a component of a field. \param gravity m/s^2
  TissueSolver(TissueCells cells, const LatticeShape& shape, const Eigen::Vector3d& spacing, std::vector<float> live,
               const Eigen::Vector3d& gravity);

  /// Looks for the state of rest from the present one (\a isGuess: which is far from any, in its pressures above all). \returns
  /// false, and the present state as it was, when there is none that turns no cell inside out and has no probe between its nodes,
  /// or when it is not found in \a maximumSteps
  bool Solve(bool isGuess, double toleranceMm, int maximumSteps, TissueWork& work, const Progress& progress);

  const TissueCells& Cells() const { return cells_; }
  const LatticeShape& Shape() const { return shape_; }
  const Eigen::Vector3d& Spacing() const { return spacing_; }
  const std::vector<float>& Live() const { return live_; }
  LatticeField<double>& Displacement() { return displacement_; }
  const LatticeField<double>& Displacement() const { return displacement_; }
  ProbeContact& Contact() { return contact_; }
  const ProbeContact& Contact() const { return contact_; }
  const BodyContact& Bodies() const { return bodies_; }
  /// Where it is, and what pushes it.
  struct State {
    LatticeField<double> displacement;
    std::vector<ProbeContact::Node> contact;
    std::vector<double> bodies;
  };
  State Now() const { return {displacement_, contact_.Nodes(), bodies_.Forces()}; }
  void Return(const State& state);
  double LeastVolume() const { return LeastTissueVolume(cells_, spacing_, displacement_); }

private:
  double TissueTerms(const LatticeField<double>& displacement, LatticeField<double>& force) const;
  double ContactEnergy(const LatticeField<double>& displacement) const
  {
    return contact_.Energy(displacement) + bodies_.Energy(displacement);
  }
  void MakeMatrix(bool isNew, bool tame, bool withBends);

  TissueCells cells_;
  LatticeShape shape_;
  Eigen::Vector3d spacing_;
  std::vector<float> live_;
  LatticeField<double> weight_; ///< mN
  LatticeField<double> displacement_;
  ProbeContact contact_;
  BodyContact bodies_;
  LatticeMultigrid multigrid_;
  std::vector<LatticeLink> links_;            ///< between pieces of tissue, in the matrix
  std::vector<Eigen::Matrix3f> own_, pushed_; ///< in the matrix, at the nodes of the skin: of the tissue, and of the contact
};

} // namespace echorama
