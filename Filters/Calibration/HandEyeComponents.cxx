// SPDX-License-Identifier: BSD-3-Clause
// The covariance of a residual (HandEyeModel.h) is V(x) = exp(2 x0) K + exp(2 x1) s^2 G G^T + exp(2 x2) v^2 H H^T, where K is
// that of the shifts as stated, G turns about the sensor and H = [hat(x3..5); I] about the centre. Shifts of the two sides look
// alike and have one factor. x maximises the restricted likelihood (Patterson and Thompson 1971)
//
//     -2 log L = n log|V| + log|sum J^T V^-1 J| + sum r^T V^-1 r.
//
// With J N^-1 J^T, the covariance of what the fit follows, N = sum J^T V^-1 J, it has the slopes of n log|V| + tr(V^-1 T) for
// T = sum (r r^T + J N^-1 J^T) held fixed: so scans are passed through once for each T, and x follows by scoring on 6 x 6
// matrices (expectation and maximisation; few scans need some twenty rounds, many three).
//
// A calibration weighed by an estimated V errs by more than V says, and its region has fewer degrees of freedom: by Kenward and
// Roger 1997, and Satterthwaite for the trace of the target's covariance.
#include "Filters/Calibration/HandEyeComponents.h"
#include "Core/Base/Angles.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace echorama {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Numbers = Eigen::Matrix<double, 6, 1>; // x
using Switches = std::array<bool, 6>;        // which of them are estimated

constexpr double PriorLog = 1.0, MostLog = 6.0; // of a factor, from the size of all: its standard deviation; its limit
constexpr double LeastSize = 1e-4;              // times the noise stated; what is below is rounding
constexpr int MostRounds = 20, MostSteps = 30;
constexpr double SameLikelihood = 1e-3;
constexpr double Rare[] = {0.0, 10.828, 13.816, 16.266, 18.467, 20.515}; // chi^2 that chance exceeds once in a thousand

double LogDeterminant(const Eigen::Ref<const Eigen::MatrixXd>& a)
{
  const Eigen::VectorXd size = a.diagonal().cwiseSqrt(); // units apart, eigenvalues are near each other
  return 2.0 * size.array().log().sum() +
         EigenOfSymmetric(a.cwiseQuotient(size * size.transpose())).values.cwiseMax(1e-300).array().log().sum();
}

class Estimator {
public:
  Estimator(HandEyeModel& model, const HandEyeNoise& stated, const std::vector<char>& use)
    : model_(model), use_(use), stated_(stated), count_(static_cast<double>(std::count(use.begin(), use.end(), 1)))
  {
  }

  struct Candidate {
    Numbers x = Numbers::Zero();
    HandEyeSolution solution;
    double doubt = 0.0; // -2 log of the likelihood, and of the prior
  };

  HandEyeNoise NoiseOf(const Numbers& x) const
  {
    HandEyeNoise noise = stated_;
    noise.sensor.mm *= std::exp(x[0]);
    noise.volume.mm *= std::exp(x[0]);
    noise.sensor.degrees *= std::exp(x[1]);
    noise.volume.degrees *= std::exp(x[2]);
    noise.centre += x.tail<3>();
    return noise;
  }

  double Freedom() const { return 6.0 * count_ - 12.0; }

  // The ratio as stated.
  Candidate Size(const HandEyeSolution& start)
  {
    Candidate candidate;
    candidate.solution = start;
    Follow(candidate);
    candidate.x.head<3>().setConstant(0.5 * std::log(See(candidate).square / Freedom()));
    middle_ = candidate.x[0];
    candidate.doubt = Doubt(candidate, {});
    return candidate;
  }

  void Fit(Candidate& candidate, const Switches& free)
  {
    for (int round = 0; round < MostRounds; ++round) {
      Improve(candidate, free, See(candidate).moments);
      Follow(candidate);
      const double before = candidate.doubt;
      candidate.doubt = Doubt(candidate, free);
      if (round > 0 && std::abs(candidate.doubt - before) < SameLikelihood)
        break;
    }
  }

