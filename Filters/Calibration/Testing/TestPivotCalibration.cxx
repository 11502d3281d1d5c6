// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Calibration/ConfidenceRadius.h"
#include "Filters/Calibration/PivotCalibration.h"
#include "Readers/PoseLog.h"
#include "Testing/Sanitized.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <functional>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

constexpr double DegreesPerRadian = 57.29577951308232;
const Vector3d Tip(12.0, -8.0, 150.0), Pivot(210.0, -35.0, 320.0);

struct Motion {
  int poses = 100;
  double tiltDegrees = 30.0; // standard deviation, about two axes
  double spinDegrees = 30.0; // about the third, the way to the tip
  PoseNoise noise{0.25, 0.7};
};

// A tool that is turned about its tip. \a noise: in the tool's axes.
std::vector<TimedPose> Turned(const Motion& motion, std::uint64_t seed)
{
  Random random(seed);
  std::vector<TimedPose> poses;
  for (int i = 0; i < motion.poses; ++i) {
    const Vector3d turn(motion.tiltDegrees * random.Normal(), motion.tiltDegrees * random.Normal(),
                        motion.spinDegrees * random.Normal());
    Pose pose = Pose::Identity();
    pose.linear() = ExpRotation(Vector3d(0.4, -0.9, 1.7)) * ExpRotation(turn / DegreesPerRadian);
    pose.translation() = Pivot - pose.linear() * Tip;
    Pose noise = Pose::Identity();
    const Vector3d w(random.Normal(), random.Normal(), random.Normal());
    noise.linear() = ExpRotation(motion.noise.degrees / DegreesPerRadian * w);
    noise.translation() = motion.noise.mm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    poses.push_back({i / 60.0, pose * noise});
  }
  return poses;
}

Motion Exact(Motion motion = {})
{
  motion.noise = {0.0, 0.0};
  return motion;
}

void Refused(const std::vector<TimedPose>& poses, Error::Kind kind, const std::string& words,
             const PivotParameters& parameters = {})
{
  ExpectRefused([&] { CalibratePivot(poses, parameters); }, kind,
                kind == Error::Kind::InvalidParameter ? "" : "pivot calibration", words);
}

bool HasNote(const PivotResult& result, const std::string& words)
{
  for (const std::string& note : result.notes)
    if (note.find(words) != std::string::npos)
      return true;
  return false;
}

} // namespace

TEST(PivotCalibration, Exact)
{
  const PivotResult result = CalibratePivot(Turned(Exact(), 1));
  EXPECT_LT((result.tip - Tip).norm(), 1e-9);
  EXPECT_LT((result.pivot - Pivot).norm(), 1e-9);
  EXPECT_LT((result.algebraicTip - Tip).norm(), 1e-9);
  EXPECT_EQ(result.inliers, 100);
  EXPECT_LT(result.rmsMm, 1e-9);
  ASSERT_TRUE(result.sphere.known);
  EXPECT_LT((result.sphere.centre - Pivot).norm(), 1e-6);
  EXPECT_NEAR(result.sphere.radiusMm, Tip.norm(), 1e-6);
  EXPECT_TRUE(result.notes.empty()) << result.notes[0];

  // The tip may be the sensor itself: then nothing moves.
  std::vector<TimedPose> still = Turned(Exact(), 1);
  for (TimedPose& pose : still)
    pose.pose.translation() = Pivot;
  const PivotResult zero = CalibratePivot(still);
  EXPECT_LT(zero.tip.norm(), 1e-9);
  EXPECT_FALSE(zero.sphere.known);
}

