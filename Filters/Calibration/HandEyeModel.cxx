// SPDX-License-Identifier: BSD-3-Clause
// With T the shift to the target, the residual of a scan is e = Log F, F = T^-1 C^-1 S^-1 O M T, the identity when all fits.
// Moving C by Exp(c) about the target and O by Exp(o) about the middle gives Exp(-c) F Exp(Ad o), where Ad belongs to the scan
// and is made once. So the derivatives are -J_l^-1(e) and J_r^-1(e) Ad, of which the first three terms of the series are taken.
//
// Noise s of S, S = S* Exp(s), and m of M about the target, M T = M* T Exp(m), give e = m - Ad((C T)^-1) s to first order; noise
// about another centre c is m = Ad(c - target) m'.
//
// Twelve unknowns and six residuals per scan: the normal matrix is made in some 0.3 microseconds per scan. The weights
// depend on C through the lever; they follow it from step to step and are not differentiated, as in iteratively weighted least
// squares.
#include "Filters/Calibration/HandEyeModel.h"
#include "Core/Base/Angles.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Cholesky>

namespace echorama {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// ad(e): the derivative of the adjoint.
Matrix6 SmallAdjoint(const Twist& e)
{
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = Hat(e.tail<3>());
  m.topRightCorner<3, 3>() = Hat(e.head<3>());
  return m;
}

Matrix6 CovarianceOf(const PoseNoise& noise)
{
  const double radians = noise.degrees * RadiansPerDegree;
  Matrix6 m = Matrix6::Zero();
  m.diagonal().head<3>().setConstant(noise.mm * noise.mm);
  m.diagonal().tail<3>().setConstant(radians * radians);
  return m;
}

} // namespace

Eigen::Matrix<double, 6, 6> Adjoint(const Pose& pose)
{
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = pose.linear();
  m.topRightCorner<3, 3>() = Hat(pose.translation()) * pose.linear();
  return m;
}

HandEyeModel::HandEyeModel(const std::vector<HandEyePair>& pairs, const HandEyeNoise& noise, const Eigen::Vector3d& target,
                           int middleOf)
  : noise_(noise), target_(target)
{
  const std::size_t within = middleOf > 0 ? static_cast<std::size_t>(middleOf) : pairs.size();
  for (std::size_t i = 0; i < within; ++i)
    middle_ += pairs[i].volumeToWorld * target / static_cast<double>(within);
  scans_.reserve(pairs.size());
  for (const HandEyePair& pair : pairs) {
    Scan scan;
    scan.trackerToSensor = pair.sensorToTracker.inverse();
    scan.targetToWorld = pair.volumeToWorld * Eigen::Translation3d(target);
    scan.worldToTarget = Adjoint(scan.targetToWorld.inverse() * Eigen::Translation3d(middle_));
    scans_.push_back(scan);
  }
}

Twist HandEyeModel::Residual(int scan, const HandEyeSolution& solution) const
{
  const Scan& s = scans_[static_cast<std::size_t>(scan)];
  const Pose& C = solution.volumeToSensor;
  const Pose byAlignment = s.trackerToSensor * solution.worldToTracker * s.targetToWorld; // target to sensor
  Pose open = Pose::Identity();
  open.linear() = C.linear().transpose() * byAlignment.linear();
  open.translation() = C.linear().transpose() * (byAlignment.translation() - C * target_);
  return Log(open);
}

Matrix6 HandEyeModel::Covariance(const Pose& volumeToSensor) const
{
  const Matrix6 lever = Adjoint(Pose(volumeToSensor * Eigen::Translation3d(target_)).inverse());
  const Matrix6 turn = Adjoint(Pose(Eigen::Translation3d(noise_.centre - target_)));
  return lever * CovarianceOf(noise_.sensor) * lever.transpose() + turn * CovarianceOf(noise_.volume) * turn.transpose();
}

Eigen::Matrix<double, 6, 12> HandEyeModel::Jacobian(int scan, const Twist& residual) const
{
  const Matrix6 ad = SmallAdjoint(residual), even = Matrix6::Identity() + ad * ad / 12.0;
  Eigen::Matrix<double, 6, 12> jacobian;
  jacobian.leftCols<6>() = 0.5 * ad - even;
  jacobian.rightCols<6>().noalias() = (even + 0.5 * ad) * scans_[static_cast<std::size_t>(scan)].worldToTarget;
  return jacobian;
}

HandEyeSolution HandEyeModel::Moved(const HandEyeSolution& solution, const HandEyeStep& step) const
{
  const auto about = [](const Pose& pose, const Eigen::Vector3d& centre, const Twist& twist) {
    return Pose(pose * Eigen::Translation3d(centre) * Exp(twist) * Eigen::Translation3d(-centre));
  };
  return {about(solution.volumeToSensor, target_, step.head<6>()), about(solution.worldToTracker, middle_, step.tail<6>())};
}

