// SPDX-License-Identifier: BSD-3-Clause
// Seen from the tool, pose i leaves the residual e_i = p + R_i^T (t_i - q) of tip p and pivot q. With noise u, w (mm, radians) in
// the tool's axes e_i = u + w x p: its covariance is s_t^2 across all and s_r^2 |p|^2 more across the lever, the same for every
// pose. Maximum likelihood therefore minimises the sum of |W(p) e_i|^2 with W the inverse root of that covariance. W depends on
// p, and its derivative must not be left out: the rotations that multiply q are noisy themselves, and plain least squares draws
// the tip towards the sensor when the swing is small, as every regression on a noisy variable does. The derivative takes that
// back, as total least squares does.
//
// Plain least squares has a closed form: with R the mean rotation, (I - R^T R) p = -mean(R_i^T (t_i - mean t)). The matrix on
// the left says how far each direction of the tool swings; where it is singular, the tip is known only up to a line. Poses
// at which the tip was not in place: start from the best of small samples by the median residual, then Cauchy weights, then
// a chi-square test, all linear in the number of poses.
#include "Filters/Calibration/PivotCalibration.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Core/Geometry/ToolPose.h"
#include "Filters/Calibration/CalibrationText.h"
#include "Filters/Calibration/ConfidenceRadius.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <Eigen/Eigenvalues>

namespace echorama {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr int LeastPoses = 4;
constexpr double OutlierChiSquare = 16.27;  // three degrees of freedom, one in a thousand
constexpr double MedianChiSquare = 2.366;   // of three degrees of freedom
constexpr double HopelessPivotScale = 10.0; // residuals of so many times the noise are no noise
constexpr int Samples = 100, SampleSize = 5;
constexpr std::size_t ScoredPoses = 200;
constexpr double TinyMm = 1e-9; // the least scale of residuals, for poses without any noise

[[noreturn]] void RefusePivot(const std::string& reason)
{
  throw Error(Error::Kind::NotPossible, "pivot calibration: " + reason);
}

// "pose 12 (at 3.4 s)", counted from 1.
std::string PoseName(const std::vector<TimedPose>& poses, std::size_t index)
{
  const std::string number = "pose " + std::to_string(index + 1);
  return std::isfinite(poses[index].time) ? number + Format(" (at %.6g s)", poses[index].time) : number;
}

struct Solution {
  Vector3d tip = Vector3d::Zero(), pivot = Vector3d::Zero();

  Vector3d Residual(const Pose& pose) const { return tip + pose.linear().transpose() * (pose.translation() - pivot); }
};

// Weighted least squares; \a weightOf(i) of pose i. \a swing: eigenvalues of I - R^T R, ascending, and their vectors.
struct LeastSquares {
  Eigen::SelfAdjointEigenSolver<Matrix3d> swing;
  Solution solution;
  bool determined = false;
};

template <class Weight>
LeastSquares Solve(const std::vector<Pose>& poses, const Weight& weightOf)
{
  double sum = 0.0;
  Matrix3d turn = Matrix3d::Zero();
  Vector3d place = Vector3d::Zero(), local = Vector3d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double weight = weightOf(i);
    sum += weight;
    turn += weight * poses[i].linear();
    place += weight * poses[i].translation();
  }
  turn /= sum;
  place /= sum;
  for (std::size_t i = 0; i < poses.size(); ++i)
    local += weightOf(i) / sum * (poses[i].linear().transpose() * (poses[i].translation() - place));
  LeastSquares result;
  result.swing.compute(Matrix3d::Identity() - turn.transpose() * turn);
  const Vector3d values = result.swing.eigenvalues();
  result.determined = std::isfinite(values[0]) && values[0] > 1e-9;
  if (result.determined) {
    const Matrix3d& axes = result.swing.eigenvectors();
    result.solution.tip = -(axes * ((axes.transpose() * local).array() / values.array()).matrix());
    result.solution.pivot = turn * result.solution.tip + place;
  }
  return result;
}

std::vector<Pose> SomeOf(const std::vector<Pose>& poses, std::size_t most)
{
  if (poses.size() <= most)
    return poses;
  std::vector<Pose> some;
  for (std::size_t i = 0; i < most; ++i)
    some.push_back(poses[i * poses.size() / most]);
  return some;
}

double MedianResidual(const std::vector<Pose>& poses, const Solution& solution)
{
  std::vector<double> mm;
  for (const Pose& pose : poses)
    mm.push_back(solution.Residual(pose).norm());
  return Median(std::move(mm));
}

