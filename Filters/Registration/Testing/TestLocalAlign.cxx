// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Registration/LocalAlign.h"
#include "LocalAlignScene.h"
#include "Testing/Sanitized.h"
#include <limits>

namespace echorama {
namespace {

using namespace testing_scene;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double RadiansPerDegree = 0.017453292519943295;
constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

LocalAlignParameters Quick()
{
  LocalAlignParameters p;
  p.points = 15000;
  return p;
}

// Two views of one texture, 12 of 44 mm apart.
class LocalAlignTest : public testing::TestWithParam<std::string> {
protected:
  const Texture texture{7};
  const Field field = [this](const Eigen::Vector3d& p) { return static_cast<float>(texture(p)); };
  const ImageGeometry fixedGeometry = Box({44, 40, 36}, {1.0, 1.0, 1.0}, {-28.0, -20.0, -18.0});
  const ImageGeometry movingGeometry = Box({44, 40, 36}, {1.0, 1.0, 1.0}, {-16.0, -19.3, -18.6});
  const Seen fixed{fixedGeometry, field}, moving{movingGeometry, field};

  // In a volume so small most windows of the local NCC touch the border, whose cut windows pull a little (see
  // MetricLocalNcc.cxx); without its weights against that it would be 0.4 voxels.
  static constexpr double LocalNccTolerance = 0.25;

  Pose Knocked(std::uint64_t item, double mm = 5.0, double degrees = 6.0) const
  {
    Random random(77, item);
    const Eigen::Vector3d axis = random.Direction(), way = random.Direction();
    return MotionAbout(movingGeometry.Centre(), degrees * RadiansPerDegree * axis, mm * way);
  }
};

INSTANTIATE_TEST_SUITE_P(All, LocalAlignTest, testing::ValuesIn(MetricNames()), TestName);
class LocalNccAlignTest : public LocalAlignTest {};
INSTANTIATE_TEST_SUITE_P(Default, LocalNccAlignTest, testing::Values("local-ncc"));

TEST_P(LocalAlignTest, FindsTheWayHome)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  for (std::uint64_t item = 0; item < 2; ++item) {
    const LocalAlignResult result = LocalAlign(*a, Pose::Identity(), *b, Knocked(item), Quick());
    EXPECT_LT(Distance(result.volumeToWorld, Pose::Identity(), movingGeometry),
              GetParam() == "local-ncc" ? LocalNccTolerance : 0.1)
        << "start " << item;
    EXPECT_TRUE(result.converged);
    EXPECT_GT(result.similarity, 0.9);
    EXPECT_NEAR(result.overlap, 32.0 / 44.0, 0.12);
    EXPECT_NEAR((result.centre - Eigen::Vector3d(0.0, 0.0, 0.0)).norm(), 0.0, 4.0);
    EXPECT_TRUE(IsRotation(result.volumeToWorld.linear(), 1e-12));
  }
}

// Where it would stop if it never stopped: the points are the same, so the answers differ by what the last steps left.
TEST_P(LocalNccAlignTest, ATighterStopEndsCloserToTheOptimum)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  LocalAlignParameters p = Quick();
  p.iterations = 1000;
  double loose = 0.0, tight = 0.0; // mm, of three starts; voxels of 1 mm
  for (std::uint64_t item = 0; item < 3; ++item) {
    const auto stoppedAt = [&](double voxels) {
      p.stopVoxels = voxels;
      const LocalAlignResult result = LocalAlign(*a, Pose::Identity(), *b, Knocked(item), p);
      EXPECT_TRUE(result.converged);
      return result.volumeToWorld;
    };
    const Pose optimum = stoppedAt(1e-7);
    loose += Distance(stoppedAt(0.002), optimum, movingGeometry);
    tight += Distance(stoppedAt(2e-5), optimum, movingGeometry);
  }
  EXPECT_LT(tight, 3e-4);
  EXPECT_LT(tight, 0.5 * loose);
}

TEST_P(LocalNccAlignTest, ThePoseIsTheSameWithoutInformation)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  LocalAlignParameters p = Quick();
  const LocalAlignResult with = LocalAlign(*a, Pose::Identity(), *b, Knocked(0), p);
  p.withInformation = false;
  const LocalAlignResult without = LocalAlign(*a, Pose::Identity(), *b, Knocked(0), p);
  EXPECT_EQ(with.volumeToWorld.matrix(), without.volumeToWorld.matrix());
  EXPECT_EQ(with.similarity, without.similarity);
  EXPECT_FALSE(with.information.isZero());
  EXPECT_TRUE(without.information.isZero());
}

