// SPDX-License-Identifier: BSD-3-Clause
// Levenberg-Marquardt over rigid motions, coarse to fine. A level compares what the metric sees at points of both volumes
// (Metric*.cxx); here are the steps, and what is said about the result.
//
// Merit. Gauss-Newton follows the differences inside the overlap and does not see its border. Whether a step is kept is
// decided by the merit: on the coarse levels the similarity summed over the overlap, where every point that agrees better
// than chance adds, so that volumes are not driven apart; on the last level its mean, because the pull of the
// overlap alone would shift the answer by some tenths of a voxel.
//
// Within 0.002 voxels of the answer the gradient decides too: its root lies a little beside the top of the merit, because weights
// move with the pose, and from that top no step leads up any more.
//
// Step length. Speckle that differs between the volumes has gradients too; Gauss-Newton takes them for signal, its Hessian is
// too large and its steps too short by the same factor again and again. How much the gradient really changed over the
// last step tells the factor (a secant), and the next step is longer by it.
//
// Covariance. The curvature is measured: central differences of the analytic gradient. The noise of the gradient is measured
// too: its parts, summed over blocks of tissue larger than the speckle's and the windows' correlation, vary from block to block,
// whatever the correlation inside. Both give the covariance of the estimate as H^-1 B H^-1. Errors that are correlated from block
// to block are not seen: waves of 5 to 27 voxels, of which the longest span two blocks, make the true variance 1.4 times larger.
//
// Landmarks. They are weighed against the images by the noise of the gradient, which the blocks of tissue tell at each level's
// start: far from home it is large and landmarks lead, near it the images do, in all directions that they determine.
//
// Few blocks. Blocks at the border hold little, so how many there are says little. With s the squared gradient of a block,
// n = (5/3) (sum s)^2 / (sum s^2) equal blocks would vary as much: s is a sum over three directions, and by chance alone the mean
// of s^2 is 5/3 of its squared mean. The fit makes the sum of the gradients vanish. That takes six of the 3 n numbers that n
// blocks say, so the squares that are left are too small by the factor (3 n - 6) / (3 n).
#include "LocalAlign.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Stage {
  const MetricLevel *fixed, *moving;
  double VoxelMm() const { return std::max(fixed->voxelMm, moving->voxelMm); }
};

// The coarsest level that is not coarser than the octave; the finest when all are.
const MetricLevel& LevelAt(const MetricPyramid& pyramid, int octave)
{
  const MetricLevel* found = &pyramid.levels.front();
  for (const MetricLevel& level : pyramid.levels)
    if (level.octave <= octave && level.octave > found->octave)
      found = &level;
  return *found;
}

// Pairs of levels of like resolution, the coarsest first.
std::vector<Stage> StagesOf(const MetricPyramid& fixed, const MetricPyramid& moving, const LocalAlignParameters& p)
{
  const int coarsest = std::min(fixed.levels.back().octave, moving.levels.back().octave);
  const int finest = std::max(fixed.levels.front().octave, moving.levels.front().octave);
  std::vector<Stage> all;
  for (int octave = std::max(coarsest, finest); octave >= finest; --octave) {
    const Stage stage{&LevelAt(fixed, octave), &LevelAt(moving, octave)};
    if (all.empty() || all.back().fixed != stage.fixed || all.back().moving != stage.moving)
      all.push_back(stage);
  }
  constexpr double Slack = 1.001;
  std::size_t first = 0, last = all.size() - 1;
  while (p.finestMm > 0.0 && last > 0 && all[last].VoxelMm() * Slack < p.finestMm)
    --last;
  while (p.coarsestMm > 0.0 && first < last && all[first].VoxelMm() > p.coarsestMm * Slack)
    ++first;
  return {all.begin() + static_cast<std::ptrdiff_t>(first), all.begin() + static_cast<std::ptrdiff_t>(last) + 1};
}

Pose Moved(const Pose& pose, const Eigen::Vector3d& centre, const Vector6& twist)
{
  Pose moved = MotionAbout(centre, twist.tail<3>(), twist.head<3>()) * pose;
  moved.linear() = Eigen::Quaterniond(moved.linear()).normalized().toRotationMatrix();
  return moved;
}

struct Sums : MetricSums {
  double landmarkLoss = 0.0; ///< as much as it counts beside `similar`
};