  // Where turns and shifts that go together have their centre.
  Eigen::Vector3d CentreSeen(const Candidate& candidate)
  {
    const Matrix6 moments = See(candidate).moments;
    const Eigen::Matrix3d turns = moments.bottomRightCorner<3, 3>(), across = moments.bottomLeftCorner<3, 3>();
    const Eigen::Matrix3d lever = SolveSymmetric(turns, across).transpose();
    return 0.5 * Eigen::Vector3d(lever(2, 1) - lever(1, 2), lever(0, 2) - lever(2, 0), lever(1, 0) - lever(0, 1));
  }

  void State(const Candidate& candidate, const Switches& free, HandEyeComponents& result)
  {
    result.noise = NoiseOf(candidate.x);
    result.solution = candidate.solution;
    const Evidence seen = See(candidate);
    const Matrix6 weight = InverseOfSymmetric(CovarianceOf(candidate));
    const std::array<Matrix6, 6> slopes = Slopes(candidate);
    std::vector<int> numbers;
    for (int k = 0; k < 6; ++k)
      if (free[static_cast<std::size_t>(k)])
        numbers.push_back(k);
    const auto size = static_cast<Eigen::Index>(numbers.size());
    const auto slope = [&](Eigen::Index a) { return slopes[static_cast<std::size_t>(numbers[static_cast<std::size_t>(a)])]; };
    std::vector<HandEyeMatrix> first; // derivatives of N, but for the sign, between N^-1
    for (Eigen::Index a = 0; a < size; ++a)
      first.push_back(seen.covariance * Summed(weight * slope(a) * weight) * seen.covariance);
    std::vector<HandEyeMatrix> second(numbers.size() * numbers.size());
    Eigen::MatrixXd information(size, size);
    Eigen::VectorXd gradient(size);
    for (Eigen::Index a = 0; a < size; ++a) {
      gradient[a] = first[static_cast<std::size_t>(a)].topLeftCorner<3, 3>().trace();
      for (Eigen::Index b = 0; b < size; ++b) {
        const Matrix6 product = weight * slope(a) * weight * slope(b);
        const HandEyeMatrix sum = Summed(product * weight);
        const HandEyeMatrix &one = first[static_cast<std::size_t>(a)], &other = first[static_cast<std::size_t>(b)];
        second[static_cast<std::size_t>(a * size + b)] = seen.covariance * sum * seen.covariance - one * seen.information * other;
        information(a, b) = 0.5 * (count_ * product.trace() - 2.0 * seen.covariance.cwiseProduct(sum.transpose()).sum() +
                                   (one * seen.information).cwiseProduct((other * seen.information).transpose()).sum()) +
                            Prior(free)(numbers[static_cast<std::size_t>(a)], numbers[static_cast<std::size_t>(b)]);
      }
    }
    const Eigen::MatrixXd covariance = SolveSymmetric(information, Eigen::MatrixXd::Identity(size, size));
    HandEyeMatrix more = HandEyeMatrix::Zero();
    for (Eigen::Index a = 0; a < size; ++a)
      for (Eigen::Index b = 0; b < size; ++b)
        more += covariance(a, b) * second[static_cast<std::size_t>(a * size + b)];
    result.covariance = seen.covariance + more + more.transpose();
    const double variance = seen.covariance.topLeftCorner<3, 3>().trace();
    result.degreesOfFreedom = std::clamp(2.0 * variance * variance / gradient.dot(covariance * gradient), 1.0, Freedom());
  }

private:
  struct Evidence {
    Matrix6 moments = Matrix6::Zero();                             // T
    HandEyeMatrix information = HandEyeMatrix::Zero(), covariance; // N and its inverse
    double square = 0.0;                                           // sum of r^T V^-1 r
  };

  void Follow(Candidate& candidate)
  {
    model_.SetNoise(NoiseOf(candidate.x));
    candidate.solution = model_.Refine(candidate.solution, use_).solution;
  }

