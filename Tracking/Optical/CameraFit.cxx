// SPDX-License-Identifier: BSD-3-Clause
// Levenberg and Marquardt on everything at once: seven numbers of the lens, the residual's freedoms, six per pose. What is known
// before, of a lens or of how it is mounted, and the weight of the residual's energy are one quadratic prior; so one solver fits
// a camera from nothing, and places a known camera in a shell by a few points.
//
// The residual lies over the pixels that the lens predicts, not over those that were seen: a smooth field over these could
// repeat them, noise and all, and no lens would be left.
//
// Passes: robust without a residual (Cauchy's weights, whose scale is the median of what is left over); then, until no point
// changes sides: choice of the residual's weight, all unknowns, outliers by what each point is off were it not in the fit. The
// weight is that under which the observations are most likely, whatever camera and residual are (restricted maximum likelihood,
// Wood, J. R. Stat. Soc. B 2011): unlike cross-validation it seldom takes noise for a residual, and when in doubt it leaves a
// stiff one, whose uncertainty is then part of every answer. Where none is likeliest there is none, unless there are several
// poses: see LowOrders().
//
// Cost: n points and m centres take n (13 + 2 m)^2 per step, some ten steps: 0.3 s for 350 and 60.
#include "CameraFit.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace echorama {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr Index PerLens = CameraOptics::LensUnknowns, PerPose = 6;
constexpr double MedianOfTwo = 1.17741;               // of the length of a pair of normal numbers
constexpr double PoseSigmaMm = 20.0, PoseSigma = 0.3; // of a rough one, for what observations leave open; radians
constexpr double WidthBesideResidual = 0.3;           // of the lens's prior
constexpr double LowOrderPx = 3.0;       // of the residual's lowest orders, about: what a tilted sensor and the like come to
constexpr double ErrorScaleOfNone = 1e4; // sigmas of a point that the camera cannot see
constexpr double LeastKnown = 1e-5;      // of a rough standard deviation: nothing is known better
constexpr double LeastScale = 0.05;      // what is left over per what covariances say: not all observations are that good

std::array<double*, PerLens> NumbersOf(FisheyeLens& lens)
{
  return {&lens.focal, &lens.centreX, &lens.centreY, &lens.k1, &lens.k2, &lens.k3, &lens.k4};
}

// Lens, residual's freedoms of x and of y, poses.
struct CameraState {
  FisheyeLens lens;
  VectorXd bend;
  std::vector<Pose> poses;
};

class CameraProblem {
public:
  CameraProblem(const std::vector<SeenPoint>& points, const CameraOptics& start, const std::vector<Pose>& poses,
                const CameraFitSettings& settings)
    : points_(points), settings_(settings), start_{start.lens, {}, poses}, state_(start_), errors_(points.size()),
      roots_(points.size()), weights_(points.size(), 1.0)
  {
    SetResidual(start.residual);
    SetLensPrior(start.lens, 1.0);
  }

  static std::array<double, PerLens> RoughSigmas(const FisheyeLens& lens)
  {
    return {0.1 * lens.focal, 0.05 * lens.width, 0.05 * lens.height, 0.1, 0.05, 0.02, 0.01};
  }

  // Wide enough for what is known of a lens by its name, and tight enough that powers of angles nobody saw stay where they were.
  // Beside a residual it is tighter, about what the lens is without: both can do much of the same, and where depth passes for
  // direction, too, nothing else would hold the lens.
  void SetLensPrior(const FisheyeLens& mean, double width)
  {
    start_.lens = mean;
    const auto sigmas = RoughSigmas(mean);
    lensInformation_.setZero();
    for (Index i = 0; i < PerLens; ++i)
      lensInformation_(i, i) = 1.0 / std::pow(width * sigmas[static_cast<std::size_t>(i)], 2);
  }

  // What a lens cannot do is noise to a fit without residual: so many times what covariances say.
  void SetMisfit(double scale) { misfit_ = scale; }