TEST_P(LocalAlignTest, SwappedVolumesGiveTheInverse)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  const Pose start = Knocked(3, 3.0, 4.0);
  const Pose there = LocalAlign(*a, Pose::Identity(), *b, start, Quick()).volumeToWorld;
  const Pose back = LocalAlign(*b, start, *a, Pose::Identity(), Quick()).volumeToWorld; // a beside b, which stays at the start
  EXPECT_LT(Distance(back.inverse() * start, there, movingGeometry), 0.1);
}

TEST_P(LocalNccAlignTest, SaysTheSameOnOneThreadAndOnTwo)
{
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
    return LocalAlign(*a, Pose::Identity(), *b, Knocked(1), Quick());
  };
  const LocalAlignResult one = run(1), two = run(2);
  EXPECT_EQ(one.volumeToWorld.matrix(), two.volumeToWorld.matrix());
  EXPECT_EQ(one.similarity, two.similarity);
  EXPECT_EQ(one.information, two.information);
}

TEST_P(LocalNccAlignTest, IsIndependentOfWhereTheWorldIs)
{
  const Pose away = MotionAbout({0.0, 0.0, 0.0}, {0.4, -1.0, 0.7}, {300.0, -500.0, 200.0});
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  const Pose here = LocalAlign(*a, Pose::Identity(), *b, Knocked(2), Quick()).volumeToWorld;
  const Pose there = LocalAlign(*a, away, *b, away * Knocked(2), Quick()).volumeToWorld;
  EXPECT_LT(Distance(away.inverse() * there, here, movingGeometry), 0.02);
}

TEST_P(LocalNccAlignTest, GainThatFallsWithDepthDoesNotMatter)
{
  const Seen dim(movingGeometry,
                 [this](const Eigen::Vector3d& p) { return static_cast<float>(40.0 + 0.3 * texture(p) - 0.8 * (p.z() + 18.0)); });
  const auto a = fixed.As(GetParam()), b = dim.As(GetParam());
  EXPECT_LT(Distance(LocalAlign(*a, Pose::Identity(), *b, Knocked(0), Quick()).volumeToWorld, Pose::Identity(), movingGeometry),
            LocalNccTolerance);
}

TEST_P(LocalNccAlignTest, InvertedContrastIsNotTakenForAgreement)
{
  const Seen negative(movingGeometry, [this](const Eigen::Vector3d& p) { return 255.0f - static_cast<float>(texture(p)); });
  const auto a = fixed.As(GetParam()), b = negative.As(GetParam());
  EXPECT_LT(LocalAlign(*a, Pose::Identity(), *b, Knocked(0), Quick()).similarity, 0.5);
}

TEST_P(LocalNccAlignTest, ThickSlicesAndHoles)
{
  const Seen thick(Box({44, 40, 9}, {1.0, 1.0, 5.0}, {-16.0, -19.3, -20.6}), [this](const Eigen::Vector3d& p) {
    double sum = 0.0; // a slice sees what is in it
    for (int s = -2; s <= 2; ++s)
      sum += 0.2 * texture(p + Eigen::Vector3d(0.0, 0.0, s));
    return (p - Eigen::Vector3d(8.0, 3.0, 0.0)).norm() < 6.0 ? NaN : static_cast<float>(sum);
  });
  const auto a = fixed.As(GetParam()), b = thick.As(GetParam());
  const LocalAlignResult result = LocalAlign(*a, Pose::Identity(), *b, Knocked(0, 3.0, 4.0), Quick());
  EXPECT_LT(Distance(result.volumeToWorld, Pose::Identity(), movingGeometry), 0.5);
  EXPECT_TRUE(result.information.allFinite());
}

TEST_P(LocalNccAlignTest, HalvesAgree)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  LocalAlignParameters p = Quick();
  const auto overlapOf = [&](int part) {
    p.part = part;
    return Evaluate(*a, Pose::Identity(), *b, Pose::Identity(), p);
  };
  EXPECT_GT(overlapOf(1).independentVoxels, 0.0);
  EXPECT_GT(overlapOf(2).independentVoxels, 0.0);
  for (const int part : {1, 2}) {
    p.part = part;
    EXPECT_LT(Distance(LocalAlign(*a, Pose::Identity(), *b, Knocked(part), p).volumeToWorld, Pose::Identity(), movingGeometry),
              LocalNccTolerance);
  }
}

