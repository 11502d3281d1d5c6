// SPDX-License-Identifier: BSD-3-Clause
#include "LandmarkTerm.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <cmath>
#include <map>

namespace echorama {
namespace {

// Beyond so many standard deviations a landmark contradicts a pose; all of them together when they are as unlikely as that.
constexpr double FarSigmas = 4.0;
// Beyond these a difference counts linearly.
constexpr double LinearSigmas = 2.0;

std::map<std::string, Eigen::Vector3d> ByLabel(const std::vector<Landmark>& landmarks, const std::string& name)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadInput, name + ": " + reason); };
  std::map<std::string, Eigen::Vector3d> positions;
  for (const Landmark& landmark : landmarks) {
    if (landmark.label.empty())
      fail("a landmark has no label; landmarks are paired by their labels");
    if (!landmark.position.allFinite())
      fail("the landmark \"" + landmark.label + "\" is not finite");
    if (!positions.emplace(landmark.label, landmark.position).second)
      fail("two landmarks have the label \"" + landmark.label + "\"");
  }
  return positions;
}

// What the sum of so many squared standard normal numbers exceeds as seldom as three of them exceed FarSigmas^2 (Wilson and
// Hilferty 1931).
double MostSquares(double count)
{
  const auto cubeRoot = [](double n, double deviations) {
    return 1.0 - 2.0 / (9.0 * n) + deviations * std::sqrt(2.0 / (9.0 * n));
  };
  const double deviations = (std::cbrt(FarSigmas * FarSigmas / 3.0) - 1.0 + 2.0 / 27.0) / std::sqrt(2.0 / 27.0);
  return count * std::pow(cubeRoot(count, deviations), 3);
}

} // namespace

std::vector<LandmarkPair> PairLandmarks(const std::vector<Landmark>& fixed, const std::string& fixedName,
                                        const std::vector<Landmark>& moving, const std::string& movingName)
{
  ByLabel(fixed, fixedName); // for its checks
  const auto others = ByLabel(moving, movingName);
  std::vector<LandmarkPair> pairs;
  for (const Landmark& landmark : fixed)
    if (const auto other = others.find(landmark.label); other != others.end())
      pairs.push_back({landmark.label, landmark.position, other->second});
  return pairs;
}

LandmarkTerm::LandmarkTerm(const std::vector<LandmarkPair>& pairs, const Pose& fixedToWorld, double sigmaMm)
  : pairs_(pairs), sigmaMm_(sigmaMm)
{
  for (LandmarkPair& pair : pairs_)
    pair.fixed = fixedToWorld * pair.fixed;
}

LandmarkLoss LandmarkTerm::At(const Pose& movingToWorld, const Eigen::Vector3d& centre) const
{
  LandmarkLoss sum;
  const double variance = sigmaMm_ * sigmaMm_, linear = LinearSigmas * LinearSigmas;
  for (const LandmarkPair& pair : pairs_) {
    const Eigen::Vector3d place = movingToWorld * pair.moving, error = place - pair.fixed;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Eigen::Matrix3d::Identity(), -Hat(place - centre);
    const double root = std::sqrt(1.0 + error.squaredNorm() / (variance * linear)); // pseudo-Huber
    sum.loss += linear * (root - 1.0);
    sum.gradient += jacobian.transpose() * error / (variance * root);
    sum.hessian += jacobian.transpose() * jacobian / (variance * root);
  }
  return sum;
}

Pose LandmarkTerm::Nearest(const Pose& start) const
{
  if (Empty())
    return start;
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero(), moving = fixed;
  for (const LandmarkPair& pair : pairs_) {
    fixed += pair.fixed / static_cast<double>(pairs_.size());
    moving += start * pair.moving / static_cast<double>(pairs_.size());
  }
  // The start counts as much as landmarks one standard deviation away from their middle: enough to decide what they leave open,
  // among it the turn about a line on which they nearly lie.
  Eigen::Matrix3d sum = sigmaMm_ * sigmaMm_ * Eigen::Matrix3d::Identity();
  for (const LandmarkPair& pair : pairs_)
    sum += (pair.fixed - fixed) * (start * pair.moving - moving).transpose();
  const Eigen::Matrix3d turn = NearestRotation(sum);
  Pose nearest = start;
  nearest.linear() = turn * start.linear();
  nearest.translation() = turn * (start.translation() - moving) + fixed;
  return nearest;
}

bool LandmarkTerm::Agrees(const Pose& movingToWorld, double slackMm) const
{
  const double variance = sigmaMm_ * sigmaMm_ + slackMm * slackMm;
  double sum = 0.0;
  for (const LandmarkPair& pair : pairs_) {
    const double square = (movingToWorld * pair.moving - pair.fixed).squaredNorm() / variance;
    if (!(square <= FarSigmas * FarSigmas))
      return false;
    sum += square;
  }
  return Empty() || sum <= MostSquares(3.0 * static_cast<double>(pairs_.size()));
}

std::string LandmarkTerm::Worst(const Pose& movingToWorld) const
{
  const auto off = [&](const LandmarkPair& pair) { return (movingToWorld * pair.moving - pair.fixed).norm(); };
  const auto worst =
      std::max_element(pairs_.begin(), pairs_.end(), [&](const auto& a, const auto& b) { return off(a) < off(b); });
  return worst == pairs_.end() ? std::string() : "\"" + worst->label + "\" is " + Format("%.1f", off(*worst)) + " mm off";
}

} // namespace echorama
