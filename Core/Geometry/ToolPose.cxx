// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/ToolPose.h"
#include <Eigen/SVD>

namespace echorama {

std::string ToolTransformName(const std::string& name)
{
  std::string clean = name;
  for (char& c : clean)
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r')
      c = '_';
  if (const auto frames = FramesOf(clean))
    return frames->first + "To" + frames->second;
  if (clean.empty())
    return "ToolToTracker";
  if (clean[0] >= 'a' && clean[0] <= 'z')
    clean[0] = static_cast<char>(clean[0] - 'a' + 'A');
  return clean + "ToTracker";
}

bool NearestPose(const Eigen::Matrix4d& matrix, Pose& pose)
{
  if (!matrix.allFinite() || (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    return false;
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  if (!IsRotation(turn, 1e-3))
    return false;
  if (IsRotation(turn, 1e-13)) { // one already, and stays so to the last bit however often it is written and read
    pose.linear() = turn;
  } else {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turn, Eigen::ComputeFullU | Eigen::ComputeFullV);
    pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  }
  pose.translation() = matrix.topRightCorner<3, 1>();
  pose.makeAffine();
  return true;
}

} // namespace echorama