class LocalSearch {
public:
  LocalSearch(const MetricPyramid& fixed, const Pose& fixedToWorld, const MetricPyramid& moving, const Pose& movingToWorld,
              const LocalAlignParameters& p)
    : p_(p), fixedToWorld_(fixedToWorld), start_(movingToWorld), pose_(movingToWorld)
  {
    CheckRanges(p);
    if (fixed.metric != moving.metric || fixed.levels.empty() || moving.levels.empty())
      throw Error(Error::Kind::BadInput, fixed.name + " and " + moving.name +
                                             " cannot be compared: they were prepared for different metrics (" + fixed.metric +
                                             ", " + moving.metric + ")");
    if (!IsRotation(fixedToWorld.linear()) || !IsRotation(movingToWorld.linear()) || !fixedToWorld.matrix().allFinite() ||
        !movingToWorld.matrix().allFinite())
      throw Error(Error::Kind::BadInput, fixed.name + " and " + moving.name + ": their poses must be rigid and finite");
    metric_ = &MetricNamed(fixed.metric);
    stages_ = StagesOf(fixed, moving, p);
    centre_ = movingToWorld * moving.centre;
  }

  LocalAlignResult Align(const Progress& progress)
  {
    for (std::size_t s = 0; s < stages_.size(); ++s) {
      progress(static_cast<double>(s) / static_cast<double>(stages_.size()));
      if (!Enter(stages_[s]))
        break;
      Descend(s + 1 == stages_.size(), static_cast<double>(s) / static_cast<double>(stages_.size()), progress);
    }
    progress(1.0);
    return Result();
  }

  LocalAlignResult Evaluate()
  {
    converged_ = Enter(stages_.back());
    return Result();
  }

private:
  // Draws the points of a level; whether the volumes overlap there.
  bool Enter(const Stage& stage)
  {
    ComparisonSetup setup;
    setup.metric = metric_;
    setup.fixed = stage.fixed;
    setup.moving = stage.moving;
    setup.fixedToWorld = fixedToWorld_;
    setup.startToWorld = start_;
    setup.points = p_.points;
    setup.part = p_.part;
    setup.blockMm = 12.0 * stages_.back().VoxelMm();
    setup.seed = p_.seed;
    comparison_ = ComparePoints(setup);
    voxelMm_ = stage.VoxelMm();
    trust_ = 0.0;
    sums_ = At(pose_);
    if (!(sums_.weight > 0.0)) {
      sums_ = Sums();
      return false;
    }
    centre_ = sums_.moment / sums_.weight;
    Trust();
    sums_ = At(pose_);
    return true;
  }

  // How much of the images' loss a unit of the landmarks' is worth: the squared noise of the images' gradient over their Hessian,
  // in the direction in which it is largest. So landmarks have their say there; elsewhere a few times more than they deserve is
  // still little.
  void Trust()
  {
    if (p_.landmarks.Empty())
      return;
    BlockGradients blocks;
    const MetricSums sums = comparison_->At(pose_, centre_, &blocks);
    const Eigen::VectorXd unit = sums.hessian.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const SymmetricEigen bent = EigenOfSymmetric(unit.asDiagonal() * sums.hessian * unit.asDiagonal());
    const Eigen::VectorXd strength = bent.values.cwiseMax(1e-9).cwiseSqrt();
    const Eigen::MatrixXd whiten = strength.cwiseInverse().asDiagonal() * bent.vectors.transpose() * unit.asDiagonal();
    Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(6, 6);
    for (const Vector6& block : blocks) {
      const Eigen::VectorXd white = whiten * block;
      noise += white * white.transpose();
    }
    trust_ = EigenOfSymmetric(noise).values.maxCoeff();
    const double chance = sums.loss / (sums.weight - sums.similar);
    similarOfLoss_ = chance > 0.0 && std::isfinite(chance) ? 1.0 / chance : 0.0;
    if (!std::isfinite(trust_))
      trust_ = 0.0;
  }

  Sums At(const Pose& pose) const
  {
    Sums sums{comparison_->At(pose, centre_)};
    if (trust_ > 0.0) {
      const LandmarkLoss landmarks = p_.landmarks.At(pose, centre_);
      sums.gradient += trust_ * landmarks.gradient;
      sums.hessian += trust_ * landmarks.hessian;
      sums.landmarkLoss = 2.0 * trust_ * similarOfLoss_ * landmarks.loss; // gradients are of half the loss
    }
    return sums;
  }

  double Merit(const Sums& sums, bool isLast) const
  {
    if (!(sums.weight > 0.0))
      return -std::numeric_limits<double>::infinity();
    return (sums.similar - sums.landmarkLoss) / (isLast ? sums.weight : comparison_->SmallerWeight());
  }

