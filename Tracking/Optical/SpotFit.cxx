// SPDX-License-Identifier: BSD-3-Clause
// Levenberg-Marquardt on six numbers per spot (peak, centre, precision of its ellipse) and three of the plane. Twice: the
// weights of the first pass come from where it starts, those of the second from where the first ended, which is Fisher scoring,
// as good as maximum likelihood here. Weights that come from the values themselves would pull every spot to its dark pixels.
//
// Saturated pixels are left out, and so are those of which the model expects that noise may saturate them: were that left to
// the values, the dark half of the noise would stay and the bright half go, on one side of the spot more than on the other
// where the background is sloped.
//
// Cost: per iteration the samples times the square of the number of parameters.
#include "SpotFit.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

constexpr int PerSpot = 6, PerPlane = 3;

// Of one problem: parameters are (peak, x, y, a, b, c) per spot, then constant and slopes about the middle of the samples. All
// samples of a column at once: Eigen computes eight, four or two numbers, also of exp, in one step.
class SpotProblem {
public:
  SpotProblem(const std::vector<SpotSample>& samples, int spots, const SpotFitSettings& settings)
    : samples_(samples), spots_(spots), settings_(settings)
  {
    for (const SpotSample& s : samples)
      middle_ += Eigen::Vector2d(s.x, s.y);
    middle_ /= static_cast<double>(std::max<std::size_t>(samples.size(), 1));
  }

  int Parameters() const { return PerSpot * spots_ + PerPlane; }
  int Used() const { return static_cast<int>(x_.size()); }

  // Chooses samples and weights by what the model expects.
  void Weigh(const Eigen::VectorXd& p)
  {
    const auto count = static_cast<Eigen::Index>(samples_.size());
    Resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      x_[i] = samples_[static_cast<std::size_t>(i)].x;
      y_[i] = samples_[static_cast<std::size_t>(i)].y;
    }
    Model(p);
    Eigen::Index used = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const SpotSample& s = samples_[static_cast<std::size_t>(i)];
      const double total = s.background + model_[i];
      const double variance = settings_.noise.Variance(total), room = settings_.saturation - std::max(total, 0.0);
      if (room <= 0.0 || 9.0 * variance >= room * room || s.value + s.background >= settings_.saturation)
        continue;
      x_[used] = s.x;
      y_[used] = s.y;
      values_[used] = s.value;
      rootWeights_[used++] = variance + settings_.backgroundNoise * settings_.noise.Variance(s.background);
    }
    Resize(used);
    rootWeights_ = (settings_.pixelsPerSample / rootWeights_).sqrt();
  }

  // Sum of squared weighted residuals. Remembers what Differentiate(), of the parameters of the call before, needs.
  double Evaluate(const Eigen::VectorXd& p)
  {
    Model(p);
    residuals_ = rootWeights_ * (values_ - model_);
    return residuals_.matrix().squaredNorm();
  }

  // The Hessian of half of that sum, and minus its gradient.
  void Differentiate(const Eigen::VectorXd& p, Eigen::MatrixXd& information, Eigen::VectorXd& gradient)
  {
    jacobian_.resize(x_.size(), Parameters());
    const auto column = [this](int at) { return jacobian_.col(at).array(); };
    for (int k = 0; k < spots_; ++k) {
      const auto q = p.segment<PerSpot>(static_cast<Eigen::Index>(PerSpot) * k);
      const int first = PerSpot * k;
      const auto dx = x_ - q[1], dy = y_ - q[2];
      column(first) = rootWeights_ * shapes_.col(k);
      light_ = q[0] * column(first);
      column(first + 1) = light_ * (q[3] * dx + q[4] * dy);
      column(first + 2) = light_ * (q[4] * dx + q[5] * dy);
      column(first + 3) = -0.5 * light_ * dx * dx;
      column(first + 4) = -light_ * dx * dy;
      column(first + 5) = -0.5 * light_ * dy * dy;
    }
    const int first = PerSpot * spots_;
    column(first) = rootWeights_;
    column(first + 1) = rootWeights_ * (x_ - middle_.x());
    column(first + 2) = rootWeights_ * (y_ - middle_.y());
    information.noalias() = jacobian_.transpose() * jacobian_;
    gradient.noalias() = jacobian_.transpose() * residuals_.matrix();
  }

