// SPDX-License-Identifier: BSD-3-Clause
// Pivot calibration: time, error of the tip and how often the stated 95% region holds, beside the plain least squares that most
// programs solve: all poses stacked into [R -I] [tip; pivot] = -t, by the singular value decomposition.
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/PivotCalibration.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <Eigen/SVD>

using namespace echorama;
using Eigen::Vector3d;

namespace {

const int Trials = benchmark::Trials(500);
const Vector3d Tip(12.0, -8.0, 150.0), Pivot(210.0, -35.0, 320.0);

struct Case {
  const char* name;
  int poses;
  double swingDegrees;
  PoseNoise noise;
  double outliers;
};

std::vector<TimedPose> Recorded(const Case& c, std::uint64_t seed)
{
  Random random(seed);
  std::vector<TimedPose> poses;
  for (int i = 0; i < c.poses; ++i) {
    Pose pose = Pose::Identity(), noise = Pose::Identity();
    pose.linear() = ExpRotation(c.swingDegrees / DegreesPerRadian * Vector3d(random.Normal(), random.Normal(), random.Normal()));
    pose.translation() = Pivot - pose.linear() * Tip;
    noise.linear() =
        ExpRotation(c.noise.degrees / DegreesPerRadian * Vector3d(random.Normal(), random.Normal(), random.Normal()));
    noise.translation() = c.noise.mm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    pose = pose * noise;
    if (random.Uniform() < c.outliers)
      pose.translation() += random.Uniform(20.0, 100.0) * random.Direction();
    poses.push_back({i / 60.0, pose});
  }
  return poses;
}

Vector3d StackedLeastSquares(const std::vector<TimedPose>& poses)
{
  const Eigen::Index count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd A(3 * count, 6);
  Eigen::VectorXd b(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Pose& pose = poses[static_cast<std::size_t>(i)].pose;
    A.block<3, 3>(3 * i, 0) = pose.linear();
    A.block<3, 3>(3 * i, 3) = -Eigen::Matrix3d::Identity();
    b.segment<3>(3 * i) = -pose.translation();
  }
  return A.bdcSvd(Eigen::ComputeThinU | Eigen::ComputeThinV).solve(b).head<3>();
}

} // namespace

int main()
{
  for (const Case& c :
       {Case{"200 poses, swing 25 deg", 200, 25.0, {0.25, 0.7}, 0.0}, Case{"200 poses, swing 6 deg", 200, 6.0, {0.25, 0.7}, 0.0},
        Case{"200 poses, swing 6 deg, noise 0.5 deg 0.2 mm", 200, 6.0, {0.5, 0.2}, 0.0},
        Case{"20 poses, swing 25 deg", 20, 25.0, {0.25, 0.7}, 0.0},
        Case{"200 poses, swing 25 deg, 20% outliers", 200, 25.0, {0.25, 0.7}, 0.2}}) {
    double ours = 0.0, stated = 0.0, plain = 0.0;
    int held = 0;
    PivotParameters parameters;
    parameters.noise = c.noise; // its ratio counts: the scale is estimated
    for (int trial = 0; trial < Trials; ++trial) {
      const std::vector<TimedPose> poses = Recorded(c, static_cast<std::uint64_t>(trial));
      const PivotResult result = CalibratePivot(poses, parameters);
      ours += (result.tip - Tip).squaredNorm();
      stated += result.tipRmsMm * result.tipRmsMm;
      held += (result.tip - Tip).norm() <= result.tipRadius95Mm;
      plain += (StackedLeastSquares(poses) - Tip).squaredNorm();
    }
    const std::vector<TimedPose> poses = Recorded(c, 1);
    const auto [oursSeconds, plainSeconds] =
        benchmark::Duel([&] { CalibratePivot(poses, parameters); }, [&] { StackedLeastSquares(poses); }, 21);
    benchmark::Report(
        "pivot", c.name, "ours", oursSeconds, std::sqrt(ours / Trials), "mm",
        {{"trials", Trials}, {"stated", std::sqrt(stated / Trials)}, {"region_held", held / static_cast<double>(Trials)}});
    benchmark::Report("pivot", c.name, "least squares (SVD)", plainSeconds, std::sqrt(plain / Trials), "mm",
                      {{"trials", Trials}});
  }
}
