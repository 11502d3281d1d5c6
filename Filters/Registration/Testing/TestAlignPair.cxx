// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Registration/AlignPair.h"
#include "RandomScene.h"
#include "Testing/Sanitized.h"
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace echorama {
namespace {

// Two windows on a scene, 3 mm voxels, that share the larger part.
struct Windows {
  ImageGeometry a = Box({30, 28, 26}, 3.0, {0.0, 0.0, 0.0}), b = Box({28, 26, 28}, 3.0, {22.0, 10.0, 6.0});
  std::vector<PyramidLevel> pa, pb;

  Windows(const std::function<double(const Eigen::Vector3d&)>& sceneA,
          const std::function<double(const Eigen::Vector3d&)>& sceneB)
    : pa(PyramidOf(See(sceneA, a), a)), pb(PyramidOf(See(sceneB, b), b))
  {
  }
  PairAlignment Align(const Pose& start, const AlignPairParameters& p, const Progress& progress = {}) const
  {
    const PlacedVolume fixed{&pa, Pose::Identity(), "A", nullptr}, moving{&pb, start, "B", nullptr};
    return AlignPair(fixed, BuildMetricPyramid(fixed, p.metric), moving, BuildMetricPyramid(moving, p.metric), p, progress);
  }
};

Pose Knock(const Windows& windows, double degrees, double mm, std::uint64_t seed)
{
  Random random(seed);
  return MotionAbout(windows.b.Centre(), degrees / 57.29577951308232 * random.Direction(), mm * random.Direction());
}

AlignPairParameters With(AlignStart start)
{
  AlignPairParameters p;
  p.start = start;
  return p;
}

TEST(AlignPair, FindsTheWayHomeAndSaysSo)
{
  ECHORAMA_SKIP_SANITIZED();
  const Windows windows(Scene(5), Scene(5));
  const Pose start = Knock(windows, 20.0, 20.0, 1);
  const PairAlignment found = windows.Align(start, With(AlignStart::HandMade));
  EXPECT_EQ(found.verdict, Verdict::Aligned) << found.reason;
  EXPECT_LT(Distance(found.volumeToWorld, Pose::Identity(), windows.b), 0.5);
  EXPECT_GT(found.similarity, 0.9);
  EXPECT_GT(found.overlap, 0.4);
  EXPECT_LT(found.overlap, 0.9);
  EXPECT_TRUE(found.reason.empty());
  EXPECT_LT(found.errorMm, 1.0);
  EXPECT_LT(found.splitMm, 1.0);
}

TEST(AlignPair, OtherTissueIsNotAligned)
{
  const Windows windows(Scene(5), Scene(6));
  const PairAlignment found = windows.Align(Knock(windows, 5.0, 5.0, 2), With(AlignStart::Tracked));
  EXPECT_NE(found.verdict, Verdict::Aligned);
  EXPECT_FALSE(found.reason.empty());
}

TEST(AlignPair, AShapeThatCanTurnIsNotAligned)
{
  // A ball looks the same from everywhere.
  const auto ball = [](const Eigen::Vector3d& p) {
    return 100.0 / (1.0 + std::exp((p - Eigen::Vector3d(55.0, 45.0, 40.0)).norm() - 18.0));
  };
  const Windows windows(ball, ball);
  const PairAlignment found = windows.Align(Knock(windows, 5.0, 5.0, 3), With(AlignStart::Tracked));
  EXPECT_NE(found.verdict, Verdict::Aligned);
}

TEST(AlignPair, TheSameForOneThreadAndTwo)
{
  ECHORAMA_SKIP_SANITIZED();
  const Windows windows(Scene(5), Scene(5));
  const Pose start = Knock(windows, 8.0, 8.0, 4);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return windows.Align(start, With(AlignStart::Tracked));
  };
  const PairAlignment one = run(1), two = run(2);
  EXPECT_EQ(one.volumeToWorld.matrix(), two.volumeToWorld.matrix());
  EXPECT_EQ(one.information, two.information);
  EXPECT_EQ(one.peakRatio, two.peakRatio);
}

TEST(AlignPair, StopsWhenAsked)
{
  const Windows windows(Scene(5), Scene(5));
  int calls = 0;
  const Progress progress([&calls](double) { return ++calls < 3; });
  try {
    windows.Align(Pose::Identity(), With(AlignStart::Unknown), progress);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

TEST(AlignPair, RefusesParametersThatAreNone)
{
  const auto message = [](const AlignPairParameters& p) {
    try {
      p.Check();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  AlignPairParameters p;
  EXPECT_EQ(message(p), "");
  p.minimumOverlap = 0.0;
  EXPECT_NE(message(p).find("minimumOverlap"), std::string::npos);
  p = {};
  p.metric = "banana";
  EXPECT_NE(message(p).find("banana"), std::string::npos);
  EXPECT_NE(message(p).find("local-ncc"), std::string::npos);
  p = {};
  p.maximumErrorVoxels = std::nan("");
  EXPECT_NE(message(p).find("maximumErrorVoxels"), std::string::npos);
  EXPECT_THROW(AlignStartOf("nowhere"), Error);
  for (const std::string& name : AlignStartNames())
    EXPECT_EQ(NameOf(AlignStartOf(name)), name);
}

TEST(AlignPair, TheCovarianceOfNothingIsLargeAndFinite)
{
  const double radius = 50.0;
  Information information = Information::Zero();
  Information covariance = CovarianceOf(information, radius);
  EXPECT_TRUE(covariance.allFinite());
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 1e6, 1.0);
  EXPECT_NEAR(std::sqrt(covariance(5, 5)) * radius, 1e6, 1.0);
  information.diagonal() << 4.0, 4.0, 4.0, 1e4, 1e4, 1e4;
  covariance = CovarianceOf(information, radius);
  EXPECT_NEAR(covariance(1, 1), 0.25, 1e-12);
  EXPECT_NEAR(covariance(4, 4), 1e-4, 1e-16);
  information(5, 5) = 0.0; // a turn that changes nothing leaves the others alone
  covariance = CovarianceOf(information, radius);
  EXPECT_NEAR(covariance(1, 1), 0.25, 1e-12);
  EXPECT_GT(covariance(5, 5), 1e6);
  information(0, 0) = std::nan("");
  EXPECT_TRUE(CovarianceOf(information, radius).allFinite());
}

} // namespace
} // namespace echorama
