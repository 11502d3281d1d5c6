// SPDX-License-Identifier: BSD-3-Clause
// Starts are the closed form of all scans, which is good when few are wrong, and of triples, which is good when a triple holds no
// wrong one. Triples are drawn at random and sorted before anything is solved: the angle and the shift along the axis of
// a motion are the same on both sides whatever C is, so a triple that holds a wrong scan mostly shows it at once; and
// those that turn far are worth more. The starts that fit best, by a cost that grows with the logarithm and so lets no scan
// dominate, are refined with that cost. From the best of them, those that are far off leave at once; the others are solved anew
// by plain maximum likelihood, and the worst leaves as long as one is wrong (of more than 40 scans the worst tenth of the wrong,
// so that rounds grow with the logarithm of their number); at the end those who agree after all come back.
//
// Cost: some 30 small eigenproblems, a handful of refinements and one for each round; 1.5 ms for 20 scans, and linear in their
// number but for the logarithm.
#include "Filters/Calibration/HandEyeSearch.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Calibration/HandEyeClosedForms.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Eigenvalues>
#include <numeric>

namespace echorama {
namespace {

constexpr double MedianChiSquare6 = 5.348;
constexpr double RareChiSquare6 = 22.458; // exceeded once in a thousand
constexpr double ExplainedScale = 1.5;    // noise alone explains the residuals of most scans: no start leads to a better fit
constexpr std::size_t OneByOne = 40;      // scans, up to which they leave one at a time
constexpr int DrawnTriples = 250, SolvedTriples = 25, RefinedStarts = 4;

// The fit follows 12 numbers of the 6 n, and residuals are smaller for it.
double ScaleOf(const std::vector<double>& chiSquare)
{
  const double count = static_cast<double>(chiSquare.size());
  return std::sqrt(Median(chiSquare) / (MedianChiSquare6 * std::max(0.1, (count - 2.0) / count)));
}

std::vector<double> ChiSquares(const HandEyeModel& model, const HandEyeSolution& solution)
{
  const Eigen::Matrix<double, 6, 6> weight = InverseOfSymmetric(model.Covariance(solution.volumeToSensor));
  std::vector<double> chiSquares;
  for (int i = 0; i < model.Count(); ++i) {
    const Twist residual = model.Residual(i, solution);
    chiSquares.push_back(residual.dot(weight * residual));
  }
  return chiSquares;
}

double SoftCost(const HandEyeModel& model, const HandEyeSolution& solution, double scale)
{
  double cost = 0.0;
  for (const double chiSquare : ChiSquares(model, solution))
    cost += std::log1p(chiSquare / (6.0 * scale * scale));
  return cost;
}

// A triple that is worth solving has a small value.
double Doubt(const std::vector<HandEyePair>& pairs, const std::array<std::size_t, 3>& triple)
{
  constexpr double Angle = 0.01, Shift = 2.0; // of the order of noise: radians, mm
  double contradiction = 0.0;
  std::vector<Pose> sensors, volumes;
  for (int i = 0; i < 3; ++i) {
    const HandEyePair &one = pairs[triple[static_cast<std::size_t>(i)]],
                      &other = pairs[triple[static_cast<std::size_t>((i + 1) % 3)]];
    const Pose A = one.sensorToTracker.inverse() * other.sensorToTracker, B = one.volumeToWorld.inverse() * other.volumeToWorld;
    const Eigen::Vector3d a = LogRotation(A.linear()), b = LogRotation(B.linear());
    contradiction += std::pow((a.norm() - b.norm()) / Angle, 2);
    if (b.norm() > 0.2 && a.norm() > 0.2) // the sign is lost at half a turn, so the size is compared
      contradiction +=
          std::pow((std::abs(a.normalized().dot(A.translation())) - std::abs(b.normalized().dot(B.translation()))) / Shift, 2);
    sensors.push_back(one.sensorToTracker);
    volumes.push_back(one.volumeToWorld);
  }
  const double turn = std::min(SpreadOf(sensors).turns[0], SpreadOf(volumes).turns[0]);
  return (contradiction + 6.0) / std::max(turn * turn, 1e-12);
}

std::vector<HandEyeSolution> Starts(const std::vector<HandEyePair>& pairs, bool withTriples, std::uint64_t seed)
{
  const std::size_t count = pairs.size();
  std::vector<HandEyeSolution> starts{SolveHandEyeByKronecker(pairs)};
  if (!withTriples)
    return starts;

  std::vector<std::array<std::size_t, 3>> triples;
  if (count * (count - 1) * (count - 2) / 6 <= DrawnTriples) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < count; ++j)
        for (std::size_t k = j + 1; k < count; ++k)
          triples.push_back({i, j, k});
  } else {
    Random random(seed);
    while (triples.size() < DrawnTriples) {
      const std::array<std::size_t, 3> triple{random.Below(count), random.Below(count), random.Below(count)};
      if (triple[0] != triple[1] && triple[0] != triple[2] && triple[1] != triple[2])
        triples.push_back(triple);
    }
  }
  std::vector<std::pair<double, std::size_t>> doubts;
  for (std::size_t i = 0; i < triples.size(); ++i)
    doubts.emplace_back(Doubt(pairs, triples[i]), i);
  const std::size_t solved = std::min<std::size_t>(doubts.size(), SolvedTriples);
  std::partial_sort(doubts.begin(), doubts.begin() + static_cast<std::ptrdiff_t>(solved), doubts.end());
  for (std::size_t i = 0; i < solved; ++i) {
    const std::array<std::size_t, 3>& triple = triples[doubts[i].second];
    starts.push_back(SolveHandEyeByKronecker({pairs[triple[0]], pairs[triple[1]], pairs[triple[2]]}));
  }
  return starts;
}

} // namespace

