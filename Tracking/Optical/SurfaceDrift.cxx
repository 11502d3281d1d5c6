// SPDX-License-Identifier: BSD-3-Clause
#include "SurfaceDrift.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/SymmetricMatrix.h"
#include <cmath>
#include <Eigen/LU>
#include <limits>

namespace echorama {

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// A camera that moved by more has fallen out of its base. It keeps motions apart that few marks cannot tell.
constexpr double LikelyMoveMm = 20.0, LikelyTurn = 0.3;

double SquaresOf(const DriftPoint& point, const Eigen::Vector2d& difference)
{
  return difference.dot(point.covariance.inverse() * difference);
}

struct DriftMotion {
  Vector6d motion = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  double chiSquared = 0.0; // that it leaves
};

DriftMotion FitDriftMotion(const std::vector<DriftPoint>& points)
{
  Matrix6d information = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    information(i, i) = i < 3 ? 1.0 / (LikelyMoveMm * LikelyMoveMm) : 1.0 / (LikelyTurn * LikelyTurn);
  Vector6d right = Vector6d::Zero();
  for (const DriftPoint& point : points) {
    const Eigen::Matrix<double, 6, 2> weighted = point.motion.transpose() * point.covariance.inverse();
    information += weighted * point.motion;
    right += weighted * point.difference;
  }
  DriftMotion fit;
  fit.covariance = InverseOfSymmetric(information);
  fit.motion = fit.covariance * right;
  for (const DriftPoint& point : points)
    fit.chiSquared += SquaresOf(point, point.difference - point.motion * fit.motion);
  return fit;
}

// Standard error of the length of a vector.
double LengthError(const Eigen::Vector3d& vector, const Eigen::Matrix3d& covariance)
{
  const double length = vector.norm();
  return length > 0.0 ? std::sqrt(vector.dot(covariance * vector)) / length : 0.0;
}

} // namespace

double ChiSquaredChance(double value, int evenDegrees)
{
  if (!(value > 0.0))
    return 1.0;
  double term = std::exp(-0.5 * value), sum = 0.0;
  for (int k = 0; k < evenDegrees / 2; ++k) {
    sum += term;
    term *= 0.5 * value / (k + 1);
  }
  return std::min(sum, 1.0);
}

SurfaceDrift JudgeDrift(const std::vector<DriftPoint>& points, double significance)
{
  CheckRange("the significance of a drift check", significance, 1e-12, 0.5);
  if (points.size() < 4)
    throw Error(Error::Kind::NotPossible, Format("a drift check needs four marks at least, five are better; there are %d",
                                                 static_cast<int>(points.size())));
  SurfaceDrift drift;
  drift.degreesOfFreedom = 2 * static_cast<int>(points.size());
  double worst = 0.0;
  const DriftPoint* wrong = nullptr;
  for (const DriftPoint& point : points) {
    if (!point.difference.allFinite() || !point.covariance.allFinite() || !point.motion.allFinite() ||
        !(point.covariance.determinant() > 0.0) || !(point.covariance.trace() > 0.0))
      throw Error(Error::Kind::BadInput, Format("mark %d of a drift check is not finite, or has no covariance", point.mark));
    const double squares = SquaresOf(point, point.difference);
    drift.chiSquared += squares;
    drift.rmsPx += point.difference.squaredNorm() / static_cast<double>(points.size());
    if (squares > worst) {
      worst = squares;
      wrong = &point;
    }
  }
  drift.rmsPx = std::sqrt(drift.rmsPx);
  drift.chance = ChiSquaredChance(drift.chiSquared, drift.degreesOfFreedom);
  if (drift.chance >= significance) {
    drift.message =
        Format("the calibration holds: %d marks lie %.2f px (RMS) from where they are expected, which chance alone does "
               "in %.0f%% of such checks",
               static_cast<int>(points.size()), drift.rmsPx, 100.0 * drift.chance);
    return drift;
  }

  const DriftMotion fit = FitDriftMotion(points);
  const double cost = std::log(static_cast<double>(drift.degreesOfFreedom)); // of an unknown
  const double ofMotion = fit.chiSquared + 6.0 * cost, ofMark = drift.chiSquared - worst + 2.0 * cost;
  if (ofMark < ofMotion && ChiSquaredChance(drift.chiSquared - worst, drift.degreesOfFreedom - 2) >= significance) {
    drift.verdict = SurfaceDrift::Verdict::WrongMark;
    drift.mark = wrong->mark;
    drift.markPx = wrong->difference.norm();
    drift.message =
        Format("mark %d is seen %.1f px from where it is expected, while the %d others are where they belong: repeat it",
               drift.mark, drift.markPx, static_cast<int>(points.size()) - 1);
    return drift;
  }
  if (ChiSquaredChance(fit.chiSquared, drift.degreesOfFreedom - 6) < significance) {
    drift.verdict = SurfaceDrift::Verdict::Changed;
    drift.message =
        Format("marks lie %.1f px (RMS) from where they are expected, and no motion of the camera explains that: is it "
               "this shell, this lens, this picture? Calibrate again",
               drift.rmsPx);
    return drift;
  }
  drift.verdict = SurfaceDrift::Verdict::Moved;
  drift.movedMm = fit.motion.head<3>();
  drift.turned = fit.motion.tail<3>();
  drift.movedErrorMm = LengthError(drift.movedMm, fit.covariance.topLeftCorner<3, 3>());
  drift.turnedErrorDegrees = LengthError(drift.turned, fit.covariance.bottomRightCorner<3, 3>()) * DegreesPerRadian;
  drift.message =
      Format("the camera has moved by %.2f mm (+- %.2f) and turned by %.2f degrees (+- %.2f): calibrate again",
             drift.movedMm.norm(), drift.movedErrorMm, drift.turned.norm() * DegreesPerRadian, drift.turnedErrorDegrees);
  return drift;
}

} // namespace echorama
