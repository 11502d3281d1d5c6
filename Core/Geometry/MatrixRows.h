// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Geometry>

namespace echorama {

/// A transform's numbers row by row, as vtkMatrix4x4 and files hold them: MatrixRows(pose.matrix()).data().
using MatrixRows = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// A transform (Pose, Eigen::Affine3d) of 16 such numbers.
template <class Transform>
Transform FromRows(const double* rows)
{
  Transform transform;
  transform.matrix() = Eigen::Map<const MatrixRows>(rows);
  return transform;
}

} // namespace echorama