  void Descend(bool isLast, double fraction, const Progress& progress)
  {
    const double small = (isLast ? 0.002 : 0.02) * voxelMm_, stop = isLast ? p_.stopVoxels * voxelMm_ : small;
    const double longest = 1.5 * voxelMm_;
    const double leastShare = std::min(std::max(p_.minimumOverlap, isLast ? 0.7 * sums_.share : 0.0), sums_.share);
    double damping = 1e-3, stretch = 1.0, merit = Merit(sums_, isLast);
    converged_ = false;
    bool isDone = false;
    for (int iteration = 0; iteration < p_.iterations && !isDone; ++iteration) {
      progress(fraction);
      Matrix6 damped = sums_.hessian;
      const double most = damped.diagonal().maxCoeff();
      if (!(most > 0.0))
        return;
      for (int d = 0; d < 6; ++d)
        damped(d, d) += damping * damped(d, d) + 1e-9 * std::max(damped(d, d), 1e-6 * most);
      const Vector6 toRoot = SolveSymmetric(damped, sums_.gradient);
      Vector6 step = -stretch * toRoot;
      if (!step.allFinite())
        return;
      // What the step does to the points of the overlap, at most.
      const double radius = Radius();
      const double length = step.head<3>().norm() + radius * step.tail<3>().norm();
      if (length > longest)
        step *= longest / length;
      const Pose trial = Moved(pose_, centre_, step);
      const Sums sums = At(trial);
      const double trialMerit = Merit(sums, isLast);
      const Vector6 fromTrial = SolveSymmetric(damped, sums.gradient);
      const bool isCloser = isLast && length < small && sums.gradient.dot(fromTrial) < sums_.gradient.dot(toRoot);
      if (sums.share >= leastShare && (trialMerit > merit || isCloser)) {
        const double expected = step.dot(sums_.hessian * step), real = step.dot(sums.gradient - sums_.gradient);
        stretch = real > 0.0 ? std::clamp(expected / real, 1.0, 5.0) : 1.0;
        pose_ = trial;
        sums_ = sums;
        merit = trialMerit;
        damping = std::max(damping * 0.2, 1e-6);
      } else {
        stretch = 1.0;
        damping = std::min(std::max(damping * 8.0, 1e-2), 1e6);
      }
      converged_ = length < small;
      isDone = length < stop;
    }
  }

  // Of the overlap about its centre, as the Hessian weighs it.
  double Radius() const
  {
    const double moves = sums_.hessian.topLeftCorner<3, 3>().trace(), turns = sums_.hessian.bottomRightCorner<3, 3>().trace();
    return moves > 0.0 ? std::sqrt(turns / moves) : 0.0;
  }

  LocalAlignResult Result()
  {
    if (std::exchange(trust_, 0.0) > 0.0)
      sums_ = At(pose_); // what the images say is told of them alone
    LocalAlignResult result;
    result.volumeToWorld = pose_;
    result.voxelMm = voxelMm_;
    result.centre = centre_;
    result.overlap = std::clamp(sums_.share, 0.0, 1.0);
    if (!(sums_.weight > 0.0))
      return result;
    centre_ = result.centre = sums_.moment / sums_.weight;
    result.similarity = sums_.similar / sums_.weight;
    result.score = comparison_->SmallerWeight() > 0.0 ? sums_.similar / comparison_->SmallerWeight() : 0.0;
    result.converged = converged_;
    if (!p_.withInformation)
      return result;
    Inform(result);
    result.information += p_.landmarks.At(pose_, centre_).hessian;
    return result;
  }

