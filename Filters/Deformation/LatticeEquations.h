// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// Normal equations over the control points of a lattice, each of which is coupled with those at most three away along each axis:
/// a symmetric matrix, as a stencil of 7^3 blocks of 3 x 3 per control point, and a right side.
class LatticeEquations {
public:
  using Vectors = std::vector<Eigen::Vector3d>;
  static constexpr int Stencil = 343;
  using Penalty = std::array<double, Stencil>; ///< a quadratic penalty whose entries depend on the offset alone, by Entry()

  explicit LatticeEquations(const std::array<int, 3>& n)
    : n_(n), count_(static_cast<std::ptrdiff_t>(n[0]) * n[1] * n[2]),
      blocks_(static_cast<std::size_t>(count_) * Stencil * 6, 0.0),
      right_(static_cast<std::size_t>(count_), Eigen::Vector3d::Zero())
  {
  }

  static int Entry(int di, int dj, int dk) { return ((dk + 3) * 7 + dj + 3) * 7 + di + 3; }
  std::ptrdiff_t Node(int i, int j, int k) const { return (static_cast<std::ptrdiff_t>(k) * n_[1] + j) * n_[0] + i; }
  /// xx, xy, xz, yy, yz, zz of the block that couples a node with the one that far away.
  double* Block(std::ptrdiff_t node, int di, int dj, int dk) { return blocks_.data() + 6 * (node * Stencil + Entry(di, dj, dk)); }
  Vectors& Right() { return right_; }

  /// Adds the penalty, and its pull on the coefficients.
  void AddPenalty(const Penalty& entries, const Vectors& coefficients);
  double PenaltyOf(const Penalty& entries, const Vectors& coefficients) const;

  /// By conjugate gradients, preconditioned by the blocks of the diagonal, which are raised by \a damping of themselves.
  Vectors Solve(double damping) const;

private:
  Eigen::Matrix3d Diagonal(std::ptrdiff_t node) const;

  // Calls body(other node, di, dj, dk) for all nodes that a node is coupled with.
  template <class Body>
  void Neighbours(std::ptrdiff_t node, const Body& body) const
  {
    const int i = static_cast<int>(node % n_[0]), j = static_cast<int>(node / n_[0] % n_[1]),
              k = static_cast<int>(node / n_[0] / n_[1]);
    for (int dk = std::max(-3, -k); dk <= std::min(3, n_[2] - 1 - k); ++dk)
      for (int dj = std::max(-3, -j); dj <= std::min(3, n_[1] - 1 - j); ++dj)
        for (int di = std::max(-3, -i); di <= std::min(3, n_[0] - 1 - i); ++di)
          body(Node(i + di, j + dj, k + dk), di, dj, dk);
  }

  std::array<int, 3> n_;
  std::ptrdiff_t count_;
  std::vector<double> blocks_;
  Vectors right_;
};

} // namespace echorama
