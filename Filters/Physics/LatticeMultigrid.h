// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Physics/LatticeMatrix.h"
#include <Eigen/Cholesky>
#include <utility>

namespace echorama {

/// A spring between nodes that may lie far apart in a lattice: it resists the sum of weights * x over them.
struct LatticeLink {
  std::vector<std::pair<std::array<int, 3>, double>> nodes; ///< with their weights
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();      ///< symmetric, with no negative eigenvalue
};

/// Over all nodes, slice by slice, so that it does not depend on the number of threads.
double SumOfProducts(const LatticeField<float>& a, const LatticeField<float>& b);

/// Solves A x = b on a lattice by conjugate gradients, preconditioned by one V-cycle: Chebyshev smoothing over the blocks of the
/// nodes, coarse matrices by the Galerkin product, the coarsest level by Cholesky. Nodes that are fixed (live = 0) or that no
/// entry of A reaches keep x = 0. The result does not depend on the number of threads.
class LatticeMultigrid {
public:
  /// \param spacing axes whose spacing is well above the least are coarsened later than the others
  LatticeMultigrid(const std::array<int, 3>& nodes, const Eigen::Vector3d& spacing, std::vector<float> live);

  /// To be filled; then Prepare().
  LatticeMatrix& Matrix() { return levels_.front().matrix; }
  /// What Prepare() adds to the matrix.
  void SetLinks(std::vector<LatticeLink> links) { links_ = std::move(links); }
  /// Builds the coarse levels from the matrix.
  void Prepare();
  /// Adds to the own block of a node; coarse levels stay as they are, which costs steps when much is changed.
  void ChangeOwn(const std::array<int, 3>& node, const Eigen::Matrix3f& change);

  struct Result {
    int steps = 0;
    bool isConvex = true;   ///< false: a direction of negative curvature was met, and x is what was found before it
    double reduction = 1.0; ///< of the residual, in the norm of the preconditioner
  };
  /// x = about A^-1 b, to a residual that is \a tolerance of the first one.
  Result Solve(const LatticeField<float>& b, LatticeField<float>& x, double tolerance, int maximumSteps,
               const Progress& progress = {});

private:
  struct Level {
    LatticeMatrix matrix;
    PackedLatticeMatrix packed;
    std::vector<LatticeMatrix> between;                  ///< coarser along some of the axes, on the way to the next level
    std::array<bool, 3> halved{};                        ///< axes along which the next level is coarser
    double largest = 0.0;                                ///< eigenvalue of inverse * A, estimated from above
    LatticeField<float> right, value, other, step, mode; ///< scaled, as the packed matrix has it
  };
  void AddLinks();
  void EstimateLargest(Level& level);
  void Smooth(Level& level, bool fromZero);
  void Restrict(const Level& fine, Level& coarse);
  void Prolong(const Level& coarse, Level& fine);
  void SolveCoarsest();
  void Cycle(std::size_t level);
  void Cycle(); ///< correction = one V-cycle for the residual: the preconditioner, with packed matrices

  std::vector<float> live_;
  std::vector<Level> levels_;
  Eigen::LLT<Eigen::MatrixXd> coarsest_;
  std::vector<std::ptrdiff_t> unknowns_; ///< nodes of the coarsest level
  /// Between two nodes that are no neighbours: what the matrix has too much of, the energy of x1 - sign * x2.
  struct Apart {
    std::ptrdiff_t at[2];
    float sign;
    Eigen::Matrix3f stiffness;
  };
  std::vector<LatticeLink> links_;
  std::vector<Apart> apart_;
  LatticeField<float> residual_, direction_, product_, correction_;
};

} // namespace echorama