// What half of the poses and more agree on, whatever the others say.
Solution RobustStart(const std::vector<Pose>& poses, std::uint64_t seed)
{
  const std::vector<Pose> scored = SomeOf(poses, ScoredPoses);
  Solution best = Solve(poses, [](std::size_t) { return 1.0; }).solution;
  double bestScore = MedianResidual(scored, best);
  for (int sample = 0; sample < Samples && poses.size() > SampleSize; ++sample) {
    Random random(seed, static_cast<std::uint64_t>(sample));
    std::vector<Pose> few;
    for (int i = 0; i < SampleSize; ++i)
      few.push_back(poses[random.Below(poses.size())]);
    const LeastSquares fit = Solve(few, [](std::size_t) { return 1.0; });
    if (!fit.determined)
      continue;
    if (const double score = MedianResidual(scored, fit.solution); score < bestScore) {
      bestScore = score;
      best = fit.solution;
    }
  }
  for (int iteration = 0; iteration < 20; ++iteration) {
    const double scale = std::max(MedianResidual(poses, best), TinyMm);
    const LeastSquares fit = Solve(poses, [&](std::size_t i) {
      const double ratio = best.Residual(poses[i]).norm() / scale;
      return 1.0 / (1.0 + ratio * ratio);
    });
    if (!fit.determined)
      break;
    best = fit.solution;
  }
  return best;
}

// W and its derivatives by the three coordinates of the tip.
struct Whitening {
  Matrix3d W = Matrix3d::Zero();
  std::array<Matrix3d, 3> derivative{Matrix3d::Zero(), Matrix3d::Zero(), Matrix3d::Zero()};

  Whitening(const PoseNoise& noise, const Vector3d& tip)
  {
    const double radians = noise.degrees / DegreesPerRadian, length = tip.norm();
    const double along = 1.0 / noise.mm, across = 1.0 / std::hypot(noise.mm, radians * length);
    W = along * Matrix3d::Identity();
    if (!(length > 1e-9))
      return;
    const Vector3d axis = tip / length;
    const Matrix3d lever = axis * axis.transpose();
    W = across * Matrix3d::Identity() + (along - across) * lever;
    const double slope = -radians * radians * length * across * across * across; // of across, by the length
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Vector3d turned = (Vector3d::Unit(k) - axis * axis[k]) / length; // of the axis
      derivative[static_cast<std::size_t>(k)] = slope * axis[k] * (Matrix3d::Identity() - lever) +
                                                (along - across) * (turned * axis.transpose() + axis * turned.transpose());
    }
  }
};

double Cost(const std::vector<Pose>& poses, const std::vector<char>& use, const PoseNoise& noise, const Solution& solution)
{
  const Whitening whitening(noise, solution.tip);
  double cost = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (use[i])
      cost += (whitening.W * solution.Residual(poses[i])).squaredNorm();
  return cost;
}

// Levenberg-Marquardt on tip and pivot.
Solution MaximumLikelihood(const std::vector<Pose>& poses, const std::vector<char>& use, const PoseNoise& noise,
                           Solution solution)
{
  double cost = Cost(poses, use, noise, solution), damping = 1e-6;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Whitening whitening(noise, solution.tip);
    Matrix6d normal = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (!use[i])
        continue;
      const Vector3d residual = solution.Residual(poses[i]);
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian.leftCols<3>() = whitening.W;
      for (Eigen::Index k = 0; k < 3; ++k)
        jacobian.col(k) += whitening.derivative[static_cast<std::size_t>(k)] * residual;
      jacobian.rightCols<3>() = -whitening.W * poses[i].linear().transpose();
      normal += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * (whitening.W * residual);
    }
    bool better = false, settled = false;
    for (; damping < 1e12 && !better && !settled; damping *= better ? 0.1 : 10.0) {
      Matrix6d damped = normal;
      damped.diagonal() *= 1.0 + damping;
      const Vector6d step = -SolveSymmetric(damped, gradient);
      const Solution next{solution.tip + step.head<3>(), solution.pivot + step.tail<3>()};
      const double nextCost = Cost(poses, use, noise, next);
      settled = step.norm() <= 1e-10 * (1.0 + solution.tip.norm() + solution.pivot.norm());
      better = nextCost < cost;
      if (better) {
        solution = next;
        cost = nextCost;
      }
    }
    if (settled || !better)
      break;
  }
  return solution;
}

