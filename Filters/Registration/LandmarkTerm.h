// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/RigidTransform.h"
#include <string>
#include <vector>

namespace echorama {

/// One place that was found in two volumes: in mm, each in the frame of its volume.
struct LandmarkPair {
  std::string label;
  Eigen::Vector3d fixed, moving;
};

/// Landmarks of two volumes by their labels, in the order of the first. Labels that only one volume has are left out.
/// \throws Error(BadInput) that names the volume, for an empty label, a label twice in one volume, a position that is not finite
std::vector<LandmarkPair> PairLandmarks(const std::vector<Landmark>& fixed, const std::string& fixedName,
                                        const std::vector<Landmark>& moving, const std::string& movingName);

/// What is said against a pose, and how it changes with the twist (translation mm, rotation vector) that acts as
/// MotionAbout(centre, rotation, translation) * pose.
struct LandmarkLoss {
  double loss = 0.0; ///< the negative logarithm of the likelihood
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero(); ///< Gauss-Newton: also what is known of the pose
};

/// What landmarks that two volumes share tell of the pose of one beside the other. Differences along each axis are normal with
/// one standard deviation; those far beyond it count linearly instead of squared, so that a wrong landmark cannot drag the pose
/// away, but is seen to contradict it.
class LandmarkTerm {
public:
  LandmarkTerm() = default; ///< says nothing
  /// \param fixedToWorld where the fixed volume is, and stays \param sigmaMm of the difference, along each axis
  LandmarkTerm(const std::vector<LandmarkPair>& pairs, const Pose& fixedToWorld, double sigmaMm);

  bool Empty() const { return pairs_.empty(); }
  LandmarkLoss At(const Pose& movingToWorld, const Eigen::Vector3d& centre) const;

  /// The pose in which the landmarks fit best (least squares). What they leave open stays as it is at the start: one landmark
  /// moves, two also turn one line onto another by the shortest way, three and more say all, unless they lie on a line.
  Pose Nearest(const Pose& start) const;

  /// Whether the differences at a pose are such as chance makes them: all in all (chi squared), and each by itself (4 standard
  /// deviations). \param slackMm standard deviation of the pose itself
  bool Agrees(const Pose& movingToWorld, double slackMm = 0.0) const;

  /// The landmark that differs most, for people: "apex" is 12.3 mm off.
  std::string Worst(const Pose& movingToWorld) const;

private:
  std::vector<LandmarkPair> pairs_; ///< `fixed` in the world
  double sigmaMm_ = 1.0;
};

} // namespace echorama
