// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/Pyramid.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <utility>

namespace echorama {
namespace {

ImageGeometry Oblique(const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing)
{
  ImageGeometry geometry;
  geometry.dimensions = dimensions;
  geometry.spacing = spacing;
  geometry.origin = Eigen::Vector3d(-7.0, 3.0, 11.0);
  geometry.direction = ExpRotation(Eigen::Vector3d(0.3, -0.5, 0.9));
  return geometry;
}

double Ramp(const Eigen::Vector3d& p)
{
  return 3.0 + 0.5 * p.x() - 0.25 * p.y() + 0.75 * p.z();
}

Volume<float> RampOf(const ImageGeometry& geometry)
{
  Volume<float> volume(geometry.dimensions);
  const auto view = volume.View();
  for (int k = 0; k < geometry.dimensions[2]; ++k)
    for (int j = 0; j < geometry.dimensions[1]; ++j)
      for (int i = 0; i < geometry.dimensions[0]; ++i)
        view(i, j, k) = static_cast<float>(Ramp(geometry.IndexToWorld() * Eigen::Vector3d(i, j, k)));
  return volume;
}

PyramidParameters Deep()
{
  PyramidParameters p;
  p.smallestSize = 1;
  p.smallestCount = 1;
  return p;
}

// The mean of a ramp over a voxel's children is the ramp at its centre: the geometry of every level is right.
TEST(Pyramid, KeepsARampWhereItLies)
{
  const ImageGeometry geometry = Oblique({32, 16, 32}, {0.5, 0.5, 0.75});
  const Volume<float> ramp = RampOf(geometry);
  const auto levels = BuildPyramid<float>({ramp.View(), {}, geometry}, Deep());
  ASSERT_GE(levels.size(), 4u);
  for (const PyramidLevel& level : levels) {
    const auto view = level.intensity.View();
    const auto& n = view.Dimensions();
    EXPECT_EQ(n, level.geometry.dimensions);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          ASSERT_NEAR(view(i, j, k), Ramp(level.geometry.IndexToWorld() * Eigen::Vector3d(i, j, k)), 1e-4);
  }
}

TEST(Pyramid, HalvesAxesWithinTheRootOfTwo)
{
  const std::array<int, 3> n{32, 32, 32};
  const Volume<unsigned char> volume(n, 7);
  PyramidParameters p = Deep();
  p.levels = 2;
  for (const double ratio : {1.0, 1.41, 1.42, 1.9}) {
    const auto levels = BuildPyramid<unsigned char>({volume.View(), {}, Oblique(n, {1.0, 1.0, ratio})}, p);
    ASSERT_EQ(levels.size(), 2u);
    EXPECT_EQ(levels[1].geometry.dimensions, (std::array<int, 3>{16, 16, ratio < 1.415 ? 16 : 32})) << ratio;
  }
}

TEST(Pyramid, HalvesTheFinestAxesUntilVoxelsAreCubes)
{
  const std::array<int, 3> n{64, 32, 16};
  const Volume<unsigned char> volume(n, 7);
  const auto levels = BuildPyramid<unsigned char>({volume.View(), {}, Oblique(n, {0.5, 1.0, 2.0})}, Deep());
  ASSERT_GE(levels.size(), 4u);
  EXPECT_EQ(levels[1].geometry.dimensions, (std::array<int, 3>{32, 32, 16}));
  EXPECT_EQ(levels[2].geometry.dimensions, (std::array<int, 3>{16, 16, 16}));
  EXPECT_EQ(levels[3].geometry.dimensions, (std::array<int, 3>{8, 8, 8}));
  EXPECT_EQ(levels[3].geometry.spacing, Eigen::Vector3d(4.0, 4.0, 4.0));
  for (const PyramidLevel& level : levels)
    for (const float value : level.intensity.View())
      ASSERT_EQ(value, 7.0f);
}

TEST(Pyramid, TakesTheMeanOfRealVoxelsWhereHalfOfThemAre)
{
  const std::array<int, 3> n{4, 2, 2};
  Volume<float> volume(n, 100.0f);
  Volume<unsigned char> valid(n, 0);
  const auto v = volume.View();
  const auto m = valid.View();
  for (int c = 0; c < 4; ++c) { // four of eight children on the left, one of them NaN: three; four on the right
    m(0, c & 1, c >> 1) = m(2, c & 1, c >> 1) = 1;
    v(0, c & 1, c >> 1) = v(2, c & 1, c >> 1) = static_cast<float>(c);
  }
  v(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
  PyramidParameters p = Deep();
  p.levels = 2;
  ImageGeometry geometry;
  geometry.dimensions = n;
  const auto levels = BuildPyramid<float>({v, m, geometry}, p);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_EQ(levels[0].realVoxels, 7);
  EXPECT_TRUE(std::isnan(levels[1].intensity.View()(0, 0, 0)));
  EXPECT_EQ(levels[1].intensity.View()(1, 0, 0), 1.5f);
  EXPECT_EQ(levels[1].realVoxels, 1);
}

TEST(Pyramid, TreatsMissingChildrenAtOddEndsAsNotReal)
{
  const std::array<int, 3> n{3, 3, 2};
  const Volume<short> volume(n, -5);
  PyramidParameters p = Deep();
  p.levels = 2;
  ImageGeometry geometry;
  geometry.dimensions = n;
  const auto coarse = BuildPyramid<short>({volume.View(), {}, geometry}, p).at(1).intensity;
  EXPECT_EQ(coarse.Dimensions(), (std::array<int, 3>{2, 2, 1}));
  EXPECT_EQ(coarse.View()(1, 0, 0), -5.0f);        // four of eight
  EXPECT_TRUE(std::isnan(coarse.View()(1, 1, 0))); // two of eight
}

// Rows of several lengths with holes, and axes that are halved or not: each voxel beside the mean of its children.
TEST(Pyramid, EveryVoxelIsTheMeanOfItsRealChildren)
{
  Random random(6);
  for (const int length : {2, 7, 37, 70, 131})
    for (const double spacing : {1.0, 2.0}) { // of the rows: those of 2 are not halved
      const std::array<int, 3> n{length, 5, 4};
      Volume<float> volume(n);
      for (float& v : volume.View())
        v = random.Uniform() < 0.4 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(random.Normal());
      PyramidParameters p = Deep();
      p.levels = 2;
      const auto levels = BuildPyramid<float>({volume.View(), {}, Oblique(n, {spacing, 1.0, 1.0})}, p);
      ASSERT_EQ(levels.size(), 2u);
      const VolumeView<const float> coarse = levels[1].intensity.View();
      const int halved = spacing < 1.4 ? 2 : 1;
      ASSERT_EQ(coarse.Dimensions(), (std::array<int, 3>{(length + halved - 1) / halved, 3, 2}));
      for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < coarse.Dimensions()[0]; ++i) {
            double sum = 0.0;
            int real = 0;
            for (int c = 2 * k; c < 2 * k + 2; ++c)
              for (int b = 2 * j; b < std::min(5, 2 * j + 2); ++b)
                for (int a = halved * i; a < std::min(length, halved * i + halved); ++a)
                  if (const float value = std::as_const(volume).View()(a, b, c); !std::isnan(value)) {
                    sum += static_cast<double>(value);
                    ++real;
                  }
            if (real >= 2 * halved)
              ASSERT_NEAR(coarse(i, j, k), sum / real, 1e-6) << length << ": " << i << " " << j << " " << k;
            else
              ASSERT_TRUE(std::isnan(coarse(i, j, k))) << length << ": " << i << " " << j << " " << k;
          }
    }
}

TEST(Pyramid, LeavesAFlatAxisAloneAndStopsWhereTold)
{
  const std::array<int, 3> n{64, 48, 1};
  const Volume<double> volume(n, 2.0);
  PyramidParameters p;
  p.smallestCount = 0;
  const auto levels = BuildPyramid<double>({volume.View(), {}, Oblique(n, {1.0, 1.0, 0.1})}, p);
  ASSERT_EQ(levels.size(), 3u); // 64, 32, 16
  EXPECT_EQ(levels.back().geometry.dimensions, (std::array<int, 3>{16, 12, 1}));
  EXPECT_EQ(levels.back().geometry.spacing.z(), 0.1);
  p.smallestCount = 500;
  EXPECT_EQ((BuildPyramid<double>({volume.View(), {}, Oblique(n, {1.0, 1.0, 0.1})}, p).size()), 2u);
  p.levels = 1;
  EXPECT_EQ((BuildPyramid<double>({volume.View(), {}, Oblique(n, {1.0, 1.0, 0.1})}, p).size()), 1u);
}

TEST(Pyramid, DoesNotDependOnTheThreads)
{
  const std::array<int, 3> n{37, 29, 31};
  Volume<float> volume(n);
  Random random(5);
  for (float& v : volume.View())
    v = random.Uniform() < 0.2 ? std::numeric_limits<float>::infinity() : static_cast<float>(random.Normal());
  const PosedVolume<float> posed{volume.View(), {}, Oblique(n, {1.0, 1.0, 1.0})};
  const auto many = BuildPyramid(posed, Deep());
  const ThreadLimit limit(1);
  const auto one = BuildPyramid(posed, Deep());
  ASSERT_EQ(one.size(), many.size());
  for (std::size_t l = 0; l < one.size(); ++l) {
    EXPECT_EQ(one[l].realVoxels, many[l].realVoxels);
    EXPECT_EQ(std::memcmp(one[l].intensity.View().Data(), many[l].intensity.View().Data(),
                          sizeof(float) * one[l].intensity.View().Size()),
              0);
  }
}

TEST(Pyramid, RefusesAndStops)
{
  const std::array<int, 3> n{8, 8, 8};
  const Volume<float> volume(n, 1.0f);
  PosedVolume<float> posed{volume.View(), {}, Oblique(n, {1.0, 1.0, 1.0})};
  PyramidParameters none;
  none.levels = 0;
  EXPECT_THROW(BuildPyramid(posed, none), Error);
  EXPECT_THROW(BuildPyramid(posed, {}, Progress([](double) { return false; })), Error);
  posed.geometry.dimensions[0] = 9;
  EXPECT_THROW(BuildPyramid(posed), Error);
}

} // namespace
} // namespace echorama