HandEyeSpread SpreadOf(const std::vector<Pose>& poses)
{
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const Pose& pose : poses)
    mean += pose.linear() / static_cast<double>(poses.size());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.compute(Eigen::Matrix3d::Identity() - mean.transpose() * mean);
  return {solver.eigenvalues().cwiseMax(0.0).cwiseSqrt(), solver.eigenvectors().col(0)};
}

std::vector<Eigen::Vector3d> HandEyeRivalAxes(const std::vector<HandEyePair>& pairs, const std::vector<char>& use,
                                              const HandEyeModel& model, const HandEyeSolution& solution, double scale)
{
  // An axis that turns keep or reverse is one of a symmetric matrix Q = R Q R^T; without a trace there are five of these, and
  // I - (D + D^T) / 2, summed over the turns D of the five, is least at those that are kept.
  const double root = std::sqrt(0.5), sixth = std::sqrt(1.0 / 6.0);
  std::array<Eigen::Matrix3d, 5> basis;
  basis.fill(Eigen::Matrix3d::Zero());
  basis[0](0, 1) = basis[0](1, 0) = basis[1](0, 2) = basis[1](2, 0) = basis[2](1, 2) = basis[2](2, 1) = root;
  basis[3].diagonal() << root, -root, 0.0;
  basis[4].diagonal() << sixth, sixth, -2.0 * sixth;
  std::vector<Eigen::Matrix3d> turns;
  const std::size_t first = static_cast<std::size_t>(std::find(use.begin(), use.end(), 1) - use.begin());
  for (std::size_t i = first + 1; i < pairs.size(); ++i)
    if (use[i])
      turns.emplace_back(pairs[first].volumeToWorld.linear().transpose() * pairs[i].volumeToWorld.linear());
  if (turns.empty())
    return {};
  Eigen::Matrix<double, 5, 5> moved = Eigen::Matrix<double, 5, 5>::Zero();
  for (const Eigen::Matrix3d& R : turns)
    for (std::size_t b = 0; b < 5; ++b) {
      const Eigen::Matrix3d turned = R * basis[b] * R.transpose();
      for (std::size_t a = 0; a < 5; ++a) {
        const double kept = 0.5 * basis[a].cwiseProduct(turned).sum();
        moved(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) -= kept;
        moved(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(a)) -= kept;
      }
    }
  const SymmetricEigen kept = EigenOfSymmetric(moved);

  const double sigma = std::sqrt(model.Covariance(solution.volumeToSensor).bottomRightCorner<3, 3>().trace() / 3.0);
  const double limit = std::min(0.035 + 10.0 * sigma * scale, 0.35);
  std::vector<Eigen::Vector3d> axes;
  for (Eigen::Index k = 0; k < 2; ++k) {
    Eigen::Matrix3d Q = Eigen::Matrix3d::Zero();
    for (Eigen::Index a = 0; a < 5; ++a)
      Q += kept.vectors(a, k) * basis[static_cast<std::size_t>(a)];
    const Eigen::Matrix3d candidates = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(Q).eigenvectors();
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Eigen::Vector3d axis = candidates.col(c);
      double off = 0.0;
      for (const Eigen::Matrix3d& R : turns)
        off += (R * axis).cross(axis).squaredNorm() / static_cast<double>(turns.size());
      const bool seen =
          std::any_of(axes.begin(), axes.end(), [&axis](const Eigen::Vector3d& a) { return std::abs(a.dot(axis)) > 0.9; });
      if (std::sqrt(off) < limit && !seen)
        axes.push_back(axis);
    }
  }
  return axes;
}