// Of tip and pivot, for the noise as stated.
Matrix6d Covariance(const std::vector<Pose>& poses, const std::vector<char>& use, const PoseNoise& noise,
                    const Solution& solution)
{
  const Whitening whitening(noise, solution.tip);
  const Matrix3d weight = whitening.W * whitening.W;
  Matrix6d information = Matrix6d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!use[i])
      continue;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian.leftCols<3>().setIdentity();
    jacobian.rightCols<3>() = -poses[i].linear().transpose();
    information += jacobian.transpose() * weight * jacobian;
  }
  const Matrix6d covariance = InverseOfSymmetric(information);
  return 0.5 * (covariance + covariance.transpose());
}

std::vector<Pose> RigidPoses(const std::vector<TimedPose>& poses)
{
  std::vector<Pose> rigid(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!NearestPose(poses[i].pose.matrix(), rigid[i]))
      throw Error(Error::Kind::BadInput,
                  "pivot calibration: " + PoseName(poses, i) +
                      (poses[i].pose.matrix().allFinite() ? " is not rigid: a rotation and a translation are needed"
                                                          : " holds a number that is not finite"));
  return rigid;
}

// Fills in the swing, and refuses when a direction did not swing.
void MeasureSwing(const std::vector<Pose>& poses, const std::vector<char>& use, double noiseDegrees, double leastDegrees,
                  PivotResult& result)
{
  const LeastSquares fit = Solve(poses, [&use](std::size_t i) { return use[i] ? 1.0 : 0.0; });
  const double noise = noiseDegrees / DegreesPerRadian;
  for (Eigen::Index k = 0; k < 3; ++k) { // the largest first
    const double value = std::max(0.0, fit.swing.eigenvalues()[2 - k] - 2.0 * noise * noise);
    result.swingDegrees[k] = std::asin(std::min(1.0, std::sqrt(value))) * DegreesPerRadian;
    result.swingAxes.col(k) = fit.swing.eigenvectors().col(2 - k);
  }
  if (result.swingDegrees[0] < leastDegrees)
    RefusePivot(Format("the tool turned by only %.2g degrees (RMS); tilt it by 30 degrees and more, to all sides",
                       result.swingDegrees[0]));
  const Vector3d axis = result.swingAxes.col(2);
  if (result.swingDegrees[2] < leastDegrees)
    RefusePivot(
        Format("the tool turned about one axis only, (%.2f, %.2f, %.2f) in its own frame, which itself swung by %.2g degrees "
               "(RMS): the tip is known only up to a line along it; tilt the tool to other sides too",
               axis[0], axis[1], axis[2], result.swingDegrees[2]));
}

// Algebraic, then by distance.
PivotSphere FitSphere(const std::vector<Pose>& poses, const std::vector<char>& use)
{
  PivotSphere sphere;
  Vector3d mean = Vector3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (use[i]) {
      mean += poses[i].translation();
      count += 1.0;
    }
  mean /= count;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (use[i]) {
      const Vector3d x = poses[i].translation() - mean;
      const Eigen::Vector4d row(2.0 * x[0], 2.0 * x[1], 2.0 * x[2], 1.0);
      normal += row * row.transpose();
      right += row * x.squaredNorm();
    }
  const Eigen::Vector4d algebraic = SolveSymmetric(normal, right);
  Vector3d centre = algebraic.head<3>();
  double radius = std::sqrt(std::max(0.0, algebraic[3] + centre.squaredNorm()));
  Eigen::Matrix4d inverse = Eigen::Matrix4d::Zero();
  double squares = 0.0;
  for (int iteration = 0; iteration < 20 && centre.allFinite(); ++iteration) {
    normal.setZero();
    right.setZero();
    squares = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (use[i]) {
        const Vector3d out = poses[i].translation() - mean - centre;
        const double distance = std::max(out.norm(), TinyMm), residual = distance - radius;
        Eigen::Vector4d row;
        row.head<3>() = -out / distance;
        row[3] = -1.0;
        normal += row * row.transpose();
        right -= row * residual;
        squares += residual * residual;
      }
    const SymmetricEigen eigen = EigenOfSymmetric(normal);
    if (!(eigen.values[0] > 1e-7 * eigen.values[3]))
      return sphere;
    inverse = eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
    const Eigen::Vector4d step = inverse * right;
    centre += step.head<3>();
    radius += step[3];
  }
  if (!centre.allFinite() || !(radius > 0.0 && radius < 1e5) || count < 6.0)
    return sphere;
  sphere.known = true;
  sphere.centre = centre + mean;
  sphere.radiusMm = radius;
  sphere.rmsMm = std::sqrt(squares / count);
  sphere.radiusErrorMm = std::sqrt(squares / (count - 4.0) * inverse(3, 3));
  return sphere;
}

