// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Calibration/HandEye.h"
#include <vector>

namespace echorama {

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
