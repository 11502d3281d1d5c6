// SPDX-License-Identifier: BSD-3-Clause
// What two or three landmarks do for pairs whose images leave something open, and what wrong ones do not.
#include "Filters/Registration/AlignVolumes.h"
#include "RandomScene.h"
#include "Testing/Sanitized.h"
#include <gtest/gtest.h>

namespace echorama {
namespace {

constexpr double PeriodMm = 24.0;

// The same every 24 mm along each axis.
double Repeats(const Eigen::Vector3d& p)
{
  double sum = 0.0;
  for (std::uint64_t w = 0; w < 12; ++w) {
    Random random(3, w);
    const Eigen::Vector3d k{std::floor(random.Uniform(-2.0, 3.0)), std::floor(random.Uniform(-2.0, 3.0)),
                            std::floor(random.Uniform(-2.0, 3.0))};
    sum += std::cos(6.283185307179586 / PeriodMm * k.dot(p) + random.Uniform(0.0, 6.283185307179586));
  }
  return 100.0 + 8.0 * sum;
}

// A ball looks the same from everywhere.
double Ball(const Eigen::Vector3d& p)
{
  return 100.0 / (1.0 + std::exp((p - Eigen::Vector3d(55.0, 45.0, 40.0)).norm() - 18.0));
}

// Places that both windows show.
const std::vector<Eigen::Vector3d> Places{{35, 30, 20}, {70, 40, 35}, {45, 65, 60}};

struct Windows {
  ImageGeometry a = Box({30, 28, 26}, 3.0, {0.0, 0.0, 0.0}), b = Box({28, 26, 28}, 3.0, {22.0, 10.0, 6.0});
  std::vector<PyramidLevel> pa, pb;
  std::vector<Landmark> inA, inB;
  AlignPairParameters p;

  explicit Windows(const std::function<double(const Eigen::Vector3d&)>& scene)
    : pa(PyramidOf(See(scene, a), a)), pb(PyramidOf(See(scene, b), b))
  {
    p.start = AlignStart::Tracked;
    p.points = 20000;
  }
  // Picked with errors of 1 mm along each axis.
  void Pick(std::size_t count)
  {
    Random random(11);
    for (std::size_t i = 0; i < count; ++i) {
      inA.push_back({std::to_string(i), Places[i]});
      inB.push_back({std::to_string(i), Places[i] + Eigen::Vector3d{random.Normal(), random.Normal(), random.Normal()}});
    }
  }
  PairAlignment Align(const Pose& start) const
  {
    const PlacedVolume fixed{&pa, Pose::Identity(), "A", nullptr, inA}, moving{&pb, start, "B", nullptr, inB};
    return AlignPair(fixed, BuildMetricPyramid(fixed, p.metric), moving, BuildMetricPyramid(moving, p.metric), p);
  }
  double Wrong(const PairAlignment& found) const { return Distance(found.volumeToWorld, Pose::Identity(), b); }
};

// One period off, and a little turned.
Pose NextOne(const Windows& windows)
{
  return MotionAbout(windows.b.Centre(), {0.02, 0.03, -0.02}, {PeriodMm, 1.0, -1.0});
}

} // namespace

TEST(AlignLandmarks, ARepeatedStructureIsToldFromTheNextOne)
{
  ECHORAMA_SKIP_SANITIZED();
  Windows windows(Repeats);
  windows.p.start = AlignStart::HandMade;
  const PairAlignment without = windows.Align(NextOne(windows));
  EXPECT_EQ(without.verdict, Verdict::Ambiguous) << without.reason;
  for (const std::size_t count : {std::size_t{2}, std::size_t{3}}) {
    windows.inA.clear();
    windows.inB.clear();
    windows.Pick(count);
    const PairAlignment with = windows.Align(NextOne(windows));
    EXPECT_EQ(with.verdict, Verdict::Aligned) << with.reason;
    EXPECT_LT(windows.Wrong(with), 0.3) << "the images say where exactly, not the landmarks";
  }
}

TEST(AlignLandmarks, WrongOnesYieldNoAnswer)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const std::size_t count : {std::size_t{2}, std::size_t{3}}) {
    Windows windows(Repeats);
    windows.p.start = AlignStart::Automatic;
    windows.Pick(count);
    std::swap(windows.inB[0].position, windows.inB[1].position);
    const PairAlignment found = windows.Align(NextOne(windows));
    EXPECT_NE(found.verdict, Verdict::Aligned) << count << ", similarity " << found.similarity;
    EXPECT_NE(found.reason.find("landmark"), std::string::npos) << found.reason;
  }
  // One that is far from where it belongs.
  Windows windows(Scene(5));
  windows.p.start = AlignStart::HandMade;
  const Pose start = MotionAbout(windows.b.Centre(), {0.05, 0.02, 0.03}, {5, 5, 5});
  windows.Pick(3);
  EXPECT_EQ(windows.Align(start).verdict, Verdict::Aligned);
  windows.inB[2].position += Eigen::Vector3d(0, 25, 0);
  const PairAlignment found = windows.Align(start);
  EXPECT_EQ(found.verdict, Verdict::Failed);
  EXPECT_NE(found.reason.find("contradict"), std::string::npos) << found.reason;
}

