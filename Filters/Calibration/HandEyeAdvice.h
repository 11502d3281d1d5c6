// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEyeModel.h"
#include <vector>

namespace echorama {

/// Which one further pose would make the 95% region of the target smallest: turns of the volume about its target, from the mean
/// of the poses there are, about 13 axes (the volume's own and those between them), by 15, 30, 45 and 60 degrees either way. The
/// best three with different axes, the best first. \a covariance: of the step, at the present solution. \a degreesOfFreedom: of
/// the residuals that the noise was estimated from, 0 when it was stated; a further scan brings six more.
std::vector<HandEyeAdvice> AdviseHandEye(const std::vector<HandEyePair>& pairs, const std::vector<char>& inlier,
                                         const HandEyeSolution& solution, const HandEyeMatrix& covariance,
                                         const HandEyeNoise& noise, const Eigen::Vector3d& target, int degreesOfFreedom);

} // namespace echorama
