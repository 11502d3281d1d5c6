// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Registration/OverlappingPairs.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace echorama {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

Pose RandomPose(Random& random, double mm)
{
  return MotionAbout(Eigen::Vector3d::Zero(), random.Direction() * random.Uniform(0.0, 3.0),
                     random.Direction() * random.Uniform(0.0, mm));
}

TEST(BoxTree, FindsWhatAllPairsWouldFind)
{
  for (const int count : {0, 1, 2, 5, 37, 400}) {
    Random random(3, static_cast<std::uint64_t>(count));
    std::vector<Eigen::AlignedBox3d> boxes;
    for (int i = 0; i < count; ++i) {
      if (i % 11 == 7) { // of no size at all
        boxes.emplace_back();
        continue;
      }
      const double size = i % 5 == 0 ? 0.0 : i % 17 == 1 ? 50.0 : random.Uniform(0.0, 8.0);
      const double x = random.Below(6), y = random.Uniform(0.0, 40.0), z = random.Uniform(0.0, 5.0); // many touch
      const Eigen::Vector3d low(10.0 * x, y, z);
      boxes.emplace_back(low, low + Eigen::Vector3d(10.0, size, size));
    }
    Pairs all;
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b) {
        const auto &one = boxes[static_cast<std::size_t>(a)], &other = boxes[static_cast<std::size_t>(b)];
        if (!one.isEmpty() && !other.isEmpty() && (one.min().array() <= other.max().array()).all() &&
            (other.min().array() <= one.max().array()).all())
          all.emplace_back(a, b);
      }
    EXPECT_EQ(PairsThatMeet(boxes), all) << count;
    if (count == 400) {
      EXPECT_GT(all.size(), 1000u);
      EXPECT_LT(all.size(), 40000u);
    }
  }
}

TEST(BoxTree, OneBoxManyTimesMeetsItself)
{
  const std::vector<Eigen::AlignedBox3d> boxes(30, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()});
  EXPECT_EQ(PairsThatMeet(boxes).size(), 30u * 29u / 2u);
}

// The least distance of two boxes, by projecting onto one and the other in turn.
double Distance(const TurnedBox& a, const TurnedBox& b)
{
  const auto nearest = [](const TurnedBox& box, const Eigen::Vector3d& p) -> Eigen::Vector3d {
    const Eigen::Vector3d own = box.axes.transpose() * (p - box.centre);
    return box.centre + box.axes * own.cwiseMax(-box.half).cwiseMin(box.half);
  };
  Eigen::Vector3d p = a.centre, q = nearest(b, p);
  for (int i = 0; i < 3000; ++i) {
    p = nearest(a, q);
    q = nearest(b, p);
  }
  return (p - q).norm();
}

TEST(BoxTree, TurnedBoxesMeetWhereTheirDistanceIsNothing)
{
  Random random(5);
  int meet = 0, apart = 0;
  for (int i = 0; i < 1500; ++i) {
    TurnedBox boxes[2];
    for (TurnedBox& box : boxes) {
      const Pose pose = RandomPose(random, 6.0);
      box.axes = i % 3 == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : Eigen::Matrix3d(pose.linear());
      box.centre = pose.translation();
      const double x = random.Uniform(0.1, 4.0), y = random.Uniform(0.1, 4.0), z = random.Uniform(0.1, 4.0);
      box.half = Eigen::Vector3d(x, y, z);
    }
    const double distance = Distance(boxes[0], boxes[1]);
    if (distance > 1e-6 && distance < 1e-2)
      continue; // projections come to rest slowly
    EXPECT_EQ(Meet(boxes[0], boxes[1]), distance <= 1e-6) << i << ": " << distance;
    EXPECT_EQ(Meet(boxes[1], boxes[0]), distance <= 1e-6) << i << ": " << distance;
    ++(distance <= 1e-6 ? meet : apart);
  }
  EXPECT_GT(meet, 300);
  EXPECT_GT(apart, 300);
}

TEST(BoxTree, BoundsHoldTheBoxAndTouchIt)
{
  Random random(6);
  TurnedBox box;
  box.axes = RandomPose(random, 1.0).linear();
  box.centre = Eigen::Vector3d(3.0, -2.0, 5.0);
  box.half = Eigen::Vector3d(1.0, 2.0, 3.0);
  Eigen::AlignedBox3d corners;
  for (int c = 0; c < 8; ++c)
    corners.extend(box.centre +
                   box.axes * box.half.cwiseProduct(Eigen::Vector3d(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1)));
  EXPECT_TRUE(box.Bounds().isApprox(corners, 1e-12));
}