TEST(AlignLandmarks, WhatTheImagesLeaveOpenTheLandmarksSay)
{
  ECHORAMA_SKIP_SANITIZED();
  Windows windows(Ball);
  const Pose start = MotionAbout(windows.b.Centre(), {0.06, 0.03, -0.04}, {3, 2, -3});
  const PairAlignment without = windows.Align(start);
  EXPECT_NE(without.verdict, Verdict::Aligned);
  windows.Pick(3);
  windows.inB = windows.inA; // picked as exactly as they claim
  windows.p.landmarkSigmaMm = 0.5;
  const PairAlignment with = windows.Align(start);
  EXPECT_EQ(with.verdict, Verdict::Aligned) << with.reason;
  EXPECT_LT(windows.Wrong(with), 1.0);
  // A turn of the ball is known as well as three points tell it, of some 25 mm about their middle, and no better.
  EXPECT_GT(with.errorMm, 0.2);
  EXPECT_LT(with.errorMm, 1.0);
}

TEST(AlignLandmarks, TheyAddToWhatIsKnown)
{
  ECHORAMA_SKIP_SANITIZED();
  Windows windows(Scene(5));
  const PairAlignment without = windows.Align(Pose::Identity());
  windows.Pick(3);
  const PairAlignment with = windows.Align(Pose::Identity());
  EXPECT_GT(with.information(0, 0), without.information(0, 0));
  EXPECT_LE(with.errorMm, without.errorMm);
  EXPECT_LT(Distance(with.volumeToWorld, without.volumeToWorld, windows.b), 0.05) << "the images know better";
}

TEST(AlignLandmarks, AnyPairOfThreeVolumes)
{
  ECHORAMA_SKIP_SANITIZED();
  const Scene scene(5);
  const ImageGeometry boxes[] = {Box({30, 28, 26}, 3.0, {0, 0, 0}), Box({28, 26, 28}, 3.0, {22, 10, 6}),
                                 Box({28, 28, 26}, 3.0, {40, 8, 10})};
  std::vector<std::vector<PyramidLevel>> pyramids;
  for (const ImageGeometry& box : boxes)
    pyramids.push_back(PyramidOf(See(scene, box), box));
  // The third is so far away and so much turned that a hand-made start would not find it; landmarks join it to the first alone.
  const Pose far = MotionAbout(boxes[2].Centre(), {0.0, 1.2, 0.4}, {150, -80, 60});
  std::vector<PlacedVolume> volumes{{&pyramids[0], Pose::Identity(), "A", nullptr, {}},
                                    {&pyramids[1], Pose::Identity(), "B", nullptr, {}},
                                    {&pyramids[2], far, "C", nullptr, {}}};
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Automatic;
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(55, 30, 30), Eigen::Vector3d(75, 60, 40), Eigen::Vector3d(60, 50, 65)})
    for (const std::size_t v : {std::size_t{0}, std::size_t{2}})
      volumes[v].landmarks.push_back({std::to_string(place.x()), place});
  const AlignVolumesResult result = AlignVolumes(volumes, 0, p);
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Aligned) << result.volumes[v].reason;
    EXPECT_LT(Distance(result.volumes[v].volumeToWorld, Pose::Identity(), boxes[v]), 0.5) << v;
  }
  const auto pair = std::find_if(result.pairs.begin(), result.pairs.end(),
                                 [](const PairOfVolumes& each) { return each.fixed == 0 && each.moving == 2; });
  ASSERT_NE(pair, result.pairs.end());
  EXPECT_FALSE(pair->alignment.anywhere) << "the landmarks say where to look";

  volumes[1].landmarks = {{"twice", {0, 0, 0}}, {"twice", {1, 1, 1}}};
  EXPECT_THROW(AlignVolumes(volumes, 0, p), Error);
}

} // namespace echorama
