// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/SymmetricMatrix.h"
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace echorama {

Eigen::MatrixXd SolveSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b)
{
  return a.ldlt().solve(b);
}

Eigen::MatrixXd InverseOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a)
{
  return SolveSymmetric(a, Eigen::MatrixXd::Identity(a.rows(), a.cols()));
}

SymmetricEigen EigenOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& a)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

} // namespace echorama