HandEyeSolution HandEyeRival(const std::vector<HandEyePair>& pairs, const std::vector<char>& use, const HandEyeSolution& solution,
                             const Eigen::Vector3d& axis, const Eigen::Vector3d& target)
{
  HandEyeSolution rival;
  rival.volumeToSensor = solution.volumeToSensor * MotionAbout(target, EIGEN_PI * axis, Eigen::Vector3d::Zero());
  const HandEyePair& first = pairs[static_cast<std::size_t>(std::find(use.begin(), use.end(), 1) - use.begin())];
  rival.worldToTracker = first.sensorToTracker * rival.volumeToSensor * first.volumeToWorld.inverse();
  return rival;
}

// Those far off leave at once, then the worst, one by one or by tenths; who agrees after all comes back.
HandEyeConsensus HandEyeConsensusNear(const HandEyeSolution& start, double scale, const HandEyeModel& model, bool rejectOutliers,
                                      bool estimateNoise, const Progress& progress)
{
  const auto count = static_cast<std::size_t>(model.Count());
  const bool reject = rejectOutliers && count > 3;
  const std::vector<char> all(count, 1);
  HandEyeConsensus consensus;
  consensus.fit = model.Refine(start, all, reject ? std::max(1.0, scale) : 0.0);
  consensus.inlier = all;
  consensus.scale = ScaleOf(consensus.fit.chiSquare);
  double limit = RareChiSquare6;
  if (reject) {
    const double tested = estimateNoise ? std::max(consensus.scale, 0.02) : std::max(consensus.scale, 1.0);
    const double rough = estimateNoise ? 1.0 + 5.0 / (static_cast<double>(count) - 2.0) : 1.0; // the median of few
    limit *= tested * tested * rough * rough;
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < count; ++i)
      order.emplace_back(consensus.fit.chiSquare[i], i);
    std::sort(order.begin(), order.end());
    for (std::size_t i = 3; i < count; ++i) // at least three stay
      if (order[i].first > 2.0 * limit)
        consensus.inlier[order[i].second] = 0;
  }
  bool returned = false;
  for (std::size_t round = 0; round <= 2 * count; ++round) {
    if (reject || round > 0)
      consensus.fit = model.Refine(consensus.fit.solution, consensus.inlier);
    const HandEyeMatrix covariance = model.CovarianceOfStep(consensus.fit.solution, consensus.inlier);
    consensus.square.assign(count, 0.0);
    std::vector<std::pair<double, std::size_t>> beyond;
    for (std::size_t i = 0; i < count; ++i) {
      consensus.square[i] =
          model.PredictedChiSquare(static_cast<int>(i), consensus.fit.solution, covariance, consensus.inlier[i] != 0);
      if (consensus.inlier[i] && consensus.square[i] > limit)
        beyond.emplace_back(-consensus.square[i], i);
    }
    if (!reject)
      break;
    progress(1.0 - 1.0 / (1.0 + 0.1 * static_cast<double>(round)));
    const auto present = static_cast<std::size_t>(std::count(consensus.inlier.begin(), consensus.inlier.end(), 1));
    if (!beyond.empty() && present > 3) {
      std::sort(beyond.begin(), beyond.end());
      const std::size_t some = count > OneByOne ? std::max<std::size_t>(1, beyond.size() / 10) : 1;
      for (std::size_t i = 0; i < std::min(some, present - 3); ++i)
        consensus.inlier[beyond[i].second] = 0;
      continue;
    }
    bool changed = false;
    if (!returned)
      for (std::size_t i = 0; i < count; ++i)
        if (!consensus.inlier[i] && consensus.square[i] <= limit) {
          consensus.inlier[i] = 1;
          changed = true;
        }
    returned = true;
    if (!changed)
      break;
  }
  progress(1.0);
  return consensus;
}