// Fans that hang from a bent surface, some of them far from all others.
class Fans {
public:
  explicit Fans(int count)
  {
    Random random(8);
    for (int v = 0; v < count; ++v) {
      ImageGeometry geometry;
      geometry.dimensions = {20, 16, 24};
      geometry.spacing = Eigen::Vector3d(2.0, 2.5, 1.5);
      geometry.origin = Eigen::Vector3d(-19.0, -18.0, 4.0);
      geometry.direction = ExpRotation(random.Direction() * 0.4);
      Volume<float> voxels(geometry.dimensions);
      Volume<unsigned char> valid(geometry.dimensions);
      for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 16; ++j)
          for (int i = 0; i < 20; ++i) {
            voxels.View()(i, j, k) = static_cast<float>(random.Uniform(1.0, 9.0));
            valid.View()(i, j, k) = std::fabs(i - 9.5) < 3.0 + 0.3 * k && std::fabs(j - 7.5) < 2.0 + 0.2 * k ? 1 : 0;
          }
      pyramids.push_back(BuildPyramid<float>({voxels.View(), valid.View(), geometry}));
      const double x = random.Uniform(0.0, 150.0), y = random.Uniform(0.0, 90.0), angle = random.Uniform(-0.6, 0.6);
      poses.push_back(Eigen::Translation3d(x, y, v % 9 == 0 ? 1000.0 * v : 0.0) * RandomPose(random, 3.0));
      poses.back().linear() = ExpRotation({angle, 0.3 * angle, 0.2});
    }
    for (const auto& pyramid : pyramids) {
      placed.push_back({&pyramid, Pose::Identity(), "fan"});
      outlines.emplace_back(placed.back());
    }
  }

  std::vector<std::vector<PyramidLevel>> pyramids;
  std::vector<Pose> poses;
  std::vector<PlacedVolume> placed;
  std::vector<VolumeOutline> outlines;
};

TEST(OverlappingPairs, AreThoseThatAllAgainstAllWouldGive)
{
  const Fans fans(45);
  const auto isAsked = [](int a, int b) { return (a + b) % 7 != 3; };
  constexpr double least = 0.1;
  for (const double reachMm : {0.0, 12.0, 40.0}) {
    std::vector<OverlappingPair> all;
    for (int a = 0; a < 45; ++a)
      for (int b = a + 1; b < 45; ++b) {
        const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
        const VolumeShape one(fans.placed[i]), other(fans.placed[j]);
        const Eigen::Vector3d way = fans.poses[i] * one.centroid - fans.poses[j] * other.centroid;
        if (!isAsked(a, b) || way.norm() - reachMm > one.reach + other.reach)
          continue;
        const auto overlap = [&](const Eigen::Vector3d& shift) {
          PlacedVolume first = fans.placed[i], second = fans.placed[j];
          first.volumeToWorld = fans.poses[i];
          second.volumeToWorld = Eigen::Translation3d(shift) * fans.poses[j];
          return std::max(OverlapOf({first}, second, 1000), OverlapOf({second}, first, 1000));
        };
        OverlappingPair pair{a, b, overlap(Eigen::Vector3d::Zero())};
        if (pair.overlap < least) {
          pair.isFar = true;
          pair.overlap = overlap(way * std::min(1.0, reachMm / way.norm()));
        }
        if (pair.overlap >= least)
          all.push_back(pair);
      }
    const auto found = OverlappingPairs(fans.outlines, fans.poses, reachMm, least, isAsked);
    ASSERT_EQ(found.size(), all.size()) << reachMm;
    int far = 0;
    for (std::size_t p = 0; p < all.size(); ++p) {
      EXPECT_EQ(found[p].a, all[p].a);
      EXPECT_EQ(found[p].b, all[p].b);
      EXPECT_EQ(found[p].overlap, all[p].overlap);
      EXPECT_EQ(found[p].isFar, all[p].isFar);
      far += all[p].isFar;
    }
    EXPECT_GT(all.size(), 40u);
    EXPECT_EQ(far > 10, reachMm > 0.0);
  }
}

TEST(OverlappingPairs, VolumesWithoutAVoxelOverlapNothing)
{
  Fans fans(3);
  fans.poses.assign(3, Pose::Identity());
  for (float& voxel : fans.pyramids[1].back().intensity.View())
    voxel = std::nanf("");
  fans.outlines.clear();
  for (const PlacedVolume& volume : fans.placed)
    fans.outlines.emplace_back(volume);
  const auto found = OverlappingPairs(fans.outlines, fans.poses, 5.0, 0.1, [](int, int) { return true; });
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].a, 0);
  EXPECT_EQ(found[0].b, 2);
}

} // namespace
} // namespace echorama
