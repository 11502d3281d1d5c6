// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Registration/AlignPair.h"
#include "RandomScene.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
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

TEST(AlignPair, VoxelsThatAreNoCubesAreUsedAtFullResolution)
{
  Windows windows(Scene(5), Scene(5));
  const Eigen::Vector3d spacing(2.5, 2.5, 3.5);
  windows.a.dimensions = {36, 34, 22};
  windows.b.dimensions = {34, 31, 24};
  windows.a.spacing = windows.b.spacing = spacing;
  windows.pa = PyramidOf(See(Scene(5), windows.a), windows.a);
  windows.pb = PyramidOf(See(Scene(5), windows.b), windows.b);
  const PairAlignment found = windows.Align(Knock(windows, 3.0, 3.0, 1), With(AlignStart::Tracked));
  EXPECT_EQ(found.verdict, Verdict::Aligned) << found.reason;
  EXPECT_NEAR(found.voxelMm, std::cbrt(spacing.prod()), 1e-9);
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
  EXPECT_GT(found.splitMm, 0.0) << "two halves of the voxels, and not the same ones twice";
  EXPECT_LT(found.splitMm, 1.0);

  // The error is what the twist's covariance does to the voxels, in the mean.
  const Information covariance = found.information.inverse();
  double square = 0.0;
  int count = 0;
  for (int k = 0; k < windows.b.dimensions[2]; ++k)
    for (int j = 0; j < windows.b.dimensions[1]; ++j)
      for (int i = 0; i < windows.b.dimensions[0]; ++i, ++count) {
        const Eigen::Vector3d r = found.volumeToWorld * (windows.b.IndexToWorld() * Eigen::Vector3d(i, j, k)) - found.centre;
        Eigen::Matrix<double, 3, 6> moves;
        for (int axis = 0; axis < 3; ++axis) {
          moves.col(axis) = Eigen::Vector3d::Unit(axis);
          moves.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(r);
        }
        square += (moves * covariance * moves.transpose()).trace();
      }
  EXPECT_NEAR(found.errorMm / std::sqrt(square / count), 1.0, 0.05);
}

// What passes every check, just.
PairAlignment JustGoodEnough(const AlignPairParameters& p)
{
  PairAlignment alignment;
  alignment.voxelMm = 0.5;
  alignment.overlap = p.minimumOverlap;
  alignment.similarity = p.minimumSimilarity;
  alignment.errorMm = p.maximumErrorVoxels * alignment.voxelMm;
  alignment.splitMm = p.maximumSplitVoxels * alignment.voxelMm;
  alignment.peakRatio = p.minimumPeakRatio;
  return alignment;
}

TEST(AlignPair, EachCheckOfTheVerdictByItself)
{
  AlignPairParameters p;
  p.minimumOverlap = 0.25;
  p.minimumSimilarity = 0.16;
  p.maximumErrorVoxels = 1.5;
  p.maximumSplitVoxels = 2.5;
  p.minimumPeakRatio = 1.25;
  PairAlignment alignment = JustGoodEnough(p);
  alignment.reason = "of an earlier attempt";
  Judge(p, Information::Identity(), 40.0, alignment);
  EXPECT_EQ(alignment.verdict, Verdict::Aligned);
  EXPECT_EQ(alignment.reason, "");

  const auto judged = [&p](const auto& change, Verdict verdict, const char* reason) {
    PairAlignment spoilt = JustGoodEnough(p);
    change(spoilt);
    Judge(p, Information::Identity(), 40.0, spoilt);
    EXPECT_EQ(spoilt.verdict, verdict) << reason;
    EXPECT_NE(spoilt.reason.find(reason), std::string::npos) << spoilt.reason << " instead of " << reason;
  };
  judged([](PairAlignment& a) { a.overlap = 0.2449; }, Verdict::Failed, "overlap by only 24%");
  judged([](PairAlignment& a) { a.similarity = 0.1591; }, Verdict::Failed, "by chance (similarity 0.159)");
  judged([](PairAlignment& a) { a.similarity = std::nan(""); }, Verdict::Failed, "by chance");
  judged([](PairAlignment& a) { a.errorMm = 0.76; }, Verdict::Ambiguous, "do not determine the pose (predicted error 0.8 mm)");
  judged([](PairAlignment& a) { a.errorMm = 1e6; }, Verdict::Ambiguous, "predicted error 999.0 mm");
  judged([](PairAlignment& a) { a.splitMm = 1.26; }, Verdict::Failed, "two halves of the voxels separately gives poses 1.3 mm");
  judged([](PairAlignment& a) { a.peakRatio = 1.2449; }, Verdict::Ambiguous, "a different pose fits nearly as well (ratio 1.24)");

  // The less alike, the better the pose must be determined.
  p.minimumSimilarity = 0.075;
  judged([](PairAlignment& a) { a.errorMm *= 0.499; }, Verdict::Aligned, "");
  judged([](PairAlignment& a) { a.errorMm *= 0.501; }, Verdict::Ambiguous, "do not determine the pose");
  p.minimumSimilarity = 0.16;

  // What is wrong with most of it is said first.
  judged([](PairAlignment& a) { a.overlap = a.similarity = 0.0; }, Verdict::Failed, "overlap");
  judged([](PairAlignment& a) { a.similarity = 0.0, a.errorMm = 9.0; }, Verdict::Failed, "by chance");
  judged([](PairAlignment& a) { a.errorMm = a.splitMm = 9.0; }, Verdict::Ambiguous, "do not determine");
  judged([](PairAlignment& a) { a.splitMm = 9.0, a.peakRatio = 1.0; }, Verdict::Failed, "two halves");

  // A bound in mm holds whatever the voxels.
  p.maximumErrorMm = 0.75;
  judged([](PairAlignment&) {}, Verdict::Aligned, "");
  p.maximumErrorMm = 0.74;
  judged([](PairAlignment&) {}, Verdict::Ambiguous, "the predicted error is 0.75 mm, and at most 0.74 mm are accepted");
}