// Whether the stated region holds, and whether anything is gained over least squares.
TEST(PivotCalibration, RegionHoldsAndBoundIsReached)
{
  ECHORAMA_SKIP_SANITIZED();
  struct Case {
    Motion motion;
    bool estimate;
    std::uint64_t seed;
  };
  for (const Case& c : {Case{{100, 30.0, 30.0, {0.25, 0.7}}, false, 1000}, Case{{100, 30.0, 30.0, {0.25, 0.7}}, true, 11000},
                        Case{{8, 30.0, 60.0, {0.25, 0.7}}, true, 21000}, Case{{200, 6.0, 6.0, {0.25, 0.3}}, false, 31000},
                        Case{{200, 6.0, 6.0, {0.5, 0.2}}, true, 41000}, Case{{60, 20.0, 20.0, {0.75, 2.1}}, true, 51000}}) {
    constexpr int Trials = 500;
    int held = 0;
    double squares = 0.0, stated = 0.0, algebraic = 0.0, mahalanobis = 0.0;
    PivotParameters parameters;
    parameters.noise = c.estimate ? PoseNoise{c.motion.noise.degrees / 2, c.motion.noise.mm / 2} : c.motion.noise;
    parameters.estimateNoise = c.estimate;
    parameters.rejectOutliers = c.seed == 1000; // the search takes most of the time, and must cost no accuracy
    for (int trial = 0; trial < Trials; ++trial) {
      const PivotResult result = CalibratePivot(Turned(c.motion, c.seed + static_cast<std::uint64_t>(trial)), parameters);
      const double error = (result.tip - Tip).norm();
      held += error <= result.tipRadius95Mm;
      squares += error * error;
      algebraic += (result.algebraicTip - Tip).squaredNorm();
      stated += result.tipRmsMm * result.tipRmsMm;
      Eigen::Matrix<double, 6, 1> off;
      off << result.tip - Tip, result.pivot - Pivot;
      mahalanobis += off.dot(SolveSymmetric(result.covariance, off).col(0)) / Trials;
    }
    const double rms = std::sqrt(squares / Trials), bound = std::sqrt(stated / Trials), plain = std::sqrt(algebraic / Trials);
    SCOPED_TRACE("case " + std::to_string(c.seed) + ": held " + std::to_string(held) + ", rms " + std::to_string(rms) +
                 ", stated " + std::to_string(bound) + ", plain " + std::to_string(plain));
    EXPECT_GE(held, 465);
    EXPECT_NEAR(mahalanobis, 6.0, c.motion.poses < 20 ? 1.6 : 1.0); // six numbers; of 8 poses the scale has 18 degrees of freedom
    EXPECT_LE(held, 485);
    EXPECT_NEAR(rms / bound, 1.0, 0.08);
    EXPECT_LT(rms, 1.02 * plain);
  }
}

TEST(PivotCalibration, OutliersAreNamed)
{
  for (const bool estimate : {false, true}) {
    double clean = 0.0, dirty = 0.0;
    for (std::uint64_t trial = 0; trial < 40; ++trial) {
      std::vector<TimedPose> poses = Turned({}, 300 + trial);
      PivotParameters parameters;
      parameters.estimateNoise = estimate;
      clean += (CalibratePivot(poses, parameters).tip - Tip).squaredNorm();
      Random random(7, trial);
      for (std::size_t i = 0; i < 15; ++i) // before the tip was put down
        poses[i].pose.translation() += random.Uniform(15.0, 100.0) * random.Direction();
      for (std::size_t i = 60; i < 75; ++i) // a tracker that errs
        poses[i].pose.linear() = poses[i].pose.linear() * ExpRotation(random.Uniform(0.3, 3.0) * Vector3d(0.8, 0.6, 0.0));
      const PivotResult result = CalibratePivot(poses, parameters);
      dirty += (result.tip - Tip).squaredNorm();
      EXPECT_GE(result.inliers, 65);
      EXPECT_LE(result.inliers, 70);
      EXPECT_FALSE(result.residuals[3].inlier);
      EXPECT_FALSE(result.residuals[61].inlier);
      EXPECT_TRUE(HasNote(result, "poses were left out")) << result.notes.size();
      EXPECT_TRUE(HasNote(result, "pose 1 (at 0 s) to pose 15 (at 0.233333 s)"));
    }
    EXPECT_LT(std::sqrt(dirty / clean), 1.5);
  }
  PivotParameters all;
  all.rejectOutliers = false;
  std::vector<TimedPose> poses = Turned({}, 300);
  poses[5].pose.translation().x() += 60.0;
  const PivotResult result = CalibratePivot(poses, all);
  EXPECT_EQ(result.inliers, 100);
  EXPECT_TRUE(HasNote(result, "times what the noise explains"));
}

