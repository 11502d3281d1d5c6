// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Calibration/HandEyeClosedForms.h"
#include "Core/Base/Error.h"
#include "Core/Base/SymmetricMatrix.h"

namespace echorama {

HandEyeSolution SolveHandEyeByKronecker(const std::vector<HandEyePair>& pairs)
{
  if (pairs.size() < 2)
    throw Error(Error::Kind::NotPossible, "hand-eye calibration: a motion needs two scans at least");
  // R_S R_C R_M^T = R_O: the sum over scans of M kron S takes vec(R_C) to n vec(R_O).
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  Matrix9 sum = Matrix9::Zero();
  for (const HandEyePair& pair : pairs)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        sum.block<3, 3>(3 * row, 3 * column) += pair.volumeToWorld.linear()(row, column) * pair.sensorToTracker.linear();
  HandEyeSolution solution;
  Pose &C = solution.volumeToSensor, &O = solution.worldToTracker;
  const Matrix9 squared = sum.transpose() * sum;
  const Eigen::VectorXd leading = EigenOfSymmetric(squared).vectors.col(8);
  const Eigen::Matrix3d numbers = Eigen::Map<const Eigen::Matrix3d>(leading.data()); // up to a factor of either sign
  C.linear() = NearestRotation(numbers.determinant() < 0.0 ? Eigen::Matrix3d(-numbers) : numbers);
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  for (const HandEyePair& pair : pairs)
    turns += pair.sensorToTracker.linear() * C.linear() * pair.volumeToWorld.linear().transpose();
  O.linear() = NearestRotation(turns);
  // R_S t_C - t_O = R_O t_M - t_S, linear in both translations. With the mean over scans taken off, only t_C is left.
  const double count = static_cast<double>(pairs.size());
  Eigen::Matrix3d meanTurn = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const HandEyePair& pair : pairs) {
    meanTurn += pair.sensorToTracker.linear() / count;
    mean += (O.linear() * pair.volumeToWorld.translation() - pair.sensorToTracker.translation()) / count;
  }
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const HandEyePair& pair : pairs) {
    const Eigen::Matrix3d turn = pair.sensorToTracker.linear() - meanTurn;
    normal += turn.transpose() * turn;
    right += turn.transpose() * (O.linear() * pair.volumeToWorld.translation() - pair.sensorToTracker.translation() - mean);
  }
  C.translation() = SolveSymmetric(normal, right);
  O.translation() = meanTurn * C.translation() - mean;
  return solution;
}

} // namespace echorama
