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
/// long one, and each says something.
std::vector<HandEyeMotion> HandEyeMotions(const std::vector<HandEyePair>& pairs);

/// C and O by one of the closed forms. O is the mean of what each scan says of it, given C.
///
/// Nothing is refused: too little motion gives a rigid answer without meaning, which CalibrateHandEye finds out.
/// \throws Error(InvalidParameter) for MaximumLikelihood, which is none; Error(NotPossible) for fewer than two pairs.
/// Cost: quadratic in the number of scans; 20 scans take some 0.05 ms.
HandEyeSolution SolveHandEyeClosedForm(HandEyeMethod method, const std::vector<HandEyePair>& pairs);

/// C and O from all scans at once, without motions (Shah 2013): the rotations are the leading singular vectors of the sum of the
/// Kronecker products of M_i and S_i, made rotations. Linear in the number of scans and blind to the sign of a turn by 180
/// degrees, so a start that does not fail where the others may. Two scans are enough for an answer, three for a meaning.
HandEyeSolution SolveHandEyeByKronecker(const std::vector<HandEyePair>& pairs);

} // namespace echorama