// When the poses do not agree: what would make them; empty when nothing does.
std::string ExplainDisagreement(const std::vector<Pose>& poses, double medianMm, std::uint64_t seed)
{
  std::vector<Pose> turned = poses;
  for (Pose& pose : turned)
    pose.linear() = Eigen::Matrix3d(pose.linear().transpose());
  if (MedianResidual(turned, RobustStart(turned, seed)) < 0.2 * medianMm)
    return "; with all rotations the wrong way round they would: is the convention another?";
  return {};
}

std::string OutlierNote(const std::vector<TimedPose>& poses, const std::vector<PivotResidual>& residuals)
{
  constexpr int MostRuns = 6;
  std::string text;
  int runs = 0, left = 0;
  for (std::size_t i = 0; i < poses.size();) {
    if (residuals[i].inlier) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end + 1 < poses.size() && !residuals[end + 1].inlier)
      ++end;
    left += static_cast<int>(end - i) + 1;
    if (++runs <= MostRuns)
      text += (runs > 1 ? ", " : "") + PoseName(poses, i) + (end > i ? " to " + PoseName(poses, end) : "");
    i = end + 1;
  }
  if (runs == 0)
    return {};
  if (runs > MostRuns)
    text += " and others";
  return std::to_string(left) + " of " + std::to_string(poses.size()) + " poses were left out, the tip was not in place: " + text;
}

} // namespace

ParameterList Describe(PivotParameters& p)
{
  return {
      Parameter("NoiseDegrees", p.noise.degrees, {0, 45}, "degrees",
                "Standard deviation of the angle of a pose, about each axis of the tool."),
      Parameter("NoiseMm", p.noise.mm, {0, 100, true}, "mm",
                "Standard deviation of the position of a pose, along each axis of the tool."),
      Parameter(
          "EstimateNoise", p.estimateNoise,
          "Whether the noise is scaled to what the residuals say. Off: it is taken as stated, and decides what is an outlier."),
      Parameter("RejectOutliers", p.rejectOutliers, "Whether poses at which the tip was not in place are left out."),
      Parameter(
          "LeastSwing", p.leastSwingDegrees, {0.1, 45}, "degrees",
          "What every direction of the tool must swing by (RMS), less what the noise pretends; otherwise the tip is refused.")
          .Advanced(),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "Seed of the search among poses with outliers.").Advanced(),
  };
}

