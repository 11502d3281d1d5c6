// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEye.h"
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

/// A closed form as published; all weigh every pair the same and know of no outliers.
struct HandEyeClosedForm {
  const char* name;
  HandEyeSolution (*solve)(const std::vector<HandEyePair>& pairs);
};

/// "shiu-ahmad" (dissertation 4.1.2; 1989): rotation, then translation, linear; "tsai-lenz" (1989): modified Rodrigues vectors;
/// "park-martin" (1994): logarithms of rotations; "horaud" (with Dornaika, 1995): unit quaternions; "daniilidis" (1999): dual
/// quaternions; "andreff" (1999): linear in the nine numbers of the rotation, made rigid, then translation.
const std::vector<HandEyeClosedForm>& HandEyeClosedForms();

} // namespace echorama
