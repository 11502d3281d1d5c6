// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/ImageGeometry.h"
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;

ImageGeometry Oblique()
{
  ImageGeometry g;
  g.dimensions = {11, 21, 31};
  g.origin = {1, 2, 3};
  g.spacing = {0.5, 0.75, 1.25};
  g.direction = ExpRotation({0.3, -0.5, 0.9});
  return g;
}

TEST(ImageGeometry, IndexToWorldAndBack)
{
  const ImageGeometry g = Oblique();
  EXPECT_EQ(g.VoxelCount(), 11u * 21u * 31u);
  const Eigen::Vector3d index(3, 7, 20);
  const Eigen::Vector3d expected = g.origin + 1.5 * g.direction.col(0) + 5.25 * g.direction.col(1) + 25.0 * g.direction.col(2);
  EXPECT_LT((g.IndexToWorld() * index - expected).norm(), 1e-13);
  EXPECT_LT((g.WorldToIndex() * expected - index).norm(), 1e-12);
  EXPECT_LT((g.Centre() - g.IndexToWorld() * Eigen::Vector3d(5, 10, 15)).norm(), 1e-13);
}

TEST(ImageGeometry, MovedVoxelsMoveWithThePose)
{
  const ImageGeometry g = Oblique();
  const Pose pose = MotionAbout({5, 5, 5}, {1, 0.2, 0.3}, {7, 8, 9});
  const Eigen::Vector3d index(3, 7, 20);
  EXPECT_LT((g.Moved(pose).IndexToWorld() * index - pose * (g.IndexToWorld() * index)).norm(), 1e-12);
  EXPECT_TRUE(g.Moved(pose).Moved(pose.inverse()).AgreesWith(g, 1e-12));
}

TEST(ImageGeometry, AgreesToAFractionOfAVoxel)
{
  const ImageGeometry g = Oblique();
  EXPECT_TRUE(g.AgreesWith(g, 0.0));
  ImageGeometry other = g;
  other.origin.x() += 0.0004;
  EXPECT_TRUE(g.AgreesWith(other));
  other.origin.x() += 0.0004;
  EXPECT_FALSE(g.AgreesWith(other)) << "0.0008 mm of 0.5 mm";
  other = g;
  other.spacing.z() *= 1.0 + 1e-4; // 0.00375 mm at the far end
  EXPECT_FALSE(g.AgreesWith(other));
  other = g;
  other.dimensions[2] = 30;
  EXPECT_FALSE(g.AgreesWith(other));
  other = g;
  other.origin.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(g.AgreesWith(other));
  ImageGeometry voxel, larger;
  voxel.dimensions = larger.dimensions = {1, 1, 1};
  larger.spacing.setConstant(2.0);
  EXPECT_FALSE(voxel.AgreesWith(larger)) << "a single voxel";
}

std::string Refusal(const ImageGeometry& g)
{
  try {
    g.Check("a.mha");
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    EXPECT_EQ(std::string(error.what()).rfind("a.mha: ", 0), 0u) << error.what();
    return error.what();
  }
  return {};
}

TEST(ImageGeometry, RefusesWhatIsNoGeometry)
{
  EXPECT_EQ(Refusal(Oblique()), "");
  const auto with = [](const auto& change) {
    ImageGeometry g = Oblique();
    change(g);
    return Refusal(g);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(has(with([](auto& g) { g.dimensions[1] = 0; }), "dimension 1"));
  EXPECT_TRUE(has(with([](auto& g) { g.dimensions[2] = -5; }), "dimension 2"));
  EXPECT_TRUE(has(with([](auto& g) { g.dimensions = {2000000000, 2000000000, 2000000000}; }), "overflows"));
  EXPECT_TRUE(has(with([](auto& g) { g.spacing[0] = 0; }), "spacing 0"));
  EXPECT_TRUE(has(with([](auto& g) { g.spacing[2] = -1; }), "spacing 2"));
  EXPECT_TRUE(has(with([&](auto& g) { g.spacing[2] = nan; }), "not finite"));
  EXPECT_TRUE(has(with([&](auto& g) { g.origin[1] = inf; }), "not finite"));
  EXPECT_TRUE(has(with([&](auto& g) { g.direction(1, 1) = nan; }), "not finite"));
  EXPECT_TRUE(has(with([](auto& g) { g.direction.setZero(); }), "direction"));
  EXPECT_TRUE(has(with([](auto& g) { g.direction.col(0) = -g.direction.col(0); }), "direction"));
  EXPECT_TRUE(has(with([](auto& g) { g.direction *= 2; }), "direction"));
}

} // namespace