// The same in other units, with outliers and the noise as it is stated: only poses close to the tip may decide where to begin.
TEST(PivotCalibration, OutliersAreFoundInAnyUnit)
{
  PivotParameters parameters;
  parameters.estimateNoise = false;
  std::vector<TimedPose> poses = Turned({}, 301);
  Random random(7);
  for (std::size_t i = 0; i < 40; ++i)
    poses[i].pose.translation() += random.Uniform(15.0, 100.0) * random.Direction();
  const PivotResult expected = CalibratePivot(poses, parameters);
  EXPECT_EQ(expected.inliers, 60);
  EXPECT_LT((expected.tip - Tip).norm(), 1.5 * expected.tipRadius95Mm);
  const double mm = parameters.noise.mm;
  for (const double unit : {0.01, 100.0}) {
    SCOPED_TRACE(unit);
    std::vector<TimedPose> scaled = poses;
    for (TimedPose& pose : scaled)
      pose.pose.translation() *= unit;
    parameters.noise.mm = unit * mm;
    const PivotResult result = CalibratePivot(scaled, parameters);
    EXPECT_EQ(result.inliers, expected.inliers);
    EXPECT_LT((result.tip / unit - expected.tip).norm(), 1e-5);
    EXPECT_NEAR(result.tipRadius95Mm / unit, expected.tipRadius95Mm, 1e-6);
  }
}

// Three numbers per pose, less the six that are fitted.
TEST(PivotCalibration, TheRegionOfFewPosesKnowsThatTheyAreFew)
{
  PivotParameters parameters;
  parameters.rejectOutliers = false;
  for (const int count : {4, 5, 9})
    for (const bool estimate : {false, true}) {
      parameters.estimateNoise = estimate;
      const PivotResult result = CalibratePivot(Turned({count, 30.0, 60.0, {0.25, 0.7}}, 3), parameters);
      const Eigen::Matrix3d covariance = result.covariance.topLeftCorner<3, 3>();
      EXPECT_DOUBLE_EQ(result.tipRadius95Mm, ConfidenceRadius(covariance, estimate ? 3 * count - 6 : 0)) << count;
    }
}

// Positions on a circle lie on many spheres. Those of a cap of b degrees (RMS) tell theirs by how far they leave the plane, which
// goes with the square of b.
TEST(PivotCalibration, ASphereIsKnownWhenThePositionsMakeOne)
{
  const auto sphereOf = [](double tiltDegrees, bool circle) {
    std::vector<TimedPose> poses;
    for (int i = 0; i < 200; ++i) {
      // About the lever it spins freely; the lever leans by as much everywhere, or by anything up to twice that.
      const double azimuth = 2.4 * i, lean = circle ? 1.0 : 2.0 * std::sqrt((i + 0.5) / 200.0) / std::sqrt(2.0);
      const Vector3d lever = Tip.normalized(), side = lever.unitOrthogonal(), other = lever.cross(side);
      const double radians = tiltDegrees * std::sqrt(2.0) / DegreesPerRadian * lean;
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation(radians * (std::cos(azimuth) * side + std::sin(azimuth) * other)) *
                      ExpRotation(0.7 * std::sin(1.3 * i) * lever);
      pose.translation() = Pivot - pose.linear() * Tip;
      poses.push_back({i / 60.0, pose});
    }
    PivotParameters parameters;
    parameters.leastSwingDegrees = 0.5;
    return CalibratePivot(poses, parameters).sphere;
  };
  EXPECT_FALSE(sphereOf(20.0, true).known);
  EXPECT_FALSE(sphereOf(1.2, false).known);
  for (const double degrees : {2.5, 20.0}) {
    const PivotSphere sphere = sphereOf(degrees, false);
    ASSERT_TRUE(sphere.known) << degrees;
    EXPECT_NEAR(sphere.radiusMm, Tip.norm(), 1e-4) << degrees;
    EXPECT_LT((sphere.centre - Pivot).norm(), 1e-4) << degrees;
  }
}

