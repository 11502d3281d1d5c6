// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// A rows x columns matrix of numbers between -1 and 1.
Eigen::MatrixXd Numbers(Random& random, Eigen::Index rows, Eigen::Index columns)
{
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&random]() { return random.Uniform(-1.0, 1.0); });
}

TEST(SymmetricMatrix, SolvesWhatWasMultiplied)
{
  Random random(1);
  for (Eigen::Index size = 1; size <= 12; ++size) {
    const Eigen::MatrixXd root = Numbers(random, size + 3, size), a = root.transpose() * root;
    const Eigen::MatrixXd x = Numbers(random, size, 2);
    EXPECT_LT((SolveSymmetric(a, a * x) - x).norm(), 1e-9) << size;
    EXPECT_LT((InverseOfSymmetric(a) * a - Eigen::MatrixXd::Identity(size, size)).norm(), 1e-9) << size;
  }
  // Matrices of a fixed size, and columns of others.
  const Eigen::Matrix3d a = Eigen::Vector3d(1.0, 2.0, 4.0).asDiagonal();
  const Eigen::Vector3d x = SolveSymmetric(a, Eigen::Vector3d(1.0, 2.0, 4.0));
  EXPECT_LT((x - Eigen::Vector3d::Ones()).norm(), 1e-15);
}

TEST(SymmetricMatrix, ASingularOneIsSolvedWhereItCanBe)
{
  const Eigen::Vector3d axis(1.0, 2.0, -2.0);
  const Eigen::Matrix3d a = axis * axis.transpose();
  const Eigen::Vector3d right = 5.0 * axis;
  const Eigen::Vector3d x = SolveSymmetric(a, right);
  ASSERT_TRUE(x.allFinite());
  EXPECT_LT((a * x - right).norm(), 1e-13);
}

TEST(SymmetricMatrix, EigenvectorsRiseWithTheirValues)
{
  Random random(2);
  for (Eigen::Index size = 1; size <= 12; ++size) {
    const Eigen::MatrixXd some = Numbers(random, size, size), a = some + some.transpose();
    const SymmetricEigen eigen = EigenOfSymmetric(a);
    EXPECT_LT((a * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-12) << size;
    EXPECT_LT((eigen.vectors.transpose() * eigen.vectors - Eigen::MatrixXd::Identity(size, size)).norm(), 1e-12) << size;
    for (Eigen::Index i = 1; i < size; ++i)
      EXPECT_LE(eigen.values[i - 1], eigen.values[i]) << size;
  }
}

} // namespace
