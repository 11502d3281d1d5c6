// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Phantoms/VesselTree.h"
#include <cmath>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// Room in a ball about the origin.
VesselRoom Ball(double radius)
{
  return [radius](const Vector3d& p) { return radius - p.norm(); };
}

VesselTreeParameters InBall()
{
  VesselTreeParameters p;
  p.root = {0.0, 0.0, 60.0};
  p.direction = {0.0, 0.0, -2.0};
  return p;
}

// The children of each branch.
std::vector<std::vector<const VesselBranch*>> Children(const std::vector<VesselBranch>& tree)
{
  std::vector<std::vector<const VesselBranch*>> children(tree.size());
  for (const VesselBranch& branch : tree)
    if (branch.parent >= 0)
      children[static_cast<std::size_t>(branch.parent)].push_back(&branch);
  return children;
}

} // namespace

TEST(VesselTree, BranchesByMurraysLaw)
{
  const std::vector<VesselBranch> tree = GrowVessels(InBall(), Ball(60.0));
  ASSERT_GT(tree.size(), 40u);
  const auto children = Children(tree);
  int partings = 0;
  for (std::size_t i = 0; i < tree.size(); ++i) {
    if (children[i].empty())
      continue;
    ASSERT_EQ(children[i].size(), 2u);
    ++partings;
    const VesselBranch &one = *children[i][0], &other = *children[i][1];
    const double r0 = tree[i].radius, r1 = one.radius, r2 = other.radius;
    EXPECT_NEAR(r1 * r1 * r1 + r2 * r2 * r2, r0 * r0 * r0, 1e-12 * r0 * r0 * r0);
    EXPECT_EQ(one.generation, tree[i].generation + 1);
    EXPECT_EQ(one.from, tree[i].to);
    EXPECT_TRUE(one.main && !other.main && r1 >= r2);
    const Vector3d axis = (tree[i].to - tree[i].from).normalized();
    const Vector3d d1 = (one.to - one.from).normalized(), d2 = (other.to - other.from).normalized();
    EXPECT_NEAR(axis.dot(d1), (std::pow(r0, 4) + std::pow(r1, 4) - std::pow(r2, 4)) / (2 * r0 * r0 * r1 * r1), 1e-9);
    EXPECT_NEAR(axis.dot(d2), (std::pow(r0, 4) + std::pow(r2, 4) - std::pow(r1, 4)) / (2 * r0 * r0 * r2 * r2), 1e-9);
    EXPECT_NEAR(axis.dot(d1.cross(d2)), 0.0, 1e-9) << "parent and children lie in one plane";
    // Where the forces of least cost balance: r0^2 axis = r1^2 d1 + r2^2 d2.
    EXPECT_LT((r0 * r0 * axis - r1 * r1 * d1 - r2 * r2 * d2).norm(), 1e-9 * r0 * r0);
  }
  EXPECT_GE(partings, 20);
}

TEST(VesselTree, StaysWhereThereIsRoomAndClearOfItself)
{
  const std::vector<VesselBranch> tree = GrowVessels(InBall(), Ball(60.0));
  for (std::size_t i = 1; i < tree.size(); ++i) {
    EXPECT_LT(tree[i].to.norm() + tree[i].radius, 60.0);
    EXPECT_GE(tree[i].radius, InBall().smallestRadiusMm);
    EXPECT_LE(tree[i].generation, InBall().generations);
    // The end of a branch lies outside of all others but those that it meets there.
    for (std::size_t j = 0; j < tree.size(); ++j) {
      const bool meets = i == j || tree[j].parent == static_cast<int>(i) || tree[i].parent == static_cast<int>(j) ||
                         tree[j].parent == tree[i].parent ||
                         (tree[j].parent >= 0 && tree[static_cast<std::size_t>(tree[j].parent)].parent == static_cast<int>(i)) ||
                         (tree[i].parent >= 0 && tree[j].parent == tree[static_cast<std::size_t>(tree[i].parent)].parent) ||
                         (tree[j].parent >= 0 && tree[i].parent == tree[static_cast<std::size_t>(tree[j].parent)].parent);
      if (meets)
        continue;
      const Vector3d along = tree[j].to - tree[j].from;
      const double t = std::min(1.0, std::max(0.0, (tree[i].to - tree[j].from).dot(along) / along.squaredNorm()));
      EXPECT_GT((tree[i].to - tree[j].from - t * along).norm(), tree[j].radius) << i << " in " << j;
    }
  }
}