TEST(PivotCalibration, StatedNoiseIsComparedWithTheResiduals)
{
  PivotParameters parameters;
  parameters.estimateNoise = false;
  for (const bool reject : {false, true}) {
    parameters.rejectOutliers = reject;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      parameters.noise = {0.25, 0.7};
      EXPECT_FALSE(HasNote(CalibratePivot(Turned({}, seed), parameters), "the noise stated")) << seed;
      parameters.noise = {0.15, 0.4};
      EXPECT_TRUE(HasNote(CalibratePivot(Turned({}, seed), parameters), "region is too small")) << seed;
      parameters.noise = {0.75, 2.1};
      EXPECT_TRUE(HasNote(CalibratePivot(Turned({}, seed), parameters), "region is too large")) << seed;
      parameters.estimateNoise = true;
      EXPECT_FALSE(HasNote(CalibratePivot(Turned({}, seed), parameters), "the noise stated")) << seed;
      parameters.estimateNoise = false;
    }
  }
  // One pose that is far off, and none left out.
  parameters.rejectOutliers = false;
  parameters.noise = {0.25, 0.7};
  std::vector<TimedPose> poses = Turned({}, 300);
  poses[5].pose.translation().x() += 60.0;
  EXPECT_TRUE(HasNote(CalibratePivot(poses, parameters), "region is too small"));
}

TEST(PivotCalibration, TooLittleTurning)
{
  Refused({}, Error::Kind::NotPossible, "at least 4 poses");
  Refused(Turned({3, 30.0, 30.0, {}}, 1), Error::Kind::NotPossible, "at least 4 poses");
  Refused(Turned({100, 0.0, 0.0, {0.25, 0.7}}, 1), Error::Kind::NotPossible, "turned by only");
  Refused(Turned({100, 1.0, 1.0, {0.25, 0.7}}, 1), Error::Kind::NotPossible, "turned by only");
  std::vector<TimedPose> moved = Turned(Exact({100, 0.0, 0.0, {}}), 1); // pure translation
  for (std::size_t i = 0; i < moved.size(); ++i)
    moved[i].pose.translation().x() += static_cast<double>(i);
  Refused(moved, Error::Kind::NotPossible, "turned by only 0 degrees");
  // About one axis, with and without noise: any axis.
  Refused(Turned({100, 0.0, 40.0, {0.25, 0.7}}, 1), Error::Kind::NotPossible, "one axis only, (");
  Refused(Turned(Exact({100, 0.0, 40.0, {}}), 1), Error::Kind::NotPossible, "known only up to a line along it");
  // Half a turn about one axis, and full turns.
  std::vector<TimedPose> half(Turned(Exact({100, 0.0, 0.0, {}}), 1));
  for (std::size_t i = 0; i < half.size(); ++i) {
    half[i].pose.linear() =
        half[i].pose.linear() * ExpRotation(Vector3d(3.14159265358979 * static_cast<double>(i % 2), 0.0, 0.0));
    half[i].pose.translation() = Pivot - half[i].pose.linear() * Tip;
  }
  Refused(half, Error::Kind::NotPossible, "one axis only");
  // Outliers alone do not make a swing.
  std::vector<TimedPose> still = Turned({100, 0.0, 0.0, {0.25, 0.7}}, 1);
  const std::vector<TimedPose> others = Turned({100, 40.0, 40.0, {}}, 2);
  for (std::size_t i = 0; i < 20; ++i) {
    still[i] = others[i];
    still[i].pose.translation() += Vector3d(50.0, 10.0 * static_cast<double>(i), 0.0);
  }
  Refused(still, Error::Kind::NotPossible, "turned by only");
}