HandEyeModel::Fit HandEyeModel::Refine(const HandEyeSolution& start, const std::vector<char>& use, double scale,
                                       int iterations) const
{
  const std::size_t count = scans_.size();
  const double soft = 6.0 * scale * scale;
  Matrix6 weight = Matrix6::Zero();
  std::vector<Twist> residuals(count);
  Fit fit;
  const auto evaluate = [&](const HandEyeSolution& solution, std::vector<double>& chiSquare, std::vector<Twist>& twists) {
    double cost = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      twists[i] = Residual(static_cast<int>(i), solution);
      chiSquare[i] = twists[i].dot(weight * twists[i]);
      if (use[i])
        cost += scale > 0.0 ? soft * std::log1p(chiSquare[i] / soft) : chiSquare[i];
    }
    return cost;
  };
  fit.solution = start;
  fit.chiSquare.resize(count);
  std::vector<double> chiSquare(count);
  std::vector<Twist> twists(count);
  double damping = 1e-6;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    weight = InverseOfSymmetric(Covariance(fit.solution.volumeToSensor));
    fit.cost = evaluate(fit.solution, fit.chiSquare, residuals);
    HandEyeMatrix normal = HandEyeMatrix::Zero();
    HandEyeStep gradient = HandEyeStep::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      if (!use[i])
        continue;
      const double trust = scale > 0.0 ? 1.0 / (1.0 + fit.chiSquare[i] / soft) : 1.0;
      const Eigen::Matrix<double, 6, 12> jacobian = Jacobian(static_cast<int>(i), residuals[i]);
      const Eigen::Matrix<double, 6, 12> weighted = trust * (weight * jacobian);
      normal.noalias() += jacobian.transpose() * weighted;
      gradient.noalias() += weighted.transpose() * residuals[i];
    }
    bool moved = false;
    HandEyeStep step;
    while (!moved && damping < 1e8) {
      HandEyeMatrix damped = normal;
      damped.diagonal() *= 1.0 + damping;
      step = -SolveSymmetric(damped, gradient);
      const HandEyeSolution next = Moved(fit.solution, step);
      moved = step.allFinite() && evaluate(next, chiSquare, twists) <= fit.cost * (1.0 + 1e-14);
      if (moved) {
        fit.solution = next;
        damping = std::max(damping * 0.1, 1e-12);
      } else
        damping = std::max(damping * 10.0, 1e-6);
    }
    // Far below any noise: 1e-7 of its standard deviation.
    if (!moved || step.dot(normal * step) < 1e-14)
      break;
  }
  // Orthonormal to the last bit after many products.
  for (Pose* pose : {&fit.solution.volumeToSensor, &fit.solution.worldToTracker})
    pose->linear() = Eigen::Quaterniond(pose->linear()).normalized().toRotationMatrix();
  weight = InverseOfSymmetric(Covariance(fit.solution.volumeToSensor));
  fit.cost = evaluate(fit.solution, fit.chiSquare, residuals);
  return fit;
}

HandEyeMatrix HandEyeModel::Information(const HandEyeSolution& solution, const std::vector<char>& use) const
{
  const Matrix6 weight = InverseOfSymmetric(Covariance(solution.volumeToSensor));
  HandEyeMatrix information = HandEyeMatrix::Zero();
  for (std::size_t i = 0; i < scans_.size(); ++i)
    if (use[i]) {
      const Eigen::Matrix<double, 6, 12> jacobian = Jacobian(static_cast<int>(i), Residual(static_cast<int>(i), solution));
      information.noalias() += jacobian.transpose() * weight * jacobian;
    }
  return information;
}

HandEyeMatrix HandEyeModel::CovarianceOfStep(const HandEyeSolution& solution, const std::vector<char>& use) const
{
  return InverseOfSymmetric(Information(solution, use));
}

double HandEyeModel::PredictedChiSquare(int scan, const HandEyeSolution& solution, const HandEyeMatrix& covariance,
                                        bool used) const
{
  const Twist residual = Residual(scan, solution);
  const Eigen::Matrix<double, 6, 12> jacobian = Jacobian(scan, residual);
  // Whitened, the residual's covariance is I - H for a scan in the fit, I + H for one outside it. Directions that the scan
  // alone decides (H = 1) cannot contradict it.
  const Eigen::LLT<Matrix6> noise(Covariance(solution.volumeToSensor));
  const Eigen::Matrix<double, 6, 12> white = noise.matrixL().solve(jacobian);
  const Twist whiteResidual = noise.matrixL().solve(residual);
  const Matrix6 followed = white * covariance * white.transpose(), own = Matrix6::Identity() + (used ? -1.0 : 1.0) * followed;
  const SymmetricEigen axes = EigenOfSymmetric(own);
  double chiSquare = 0.0;
  for (int i = 0; i < 6; ++i)
    if (axes.values[i] > 1e-3)
      chiSquare += std::pow(axes.vectors.col(i).dot(whiteResidual), 2) / axes.values[i];
  return chiSquare;
}

HandEyeMatrix HandEyeModel::CovarianceOfPoses(const HandEyeMatrix& covarianceOfStep) const
{
  HandEyeMatrix shift = HandEyeMatrix::Zero();
  shift.topLeftCorner<6, 6>() = Adjoint(Pose(Eigen::Translation3d(target_)));
  shift.bottomRightCorner<6, 6>() = Adjoint(Pose(Eigen::Translation3d(middle_)));
  return shift * covarianceOfStep * shift.transpose();
}

} // namespace echorama
