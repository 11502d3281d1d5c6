// SPDX-License-Identifier: BSD-3-Clause
// Against brute force in double, and against closed forms where brute force would take too long.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/DistanceMap.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Size = std::array<int, 3>;
constexpr float Infinity = std::numeric_limits<float>::infinity();
const Eigen::Vector3d Unit = Eigen::Vector3d::Ones();

// A mask of the voxels where isSite(i, j, k).
template <class Function>
Volume<unsigned char> Mask(const Size& size, const Function& isSite)
{
  Volume<unsigned char> mask(size);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        mask.View()(i, j, k) = isSite(i, j, k) ? 1 : 0;
  return mask;
}

Volume<unsigned char> RandomMask(const Size& size, double density, std::uint64_t seed)
{
  Random random(seed);
  return Mask(size, [&](int, int, int) { return random.Uniform() < density; });
}

Volume<float> MapOf(const Volume<unsigned char>& mask, const Eigen::Vector3d& spacing)
{
  Volume<float> map(mask.Dimensions(), -1.0f);
  SquaredDistanceMap(mask.View(), spacing, map.View());
  return map;
}

// The largest difference from brute force in every \a slices-th slice, in units in the last place of the true value.
double WorstUlp(const Volume<unsigned char>& mask, const Eigen::Vector3d& spacing, const Volume<float>& map, int slices = 1)
{
  const Size size = mask.Dimensions();
  std::vector<Eigen::Vector3d> sites;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (mask.View()(i, j, k))
          sites.push_back(spacing.cwiseProduct(Eigen::Vector3d(i, j, k)));
  double worst = 0.0;
  for (int k = 0; k < size[2]; k += slices)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const Eigen::Vector3d here = spacing.cwiseProduct(Eigen::Vector3d(i, j, k));
        double nearest = std::numeric_limits<double>::infinity();
        for (const Eigen::Vector3d& site : sites)
          nearest = std::min(nearest, (here - site).squaredNorm());
        const double value = map.View()(i, j, k);
        if (value == nearest)
          continue;
        const float rounded = static_cast<float>(nearest);
        worst = std::max(worst, std::abs(value - nearest) / (std::nextafter(rounded, Infinity) - rounded));
      }
  return worst;
}

bool IsConstant(const Volume<float>& map, float value)
{
  return std::all_of(map.View().begin(), map.View().end(), [value](float v) { return v == value; });
}

// Odd sizes, powers of two, single voxels, columns, images in each plane, sizes around sixteen.
const Size Sizes[] = {{1, 1, 1},    {40, 1, 1},  {1, 40, 1},  {1, 1, 40},   {37, 29, 1}, {1, 29, 37}, {29, 1, 37},
                      {16, 16, 16}, {32, 32, 8}, {17, 33, 9}, {15, 31, 17}, {3, 50, 20}, {48, 2, 47}, {129, 5, 6}};

} // namespace

TEST(DistanceMap, IsExactlyBruteForceWithUnitSpacing)
{
  std::uint64_t seed = 1;
  for (const Size& size : Sizes)
    for (const double density : {0.3, 0.05, 0.003}) {
      const auto mask = RandomMask(size, density, seed++);
      EXPECT_EQ(WorstUlp(mask, Unit, MapOf(mask, Unit)), 0.0) << size[0] << " " << size[1] << " " << size[2] << " at " << density;
    }
}

TEST(DistanceMap, IsBruteForceToRoundingWithAnySpacing)
{
  const Eigen::Vector3d spacings[] = {{0.3, 0.7, 1.9}, {2.1, 0.11, 0.6}, {100.0, 1.0, 0.01}};
  std::uint64_t seed = 100;
  for (const Size& size : Sizes)
    for (const double density : {0.3, 0.05, 0.003}) {
      const Eigen::Vector3d& spacing = spacings[(seed + seed / 3) % 3]; // each density meets each spacing
      const auto mask = RandomMask(size, density, seed++);
      EXPECT_LE(WorstUlp(mask, spacing, MapOf(mask, spacing)), 2.5)
          << size[0] << " " << size[1] << " " << size[2] << " at " << density << " with " << spacing.transpose();
    }
}

TEST(DistanceMap, EqualSpacingScalesTheExactIntegers)
{
  const auto mask = RandomMask({30, 21, 13}, 0.01, 5);
  const auto voxels = MapOf(mask, Unit), millimetres = MapOf(mask, Unit * 0.3);
  for (std::ptrdiff_t i = 0; i < voxels.View().Size(); ++i)
    ASSERT_EQ(millimetres.View()[i], static_cast<float>(voxels.View()[i] * (0.3 * 0.3)));
}

TEST(DistanceMap, AnyNumberButZeroIsMask)
{
  const auto mask = RandomMask({20, 20, 5}, 0.05, 6);
  auto bright = mask;
  for (unsigned char& m : bright.View())
    m = static_cast<unsigned char>(m * 255);
  const auto a = MapOf(mask, Unit), b = MapOf(bright, Unit);
  EXPECT_TRUE(std::equal(a.View().begin(), a.View().end(), b.View().begin()));
}

TEST(DistanceMap, EmptyMaskIsInfinitelyFar)
{
  for (const Size& size : Sizes)
    for (const Eigen::Vector3d& spacing : {Eigen::Vector3d(Unit), Eigen::Vector3d(1.0, 2.0, 3.0)})
      EXPECT_TRUE(IsConstant(MapOf(Volume<unsigned char>(size, 0), spacing), Infinity));
}

TEST(DistanceMap, FullMaskIsZero)
{
  for (const Size& size : Sizes)
    for (const Eigen::Vector3d& spacing : {Eigen::Vector3d(Unit), Eigen::Vector3d(1.0, 2.0, 3.0)})
      EXPECT_TRUE(IsConstant(MapOf(Volume<unsigned char>(size, 1), spacing), 0.0f));
}

