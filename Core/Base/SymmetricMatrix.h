// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>

// Small dense symmetric matrices. Compiled once for all sizes: Eigen unrolls its factorisations for every fixed size, which takes
// the compiler seconds each and gains nothing where a matrix is factorised once per step of a fit.
namespace echorama {

/// X of A X = B for a symmetric, positive semidefinite A (LDL^T); where A is singular, one of the
/// solutions.
Eigen::MatrixXd SolveSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b);

/// The inverse of a symmetric, positive definite matrix.
Eigen::MatrixXd InverseOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a);

/// Of a symmetric matrix: eigenvalues, ascending, and orthonormal eigenvectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen EigenOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a);

} // namespace echorama