private:
  void Resize(Eigen::Index count)
  {
    for (Eigen::ArrayXd* array : {&x_, &y_, &values_, &rootWeights_})
      array->conservativeResize(count);
  }

  void Model(const Eigen::VectorXd& p)
  {
    shapes_.resize(x_.size(), spots_);
    const int first = PerSpot * spots_;
    model_ = p[first] + p[first + 1] * (x_ - middle_.x()) + p[first + 2] * (y_ - middle_.y());
    for (int k = 0; k < spots_; ++k) {
      const auto q = p.segment<PerSpot>(static_cast<Eigen::Index>(PerSpot) * k);
      const auto dx = x_ - q[1], dy = y_ - q[2];
      shapes_.col(k) = (-0.5 * (q[3] * dx * dx + 2.0 * q[4] * dx * dy + q[5] * dy * dy)).exp();
      model_ += q[0] * shapes_.col(k);
    }
  }

  const std::vector<SpotSample>& samples_;
  int spots_;
  SpotFitSettings settings_;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  Eigen::ArrayXd x_, y_, values_, rootWeights_; // of the samples that are used
  Eigen::ArrayXd model_, residuals_, light_;
  Eigen::ArrayXXd shapes_; // what each spot's peak is multiplied by
  Eigen::MatrixXd jacobian_;
};

// Peaks above 0, ellipses that are ellipses, with radii of a third of a pixel to a hundred.
bool IsPossible(const Eigen::VectorXd& p, int spots)
{
  for (int k = 0; k < spots; ++k) {
    const double a = p[PerSpot * k + 3], b = p[PerSpot * k + 4], c = p[PerSpot * k + 5];
    const double mean = 0.5 * (a + c), spread = std::hypot(0.5 * (a - c), b);
    if (!(p[PerSpot * k] > 0.0 && mean - spread > 1e-4 && mean + spread < 9.0))
      return false;
  }
  return true;
}

// \returns whether it converged; \a information is the Hessian where it ended.
bool Descend(SpotProblem& problem, int spots, double tolerance, Eigen::VectorXd& p, double& sum, Eigen::MatrixXd& information)
{
  Eigen::VectorXd gradient;
  double damping = 1e-3;
  sum = problem.Evaluate(p);
  for (int iteration = 0; iteration < 25; ++iteration) {
    problem.Differentiate(p, information, gradient);
    bool better = false;
    Eigen::VectorXd step;
    while (!better && damping < 1e6) {
      Eigen::MatrixXd damped = information;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-12;
      step = SolveSymmetric(damped, gradient);
      const Eigen::VectorXd next = p + step;
      if (step.allFinite() && IsPossible(next, spots)) {
        const double nextSum = problem.Evaluate(next);
        if (nextSum <= sum) {
          better = true;
          p = next;
          sum = nextSum;
        }
      }
      damping = better ? std::max(damping * 0.1, 1e-9) : damping * 10.0;
    }
    if (!better)
      return iteration > 0; // as low as it gets
    bool small = true;
    for (int k = 0; k < spots; ++k)
      small = small && std::abs(step[PerSpot * k + 1]) < tolerance && std::abs(step[PerSpot * k + 2]) < tolerance &&
              std::abs(step[PerSpot * k]) < 5.0 * tolerance * p[PerSpot * k];
    if (small)
      return true;
  }
  return false;
}

} // namespace

SpotFitResult FitSpots(const std::vector<SpotSample>& samples, const std::vector<GaussianSpot>& start,
                       const SpotFitSettings& settings)
{
  SpotFitResult result;
  const int spots = static_cast<int>(start.size());
  SpotProblem problem(samples, spots, settings);
  Eigen::VectorXd p = Eigen::VectorXd::Zero(problem.Parameters());
  for (int k = 0; k < spots; ++k) {
    const GaussianSpot& s = start[static_cast<std::size_t>(k)];
    p.segment<PerSpot>(PerSpot * k) << s.peak, s.centre.x(), s.centre.y(), s.precision(0, 0), s.precision(0, 1),
        s.precision(1, 1);
  }
  if (spots == 0 || !p.allFinite() || !IsPossible(p, spots))
    return result;

  double sum = 0.0;
  int used = 0;
  Eigen::MatrixXd information;
  for (const double tolerance : {0.05, 2e-3}) {
    problem.Weigh(p);
    used = problem.Used();
    if (used < problem.Parameters() + 2)
      return result;
    result.converged = Descend(problem, spots, tolerance, p, sum, information);
    if (!result.converged)
      return result;
  }

  result.chiSquared = sum / (used - problem.Parameters());
  // What the model leaves over counts as noise, too.
  const Eigen::MatrixXd covariance = InverseOfSymmetric(information) * std::max(result.chiSquared, 1.0);
  if (!covariance.allFinite()) {
    result.converged = false;
    return result;
  }
  for (int k = 0; k < spots; ++k) {
    const double* q = p.data() + static_cast<std::ptrdiff_t>(PerSpot) * k;
    GaussianSpot spot;
    spot.peak = q[0];
    spot.centre = {q[1], q[2]};
    spot.precision << q[3], q[4], q[4], q[5];
    result.spots.push_back(spot);
    result.covariances.emplace_back(covariance.block<2, 2>(PerSpot * k + 1, PerSpot * k + 1));
    result.peakSigmas.push_back(std::sqrt(std::max(covariance(PerSpot * k, PerSpot * k), 0.0)));
  }
  return result;
}

} // namespace echorama