TEST_P(LocalNccAlignTest, VolumesThatDoNotMeetStayWhereTheyAre)
{
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  Pose far = Pose::Identity();
  far.translation() = Eigen::Vector3d(200.0, 0.0, 0.0);
  for (const LocalAlignResult& result :
       {LocalAlign(*a, Pose::Identity(), *b, far, Quick()), Evaluate(*a, Pose::Identity(), *b, far, Quick())}) {
    EXPECT_EQ(result.overlap, 0.0);
    EXPECT_EQ(result.similarity, 0.0);
    EXPECT_EQ(result.score, 0.0);
    EXPECT_FALSE(result.converged);
    EXPECT_TRUE(result.volumeToWorld.isApprox(far, 1e-12));
    EXPECT_TRUE(result.information.isZero());
  }
}

TEST_P(LocalNccAlignTest, WrongCallsAreRefused)
{
  const auto a = fixed.As("ncc", "A"), b = moving.As("lc2", "B");
  const std::string message = MessageOf([&] { LocalAlign(*a, Pose::Identity(), *b, Pose::Identity()); }, Error::Kind::BadInput);
  EXPECT_NE(message.find("A and B"), std::string::npos) << message;
  LocalAlignParameters p;
  p.part = 3;
  MessageOf([&] { LocalAlign(*a, Pose::Identity(), *a, Pose::Identity(), p); }, Error::Kind::InvalidParameter);
  p = {};
  p.finestMm = std::numeric_limits<double>::quiet_NaN();
  MessageOf([&] { Evaluate(*a, Pose::Identity(), *a, Pose::Identity(), p); }, Error::Kind::InvalidParameter);
  Pose sheared = Pose::Identity();
  sheared.matrix()(0, 1) = 0.2;
  MessageOf([&] { LocalAlign(*a, Pose::Identity(), *a, sheared); }, Error::Kind::BadInput);
  int calls = 0;
  const Progress stop([&calls](double) { return ++calls < 5; });
  MessageOf([&] { LocalAlign(*a, Pose::Identity(), *a, Knocked(0), {}, stop); }, Error::Kind::Cancelled);
  EXPECT_EQ(calls, 5);
}

// An elongated box, so that the axes differ; speckle of its own, so that neither half of the sandwich is zero.
TEST(LocalAlignCovariance, TurnsWithTheWorld)
{
  ECHORAMA_SKIP_SANITIZED();
  const Texture texture(7);
  const ImageGeometry geometry = Box({64, 24, 24}, {1.0, 1.0, 1.0}, {-32.0, -12.0, -12.0});
  std::array<std::shared_ptr<const MetricPyramid>, 2> f;
  for (std::uint64_t side = 0; side < 2; ++side) {
    const Texture speckle(1000 + side);
    const Seen seen(geometry, [&](const Eigen::Vector3d& x) { return static_cast<float>(texture(x) + 0.5 * speckle(1.5 * x)); });
    f[side] = seen.As("local-ncc");
  }
  const Pose away = MotionAbout({0.0, 0.0, 0.0}, {0.4, -1.0, 0.7}, {300.0, -500.0, 200.0});
  const LocalAlignResult here = LocalAlign(*f[0], Pose::Identity(), *f[1], Pose::Identity(), Quick());
  const LocalAlignResult there = LocalAlign(*f[0], away, *f[1], away, Quick());
  EXPECT_LT((there.centre - away * here.centre).norm(), 0.1);
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = away.linear();
  const Matrix6 expected = turn * here.information * turn.transpose();
  const Vector6 s = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((s.asDiagonal() * (there.information - expected) * s.asDiagonal()).cwiseAbs().maxCoeff(), 0.2);
}