  Matrix6 CovarianceOf(const Candidate& candidate)
  {
    model_.SetNoise(NoiseOf(candidate.x));
    return model_.Covariance(candidate.solution.volumeToSensor);
  }

  Evidence See(const Candidate& candidate)
  {
    const Matrix6 weight = InverseOfSymmetric(CovarianceOf(candidate));
    residuals_.clear();
    jacobians_.clear();
    Evidence seen;
    HandEyeStep gradient = HandEyeStep::Zero();
    for (int i = 0; i < model_.Count(); ++i) {
      if (!use_[static_cast<std::size_t>(i)])
        continue;
      residuals_.push_back(model_.Residual(i, candidate.solution));
      jacobians_.push_back(model_.Jacobian(i, residuals_.back()));
      const Eigen::Matrix<double, 6, 12> weighted = weight * jacobians_.back();
      seen.information.noalias() += jacobians_.back().transpose() * weighted;
      gradient.noalias() += weighted.transpose() * residuals_.back();
    }
    seen.covariance = InverseOfSymmetric(seen.information);
    const HandEyeStep step = -seen.covariance * gradient;
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      const Twist left = residuals_[i] + jacobians_[i] * step;
      seen.square += left.dot(weight * left);
      seen.moments.noalias() += left * left.transpose() + jacobians_[i] * seen.covariance * jacobians_[i].transpose();
    }
    return seen;
  }

  // sum J^T m J, at the candidate seen last
  HandEyeMatrix Summed(const Matrix6& m) const
  {
    HandEyeMatrix sum = HandEyeMatrix::Zero();
    for (const auto& jacobian : jacobians_)
      sum.noalias() += jacobian.transpose() * (m * jacobian);
    return sum;
  }

  // Of x: the factors estimated are near each other.
  static Matrix6 Prior(const Switches& free)
  {
    const auto factors = static_cast<double>(std::count(free.begin(), free.begin() + 3, true));
    Matrix6 prior = Matrix6::Zero();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (free[static_cast<std::size_t>(a)] && free[static_cast<std::size_t>(b)])
          prior(a, b) = ((a == b ? 1.0 : 0.0) - 1.0 / factors) / (PriorLog * PriorLog);
    return prior;
  }

  double Doubt(const Candidate& candidate, const Switches& free)
  {
    const Evidence seen = See(candidate);
    return count_ * LogDeterminant(CovarianceOf(candidate)) + LogDeterminant(seen.information) + seen.square +
           candidate.x.dot(Prior(free) * candidate.x);
  }

  std::array<Matrix6, 6> Slopes(const Candidate& candidate) const
  {
    const HandEyeNoise noise = NoiseOf(candidate.x);
    const auto variance = [](double degrees) { return std::pow(degrees * RadiansPerDegree, 2); };
    std::array<Matrix6, 6> slopes;
    slopes.fill(Matrix6::Zero());
    slopes[0].diagonal().head<3>().setConstant(2.0 * (noise.sensor.mm * noise.sensor.mm + noise.volume.mm * noise.volume.mm));
    const Eigen::Matrix<double, 6, 3> bySensor =
        Adjoint(Pose(candidate.solution.volumeToSensor * Eigen::Translation3d(stated_.centre)).inverse()).rightCols<3>();
    slopes[1] = 2.0 * variance(noise.sensor.degrees) * bySensor * bySensor.transpose();
    Eigen::Matrix<double, 6, 3> byVolume;
    byVolume << Hat(Eigen::Vector3d(candidate.x.tail<3>())), Eigen::Matrix3d::Identity();
    slopes[2] = 2.0 * variance(noise.volume.degrees) * byVolume * byVolume.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      Matrix6& slope = slopes[static_cast<std::size_t>(3 + axis)];
      slope.topRows<3>() =
          variance(noise.volume.degrees) * Hat(Eigen::Vector3d(Eigen::Vector3d::Unit(axis))) * byVolume.transpose();
      slope = (slope + slope.transpose()).eval();
    }
    return slopes;
  }

  // x for these moments: Levenberg-Marquardt with Fisher's information.
  void Improve(Candidate& candidate, const Switches& free, const Matrix6& moments)
  {
    const Matrix6 prior = Prior(free);
    const auto doubt = [&](const Candidate& c) {
      const Matrix6 v = CovarianceOf(c);
      return count_ * LogDeterminant(v) + SolveSymmetric(v, moments).trace() + c.x.dot(prior * c.x);
    };
    double cost = doubt(candidate), damping = 1e-3;
    for (int step = 0; step < MostSteps; ++step) {
      const Matrix6 v = CovarianceOf(candidate), weight = InverseOfSymmetric(v);
      const Matrix6 open = weight * (moments - count_ * v) * weight;
      const std::array<Matrix6, 6> slopes = Slopes(candidate);
      Matrix6 normal = Matrix6::Identity();
      Numbers gradient = Numbers::Zero();
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b)
          if (free[static_cast<std::size_t>(a)] && free[static_cast<std::size_t>(b)]) {
            const Matrix6 &one = slopes[static_cast<std::size_t>(a)], &other = slopes[static_cast<std::size_t>(b)];
            normal(a, b) = 0.5 * count_ * (weight * one).cwiseProduct((weight * other).transpose()).sum() + prior(a, b);
            if (a == b)
              gradient[a] = prior.row(a).dot(candidate.x) - 0.5 * open.cwiseProduct(one).sum();
          }
      bool moved = false;
      double next = cost;
      while (!moved && damping < 1e8) {
        Matrix6 damped = normal;
        damped.diagonal() *= 1.0 + damping;
        Candidate there = candidate;
        Numbers move = -SolveSymmetric(damped, gradient);
        there.x += move / std::max(1.0, 0.5 * move.head<3>().cwiseAbs().maxCoeff()); // factors by exp(2) at most
        there.x.head<3>() = there.x.head<3>().cwiseMax(middle_ - MostLog).cwiseMin(middle_ + MostLog);
        next = doubt(there);
        moved = next <= cost;
        if (moved)
          candidate.x = there.x;
        damping = moved ? std::max(0.1 * damping, 1e-6) : 10.0 * damping;
      }
      if (!moved || cost - next < 0.1 * SameLikelihood)
        break;
      cost = next;
    }
  }

  HandEyeModel& model_;
  const std::vector<char>& use_;
  const HandEyeNoise stated_;
  const double count_;
  double middle_ = 0.0; // logarithm of the size
  std::vector<Twist> residuals_;
  std::vector<Eigen::Matrix<double, 6, 12>> jacobians_;
};

} // namespace