  Index BendCount() const { return freedoms_.cols(); } // per component
  Index Count() const { return PerLens + 2 * BendCount() + PerPose * static_cast<Index>(state_.poses.size()); }
  const CameraState& State() const { return state_; }
  const std::vector<Vector2d>& Errors() const { return errors_; }

  double MedianError() const // the standard deviation that it is that of
  {
    std::vector<double> lengths;
    for (const Vector2d& error : errors_)
      lengths.push_back(error.norm());
    return Median(lengths) / MedianOfTwo;
  }

  // Takes another plate; its weights are where it starts.
  void SetResidual(const ThinPlate& plate)
  {
    plate_ = plate;
    freedoms_ = plate.Freedoms();
    const Index count = freedoms_.cols();
    start_.bend = VectorXd::Zero(2 * count);
    if (count == 0) {
      plate_ = {};
    } else {
      start_.bend = BendOf(plate);
    }
    state_.bend = start_.bend;
    if (settings_.covariance.size() > 0) {
      const MatrixXd reduced = Block(Reducing());
      MatrixXd known = reduced * settings_.covariance * reduced.transpose();
      VectorXd least = VectorXd::Ones(Count()); // of what is said to be exact there would be no inverse
      const auto sigmas = RoughSigmas(start_.lens);
      std::copy(sigmas.begin(), sigmas.end(), least.data());
      for (Index pose = PerLens + 2 * count; pose < Count(); pose += PerPose)
        least.segment<PerPose>(pose) << Vector3d::Constant(PoseSigmaMm), Vector3d::Constant(PoseSigma);
      known.diagonal() += (LeastKnown * least).cwiseAbs2();
      information_ = InverseOfSymmetric(known);
    }
  }
  void SetSmoothness(double smoothness) { smoothness_ = smoothness; }
  void SetState(const CameraState& state) { state_ = state; }

  // The freedoms of a plate with the same centres.
  VectorXd BendOf(const ThinPlate& plate) const
  {
    const Index count = BendCount();
    VectorXd bend(2 * count);
    if (count > 0) {
      MatrixXd given(freedoms_.rows(), 2);
      for (Index i = 0; i < given.rows(); ++i)
        given.row(i) = plate.weights[static_cast<std::size_t>(i)].transpose();
      const MatrixXd both = Reducing() * given;
      bend << both.col(0), both.col(1);
    }
    return bend;
  }

  // Where the residual's plate ended.
  ThinPlate Residual() const
  {
    ThinPlate plate = plate_;
    const Index count = BendCount();
    const VectorXd x = freedoms_ * state_.bend.head(count), y = freedoms_ * state_.bend.tail(count);
    for (std::size_t i = 0; i < plate.weights.size(); ++i)
      plate.weights[i] = {x[static_cast<Index>(i)], y[static_cast<Index>(i)]};
    return plate;
  }

