// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Registration/AlignmentScore.h"
#include <cmath>
#include <gtest/gtest.h>

namespace echorama {
namespace {

ImageGeometry Grid(const Eigen::Vector3d& origin = Eigen::Vector3d(5.0, -3.0, 2.0))
{
  ImageGeometry geometry;
  geometry.dimensions = {21, 21, 21};
  geometry.spacing = {1.0, 1.5, 0.5};
  geometry.origin = origin;
  geometry.direction = ExpRotation({0.1, 0.2, -0.3});
  return geometry;
}

// Points of a ball of radius 10 voxels.
std::vector<Eigen::Vector3d> BallPoints(int count)
{
  const std::array<int, 3> n{21, 21, 21};
  const Volume<float> intensity(n, 1.0f);
  Volume<unsigned char> valid(n, 0);
  for (int k = 0; k < 21; ++k)
    for (int j = 0; j < 21; ++j)
      for (int i = 0; i < 21; ++i)
        valid.View()(i, j, k) = Eigen::Vector3d(i - 10, j - 10, k - 10).norm() <= 10.0;
  return ValidPoints<float>(intensity.View(), valid.View(), count, 3);
}

TEST(AlignmentScore, IsZeroForTheTruthAndTheDistanceForATranslation)
{
  const auto points = BallPoints(500);
  const ImageGeometry truth = Grid();
  Pose moved = Pose::Identity();
  moved.translation() = Eigen::Vector3d(2.0, -1.0, 2.0);
  const ScoredVolume fixed{Grid({0.0, 0.0, 0.0}), Grid({0.0, 0.0, 0.0}), points, "A"};
  EXPECT_NEAR(ScoreAlignment({fixed, {truth, truth, points, "B"}}).mean, 0.0, 1e-12);
  const AlignmentScore score = ScoreAlignment({fixed, {truth.Moved(moved), truth, points, "B"}});
  EXPECT_NEAR(score.mean, 3.0, 1e-12);
  const VolumeScore& volume = score.volumes[1];
  for (const double figure : {volume.mean, volume.rms, volume.median, volume.percentile95, volume.max})
    EXPECT_NEAR(figure, 3.0, 1e-12);
  EXPECT_LT((volume.errors[7] - moved.translation()).norm(), 1e-12);
  EXPECT_LT((volume.points[7] - truth.Moved(moved).IndexToWorld() * points[7]).norm(), 1e-12);
}

// Turning by theta moves a point at distance r from the axis by 2 r sin(theta / 2); in a ball of radius R the mean r is
// 3 pi R / 16.
TEST(AlignmentScore, OfARotationIsTheChord)
{
  const auto points = BallPoints(20000);
  ImageGeometry truth = Grid();
  truth.spacing.setConstant(2.0); // a ball of 20 mm
  const double theta = 0.2;
  const Pose turn = MotionAbout(truth.Centre(), theta * Eigen::Vector3d(0.6, 0.0, 0.8), Eigen::Vector3d::Zero());
  const AlignmentScore score = ScoreAlignment({{truth, truth, points, "A"}, {truth.Moved(turn), truth, points, "B"}});
  EXPECT_NEAR(score.mean / (2.0 * std::sin(theta / 2.0) * 3.0 * M_PI * 20.0 / 16.0), 1.0, 0.03); // a ball of voxels
  EXPECT_LE(score.volumes[1].median, score.volumes[1].percentile95);
  EXPECT_LE(score.volumes[1].percentile95, score.volumes[1].max);
  EXPECT_GE(score.volumes[1].rms, score.volumes[1].mean);
}

TEST(AlignmentScore, DoesNotSeeAMotionOfTheWhole)
{
  const auto points = BallPoints(300);
  const Pose whole = MotionAbout({1.0, 2.0, 3.0}, {0.4, -0.2, 0.9}, {30.0, -20.0, 7.0});
  Pose slip = Pose::Identity();
  slip.translation().x() = 0.25;
  const ImageGeometry a = Grid({0.0, 0.0, 0.0}), b = Grid({9.0, 1.0, 0.0}), c = Grid({-7.0, 0.0, 4.0});
  const std::vector<ScoredVolume> volumes{
      {a.Moved(whole), a, points, "A"}, {b.Moved(slip).Moved(whole), b, points, "B"}, {c.Moved(whole), c, points, "C"}};
  const AlignmentScore byFirst = ScoreAlignment(volumes, 0), bySecond = ScoreAlignment(volumes, 1);
  EXPECT_NEAR(byFirst.mean, 0.125, 1e-12); // 0.25 and 0
  EXPECT_NEAR(bySecond.mean, 0.25, 1e-12); // both others are off by the slip
  EXPECT_NEAR(bySecond.volumes[1].max, 0.0, 1e-12);
  // Error vectors are in the world of the alignment.
  EXPECT_LT((byFirst.volumes[1].errors[0] - whole.linear() * slip.translation()).norm(), 1e-12);
}

TEST(AlignmentScore, Refuses)
{
  const auto points = BallPoints(10);
  const ImageGeometry g = Grid();
  ImageGeometry other = g, coarse = g;
  other.dimensions[0] = 20;
  coarse.spacing *= 2.0;
  const ScoredVolume good{g, g, points, "A"};
  EXPECT_THROW(ScoreAlignment({good}), Error);
  EXPECT_THROW(ScoreAlignment({}), Error);
  EXPECT_THROW(ScoreAlignment({good, good}, 2), Error);
  EXPECT_THROW(ScoreAlignment({good, good}, -1), Error);
  EXPECT_THROW(ScoreAlignment({good, {other, g, points, "B"}}), Error);
  EXPECT_THROW(ScoreAlignment({good, {coarse, g, points, "B"}}), Error);
  EXPECT_THROW(ScoreAlignment({good, {g, g, {}, "B"}}), Error);
}

} // namespace
} // namespace echorama
