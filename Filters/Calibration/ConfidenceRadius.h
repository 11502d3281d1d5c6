// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>

namespace echorama {

/// The radius of the sphere about an estimated point that holds the true one with the probability \a level.
///
/// The error is normal with the \a covariance, all three axes of which count. With \a degrees > 0 the covariance was scaled by
/// residuals with that many degrees of freedom, and the error has Student's distribution: few residuals make a larger sphere.
/// \a level in (0, 1).
double ConfidenceRadius(const Eigen::Matrix3d& covariance, int degrees = 0, double level = 0.95);

} // namespace echorama