  // What each error is divided by, as the present state sees it.
  void Weigh()
  {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      Matrix2d covariance = points_[i].covariance;
      if (const auto p = state_.lens.Differentiate(InCamera(i)))
        covariance += points_[i].pointSigmaMm * points_[i].pointSigmaMm * p->byDirection * p->byDirection.transpose();
      roots_[i] = covariance.llt().matrixL().solve(Matrix2d::Identity());
    }
    Evaluate();
  }

  // Robust: weights by what is left over, anew before each step; else those of \a use.
  bool Descend(bool isRobust, const std::vector<bool>& use, int most)
  {
    for (std::size_t i = 0; i < points_.size(); ++i)
      weights_[i] = use[i] ? 1.0 : 0.0;
    Evaluate();
    double damping = 1e-3, gained = 0.0, cost = 0.0;
    MatrixXd information;
    VectorXd gradient;
    for (int iteration = 0; iteration < most; ++iteration) {
      if (isRobust)
        WeighRobustly();
      Linearise(information, gradient);
      cost = Cost();
      const CameraState before = state_;
      const VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
      const MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
      double expected = 0.0;
      gained = -1.0;
      while (damping < 1e8) {
        MatrixXd damped = scaled;
        damped.diagonal().array() += damping;
        const VectorXd step = scale.cwiseProduct(SolveSymmetric(damped, scale.cwiseProduct(gradient)));
        expected = std::max(expected, gradient.dot(step));
        if (step.allFinite() && Move(before, step)) {
          Evaluate();
          gained = cost - Cost();
          if (gained >= 0.0)
            break;
        }
        damping *= 10.0;
      }
      if (!(gained >= 0.0)) {
        state_ = before; // as low as it gets
        Evaluate();
        return expected <= 1e-6 * (cost + 1e-6);
      }
      damping = std::max(damping * 0.1, 1e-12);
      if (gained <= 1e-8 * (cost + 1e-8) && (!isRobust || iteration > 10))
        return true;
    }
    // Along a valley, as where depth passes for direction, costs hardly differ any more.
    return isRobust || gained <= 1e-4 * cost;
  }

  // Information and gradient of half the cost. Rows of errors: two per point of weight above 0.
  void Linearise(MatrixXd& information, VectorXd& gradient) const
  {
    MatrixXd jacobian;
    VectorXd errors;
    Rows(jacobian, errors);
    information.setZero(Count(), Count());
    information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
    information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
    gradient = jacobian.transpose() * errors;
    const MatrixXd turned = FromStartByStep(), prior = turned.transpose() * PriorInformation();
    information += prior * turned;
    gradient -= prior * FromStart();
  }

  // How a point's prediction, in standard deviations, follows the unknowns. \a optics are those of the present state.
  MatrixXd RowsOf(std::size_t i, const CameraOptics& optics) const
  {
    MatrixXd rows = MatrixXd::Zero(2, Count());
    const Vector3d at = InCamera(i);
    const auto by = optics.Differentiate(at);
    if (!by)
      return rows;
    const Index count = BendCount();
    rows.leftCols<PerLens>() = by->byUnknowns.leftCols<PerLens>();
    if (count > 0) { // the basis is the same for both components
      const Eigen::RowVectorXd bend = by->byUnknowns.row(0).segment(PerLens, freedoms_.rows()) * freedoms_;
      rows.block(0, PerLens, 1, count) = rows.block(1, PerLens + count, 1, count) = bend;
    }
    const auto pose = static_cast<Index>(points_[i].pose);
    rows.block<2, 3>(0, PerLens + 2 * count + PerPose * pose) = -by->byDirection;
    rows.block<2, 3>(0, PerLens + 2 * count + PerPose * pose + 3) = by->byDirection * Hat(at);
    return roots_[i] * rows;
  }

  void Rows(MatrixXd& jacobian, VectorXd& errors) const
  {
    const auto used = std::count_if(weights_.begin(), weights_.end(), [](double w) { return w > 0.0; });
    jacobian.resize(2 * used, Count());
    errors.resize(2 * used);
    Index row = 0;
    const CameraOptics optics = Optics();
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (weights_[i] > 0.0) {
        const double root = std::sqrt(weights_[i]);
        jacobian.middleRows<2>(row) = root * RowsOf(i, optics);
        errors.segment<2>(row) = root * errors_[i];
        row += 2;
      }
  }

  MatrixXd PriorInformation() const
  {
    if (information_.size() > 0)
      return information_;
    MatrixXd prior = MatrixXd::Zero(Count(), Count());
    prior.topLeftCorner<PerLens, PerLens>() = misfit_ * misfit_ * lensInformation_;
    for (Index pose = PerLens + 2 * BendCount(); pose < Count(); pose += PerPose) {
      prior.diagonal().segment<3>(pose).setConstant(std::pow(misfit_ / PoseSigmaMm, 2));
      prior.diagonal().segment<3>(pose + 3).setConstant(std::pow(misfit_ / PoseSigma, 2));
    }
    prior.diagonal().segment(PerLens, 2 * BendCount()).setConstant(smoothness_);
    const Index low = LowOrders();
    for (Index end = PerLens + BendCount(); low > 0 && end <= PerLens + 2 * BendCount(); end += BendCount())
      prior.diagonal().segment(end - low, low).setConstant(1.0 / (LowOrderPx * LowOrderPx));
    if (settings_.mount.size() > 0) {
      const auto poses = static_cast<Index>(state_.poses.size());
      const MatrixXd one = InverseOfSymmetric(settings_.mount);
      for (Index a = 0; a < poses; ++a)
        for (Index b = 0; b < poses; ++b)
          prior.block<PerPose, PerPose>(Count() - PerPose * (poses - a), Count() - PerPose * (poses - b)) +=
              one * ((a == b ? 1.0 : 0.0) - 1.0 / static_cast<double>(poses));
    }
    return prior;
  }

  // The residual's weight; infinite: none. Takes a plate at 0, a state that fits without, and the priors beside a residual.
  double ChooseSmoothness(double& effective) const
  {
    MatrixXd jacobian;
    VectorXd errors;
    Rows(jacobian, errors);
    const Index low = LowOrders(), high = BendCount() - low, rows = jacobian.rows();
    const Index poses = PerPose * static_cast<Index>(state_.poses.size()), fixed = PerLens + poses, all = fixed + 2 * low;
    // What the camera itself can explain is taken out, then what the lowest orders can; what is known before is further rows.
    MatrixXd known = MatrixXd::Zero(rows + all, all);
    known.topRows(rows) << jacobian.leftCols<PerLens>(), jacobian.rightCols(poses), jacobian.middleCols(PerLens + high, low),
        jacobian.middleCols(PerLens + BendCount() + high, low);
    VectorXd left = VectorXd::Zero(rows + all);
    left.head(rows) = errors;
    const MatrixXd prior = PriorInformation(), turned = FromStartByStep();
    const MatrixXd ofPoses = prior.bottomRightCorner(poses, poses).llt().matrixU();
    known.block<PerLens, PerLens>(rows, 0) = MatrixXd(prior.topLeftCorner<PerLens, PerLens>().llt().matrixU());
    known.block(rows + PerLens, PerLens, poses, poses) = ofPoses * turned.bottomRightCorner(poses, poses);
    left.segment(rows + PerLens, poses) = -ofPoses * FromStart().tail(poses);
    known.bottomRightCorner(2 * low, 2 * low).diagonal().setConstant(1.0 / LowOrderPx);
    const Eigen::HouseholderQR<MatrixXd> qr(known);
    const MatrixXd q = qr.householderQ() * MatrixXd::Identity(rows + all, all);
    MatrixXd bending = MatrixXd::Zero(rows + all, 2 * high);
    bending.topRows(rows) << jacobian.middleCols(PerLens, high), jacobian.middleCols(PerLens + BendCount(), high);
    bending -= (q * (q.transpose() * bending)).eval();
    left -= (q.leftCols(fixed) * (q.leftCols(fixed).transpose() * left)).eval();

    const double number = static_cast<double>(rows) - static_cast<double>(poses), none = left.squaredNorm();
    effective = 0.0;
    double chosen = std::numeric_limits<double>::infinity();
    if (none < 1e-4 * static_cast<double>(rows))
      return chosen; // nothing to explain
    double best = low > 0 ? std::numeric_limits<double>::infinity() : number * std::log(none), ofLow = 0.0, freedomsOfLow = 0.0;
    for (Index i = fixed; i < all; ++i) {
      const double gained = std::pow(LowOrderPx * qr.matrixQR()(i, i), 2);
      ofLow += std::log(gained);
      freedomsOfLow += 1.0 - 1.0 / gained;
    }
    left -= (q.rightCols(2 * low) * (q.rightCols(2 * low).transpose() * left)).eval();
    const SymmetricEigen modes = EigenOfSymmetric(bending.transpose() * bending);
    const VectorXd parts = modes.vectors.transpose() * (bending.transpose() * left);
    for (double power = 8.0; power > -6.01; power -= 0.25) {
      const double weight = std::pow(10.0, power);
      double sum = left.squaredNorm(), volume = ofLow, freedoms = freedomsOfLow;
      for (Index i = 0; i < parts.size(); ++i) {
        const double value = std::max(modes.values[i], 0.0);
        sum -= parts[i] * parts[i] / (value + weight);
        volume += std::log1p(value / weight);
        freedoms += value / (value + weight);
      }
      const double here = volume + number * std::log(std::max(sum, 1e-300));
      if (here < best) {
        best = here;
        chosen = weight;
        effective = freedoms;
      }
    }
    return chosen;
  }

  // Of CameraOptics::Unknowns() and the poses, from that of the unknowns here.
  MatrixXd Widen(const MatrixXd& covariance) const
  {
    const MatrixXd wide = Block(freedoms_);
    return wide * covariance * wide.transpose();
  }

  Vector3d InCamera(std::size_t i) const { return state_.poses[points_[i].pose].inverse(Eigen::Isometry) * points_[i].point; }
  CameraOptics Optics() const { return {state_.lens, Residual()}; }
  // Sum of the squares of what is left over, and of how far all is from what was known of it.
  double Cost() const
  {
    double cost = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i)
      cost += weights_[i] * errors_[i].squaredNorm();
    const VectorXd from = FromStart();
    return cost + from.dot(PriorInformation() * from);
  }

