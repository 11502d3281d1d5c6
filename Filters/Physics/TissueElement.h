// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/LatticeMatrix.h"
#include <vector>

namespace echorama {

/// What the cells of a lattice resist with, cell by cell (x fastest, rows padded to whole lanes). All 0: nothing is there.
/// Stiffness in kPa, lengths in mm, so forces are in mN.
struct TissueCells {
  std::array<int, 3> cells{0, 0, 0};
  std::ptrdiff_t row = 0;
  std::vector<float> shear, bulk; ///< Lame's mu and lambda, kPa
  std::vector<float> density;     ///< g/cm^3

  TissueCells() = default;
  explicit TissueCells(const std::array<int, 3>& nodes);
  std::size_t At(int i, int j, int k) const
  {
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * cells[1] + j) * row + i);
  }
  bool IsTissue(int i, int j, int k) const
  {
    return i >= 0 && j >= 0 && k >= 0 && i < cells[0] && j < cells[1] && k < cells[2] && shear[At(i, j, k)] > 0.0f;
  }
};

/// The elastic energy of displacements of the nodes, mN mm, 0 at rest.
double TissueEnergy(const TissueCells&, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement);

/// Its derivative: what the nodes must be held with, mN. \returns the energy
double TissueForce(const TissueCells&, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement,
                   LatticeField<double>& force);

/// Its second derivative, mN/mm. \a tame: with pressures limited to what leaves nearly every cell stable, for states far from
/// rest.
void TissueStiffness(const TissueCells&, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement,
                     LatticeMatrix& matrix, bool tame);

/// The least relative volume of any part of a cell (one around each integration point): not positive where tissue is turned
/// inside out.
double LeastTissueVolume(const TissueCells&, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement);

/// The volume of all tissue over that at rest.
double TissueVolumeRatio(const TissueCells&, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement);

} // namespace echorama
