// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Calibration/HandEye.h"
#include <vector>

namespace echorama {

/// How the sensor and the volume moved between two scans: A C = C B, with A = S_i^-1 S_j and B = M_i^-1 M_j (dissertation
/// eq. 4.4).
struct HandEyeMotion {
  Pose sensor = Pose::Identity(); ///< A
  Pose volume = Pose::Identity(); ///< B
};

/// The motions between all pairs of scans, n (n - 1) / 2, not only between neighbours: a short way round is not better than a
/// long one, and each says something. \throws Error(NotPossible) for fewer than two pairs, as all that need them.
std::vector<HandEyeMotion> HandEyeMotions(const std::vector<HandEyePair>& pairs);

/// The turns of a motion as rotation vectors, whose signs belong together.
struct HandEyeTurn {
  Eigen::Vector3d a, b;                                      ///< of A and B
  static Eigen::Vector4d Quaternion(const Eigen::Vector3d&); ///< sin(angle / 2) axis, cos(angle / 2)
};
std::vector<HandEyeTurn> HandEyeTurns(const std::vector<HandEyeMotion>& motions);

/// The rotation of C from R_A R_C = R_C R_B in all nine numbers, linear, made a rotation (Andreff, Horaud, Espiau 1999).
Eigen::Matrix3d AndreffRotation(const std::vector<HandEyeMotion>& motions);

/// C of this rotation, with its translation by linear least squares, and O, the mean of what each scan says of it, given C.
HandEyeSolution HandEyeSolutionOf(const Eigen::Matrix3d& rotation, const std::vector<HandEyeMotion>& motions,
                                  const std::vector<HandEyePair>& pairs);

///@{
/// The closed forms that the search for the maximum likelihood starts from: the rotation that takes the rotation vectors of B
/// closest to those of A (Park and Martin 1994), and dual quaternions, rotation and translation together (Daniilidis 1999).
///
/// Nothing is refused: too little motion gives a rigid answer without meaning, which CalibrateHandEye finds out.
/// Cost: quadratic in the number of scans; 20 scans take some 0.05 ms.
HandEyeSolution SolveHandEyeParkMartin(const std::vector<HandEyePair>& pairs);
HandEyeSolution SolveHandEyeDaniilidis(const std::vector<HandEyePair>& pairs);
///@}

/// C and O from all scans at once, without motions (Shah 2013): the rotations are the leading singular vectors of the sum of the
/// Kronecker products of M_i and S_i, made rotations. Linear in the number of scans and blind to the sign of a turn by 180
/// degrees, so a start that does not fail where the others may. Two scans are enough for an answer, three for a meaning.
HandEyeSolution SolveHandEyeByKronecker(const std::vector<HandEyePair>& pairs);

} // namespace echorama