private:
  // What of the residual is not weighed by its smoothness. Under several domes a camera whose sensor is tilted a little looks
  // much like one that is mounted elsewhere under each; a residual that has to be small rather blames the mounts, by many times
  // what they are known to, and what it claims of the lens is wrong for any other shell.
  Index LowOrders() const { return settings_.mount.size() > 0 ? plate_.LowOrders() : 0; }

  MatrixXd Reducing() const // freedoms of given weights
  {
    return InverseOfSymmetric(freedoms_.transpose() * freedoms_) * freedoms_.transpose();
  }

  // What \a bend does to both components of the residual, and nothing to all else.
  MatrixXd Block(const MatrixXd& bend) const
  {
    const Index rows = BendCount() > 0 ? bend.rows() : 0, columns = BendCount() > 0 ? bend.cols() : 0;
    const Index poses = PerPose * static_cast<Index>(state_.poses.size());
    MatrixXd block = MatrixXd::Zero(PerLens + 2 * rows + poses, PerLens + 2 * columns + poses);
    block.topLeftCorner<PerLens, PerLens>().setIdentity();
    block.bottomRightCorner(poses, poses).setIdentity();
    if (rows > 0)
      block.block(PerLens, PerLens, rows, columns) = block.block(PerLens + rows, PerLens + columns, rows, columns) = bend;
    return block;
  }

  void Evaluate()
  {
    const ThinPlate residual = Residual();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto p = state_.lens.Differentiate(InCamera(i)); // not Project(): steps may lead beyond the largest angle
      errors_[i] = p ? Vector2d(roots_[i] * (points_[i].pixel - p->pixel - residual.At(p->pixel)))
                     : Vector2d(Vector2d::Constant(ErrorScaleOfNone));
    }
  }

  VectorXd FromStart() const
  {
    VectorXd from(Count());
    CameraState now = state_, then = start_;
    const auto at = NumbersOf(now.lens), was = NumbersOf(then.lens);
    for (std::size_t i = 0; i < at.size(); ++i)
      from[static_cast<Index>(i)] = *at[i] - *was[i];
    const Index bends = 2 * BendCount();
    from.segment(PerLens, bends) = state_.bend - (information_.size() > 0 ? start_.bend : VectorXd::Zero(bends));
    for (std::size_t k = 0; k < state_.poses.size(); ++k) {
      const Pose motion = start_.poses[k].inverse(Eigen::Isometry) * state_.poses[k];
      from.segment<PerPose>(PerLens + bends + PerPose * static_cast<Index>(k)) << motion.translation(),
          LogRotation(motion.linear());
    }
    return from;
  }

  // How FromStart() follows a step: poses move in the camera's frame as it is now.
  MatrixXd FromStartByStep() const
  {
    MatrixXd by = MatrixXd::Identity(Count(), Count());
    for (std::size_t k = 0; k < state_.poses.size(); ++k) {
      const Eigen::Matrix3d turn = start_.poses[k].linear().transpose() * state_.poses[k].linear(), hat = Hat(LogRotation(turn));
      const Index first = PerLens + 2 * BendCount() + PerPose * static_cast<Index>(k);
      by.block<3, 3>(first, first) = turn;
      by.block<3, 3>(first + 3, first + 3) += 0.5 * hat + hat * hat / 12.0; // to the second order of the turn
    }
    return by;
  }

  bool Move(const CameraState& from, const VectorXd& step)
  {
    state_ = from;
    const auto numbers = NumbersOf(state_.lens);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      *numbers[i] += step[static_cast<Index>(i)];
    const Index bends = 2 * BendCount();
    state_.bend += step.segment(PerLens, bends);
    for (std::size_t k = 0; k < state_.poses.size(); ++k) {
      const auto twist = step.segment<PerPose>(PerLens + bends + PerPose * static_cast<Index>(k));
      Pose motion = Pose::Identity();
      motion.linear() = ExpRotation(twist.tail<3>());
      motion.translation() = twist.head<3>();
      state_.poses[k] = state_.poses[k] * motion;
      state_.poses[k].linear() = NearestRotation(state_.poses[k].linear());
    }
    return state_.lens.focal > 0.05 * start_.lens.focal;
  }

  void WeighRobustly()
  {
    const double scale = 2.385 * std::max(MedianError(), LeastScale);
    for (std::size_t i = 0; i < errors_.size(); ++i)
      weights_[i] = 1.0 / (1.0 + errors_[i].squaredNorm() / (scale * scale));
  }

  const std::vector<SeenPoint>& points_;
  const CameraFitSettings& settings_;
  ThinPlate plate_;
  MatrixXd freedoms_;
  CameraState start_, state_;
  double smoothness_ = 0.0, misfit_ = 1.0;
  Eigen::Matrix<double, PerLens, PerLens> lensInformation_;
  MatrixXd information_;         // of all that was known before; empty: nothing was
  std::vector<Vector2d> errors_; // in standard deviations
  std::vector<Matrix2d> roots_;
  std::vector<double> weights_;
};

