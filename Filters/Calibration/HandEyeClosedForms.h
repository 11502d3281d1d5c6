// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEye.h"
#include <vector>

namespace echorama {

/// C and O from all scans at once, where the search for the maximum likelihood starts (Shah 2013): the rotations are the leading
/// singular vectors of the sum of the Kronecker products of M_i and S_i, made rotations; then both translations by linear least
/// squares. Linear in the number of scans and blind to the sign of a turn by 180 degrees. Two scans are enough for an answer,
/// three for a meaning; too little motion gives a rigid answer without one, which CalibrateHandEye finds out.
/// \throws Error(NotPossible) for fewer than two pairs
HandEyeSolution SolveHandEyeByKronecker(const std::vector<HandEyePair>& pairs);

} // namespace echorama