  void Inform(LocalAlignResult& result) const
  {
    BlockGradients blocks;
    const MetricSums here = comparison_->At(pose_, centre_, &blocks);
    const double radius = std::max(Radius(), voxelMm_), h = 0.5 * voxelMm_;
    Matrix6 curvature = Matrix6::Zero();
    for (int d = 0; d < 6; ++d) {
      const double step = d < 3 ? h : h / radius;
      const Vector6 twist = step * Vector6::Unit(d);
      curvature.col(d) = (comparison_->At(Moved(pose_, centre_, twist), centre_).gradient -
                          comparison_->At(Moved(pose_, centre_, -twist), centre_).gradient) /
                         (2.0 * step);
    }
    curvature = 0.5 * (curvature + curvature.transpose()).eval();

    // In units of length for turns too, so that eigenvalues can be compared.
    Vector6 scale;
    scale << 1.0, 1.0, 1.0, 1.0 / radius, 1.0 / radius, 1.0 / radius;
    const Matrix6 gaussNewton = scale.asDiagonal() * here.hessian * scale.asDiagonal();
    curvature = scale.asDiagonal() * curvature * scale.asDiagonal();
    const double largest = EigenOfSymmetric(gaussNewton).values.maxCoeff();
    if (!(largest > 0.0))
      return;
    const Matrix6 regular = gaussNewton + 1e-9 * largest * Matrix6::Identity();
    const Matrix6 unit = InverseOfSymmetric(regular);
    Matrix6 noise = Matrix6::Zero();
    double sum = 0.0, squares = 0.0;
    for (const Vector6& block : blocks) {
      const Vector6 g = scale.asDiagonal() * block;
      const double size = g.dot(unit * g);
      noise += g * g.transpose();
      sum += size;
      squares += size * size;
    }
    const double count = 5.0 / 3.0 * sum * sum / squares;
    if (!(count >= 2.0)) // one block cannot vary
      return;
    const double fitted = 3.0 * count / std::max(3.0 * count - 6.0, 3.0), factor = fitted * sum / 6.0;
    if (!(factor > 0.0) || !std::isfinite(factor))
      return;
    // Few blocks say little about 21 numbers: they are drawn towards what all directions have in common.
    constexpr double Prior = 12.0;
    noise = (count * fitted * noise + Prior * factor * regular) / (count + Prior);
    // Directions in which the measure does not curve down at all are as good as not known.
    const SymmetricEigen bent = EigenOfSymmetric(curvature);
    const Vector6 kept = bent.values.cwiseMax(1e-3 * largest);
    const Matrix6 hessian = bent.vectors * kept.asDiagonal() * bent.vectors.transpose();
    const Matrix6 unscale = scale.cwiseInverse().asDiagonal();
    Information information = unscale * (hessian * SolveSymmetric(noise, hessian)) * unscale;
    information = 0.5 * (information + information.transpose()).eval();
    if (!information.allFinite())
      return;
    result.information = information;
    result.independentVoxels = here.loss / factor;
  }

  const LocalAlignParameters p_;
  const Metric* metric_ = nullptr;
  Pose fixedToWorld_, start_, pose_;
  std::vector<Stage> stages_;
  std::unique_ptr<LevelComparison> comparison_;
  Sums sums_;
  double trust_ = 0.0, similarOfLoss_ = 0.0; // of landmarks
  Eigen::Vector3d centre_;
  double voxelMm_ = 0.0;
  bool converged_ = false;
};

} // namespace

ParameterList Describe(LocalAlignParameters& p)
{
  return {
      Parameter("CoarsestMm", p.coarsestMm, {0, Unlimited}, "mm",
                "The first level is the coarsest whose voxels are not larger. 0: the coarsest of both volumes."),
      Parameter("FinestMm", p.finestMm, {0, Unlimited}, "mm",
                "The last level is the finest whose voxels are not smaller. 0: the finest of both volumes."),
      Parameter("Iterations", p.iterations, {1, 1000}, "", "Steps on a level, at most."),
      Parameter("Points", p.points, ComparedPoints, "", "Random points of each volume that are compared on each level, at most."),
      Parameter("MinimumOverlap", p.minimumOverlap, {0.001, 1}, "",
                "Steps to less overlap are not taken, as a share of the smaller volume."),
      Parameter("StopVoxels", p.stopVoxels, {1e-7, 0.002}, "voxels",
                "The last level ends with a step that moves no point further."),
      Parameter("Part", p.part, {0, 2}, "",
                "0: all points; 1 or 2: one of two disjoint halves, a 3D checkerboard of blocks of 12 voxels."),
  };
}

LocalAlignResult LocalAlign(const MetricPyramid& fixed, const Pose& fixedToWorld, const MetricPyramid& moving,
                            const Pose& movingToWorld, const LocalAlignParameters& parameters, const Progress& progress)
{
  return LocalSearch(fixed, fixedToWorld, moving, movingToWorld, parameters).Align(progress);
}

LocalAlignResult Evaluate(const MetricPyramid& fixed, const Pose& fixedToWorld, const MetricPyramid& moving,
                          const Pose& movingToWorld, const LocalAlignParameters& parameters)
{
  return LocalSearch(fixed, fixedToWorld, moving, movingToWorld, parameters).Evaluate();
}

} // namespace echorama