HandEyeComponents EstimateHandEyeComponents(HandEyeModel model, const HandEyeNoise& stated, const HandEyeSolution& start,
                                            const std::vector<char>& use)
{
  HandEyeComponents result;
  Estimator estimator(model, stated, use);
  if (estimator.Freedom() <= 6.0)
    return result;
  Estimator::Candidate best = estimator.Size(start);
  if (!(best.x[0] > std::log(LeastSize)))
    return result;

  Switches free{true, stated.sensor.degrees > 0.0, stated.volume.degrees > 0.0, false, false, false};
  Estimator::Candidate other = best;
  int more = static_cast<int>(std::count(free.begin(), free.end(), true)) - 1;
  estimator.Fit(other, free);
  if (best.doubt - other.doubt > Rare[more]) {
    result.ratio = true;
    best = other;
    more = 0;
  }
  if (stated.volume.degrees > 0.0) {
    Switches freer = free;
    std::fill(freer.begin() + 3, freer.end(), true);
    other.x.tail<3>() = estimator.CentreSeen(other);
    estimator.Fit(other, freer);
    if (best.doubt - other.doubt > Rare[more + 3]) {
      result.ratio = result.centre = true;
      best = other;
      free = freer;
    }
  }
  if (result.ratio)
    estimator.State(best, free, result);
  return result;
}

} // namespace echorama
