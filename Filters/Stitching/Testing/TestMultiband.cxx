// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/Benchmarks/Multiband.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Value = std::function<float(int, int, int)>;

ResampledVolume Make(const GridBox& box, const Value& value, const Value& share)
{
  ResampledVolume volume{
      {box, Volume<float>(box.size)}, {box, Volume<unsigned char>(box.size, 1)}, {box, Volume<float>(box.size)}};
  for (int k = 0; k < box.size[2]; ++k)
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i) {
        volume.values.values.View()(i, j, k) = value(box.first[0] + i, box.first[1] + j, box.first[2] + k);
        volume.share.values.View()(i, j, k) = share(box.first[0] + i, box.first[1] + j, box.first[2] + k);
      }
  return volume;
}

// Two volumes that overlap in the middle third along x and change over at its middle.
std::vector<ResampledVolume> Pair(const std::array<int, 3>& n, const Value& first, const Value& second)
{
  const int third = n[0] / 3, middle = n[0] / 2;
  return {Make({{0, 0, 0}, {n[0] - third, n[1], n[2]}}, first, [=](int i, int, int) { return i < middle ? 1.0f : 0.0f; }),
          Make({{third, 0, 0}, {n[0] - third, n[1], n[2]}}, second, [=](int i, int, int) { return i < middle ? 0.0f : 1.0f; })};
}

TEST(Multiband, FineDetailChangesOverAtOnce)
{
  const std::array<int, 3> n{128, 20, 1};
  const Value checks = [](int i, int j, int) { return (i + j) % 2 ? 120.0f : 80.0f; };
  const Volume<float> blended = BlendMultiband(Pair(n, checks, [](int, int, int) { return 100.0f; }), n, 5);
  for (int j = 2; j < 18; ++j)
    for (int d = 4; d < 12; ++d) {
      EXPECT_NEAR(blended.View()(64 - d, j, 0), checks(64 - d, j, 0), 2.0);
      EXPECT_NEAR(blended.View()(64 + d, j, 0), 100.0, 2.0);
    }
}

TEST(Multiband, ConstantsStay)
{
  for (const std::array<int, 3>& n :
       {std::array<int, 3>{64, 32, 1}, {61, 37, 1}, {1, 29, 31}, {32, 32, 32}, {37, 23, 19}, {5, 1, 1}, {1, 1, 1}}) {
    const Value constant = [](int, int, int) { return 117.0f; };
    std::vector<ResampledVolume> volumes;
    if (n[0] >= 3)
      volumes = Pair(n, constant, constant);
    else
      volumes = {Make({{0, 0, 0}, n}, constant, [](int, int, int) { return 1.0f; })};
    const Volume<float> blended = BlendMultiband(volumes, n);
    for (const float value : blended.View())
      EXPECT_NEAR(value, 117.0f, 117.0f * 1e-6f);
  }
}

TEST(Multiband, AVolumeIsItselfFarFromOthersAndAtItsBorder)
{
  const std::array<int, 3> n{150, 41, 23};
  const auto noise = [](std::uint64_t seed) {
    return [seed](int i, int j, int k) {
      return static_cast<float>(255.0 * Random(seed, static_cast<std::uint64_t>(i + 1000 * (j + 1000 * k))).Uniform());
    };
  };
  const int levels = 3;
  const std::vector<ResampledVolume> volumes = Pair(n, noise(1), noise(2));
  const Volume<float> blended = BlendMultiband(volumes, n, levels);
  const int reach = 4 << levels;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (std::abs(i - n[0] / 2) > reach) {
          EXPECT_NEAR(blended.View()(i, j, k), noise(i < n[0] / 2 ? 1 : 2)(i, j, k), 1e-3);
        }
}

