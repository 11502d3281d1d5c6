// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEyeModel.h"
#include <vector>

namespace echorama {

/// What residuals say of the noise beyond its size: the ratio of shifts, turns of the sensor and turns of the alignments, and the
/// point about which alignments turn.
struct HandEyeComponents {
  bool ratio = false, centre = false; ///< which of the two is estimated; when neither is, nothing below counts
  HandEyeNoise noise;
  HandEyeSolution solution;                         ///< maximum likelihood with that noise
  HandEyeMatrix covariance = HandEyeMatrix::Zero(); ///< of the step; the noise being known from few residuals is in it
  double degreesOfFreedom = 0.0;                    ///< those that the target's part of it has
};

/// Variance components by restricted maximum likelihood, from the scans with use[scan] != 0.
///
/// The noise of \a model itself does not count; that \a stated turns about the target. What is stated as zero stays zero. A ratio
/// is estimated only where the likelihood contradicts the one stated, beyond what chance does once in a thousand, and then pulled
/// towards it as if each factor were known to exp(+-1); so is the centre. Few scans rarely contradict: give eight at least. Cost:
/// some five to twenty refinements; linear in the number of scans.
HandEyeComponents EstimateHandEyeComponents(HandEyeModel model, const HandEyeNoise& stated, const HandEyeSolution& start,
                                            const std::vector<char>& use);

} // namespace echorama