PivotResult CalibratePivot(const std::vector<TimedPose>& timed, const PivotParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  if (timed.size() < LeastPoses)
    RefusePivot("at least " + std::to_string(LeastPoses) + " poses are needed, and there are " + std::to_string(timed.size()));
  const std::vector<Pose> poses = RigidPoses(timed);
  const std::size_t count = poses.size();
  PivotResult result;
  std::vector<char> use(count, 1);
  MeasureSwing(poses, use, parameters.noise.degrees, parameters.leastSwingDegrees, result);
  Solution solution = Solve(poses, [](std::size_t) { return 1.0; }).solution; // by least squares, all poses alike
  result.algebraicTip = solution.tip;
  result.algebraicPivot = solution.pivot;
  progress(0.1);

  double scale = 1.0;
  const auto chiSquares = [&] {
    const Whitening whitening(parameters.noise, solution.tip);
    std::vector<double> all;
    for (const Pose& pose : poses)
      all.push_back((whitening.W * solution.Residual(pose)).squaredNorm());
    return all;
  };
  const double tinyScale = TinyMm / parameters.noise.mm;
  if (parameters.rejectOutliers) {
    solution = RobustStart(poses, parameters.seed);
    if (parameters.estimateNoise)
      scale = std::max(tinyScale, std::sqrt(Median(chiSquares()) / MedianChiSquare));
  }
  const int rounds = parameters.rejectOutliers ? 10 : 1;
  for (int round = 0; round < rounds; ++round) {
    progress(0.2 + 0.7 * round / rounds);
    std::vector<char> agree(count, 1);
    if (parameters.rejectOutliers) {
      const std::vector<double> chiSquare = chiSquares();
      for (std::size_t i = 0; i < count; ++i)
        agree[i] = chiSquare[i] <= OutlierChiSquare * scale * scale;
    }
    const bool same = round > 0 && agree == use;
    const std::size_t agreeing = static_cast<std::size_t>(std::count(agree.begin(), agree.end(), 1));
    if (2 * agreeing < count || agreeing < LeastPoses) {
      const double median = MedianResidual(poses, solution);
      RefusePivot(
          Format("only %d of %d poses agree on a fixed point to within the noise; the tips of half of them lie more than %.2g mm "
                 "from it",
                 static_cast<int>(agreeing), static_cast<int>(count), median) +
          ExplainDisagreement(poses, median, parameters.seed));
    }
    use = agree;
    if (same)
      break;
    solution = MaximumLikelihood(poses, use, parameters.noise, solution);
    if (parameters.estimateNoise) {
      const double freedom = 3.0 * static_cast<double>(agreeing) - 6.0;
      scale = std::max(tinyScale, std::sqrt(Cost(poses, use, parameters.noise, solution) / freedom));
    }
  }
  if (parameters.estimateNoise && scale > HopelessPivotScale) {
    const double median = MedianResidual(poses, solution);
    RefusePivot(
        Format("the poses do not turn about a fixed point: half of them place the tip more than %.2g mm from it, %.0f times what "
               "the noise explains",
               median, scale) +
        ExplainDisagreement(poses, median, parameters.seed));
  }
  const double estimated = parameters.estimateNoise ? std::min(scale, HopelessPivotScale) : 1.0;
  MeasureSwing(poses, use, parameters.noise.degrees * estimated, parameters.leastSwingDegrees, result);

  result.tip = solution.tip;
  result.pivot = solution.pivot;
  result.noiseScale = estimated;
  result.covariance = estimated * estimated * Covariance(poses, use, parameters.noise, solution);
  const Matrix3d tipCovariance = result.covariance.topLeftCorner<3, 3>();
  result.tipRmsMm = std::sqrt(tipCovariance.trace());
  result.inliers = static_cast<int>(std::count(use.begin(), use.end(), 1));
  result.tipRadius95Mm = ConfidenceRadius(tipCovariance, parameters.estimateNoise ? 3 * result.inliers - 6 : 0);
  double squares = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double mm = solution.Residual(poses[i]).norm();
    result.residuals.push_back({mm, use[i] != 0});
    squares += use[i] ? mm * mm : 0.0;
  }
  result.rmsMm = std::sqrt(squares / result.inliers);
  result.sphere = FitSphere(poses, use);

  if (const std::string note = OutlierNote(timed, result.residuals); !note.empty())
    result.notes.push_back(note);
  if (estimated > 3.0)
    result.notes.push_back(
        Format("the residuals are %.1f times what the noise explains: the tip slipped, or the tracker is noisier", estimated));
  const double freedom = 3.0 * result.inliers - 6.0, chiSquare = Cost(poses, use, parameters.noise, solution);
  const double shown = std::sqrt(chiSquare / freedom);
  if (!parameters.estimateNoise && chiSquare > freedom + 4.0 * std::sqrt(2.0 * freedom))
    result.notes.push_back(
        Format("the residuals are %.1f times what the noise stated explains, so the 95%% region is too small: let the noise be "
               "estimated, or state more",
               shown));
  else if (!parameters.estimateNoise && freedom >= 18.0 && shown < 0.5)
    result.notes.push_back(
        Format("the residuals are %.2g times what the noise stated explains, so the 95%% region is too large: let the noise be "
               "estimated, or state less",
               shown));
  const PivotSphere& sphere = result.sphere;
  const double lever = result.tip.norm(), sphereError = std::hypot(sphere.radiusErrorMm, result.tipRmsMm);
  if (sphere.known && sphereError < 0.05 * lever && std::fabs(sphere.radiusMm - lever) > 4.0 * sphereError + 1.0)
    result.notes.push_back(
        Format("the positions lie on a sphere of radius %.1f mm, but the tip lies %.1f mm from the sensor: do the "
               "rotations belong to the positions?",
               sphere.radiusMm, lever));
  double farthest = 0.0;
  for (const Pose& pose : poses)
    farthest = std::max(farthest, pose.translation().cwiseAbs().maxCoeff());
  if (farthest < 10.0)
    result.notes.push_back(Format("all positions lie within %.2g mm of the tracker's origin: are they in metres?", farthest));
  if (lever > 400.0 && lever > result.pivot.norm())
    result.notes.push_back(
        Format("the tip lies %.0f mm from the sensor, farther than the pivot from the tracker: are the poses those "
               "of the tracker in the tool's frame?",
               lever));
  progress(1.0);
  return result;
}

} // namespace echorama
