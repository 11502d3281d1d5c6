// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEye.h"
#include <vector>

namespace echorama {

/// A step of C and O: the twist of C about the target in the volume's axes, then that of O about the middle of the scans' targets
/// in the world's. Uncorrelated enough there to be well conditioned.
using HandEyeStep = Eigen::Matrix<double, 12, 1>;
using HandEyeMatrix = Eigen::Matrix<double, 12, 12>;

/// The statistics of S C = O M with noise on both sides.
///
/// The residual of a scan is the twist between the volume as the tracker places it, S C, and as the alignment does, O M, about
/// the target and in the volume's axes. The noise of M turns about its centre, which moves the target where that is another
/// place. The noise of S is turned into the volume's axes and carried along the lever from the sensor to the target: an error of
/// the sensor's angle moves the target, and does so together with the turn. So one full 6x6 covariance, which depends on C and is
/// the same for all scans, weighs the residuals.
class HandEyeModel {
public:
  /// At least one pair; rigid ones. The middle is that of the first \a middleOf pairs (0: all).
  HandEyeModel(const std::vector<HandEyePair>& pairs, const HandEyeNoise& noise, const Eigen::Vector3d& target, int middleOf = 0);

  void SetNoise(const HandEyeNoise& noise) { noise_ = noise; }

  int Count() const { return static_cast<int>(scans_.size()); }

  Twist Residual(int scan, const HandEyeSolution& solution) const;

  /// Of a residual, by the noise of both sides.
  Eigen::Matrix<double, 6, 6> Covariance(const Pose& volumeToSensor) const;

  /// The residual's derivative by a step.
  Eigen::Matrix<double, 6, 12> Jacobian(int scan, const Twist& residual) const;

  HandEyeSolution Moved(const HandEyeSolution& solution, const HandEyeStep& step) const;

  struct Fit {
    HandEyeSolution solution;
    std::vector<double> chiSquare; ///< of every scan's residual, also of those without weight
    double cost = 0.0;             ///< what was minimised
  };

  /// Minimises the sum over scans with use[scan] != 0 of chi^2 or, with \a scale > 0, of Cauchy's log(1 + chi^2 / 6 scale^2):
  /// then a scan that is far off counts for little. Levenberg-Marquardt; \a iterations at most.
  Fit Refine(const HandEyeSolution& start, const std::vector<char>& use, double scale = 0.0, int iterations = 60) const;

  /// Fisher's information on the step, from the scans with use[scan] != 0.
  HandEyeMatrix Information(const HandEyeSolution& solution, const std::vector<char>& use) const;

  /// Its inverse: the Cramer-Rao bound where the poses are the true ones, and the covariance of the estimate at its optimum.
  HandEyeMatrix CovarianceOfStep(const HandEyeSolution& solution, const std::vector<char>& use) const;

  /// chi^2 of a scan by the covariance of its own residual: one that the fit has used is smaller than the noise, since
  /// the fit followed it; one that it has not is larger, since the fit errs too. \a covariance: of the step; \a used: whether the
  /// scan was in the fit.
  double PredictedChiSquare(int scan, const HandEyeSolution& solution, const HandEyeMatrix& covariance, bool used) const;

  /// From the covariance of a step to that of twists behind the poses: C_true = C Exp(twist), and likewise O.
  HandEyeMatrix CovarianceOfPoses(const HandEyeMatrix& covarianceOfStep) const;

private:
  struct Scan {
    Pose trackerToSensor, targetToWorld;       // S^-1; M moved so that the target is the origin
    Eigen::Matrix<double, 6, 6> worldToTarget; // adjoint of the way from the middle of the world to the target
  };
  std::vector<Scan> scans_;
  HandEyeNoise noise_;
  Eigen::Vector3d target_, middle_ = Eigen::Vector3d::Zero();
};

/// The adjoint of a pose: takes twists on its right to twists on its left, P Exp(t) = Exp(Adjoint(P) t) P.
Eigen::Matrix<double, 6, 6> Adjoint(const Pose& pose);

} // namespace echorama