TEST(VesselTree, EndsWhereThereIsNoRoomOrTooNarrow)
{
  EXPECT_EQ(GrowVessels(InBall(), [](const Vector3d&) { return -1.0; }).size(), 1u) << "the root alone";
  VesselTreeParameters p = InBall();
  p.generations = 0;
  EXPECT_EQ(GrowVessels(p, Ball(60.0)).size(), 1u);
  p = InBall();
  p.smallestRadiusMm = p.rootRadiusMm;
  EXPECT_EQ(GrowVessels(p, Ball(60.0)).size(), 1u);
  p = InBall();
  p.asymmetry = 0.0;                                // both children alike: r / cbrt(2)
  p.smallestRadiusMm = p.rootRadiusMm / 2.0 - 1e-9; // three generations
  for (const VesselBranch& branch : GrowVessels(p, [](const Vector3d&) { return 1e9; }))
    EXPECT_NEAR(branch.radius, p.rootRadiusMm * std::cbrt(std::pow(0.5, branch.generation)), 1e-12);
}

TEST(VesselTree, OneSeedOneTree)
{
  const auto a = GrowVessels(InBall(), Ball(60.0)), b = GrowVessels(InBall(), Ball(60.0));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(a[i].from == b[i].from && a[i].to == b[i].to && a[i].radius == b[i].radius);
  VesselTreeParameters p = InBall();
  p.seed = 2;
  const auto c = GrowVessels(p, Ball(60.0));
  EXPECT_NE(a[1].to, c[1].to);
}

TEST(VesselTree, StemsAreSmoothAndCoverTheTree)
{
  const std::vector<VesselBranch> tree = GrowVessels(InBall(), Ball(60.0));
  const std::vector<VesselStem> stems = StemsOf(tree);
  std::size_t sides = 0;
  for (const VesselBranch& branch : tree)
    sides += branch.parent < 0 || !branch.main ? 1 : 0;
  EXPECT_EQ(stems.size(), sides);
  // Each branch's end lies on a stem, with its radius.
  for (const VesselBranch& branch : tree) {
    bool found = false;
    for (const VesselStem& stem : stems)
      for (std::size_t i = 0; i < stem.path.size(); ++i)
        found = found || (stem.path[i] == branch.to && std::abs(stem.radius[i] - branch.radius) < 1e-12);
    EXPECT_TRUE(found);
  }
  for (const VesselStem& stem : stems) {
    ASSERT_EQ(stem.path.size(), stem.radius.size());
    for (std::size_t i = 1; i + 1 < stem.path.size(); ++i) {
      // A tube of twice the radius of the lumen would not cut itself: the path bends less sharply.
      const Vector3d a = stem.path[i] - stem.path[i - 1], b = stem.path[i + 1] - stem.path[i];
      const double turn = std::atan2(a.cross(b).norm(), a.dot(b)), bend = 0.5 * (a.norm() + b.norm()) / std::max(turn, 1e-12);
      EXPECT_GT(bend, 2.0 * stem.radius[i]);
      EXPECT_LE(stem.radius[i + 1], stem.radius[i] + 1e-12) << "vessels only get narrower";
    }
  }
}

TEST(VesselTree, RefusesWhatIsOutOfRange)
{
  const auto refused = [](auto change, const char* word) {
    VesselTreeParameters p = InBall();
    change(p);
    try {
      GrowVessels(p, Ball(60.0));
      ADD_FAILURE() << word << " was not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused([](auto& p) { p.rootRadiusMm = 0.0; }, "RootRadiusMm is ");
  refused([](auto& p) { p.rootLengthMm = -1.0; }, "RootLengthMm is ");
  refused([](auto& p) { p.generations = 40; }, "Generations is ");
  refused([](auto& p) { p.asymmetry = 0.7; }, "Asymmetry is ");
  refused([](auto& p) { p.lengthOverRadius = 1.0; }, "LengthOverRadius is ");
  refused([](auto& p) { p.direction.setZero(); }, "length of Direction is 0");
  refused([](auto& p) { p.root.x() = std::numeric_limits<double>::quiet_NaN(); }, "Root is ");
}