TEST(PivotCalibration, BadPoses)
{
  std::vector<TimedPose> poses = Turned({}, 1);
  poses[4].pose.translation().x() = NAN;
  Refused(poses, Error::Kind::BadInput, "pose 5 (at 0.0666667 s) holds a number that is not finite");
  poses = Turned({}, 1);
  poses[4].pose.linear() *= 1.1;
  poses[4].time = NAN;
  Refused(poses, Error::Kind::BadInput, "pose 5 is not rigid");
  poses = Turned({}, 1);
  poses[0].pose.linear().col(0) *= -1.0;
  Refused(poses, Error::Kind::BadInput, "pose 1 (at 0 s) is not rigid");
}

TEST(PivotCalibration, Mistakes)
{
  // Rotations the wrong way round.
  std::vector<TimedPose> poses = Turned({}, 1);
  for (TimedPose& pose : poses)
    pose.pose.linear() = Eigen::Matrix3d(pose.pose.linear().transpose());
  for (const bool estimate : {false, true}) {
    PivotParameters parameters;
    parameters.estimateNoise = estimate;
    Refused(poses, Error::Kind::NotPossible, "is the convention another?", parameters);
  }
  // A tool that is carried about.
  Random random(5);
  poses = Turned({}, 1);
  for (TimedPose& pose : poses)
    pose.pose.translation() = 200.0 * random.Uniform() * random.Direction();
  Refused(poses, Error::Kind::NotPossible, "do not turn about a fixed point");
  // Metres.
  poses = Turned({}, 1);
  for (TimedPose& pose : poses)
    pose.pose.translation() *= 0.001;
  EXPECT_TRUE(HasNote(CalibratePivot(poses), "are they in metres?"));
  // The tool seen by the tracker and the tracker seen by the tool differ by who is who.
  poses = Turned({}, 1);
  for (TimedPose& pose : poses)
    pose.pose = Pose(pose.pose.inverse());
  const PivotResult inverse = CalibratePivot(poses);
  EXPECT_LT((inverse.pivot - Tip).norm(), 3.0);
  EXPECT_TRUE(inverse.tip.norm() < 400.0 || HasNote(inverse, "farther than the pivot"));
}

TEST(PivotCalibration, Parameters)
{
  PivotParameters parameters;
  parameters.noise.mm = 0.0;
  Refused(Turned({}, 1), Error::Kind::InvalidParameter, "NoiseMm is 0 mm; it must be in (0, 100]", parameters);
  parameters = {};
  parameters.noise.degrees = NAN;
  Refused(Turned({}, 1), Error::Kind::InvalidParameter, "NoiseDegrees is nan degrees; it must be in [0, 45]", parameters);
  parameters = {};
  parameters.leastSwingDegrees = 0.0;
  Refused(Turned({}, 1), Error::Kind::InvalidParameter, "LeastSwing is 0 degrees; it must be in [0.1, 45]", parameters);
  EXPECT_THROW(CalibratePivot(Turned({}, 1), {}, Progress([](double) { return false; })), Error);
}

// The stylus of Plus's landmark recording rests in landmarks; it is not turned enough for a pivot, and that is what is said.
TEST(PivotCalibration, RecordedStylus)
{
  const std::string path =
      std::string(ECHORAMA_SOURCE_DIR) + "/../shared/data/plus/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "the recordings are not there";
  std::vector<TimedPose> poses;
  for (const ToolPose& pose : ReadPoseLog(path).Of("StylusToTracker"))
    if (pose.status == TransformStatus::Valid)
      poses.push_back({pose.time, pose.pose});
  ASSERT_GT(poses.size(), 10u);
  Refused(poses, Error::Kind::NotPossible, "");
}