double RmsOf(const CameraProblem& problem, const std::vector<SeenPoint>& points, const std::vector<bool>& use)
{
  const CameraOptics optics = problem.Optics();
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (use[i])
      if (const auto pixel = optics.PixelOf(problem.InCamera(i))) {
        squares += (points[i].pixel - *pixel).squaredNorm();
        ++count;
      }
  return std::sqrt(0.5 * squares / std::max(count, 1));
}

[[noreturn]] void FailToConverge(std::size_t points)
{
  throw Error(Error::Kind::NotPossible,
              "the fit of the camera to " + std::to_string(points) + " points does not converge. " + WhatMayBeWrong);
}

void Finish(const CameraProblem& problem, CameraFitResult& result)
{
  result.optics = problem.Optics();
  result.poses = problem.State().poses;
}

} // namespace

std::optional<Vector3d> CameraOptics::DirectionOf(const Vector2d& pixel) const
{
  Vector2d ofLens = pixel; // the residual changes slowly, so this converges
  for (int iteration = 0; iteration < 30 && !residual.IsNone(); ++iteration) {
    const Vector2d next = pixel - residual.At(ofLens);
    const double change = (next - ofLens).squaredNorm();
    ofLens = next;
    if (!(change > 1e-18))
      break;
  }
  return lens.Unproject(ofLens);
}