// Volumes so small that some eleven blocks tell all, with speckle of its own in each: the covariance that is told against the
// scatter of answers.
TEST(LocalAlignCovariance, TellsTheScatterOfAnswers)
{
  ECHORAMA_SKIP_SANITIZED();
  const ImageGeometry geometry = Box({32, 30, 28}, {1.0, 1.0, 1.0}, {-16.0, -15.0, -14.0});
  constexpr int Trials = 60;
  Matrix6 scatter = Matrix6::Zero(), told = Matrix6::Zero();
  double distance = 0.0;
  LocalAlignParameters p;
  p.points = 20000;
  p.coarsestMm = 1.0;
  for (int trial = 0; trial < Trials; ++trial) {
    const Texture texture(500 + static_cast<std::uint64_t>(trial));
    std::array<std::shared_ptr<const MetricPyramid>, 2> features;
    for (std::uint64_t side = 0; side < 2; ++side) {
      const Texture speckle(1000 + 2 * static_cast<std::uint64_t>(trial) + side);
      const Seen seen(geometry, [&](const Eigen::Vector3d& x) {
        return static_cast<float>(texture(x) + 0.2 * speckle(2.7 * x)); // waves of 3 to 15 mm
      });
      features[side] = seen.As("local-ncc");
    }
    const LocalAlignResult result = LocalAlign(*features[0], Pose::Identity(), *features[1], Pose::Identity(), p);
    Vector6 error; // the twist about the centre that led here from the truth
    error << result.volumeToWorld * result.centre - result.centre, LogRotation(result.volumeToWorld.linear());
    scatter += error * error.transpose() / Trials;
    told += result.information.inverse() / Trials;
    distance += error.dot(result.information * error) / Trials;
  }
  for (const Eigen::Index first : {0, 3}) { // moves, turns
    const Eigen::Matrix3d covariance = told.block<3, 3>(first, first);
    const double trace = covariance.trace(), ratio = scatter.block<3, 3>(first, first).trace() / trace;
    // Were the covariance known, Trials * d times the ratio would have a chi-squared distribution of Trials * d degrees of
    // freedom, d = 3 when all directions vary alike. 99.9% of it (Wilson and Hilferty):
    const double freedom = Trials * trace * trace / covariance.squaredNorm(), share = 2.0 / (9.0 * freedom);
    EXPECT_GT(ratio, std::pow(1.0 - share - 3.29 * std::sqrt(share), 3)) << "from " << first;
    EXPECT_LT(ratio, std::pow(1.0 - share + 3.29 * std::sqrt(share), 3)) << "from " << first;
  }
  // 6 for six numbers, if the covariance were known. What eleven blocks leave open makes it some 12; it was 21 when slivers at
  // the border counted as whole blocks, so that directions were told too well by chance.
  EXPECT_GT(distance, 4.5);
  EXPECT_LT(distance, 16.0);
}

// Neighbours of a row of fans, each with noise of its own. Windows that the border cuts must not pull volumes together: over a
// chain that adds up, and since fans overlap less at the top, the chain would curl.
class LocalAlignBias : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Windowed, LocalAlignBias, testing::Values("local-ncc", "mind-ssc"), TestName);

TEST_P(LocalAlignBias, VolumesInARowAreNeitherPulledTogetherNorTurned)
{
  ECHORAMA_SKIP_SANITIZED();
  constexpr int Trials = 24;
  const ImageGeometry geometry = Box({32, 32, 32}, {1.0, 1.0, 1.0}, {-15.5, -15.5, -15.5});
  Vector6 sum = Vector6::Zero();
  LocalAlignParameters p;
  p.points = 20000;
  p.coarsestMm = 1.0;
  for (int trial = 0; trial < Trials; ++trial) {
    const Texture texture(700 + static_cast<std::uint64_t>(trial));
    std::array<std::shared_ptr<const MetricPyramid>, 2> features;
    std::array<Pose, 2> poses{Pose::Identity(), MotionAbout({0.0, 0.0, 0.0}, {0.06, -0.04, 0.05}, {15.0, 1.0, -1.0})};
    for (std::size_t side = 0; side < 2; ++side) {
      Random noise(900 + static_cast<std::uint64_t>(trial), side);
      Volume<float> voxels(geometry.dimensions);
      for (int k = 0; k < 32; ++k)
        for (int j = 0; j < 32; ++j)
          for (int i = 0; i < 32; ++i) {
            const Eigen::Vector3d at = geometry.IndexToWorld() * Eigen::Vector3d(i, j, k);
            const bool isInFan = std::fabs(at.x()) < 9.5 + 0.4 * (k / 31.0) * 15.5;
            voxels.View()(i, j, k) = isInFan ? static_cast<float>(texture(poses[side] * at) + 8.0 * noise.Normal()) : NaN;
          }
      const std::vector<PyramidLevel> pyramid = BuildPyramid<float>({voxels.View(), {}, geometry});
      features[side] = BuildMetricPyramid({&pyramid, Pose::Identity(), "fan"}, GetParam());
    }
    const LocalAlignResult result = LocalAlign(*features[0], poses[0], *features[1], poses[1], p);
    const Pose moved = result.volumeToWorld * poses[1].inverse(Eigen::Isometry);
    Vector6 error;
    error << moved * result.centre - result.centre, LogRotation(moved.linear());
    sum += error / Trials;
  }
  // As the windows stand, local-ncc has -0.43 mm and 0.021, mind-ssc 0.16 mm and -0.009.
  EXPECT_LT(std::fabs(sum[0]), 0.06);  // mm, along the row
  EXPECT_LT(std::fabs(sum[4]), 0.006); // radians, about the axis across
}

} // namespace
} // namespace echorama