TEST(AlignPair, TheLeastCertainMotionIsNamed)
{
  const AlignPairParameters p;
  const auto reason = [&p](const Information& covariance, double radius) {
    PairAlignment alignment = JustGoodEnough(p);
    alignment.errorMm = 100.0;
    Judge(p, covariance, radius, alignment);
    std::string text = alignment.reason;
    text.erase(std::remove(text.begin(), text.end(), '-'), text.end()); // an axis has no sign
    return text;
  };
  Information covariance = Information::Zero();
  covariance.diagonal() << 1.0, 2.0, 9.0, 1e-4, 4e-4, 2e-4; // the turns at 100 mm: 1, 4 and 2 mm^2; at 200 mm: 4, 16 and 8
  EXPECT_NE(reason(covariance, 100.0).find("a move along the direction (0.00, 0.00, 1.00)"), std::string::npos);
  EXPECT_NE(reason(covariance, 200.0).find("a turn about the direction (0.00, 1.00, 0.00)"), std::string::npos);
}

// The checks work on what the alignment itself finds: a pair that passes them all fails each one that asks for more.
TEST(AlignPair, EveryCheckIsMade)
{
  ECHORAMA_SKIP_SANITIZED();
  const Windows windows(Scene(5), Scene(5));
  const Pose start = Knock(windows, 3.0, 3.0, 4);
  const auto run = [&](const auto& ask) {
    AlignPairParameters p = With(AlignStart::Tracked);
    p.points = 20000;
    ask(p);
    return windows.Align(start, p);
  };
  const PairAlignment good = run([](AlignPairParameters&) {});
  ASSERT_EQ(good.verdict, Verdict::Aligned) << good.reason;
  const auto fails = [&](const auto& ask, const char* reason) {
    const PairAlignment found = run(ask);
    EXPECT_NE(found.verdict, Verdict::Aligned) << reason;
    EXPECT_NE(found.reason.find(reason), std::string::npos) << found.reason << " instead of " << reason;
  };
  fails([&](AlignPairParameters& p) { p.minimumOverlap = 1.0; }, "overlap");
  fails([&](AlignPairParameters& p) { p.minimumSimilarity = 1.0; }, "by chance");
  fails([&](AlignPairParameters& p) { p.maximumErrorMm = std::max(1e-3, 0.9 * good.errorMm); }, "mm are accepted");
  fails([&](AlignPairParameters& p) { p.maximumErrorVoxels = std::max(1e-3, 0.9 * good.errorMm / good.voxelMm); }, "determine");
  fails([&](AlignPairParameters& p) { p.maximumSplitVoxels = std::max(1e-3, 0.9 * good.splitMm / good.voxelMm); }, "halves");
  if (good.peakRatio < 99.0)
    fails([&](AlignPairParameters& p) { p.minimumPeakRatio = 99.0; }, "a different pose");
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
      CheckRanges(p);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  AlignPairParameters p;
  EXPECT_EQ(message(p), "");
  p.minimumOverlap = 0.0;
  EXPECT_NE(message(p).find("MinimumOverlap"), std::string::npos);
  p = {};
  p.metric = "banana";
  EXPECT_NE(message(p).find("banana"), std::string::npos);
  EXPECT_NE(message(p).find("local-ncc"), std::string::npos);
  p = {};
  p.maximumErrorVoxels = std::nan("");
  EXPECT_NE(message(p).find("MaximumErrorVoxels"), std::string::npos);
  p = {};
  ParameterList list = Describe(p);
  EXPECT_THROW(Named(list, "Start").Set("nowhere"), Error);
  Named(list, "Start").Set("hand-made");
  EXPECT_EQ(p.start, AlignStart::HandMade);
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