HandEyeConsensus FindHandEyeConsensus(const std::vector<HandEyePair>& pairs, const HandEyeModel& model, bool rejectOutliers,
                                      const Eigen::Vector3d& target, bool estimateNoise, std::uint64_t seed,
                                      const Progress& progress)
{
  const std::size_t count = pairs.size();
  const bool reject = rejectOutliers && count > 3;
  const std::vector<char> all(count, 1);

  // 1. the best starts
  std::vector<std::pair<double, HandEyeSolution>> starts;
  for (const HandEyeSolution& start : Starts(pairs, reject, seed))
    if (start.volumeToSensor.matrix().allFinite() && start.worldToTracker.matrix().allFinite())
      starts.emplace_back(SoftCost(model, start, 1.0), start);
  const auto byCost = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(starts.begin(), starts.end(), byCost);
  starts.resize(std::min<std::size_t>(starts.size(), RefinedStarts));
  progress(0.3);

  // 2. refined; which of them is best is asked with one scale for all
  std::vector<HandEyeModel::Fit> fits;
  double scale = -1.0;
  for (const auto& start : starts) {
    const double own = reject ? std::max(1.0, ScaleOf(ChiSquares(model, start.second))) : 0.0;
    fits.push_back(model.Refine(start.second, all, own, reject ? 12 : 60));
    const double after = ScaleOf(fits.back().chiSquare);
    scale = scale < 0.0 ? after : std::min(scale, after);
    if (after < ExplainedScale)
      break;
    progress(0.3 + 0.4 * static_cast<double>(fits.size()) / static_cast<double>(starts.size()));
  }
  const double common = std::max(1.0, scale);
  std::size_t best = 0;
  double bestCost = -1.0;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const double cost = reject ? SoftCost(model, fits[i].solution, common) : fits[i].cost;
    if (bestCost < 0.0 || cost < bestCost) {
      bestCost = cost;
      best = i;
    }
  }

  // Turns that keep an axis leave the closed form with a choice that only the shifts can make.
  for (const Eigen::Vector3d& axis : HandEyeRivalAxes(pairs, all, model, fits[best].solution, common)) {
    HandEyeModel::Fit rival =
        model.Refine(HandEyeRival(pairs, all, fits[best].solution, axis, target), all, reject ? common : 0.0);
    const double cost = reject ? SoftCost(model, rival.solution, common) : rival.cost;
    if (cost < bestCost) {
      bestCost = cost;
      fits.push_back(std::move(rival));
      best = fits.size() - 1;
    }
  }

  // 3. outliers leave
  return HandEyeConsensusNear(fits[best].solution, common, model, rejectOutliers, estimateNoise, progress.Part(0.7, 1.0));
}

} // namespace echorama