TEST(Multiband, RampsOfDifferentHeightMeetWithoutAJump)
{
  const std::array<int, 3> n{128, 20, 1};
  const Value first = [](int i, int, int) { return static_cast<float>(i); };
  const Value second = [](int i, int, int) { return static_cast<float>(i + 40); };
  const auto largestStep = [&](int levels) {
    const Volume<float> blended = BlendMultiband(Pair(n, first, second), n, levels);
    float largest = 0.0f;
    for (int j = 0; j < n[1]; ++j)
      for (int i = 1; i < n[0]; ++i)
        largest = std::max(largest, std::abs(blended.View()(i, j, 0) - blended.View()(i - 1, j, 0)));
    return largest;
  };
  EXPECT_FLOAT_EQ(largestStep(0), 41.0f); // the hard seam that it is without levels
  EXPECT_LT(largestStep(2), 12.0f);
  EXPECT_LT(largestStep(5), 4.0f);
}

TEST(Multiband, NothingBleedsInFromOutside)
{
  // A bright disc, alone: with zeros around it, its border would darken.
  const std::array<int, 3> n{50, 47, 1};
  ResampledVolume disc = Make(
      {{0, 0, 0}, n}, [](int, int, int) { return 200.0f; }, [](int, int, int) { return 1.0f; });
  const auto within = [](int i, int j) { return std::hypot(i - 24.0, j - 23.0) < 17.3; };
  for (int j = 0; j < n[1]; ++j)
    for (int i = 0; i < n[0]; ++i)
      if (!within(i, j)) {
        disc.inside.values.View()(i, j, 0) = 0;
        disc.values.values.View()(i, j, 0) = -1e6f;
        disc.share.values.View()(i, j, 0) = 0.0f;
      }
  disc.values.values.View()(20, 20, 0) = std::numeric_limits<float>::quiet_NaN(); // which is not there either
  const Volume<float> blended = BlendMultiband({disc}, n);
  for (int j = 0; j < n[1]; ++j)
    for (int i = 0; i < n[0]; ++i)
      EXPECT_NEAR(blended.View()(i, j, 0), within(i, j) && !(i == 20 && j == 20) ? 200.0f : 0.0f, 1e-3);
}

TEST(Multiband, BoxesDoNotMatter)
{
  // A volume in a box of its own, and the same in one as large as the grid.
  const std::array<int, 3> n{61, 43, 37};
  const GridBox small{{13, 11, 9}, {21, 17, 15}};
  const Value value = [](int i, int j, int k) { return static_cast<float>((i * i + 3 * j + 5 * k) % 97); };
  const auto there = [&](int i, int j, int k) { return i >= 13 && i < 34 && j >= 11 && j < 28 && k >= 9 && k < 24; };
  const ResampledVolume ground = Make(
      {{0, 0, 0}, n}, [](int i, int, int) { return static_cast<float>(i); },
      [&](int i, int j, int k) { return there(i, j, k) ? 0.25f : 1.0f; });
  const ResampledVolume boxed = Make(small, value, [](int, int, int) { return 0.75f; });
  ResampledVolume wide = Make({{0, 0, 0}, n}, value, [&](int i, int j, int k) { return there(i, j, k) ? 0.75f : 0.0f; });
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        wide.inside.values.View()(i, j, k) = there(i, j, k);
  const Volume<float> first = BlendMultiband({ground, boxed}, n), second = BlendMultiband({ground, wide}, n);
  for (std::ptrdiff_t v = 0; v < first.View().Size(); ++v)
    ASSERT_NEAR(first.View()[v], second.View()[v], 1e-3) << v;
}

TEST(Multiband, ThreadsAndCancel)
{
  const std::array<int, 3> n{40, 30, 20};
  const auto volumes = Pair(
      n, [](int i, int j, int k) { return static_cast<float>((i * 7 + j * 5 + k) % 13); },
      [](int i, int j, int k) { return static_cast<float>((i + j * 11 + k * 3) % 17); });
  const Volume<float> many = BlendMultiband(volumes, n);
  const ThreadLimit limit(1);
  const Volume<float> one = BlendMultiband(volumes, n);
  EXPECT_TRUE(std::equal(many.View().begin(), many.View().end(), one.View().begin()));
  EXPECT_THROW(BlendMultiband(volumes, n, 5, Progress([](double done) { return done < 0.5; })), Error);
  EXPECT_THROW(BlendMultiband(volumes, n, -1), Error);
  EXPECT_THROW(BlendMultiband(volumes, {39, 30, 20}), Error);
}

} // namespace
