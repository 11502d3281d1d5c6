// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>

namespace echorama {

/// Of something in a picture: x, y, their velocities, their accelerations; px and s.
using HandState = Eigen::Matrix<double, 6, 1>;
using HandCovariance = Eigen::Matrix<double, 6, 6>;

/// How what a hand holds goes on: it keeps its velocity, and its acceleration for a tenth of a second or so (Singer, 1970). So
/// turns are foretold, and a hand that stopped is not for long said to go on braking.
struct HandMotion {
  /// \param acceleration its standard deviation, px/s^2
  HandMotion(double seconds, double acceleration);

  HandCovariance step;  ///< of the state
  HandCovariance noise; ///< what is added to its covariance
};

} // namespace echorama
