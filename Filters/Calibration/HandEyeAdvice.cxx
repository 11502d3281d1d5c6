// SPDX-License-Identifier: BSD-3-Clause
// A new scan adds its information to what is known, wherever it will turn out to be: its residual is expected to be noise. So
// every candidate is judged by the covariance it would lead to, without a simulation. Some 100 candidates, 12x12 each.
#include "Filters/Calibration/HandEyeAdvice.h"
#include "Core/Base/Angles.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Calibration/ConfidenceRadius.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

Pose MeanPose(const std::vector<HandEyePair>& pairs, const std::vector<char>& inlier, const Eigen::Vector3d& target)
{
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (inlier[i]) {
      sum += pairs[i].volumeToWorld.linear();
      place += pairs[i].volumeToWorld * target;
      count += 1.0;
    }
  Pose mean = Pose::Identity();
  mean.linear() = NearestRotation(sum);
  mean.translation() = place / count - mean.linear() * target;
  return mean;
}

std::string AxisText(const Eigen::Vector3d& axis)
{
  std::string text;
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > 1e-9)
      text += (text.empty() ? (axis[i] < 0.0 ? "-" : "") : (axis[i] < 0.0 ? " - " : " + ")) + std::string(1, "xyz"[i]);
  return text;
}

} // namespace

std::vector<HandEyeAdvice> AdviseHandEye(const std::vector<HandEyePair>& pairs, const std::vector<char>& inlier,
                                         const HandEyeSolution& solution, const HandEyeMatrix& covariance,
                                         const HandEyeNoise& noise, const Eigen::Vector3d& target, int degreesOfFreedom)
{
  struct Candidate {
    std::size_t axis;
    double degrees;
    Eigen::Matrix3d covariance;
  };
  std::vector<Eigen::Vector3d> axes;
  for (int x = 0; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x > 0 || y > 0 || (y == 0 && z > 0)) // one of each pair of opposite ones
          axes.emplace_back(x, y, z);

  const Pose mean = MeanPose(pairs, inlier, target);
  std::vector<HandEyePair> asked;
  std::vector<Candidate> candidates;
  for (std::size_t axis = 0; axis < axes.size(); ++axis)
    for (const double degrees : {15.0, -15.0, 30.0, -30.0, 45.0, -45.0, 60.0, -60.0}) {
      HandEyePair pair;
      const Eigen::Vector3d turn = axes[axis].normalized() * degrees * RadiansPerDegree;
      pair.volumeToWorld = mean * MotionAbout(target, turn, Eigen::Vector3d::Zero());
      pair.sensorToTracker = solution.worldToTracker * pair.volumeToWorld * solution.volumeToSensor.inverse();
      asked.push_back(pair);
      candidates.push_back({axis, degrees, Eigen::Matrix3d::Zero()});
    }
  // The model's step turns O about the middle of its scans; the candidates come behind the scans to keep it where it is.
  std::vector<HandEyePair> together = pairs;
  together.insert(together.end(), asked.begin(), asked.end());
  const HandEyeModel model(together, noise, target, static_cast<int>(pairs.size()));
  const Eigen::Matrix<double, 6, 6> ofResidual = model.Covariance(solution.volumeToSensor);
  const Eigen::Matrix<double, 3, 12> top = covariance.topRows<3>();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    // What is known of the target after it (Woodbury).
    const Eigen::Matrix<double, 6, 12> jacobian = model.Jacobian(static_cast<int>(pairs.size() + i), Twist::Zero());
    const Eigen::Matrix<double, 6, 3> gain = jacobian * top.transpose();
    const Eigen::Matrix<double, 6, 6> seen = ofResidual + jacobian * covariance * jacobian.transpose();
    candidates[i].covariance = covariance.topLeftCorner<3, 3>() - gain.transpose() * SolveSymmetric(seen, gain);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.covariance.trace() < b.covariance.trace(); });
  const double before = ConfidenceRadius(covariance.topLeftCorner<3, 3>(), degreesOfFreedom);
  std::vector<HandEyeAdvice> advice;
  std::vector<char> seen(axes.size(), 0);
  for (const Candidate& candidate : candidates) {
    if (seen[candidate.axis])
      continue;
    seen[candidate.axis] = 1;
    HandEyeAdvice one;
    one.axis = axes[candidate.axis].normalized();
    one.degrees = candidate.degrees;
    one.radiusMm = ConfidenceRadius(candidate.covariance, degreesOfFreedom > 0 ? degreesOfFreedom + 6 : 0);
    one.text =
        Format("Turn the volume by %.0f degrees about its axis %s from the mean of the scans: the 95%% radius falls from %.2f to "
               "%.2f mm.",
               one.degrees, AxisText(axes[candidate.axis]).c_str(), before, one.radiusMm);
    advice.push_back(one);
    if (advice.size() == 3)
      break;
  }
  return advice;
}

} // namespace echorama
