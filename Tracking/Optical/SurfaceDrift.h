// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace echorama {

/// A mark that was visited again: where its light is seen, against where the calibration expects it.
struct DriftPoint {
  int mark = 0;                                         ///< its number
  Eigen::Vector2d difference = Eigen::Vector2d::Zero(); ///< seen minus expected, px
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero(); ///< that it has by chance, px^2
  /// How the expected place changes when the camera moves by 1 mm along the axes of the shell, and turns by 1 radian about them.
  Eigen::Matrix<double, 2, 6> motion = Eigen::Matrix<double, 2, 6>::Zero();
};

struct SurfaceDrift {
  enum class Verdict {
    Holds,     ///< the differences are such as chance makes them
    Moved,     ///< the camera has moved in the shell: calibrate again
    WrongMark, ///< one mark does not fit to the others: repeat it
    Changed,   ///< more is different than where the camera is: another shell, lens or picture; calibrate again
  };
  Verdict verdict = Verdict::Holds;
  double chiSquared = 0.0;  ///< of all differences
  int degreesOfFreedom = 0; ///< 2 per mark
  double chance = 1.0;      ///< that they are as large when nothing has changed
  double rmsPx = 0.0;
  Eigen::Vector3d movedMm = Eigen::Vector3d::Zero(),
                  turned = Eigen::Vector3d::Zero();    ///< of Moved, in the shell's frame; radians
  double movedErrorMm = 0.0, turnedErrorDegrees = 0.0; ///< standard errors of these lengths
  int mark = 0;                                        ///< of WrongMark, and its distance
  double markPx = 0.0;
  std::string message; ///< the verdict as a sentence, and what to do
};

/// Whether a calibration still holds. \param significance the share of checks of an unchanged camera that may raise an alarm.
/// What explains the differences best is told by likelihood, less ln(number of differences) per unknown (BIC): six of a motion,
/// two of a wrong mark. \throws Error(NotPossible) for fewer than four marks, Error(BadInput), Error(InvalidParameter)
SurfaceDrift JudgeDrift(const std::vector<DriftPoint>& points, double significance = 1e-3);

/// The probability that a chi-squared of an even number of degrees of freedom exceeds \a value.
double ChiSquaredChance(double value, int evenDegrees);

} // namespace echorama