TEST(DistanceMap, SingleVoxelAnywhere)
{
  const Size size{70, 64, 65};
  for (const Size& site : {Size{0, 0, 0}, Size{69, 63, 64}, Size{31, 0, 64}, Size{35, 32, 33}, Size{15, 16, 17}}) {
    const auto map = MapOf(Mask(size, [&](int i, int j, int k) { return Size{i, j, k} == site; }), Unit);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          const int x = i - site[0], y = j - site[1], z = k - site[2];
          ASSERT_EQ(map.View()(i, j, k), static_cast<float>(x * x + y * y + z * z));
        }
  }
}

TEST(DistanceMap, DiagonalSheet)
{
  const auto mask = Mask({24, 24, 24}, [](int i, int j, int k) { return i + j + k == 36; });
  EXPECT_EQ(WorstUlp(mask, Unit, MapOf(mask, Unit)), 0.0);
  EXPECT_LE(WorstUlp(mask, {0.4, 0.9, 1.3}, MapOf(mask, {0.4, 0.9, 1.3})), 2.5);
}

// Two long diagonals with a wide gap: the searches give up and the stack of parabolas takes over, in rows and in tiles.
TEST(DistanceMap, LongEnvelopes)
{
  const auto mask = Mask({700, 1, 720}, [](int i, int, int k) { return i + k == 710 || (i == 690 && k % 40 == 0); });
  EXPECT_EQ(WorstUlp(mask, Unit, MapOf(mask, Unit), 31), 0.0);
  EXPECT_LE(WorstUlp(mask, {0.8, 1.0, 1.1}, MapOf(mask, {0.8, 1.0, 1.1}), 31), 2.5);
}

// Beyond 2^24 the squares are no longer all floats.
TEST(DistanceMap, LongerThanFloatsCount)
{
  for (const Size& size : {Size{5000, 1, 1}, Size{1, 5000, 1}, Size{1, 1, 5000}, Size{5000, 3, 2}}) {
    const auto mask = Mask(size, [](int i, int j, int k) { return i + j + k == 0; });
    const auto map = MapOf(mask, Unit);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          const double square = double(i) * i + double(j) * j + double(k) * k;
          if (square <= 16777216.0)
            ASSERT_EQ(map.View()(i, j, k), static_cast<float>(square));
          else
            ASSERT_NEAR(map.View()(i, j, k), square, 4.0);
        }
  }
}

// The depth is the distance map of the complement with one more layer of outside around the grid.
TEST(DistanceMap, DepthCountsTheRim)
{
  for (const Size& size : {Size{12, 9, 7}, Size{12, 9, 1}, Size{1, 20, 1}, Size{17, 1, 16}})
    for (const double density : {1.1, 0.9, 0.5, -0.1})
      for (const Eigen::Vector3d& spacing : {Eigen::Vector3d(Unit), Eigen::Vector3d(0.5, 1.5, 2.0)}) {
        const auto region = RandomMask(size, density, 11);
        Volume<float> depth(size);
        SquaredDepthMap(region.View(), spacing, depth.View());
        Size margin, wide;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          margin[axis] = size[axis] > 1 ? 1 : 0;
          wide[axis] = size[axis] + 2 * margin[axis];
        }
        const auto inside = [&](int i, int j, int k) {
          i -= margin[0], j -= margin[1], k -= margin[2];
          return i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2] && region.View()(i, j, k) != 0;
        };
        const auto expected = MapOf(Mask(wide, [&](int i, int j, int k) { return !inside(i, j, k); }), spacing);
        for (int k = 0; k < size[2]; ++k)
          for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
              ASSERT_EQ(depth.View()(i, j, k), expected.View()(i + margin[0], j + margin[1], k + margin[2]));
      }
}

TEST(DistanceMap, SameForAnyNumberOfThreads)
{
  const auto mask = RandomMask({130, 67, 41}, 0.001, 9);
  for (const Eigen::Vector3d& spacing : {Eigen::Vector3d(Unit), Eigen::Vector3d(0.3, 0.7, 1.9)}) {
    const auto many = MapOf(mask, spacing);
    const ThreadLimit one(1);
    const auto single = MapOf(mask, spacing);
    EXPECT_TRUE(std::equal(many.View().begin(), many.View().end(), single.View().begin()));
  }
}

TEST(DistanceMap, RefusesWhatHasNoAnswer)
{
  const Volume<unsigned char> mask({4, 4, 4});
  Volume<float> map({4, 4, 4}), other({4, 4, 5});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& spacing :
       {Eigen::Vector3d(0, 1, 1), Eigen::Vector3d(1, -1, 1), Eigen::Vector3d(1, 1, nan), Eigen::Vector3d(1e-30, 1, 1),
        Eigen::Vector3d(1, 1e30, 1), Eigen::Vector3d(1, 1, Infinity)})
    EXPECT_THROW(SquaredDistanceMap(mask.View(), spacing, map.View()), Error) << spacing.transpose();
  EXPECT_THROW(SquaredDistanceMap(mask.View(), Unit, other.View()), Error);
  SquaredDistanceMap(VolumeView<const unsigned char>(), Unit, VolumeView<float>()); // nothing to do
}

TEST(DistanceMap, StopsOnRequest)
{
  const auto mask = RandomMask({40, 40, 40}, 0.1, 3);
  Volume<float> map(mask.Dimensions());
  double last = 0.0;
  try {
    SquaredDistanceMap(mask.View(), Unit, map.View(), Progress([&last](double fraction) { return (last = fraction) < 0.5; }));
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
  EXPECT_LT(last, 0.6);
}
