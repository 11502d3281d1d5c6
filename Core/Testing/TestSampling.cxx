// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;
constexpr double none = -12345.0;

template <class T>
double Linear(const Sampler<T>& sampler, double x, double y, double z)
{
  double value = none;
  return sampler.Linear(x, y, z, value) ? value : none;
}

Volume<float> Ramp()
{
  Volume<float> volume({5, 4, 3});
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 5; ++i)
        volume.View()(i, j, k) = static_cast<float>(1 + 2 * i - 3 * j + 0.5 * k + 0.25 * i * j * k);
  return volume;
}

TEST(Sampling, LinearIsExactOnTrilinearFunctions)
{
  const Volume<float> volume = Ramp();
  const Sampler<float> sampler(volume.View(), {});
  Random random(1);
  for (int n = 0; n < 1000; ++n) {
    const double x = random.Uniform(0, 4), y = random.Uniform(0, 3), z = random.Uniform(0, 2);
    EXPECT_NEAR(Linear(sampler, x, y, z), 1 + 2 * x - 3 * y + 0.5 * z + 0.25 * x * y * z, 1e-12);
  }
}

TEST(Sampling, HalfAVoxelBeyondTheRimBelongsToIt)
{
  const Volume<float> volume = Ramp();
  const Sampler<float> sampler(volume.View(), {});
  EXPECT_EQ(Linear(sampler, -0.5, 0, 0), 1.0);
  EXPECT_EQ(Linear(sampler, 4.499, 0, 0), 9.0);
  EXPECT_EQ(Linear(sampler, -0.501, 0, 0), none);
  EXPECT_EQ(Linear(sampler, 4.5, 0, 0), none);
  EXPECT_EQ(Linear(sampler, 0, 3.5, 0), none);
  EXPECT_EQ(Linear(sampler, 0, 0, -0.6), none);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e300})
    EXPECT_EQ(Linear(sampler, 1, bad, 1), none);
}

TEST(Sampling, NearestIsTheVoxelAround)
{
  const Volume<float> volume = Ramp();
  const Sampler<float> sampler(volume.View(), {});
  EXPECT_EQ(sampler.NearestIndex(2.4, 1.6, 0.5), 20 * 1 + 5 * 2 + 2) << "halves round up";
  double value = none;
  EXPECT_TRUE(sampler.Nearest(4.49, -0.5, 2.2, value));
  EXPECT_EQ(value, volume.View()(4, 0, 2));
  EXPECT_FALSE(sampler.Nearest(4.5, 0, 0, value));
}

TEST(Sampling, JustBelowAHalfStaysInside)
{
  // 0.5 - 2^-54 plus 0.5 is 1 in doubles: in a single slice that would be a voxel that does not exist.
  const Volume<float> image({3, 3, 1}, 2.0f);
  const Sampler<float> sampler(image.View(), {});
  const double below = std::nextafter(0.5, 0.0);
  EXPECT_EQ(sampler.NearestIndex(1.0, 1.0, below), 4);
  EXPECT_EQ(Linear(sampler, 1.0, 1.0, below), 2.0);
  for (int n = 1; n < 70; ++n) {
    const Volume<float> row({n, 1, 1}, 2.0f);
    EXPECT_EQ(Sampler<float>(row.View(), {}).NearestIndex(std::nextafter(n - 0.5, 0.0), 0, 0), n - 1);
  }
}

TEST(Sampling, HiddenVoxelsDoNotBleed)
{
  Volume<unsigned char> volume({4, 4, 4}, 7), valid({4, 4, 4}, 1);
  volume.View()(2, 1, 1) = 255;
  valid.View()(2, 1, 1) = 0;
  const Sampler<unsigned char> sampler(volume.View(), valid.View());
  EXPECT_EQ(Linear(sampler, 1.45, 1.2, 0.8), 7.0);
  EXPECT_EQ(Linear(sampler, 1.55, 1.2, 0.8), none) << "the mask keeps its shape";
}

TEST(Sampling, VoxelsThatAreNotFiniteAreHidden)
{
  Volume<double> volume({3, 3, 3}, 7.0);
  volume.View()(1, 1, 1) = std::numeric_limits<double>::quiet_NaN();
  volume.View()(0, 0, 0) = std::numeric_limits<double>::infinity();
  const Sampler<double> sampler(volume.View(), {});
  EXPECT_EQ(Linear(sampler, 1.3, 1, 1), none);
  EXPECT_EQ(Linear(sampler, 1.6, 1, 1), 7.0);
  EXPECT_EQ(Linear(sampler, 0.2, 0.2, 0.2), none);
  EXPECT_EQ(Linear(sampler, 0.6, 0.2, 0.2), 7.0);
}

TEST(Sampling, HiddenCornersLeaveTheMeanOfTheOthers)
{
  Volume<float> volume({2, 2, 2});
  Volume<unsigned char> valid({2, 2, 2}, 1);
  Random random(8);
  for (float& v : volume.View())
    v = static_cast<float>(random.Uniform(0.0, 100.0));
  for (int hidden = 0; hidden < 256; ++hidden) {
    for (int c = 0; c < 8; ++c)
      valid.View()[c] = hidden >> c & 1 ? 0 : 1;
    const Sampler<float> sampler(volume.View(), valid.View());
    const double x = random.Uniform(), y = random.Uniform(), z = random.Uniform();
    double sum = 0.0, weights = 0.0;
    for (int c = 0; c < 8; ++c) {
      const double w = (c & 1 ? x : 1 - x) * (c & 2 ? y : 1 - y) * (c & 4 ? z : 1 - z);
      if (valid.View()[c]) {
        sum += w * static_cast<double>(volume.View()[c]);
        weights += w;
      }
    }
    const int nearest = (x >= 0.5 ? 1 : 0) + (y >= 0.5 ? 2 : 0) + (z >= 0.5 ? 4 : 0);
    if (hidden >> nearest & 1)
      EXPECT_EQ(Linear(sampler, x, y, z), none);
    else
      EXPECT_NEAR(Linear(sampler, x, y, z), sum / weights, 1e-9) << hidden;
  }
}

TEST(Sampling, AConstantStaysThatConstant)
{
  Volume<unsigned char> valid({6, 6, 6}, 1);
  Random random(4);
  for (unsigned char& v : valid.View())
    v = random.Below(3) > 0;
  const Volume<double> volume({6, 6, 6}, 0.1);
  const Sampler<double> sampler(volume.View(), valid.View());
  int inside = 0;
  for (int n = 0; n < 5000; ++n) {
    const double value = Linear(sampler, random.Uniform(-1, 6), random.Uniform(-1, 6), random.Uniform(-1, 6));
    inside += value != none;
    EXPECT_TRUE(value == 0.1 || value == none);
  }
  EXPECT_GT(inside, 1000);
}

} // namespace