std::optional<Vector2d> CameraOptics::PixelOf(const Vector3d& direction) const
{
  const auto ofLens = lens.Project(direction);
  if (!ofLens)
    return std::nullopt;
  return Vector2d(*ofLens + residual.At(*ofLens));
}

std::optional<CameraOptics::Derivatives> CameraOptics::Differentiate(const Vector3d& direction) const
{
  const auto p = lens.Differentiate(direction);
  if (!p)
    return std::nullopt;
  const Matrix2d byPixel = Matrix2d::Identity() + residual.Gradient(p->pixel);
  Derivatives by{byPixel * p->byDirection, MatrixXd::Zero(2, Unknowns())};
  by.byUnknowns.leftCols<LensUnknowns>() = byPixel * p->byLens;
  if (!residual.IsNone()) {
    const VectorXd basis = residual.Basis(p->pixel);
    by.byUnknowns.row(0).segment(LensUnknowns, basis.size()) = basis.transpose();
    by.byUnknowns.row(1).tail(basis.size()) = basis.transpose();
  }
  return by;
}

CameraFitResult FitCamera(const std::vector<SeenPoint>& points, const CameraOptics& start,
                          const std::vector<Pose>& cameraToPoints, const CameraFitSettings& settings)
{
  CameraFitResult result;
  result.isInlier.assign(points.size(), true);
  CameraProblem problem(points, start, cameraToPoints, settings);
  const std::vector<bool> all(points.size(), true);
  for (int pass = 0; pass < 2; ++pass) { // the second with the accuracy that points have as the first one sees them
    problem.Weigh();
    if (!problem.Descend(true, all, 100))
      FailToConverge(points.size());
  }

  const bool isKnown = settings.covariance.size() > 0;
  // Wider at first: what the residual will explain must not be an outlier before.
  const auto judge = [&](double factor, const MatrixXd& covariance) {
    const CameraOptics optics = problem.Optics();
    result.sigmas.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      Matrix2d spread = Matrix2d::Identity();
      if (covariance.size() > 0) {
        const MatrixXd rows = problem.RowsOf(i, optics);
        const Matrix2d leverage = rows * covariance * rows.transpose();
        spread += result.isInlier[i] ? Matrix2d(-leverage) : leverage;
      }
      const Vector2d& error = problem.Errors()[i];
      const double squared = error.dot(SolveSymmetric(spread, error).col(0));
      result.sigmas.push_back(squared >= 0.0 ? std::sqrt(squared) : ErrorScaleOfNone); // one that alone decides something
    }
    const double scale = std::max(Median(result.sigmas) / MedianOfTwo, isKnown ? 1.0 : LeastScale);
    bool changed = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      result.sigmas[i] /= scale;
      const bool isInlier = result.sigmas[i] <= factor * settings.outlierSigmas;
      changed = changed || isInlier != result.isInlier[i];
      result.isInlier[i] = isInlier;
    }
    return changed;
  };
  judge(3.0, {});

  MatrixXd information;
  VectorXd gradient;
  for (int round = 0; round < 8; ++round) {
    std::vector<Vector2d> pixels;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (result.isInlier[i])
        pixels.push_back(points[i].pixel);
    if (!isKnown) {
      const CameraState before = problem.State();
      problem.SetResidual({});
      problem.SetLensPrior(start.lens, 1.0);
      result.misfit = std::max(problem.MedianError(), 1.0);
      problem.SetMisfit(result.misfit);
      problem.SetState({before.lens, VectorXd(), before.poses});
      if (!problem.Descend(false, result.isInlier, 300))
        FailToConverge(points.size());
      result.lensRms = RmsOf(problem, points, result.isInlier);
      result.smoothness = std::numeric_limits<double>::infinity();
      const int centres = std::min(settings.residualCentres, static_cast<int>(pixels.size()) / 2);
      if (centres >= 8) {
        const CameraState alone = problem.State();
        problem.SetResidual(ThinPlate::Over(pixels, centres)); // seen pixels are near enough to those of the lens
        problem.SetState({alone.lens, problem.State().bend, alone.poses});
        problem.SetLensPrior(alone.lens, WidthBesideResidual);
        problem.SetMisfit(1.0);
        problem.Descend(false, result.isInlier, 0);
        result.smoothness = problem.ChooseSmoothness(result.residualFreedoms);
        if (std::isinf(result.smoothness)) {
          problem.SetResidual({});
          problem.SetLensPrior(start.lens, 1.0);
          problem.SetMisfit(result.misfit);
          problem.SetState(alone);
        } else {
          problem.SetSmoothness(result.smoothness);
          result.misfit = 1.0;
        }
      }
    }
    problem.Weigh();
    if (!problem.Descend(false, result.isInlier, 300))
      FailToConverge(points.size());
    problem.Linearise(information, gradient);
    if (!judge(1.0, InverseOfSymmetric(information)))
      break;
  }
  result.rms = RmsOf(problem, points, result.isInlier);
  if (isKnown)
    result.lensRms = result.rms;

  double squares = 0.0;
  const auto used = std::count(result.isInlier.begin(), result.isInlier.end(), true);
  for (std::size_t i = 0; i < points.size(); ++i)
    squares += result.isInlier[i] ? problem.Errors()[i].squaredNorm() : 0.0;
  // Of what is not known before; with a prior on everything every point is one more, and what contradicts it counts.
  const double unknowns = isKnown ? 0.0
                                  : static_cast<double>(PerLens + PerPose * static_cast<Index>(problem.State().poses.size())) +
                                        result.residualFreedoms;
  const double rest = 2.0 * static_cast<double>(used) - unknowns;
  if (isKnown && used > 0) {
    squares = problem.Cost();
    const double spread = 2.0 / (9.0 * rest); // chi squared as a normal number (Wilson and Hilferty 1931)
    result.contradiction = (std::cbrt(squares / rest) - 1.0 + spread) / std::sqrt(spread);
  }
  result.noiseScale = rest > (isKnown ? 0.0 : 4.0) ? std::sqrt(squares / rest) : 1.0;
  // How well a hand places lights is a guess, and many observations know better; few do not, and what is known of a lens stays.
  const double scale = std::max(result.noiseScale, isKnown || rest < 100.0 ? 1.0 : LeastScale);
  result.covariance = problem.Widen(InverseOfSymmetric(information) * scale * scale);
  Finish(problem, result);
  return result;
}

CameraFitResult RefitCamera(const std::vector<SeenPoint>& points, const CameraOptics& start,
                            const std::vector<Pose>& cameraToPoints, const CameraFitSettings& settings,
                            const CameraFitResult& result, const std::vector<bool>& isLeftOut)
{
  const bool isKnown = settings.covariance.size() > 0;
  CameraFitResult refit = result;
  CameraProblem problem(points, {start.lens, isKnown ? start.residual : result.optics.residual}, cameraToPoints, settings);
  problem.SetSmoothness(std::isinf(result.smoothness) ? 0.0 : result.smoothness);
  problem.SetMisfit(result.misfit);
  if (!isKnown && !result.optics.residual.IsNone())
    problem.SetLensPrior(result.optics.lens, WidthBesideResidual);
  problem.SetState({result.optics.lens, problem.BendOf(result.optics.residual), result.poses});
  for (std::size_t i = 0; i < points.size(); ++i)
    refit.isInlier[i] = refit.isInlier[i] && !isLeftOut[i];
  problem.Weigh();
  if (!problem.Descend(false, refit.isInlier, 50))
    FailToConverge(points.size());
  Finish(problem, refit);
  return refit;
}

} // namespace echorama
