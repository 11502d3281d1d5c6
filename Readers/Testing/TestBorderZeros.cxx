// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Readers/BorderZeros.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

/// The definition, taken at its word: spread from the border until nothing changes.
template <class T>
Volume<unsigned char> BruteForce(VolumeView<const T> voxels)
{
  const auto n = voxels.Dimensions();
  Volume<unsigned char> valid(n, 1);
  const auto view = valid.View();
  const auto outside = [&](int i, int j, int k) {
    if (i < 0 || j < 0 || i >= n[0] || j >= n[1])
      return true;
    if (k < 0 || k >= n[2])
      return n[2] > 1; // above and below an image is nothing
    return view(i, j, k) == 0;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (view(i, j, k) && (voxels(i, j, k) == T(0) || !std::isfinite(static_cast<double>(voxels(i, j, k)))) &&
              (outside(i - 1, j, k) || outside(i + 1, j, k) || outside(i, j - 1, k) || outside(i, j + 1, k) ||
               outside(i, j, k - 1) || outside(i, j, k + 1))) {
            view(i, j, k) = 0;
            changed = true;
          }
  }
  for (std::ptrdiff_t i = 0; i < voxels.Size(); ++i)
    if (!std::isfinite(static_cast<double>(voxels[i])))
      view[i] = 0;
  return valid;
}

template <class T>
void ExpectAsBruteForce(const Volume<T>& voxels)
{
  Volume<unsigned char> valid(voxels.Dimensions(), 77);
  const std::int64_t missing = ValidFromBorderZeros<T>(voxels.View(), valid.View());
  Volume<unsigned char> wanted = BruteForce<T>(voxels.View());
  EXPECT_TRUE(std::equal(valid.View().begin(), valid.View().end(), wanted.View().begin()));
  EXPECT_EQ(missing, std::count(wanted.View().begin(), wanted.View().end(), 0));
}

} // namespace

TEST(BorderZeros, AgreesWithBruteForceOnRandomVolumes)
{
  for (int round = 0; round < 60; ++round) {
    Random random(1, static_cast<std::uint64_t>(round));
    const auto size = [&random] { return 1 + static_cast<int>(random.Below(12)); };
    const std::array<int, 3> dimensions{size(), size(), round % 5 == 0 ? 1 : size()};
    const double zeros = random.Uniform(0.1, 0.9); // below, at and above the percolation of zeros
    Volume<unsigned char> bytes(dimensions);
    Volume<float> floats(dimensions);
    for (std::ptrdiff_t i = 0; i < bytes.View().Size(); ++i) {
      bytes.View()[i] = random.Uniform() < zeros ? 0 : 9;
      floats.View()[i] = random.Uniform() < 0.02 ? std::numeric_limits<float>::quiet_NaN() : bytes.View()[i];
    }
    ExpectAsBruteForce(bytes);
    ExpectAsBruteForce(floats);
  }
}

TEST(BorderZeros, FluidInsideStaysReal)
{
  Volume<short> voxels({9, 9, 9}, 0);
  const auto view = voxels.View();
  for (int k = 2; k < 7; ++k)
    for (int j = 2; j < 7; ++j)
      for (int i = 2; i < 7; ++i)
        view(i, j, k) = -3;
  view(4, 4, 4) = 0;
  Volume<unsigned char> valid(voxels.Dimensions());
  EXPECT_EQ(ValidFromBorderZeros<short>(view, valid.View()), 9 * 9 * 9 - 125);
  EXPECT_EQ(valid.View()(4, 4, 4), 1);
  EXPECT_EQ(valid.View()(1, 4, 4), 0);
  view(4, 4, 5) = view(4, 4, 6) = 0; // a tunnel opens
  EXPECT_EQ(ValidFromBorderZeros<short>(view, valid.View()), 9 * 9 * 9 - 122);
}

TEST(BorderZeros, ASerpentineIsFollowedToItsEnd)
{
  // A path of zeros that doubles back in every other row: labels must be merged late and often.
  const int n = 41;
  Volume<unsigned char> voxels({n, n, 1}, 1);
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 1; i + 1 < n; ++i)
      if (j % 2 == 1 || (j % 4 == 2 ? i == 1 : i == n - 2))
        voxels.View()(i, j, 0) = 0;
  ExpectAsBruteForce(voxels);
  Volume<unsigned char> valid(voxels.Dimensions());
  ValidFromBorderZeros<unsigned char>(voxels.View(), valid.View());
  EXPECT_EQ(valid.View()(n / 2, n - 2, 0), 0) << "the far end";
}

TEST(BorderZeros, AllOrNothing)
{
  for (const unsigned char value : {0, 1}) {
    Volume<unsigned char> voxels({4, 5, 6}, value), valid({4, 5, 6});
    EXPECT_EQ(ValidFromBorderZeros<unsigned char>(voxels.View(), valid.View()), value ? 0 : 120);
  }
}

TEST(BorderZeros, LooksAreToldSlabBySlab)
{
  for (const std::array<int, 3>& n : {std::array<int, 3>{5, 4, 3}, {5, 4, 1}, {1, 3, 4}})
    for (const float nothing : {0.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1.0f}) {
      Volume<float> voxels(n, 1.0f);
      Volume<unsigned char> valid(n, 1);
      for (std::ptrdiff_t at = 0; at < voxels.View().Size(); ++at) {
        voxels.View()[at] = nothing;
        const bool everywhere = ValidFromBorderZeros<float>(voxels.View(), valid.View()) == 0;
        for (int slab = 1; slab <= n[2]; ++slab) {
          bool looks = true;
          for (int first = 0; first < n[2]; first += slab) {
            const VolumeView<const float> part(voxels.View().Row(0, first), {n[0], n[1], std::min(slab, n[2] - first)});
            looks = LooksValidEverywhere(part, first, n[2]) && looks;
          }
          EXPECT_EQ(looks, everywhere) << nothing << " at " << at << ", slabs of " << slab;
        }
        voxels.View()[at] = 1.0f;
      }
    }
}
