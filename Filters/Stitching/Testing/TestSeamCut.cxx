// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

using Labels = Volume<unsigned short>;

// A volume in a box of a grid, with a value for each voxel; inside everywhere unless told otherwise.
CoarseVolume Make(const GridBox& box, const std::function<float(int, int, int)>& value)
{
  CoarseVolume volume;
  volume.inside = {box, Volume<unsigned char>(box.size, 1)};
  volume.value = {box, Volume<float>(box.size)};
  for (int k = 0; k < box.size[2]; ++k)
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i)
        volume.value.values.View()(i, j, k) = value(box.first[0] + i, box.first[1] + j, box.first[2] + k);
  volume.low = volume.value;
  return volume;
}

bool Inside(const CoarseVolume& volume, const std::array<int, 3>& at)
{
  const GridBox& box = volume.inside.box;
  return box.HasRow(at[1], at[2]) && at[0] >= box.first[0] && at[0] < box.first[0] + box.size[0] &&
         (volume.inside.Row(at[1], at[2])[at[0] - box.first[0]] & 1);
}

double Value(const CoarseVolume& volume, const std::array<int, 3>& at)
{
  return volume.value.Row(at[1], at[2])[at[0] - volume.value.box.first[0]];
}

// The energy as the header says it, in grey levels; unit is the median difference.
double Energy(const std::vector<CoarseVolume>& volumes, const Labels& labels, const SeamParameters& parameters, double unit)
{
  double energy = 0.0;
  const std::array<int, 3> n = labels.Dimensions();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        for (int axis = 0; axis < 3; ++axis) {
          const std::array<int, 3> p{i, j, k};
          std::array<int, 3> q = p;
          if (++q[axis] >= n[axis])
            continue;
          const unsigned short a = labels.View()(p[0], p[1], p[2]), b = labels.View()(q[0], q[1], q[2]);
          if (a == b || a == noVolume || b == noVolume)
            continue;
          energy += parameters.length;
          for (const auto& x : {p, q})
            energy += Inside(volumes[a], x) && Inside(volumes[b], x)
                          ? std::min(std::abs(Value(volumes[a], x) - Value(volumes[b], x)) / unit, parameters.ceiling)
                          : parameters.border;
        }
  return energy;
}

double MedianDifference(const CoarseVolume& a, const CoarseVolume& b, const std::array<int, 3>& n)
{
  std::vector<double> all;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (Inside(a, {i, j, k}) && Inside(b, {i, j, k}) && Value(a, {i, j, k}) != Value(b, {i, j, k}))
          all.push_back(std::abs(Value(a, {i, j, k}) - Value(b, {i, j, k})));
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  return all[all.size() / 2];
}

CoarseVolume Noise(const GridBox& box, std::uint64_t seed)
{
  Random random(seed);
  return Make(box, [&](int, int, int) { return static_cast<float>(100.0 + 20.0 * random.Normal()); });
}

TEST(SeamCut, IsTheLeastOfAllLabellings)
{
  // Every labelling of an overlap of 12 voxels, in 2D and 3D.
  for (const auto& [n, first, second] :
       {std::tuple<std::array<int, 3>, GridBox, GridBox>{{8, 3, 1}, {{0, 0, 0}, {6, 3, 1}}, {{2, 0, 0}, {6, 3, 1}}},
        {{7, 2, 2}, {{0, 0, 0}, {5, 2, 2}}, {{2, 0, 0}, {5, 2, 2}}},
        {{5, 5, 1}, {{0, 0, 0}, {4, 4, 1}}, {{1, 0, 0}, {4, 5, 1}}}})
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const std::vector<CoarseVolume> volumes{Noise(first, 2 * seed), Noise(second, 2 * seed + 1)};
      SeamParameters parameters;
      parameters.length = 0.3;
      const double unit = MedianDifference(volumes[0], volumes[1], n);
      const Labels cut = CutSeams(volumes, n, parameters);
      const double found = Energy(volumes, cut, parameters, unit);
      Labels labels = cut;
      std::vector<std::ptrdiff_t> free;
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const bool a = Inside(volumes[0], {i, j, k}), b = Inside(volumes[1], {i, j, k});
            if (a && b)
              free.push_back(i + n[0] * (j + static_cast<std::ptrdiff_t>(n[1]) * k));
            else
              EXPECT_EQ(cut.View()(i, j, k), a ? 0 : b ? 1 : noVolume);
          }
      ASSERT_LE(free.size(), 12u);
      double least = std::numeric_limits<double>::infinity();
      for (unsigned bits = 0; bits < 1u << free.size(); ++bits) {
        for (std::size_t f = 0; f < free.size(); ++f)
          labels.View()[free[f]] = static_cast<unsigned short>(bits >> f & 1);
        least = std::min(least, Energy(volumes, labels, parameters, unit));
      }
      EXPECT_NEAR(found, least, 0.3) << "seed " << seed; // costs are rounded to 1/64
    }
}

TEST(SeamCut, FindsTheSurfaceWhereVolumesAgree)
{
  // Two volumes that differ but for two voxels on either side of a wavy sheet.
  const std::array<int, 3> n{40, 24, 20};
  const auto sheet = [](int j, int k) { return 20 + static_cast<int>(std::lround(4.0 * std::sin(0.4 * j) * std::cos(0.3 * k))); };
  Random random(7);
  const auto common = [](int i, int j, int k) { return static_cast<float>(100 + (7 * i + 5 * j + 3 * k) % 11); };
  std::vector<CoarseVolume> volumes{Make({{0, 0, 0}, {34, 24, 20}}, common)};
  volumes.push_back(Make({{6, 0, 0}, {34, 24, 20}}, [&](int i, int j, int k) {
    const bool agree = i >= sheet(j, k) - 3 && i < sheet(j, k) + 3;
    return common(i, j, k) + (agree ? 0.0f : static_cast<float>(30.0 + 10.0 * random.Uniform()));
  }));
  for (const int atOnce : {1000000, 1000}) {
    SeamParameters parameters;
    parameters.atOnce = atOnce;
    const Labels labels = CutSeams(volumes, n, parameters);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j) {
        int changes = 0;
        for (int i = 1; i < n[0]; ++i)
          if (labels.View()(i, j, k) != labels.View()(i - 1, j, k)) {
            ++changes;
            EXPECT_GE(i, sheet(j, k) - 3);
            EXPECT_LE(i, sheet(j, k) + 3);
          }
        EXPECT_EQ(changes, 1);
      }
  }
}

TEST(SeamCut, CoarseToFineComesCloseToTheExactCut)
{
  const std::array<int, 3> n{36, 20, 20};
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const std::vector<CoarseVolume> volumes{Noise({{0, 0, 0}, {28, 20, 20}}, 2 * seed),
                                            Noise({{8, 0, 0}, {28, 20, 20}}, 2 * seed + 1)};
    const double unit = MedianDifference(volumes[0], volumes[1], n);
    SeamParameters parameters;
    parameters.atOnce = 1000000;
    const double exact = Energy(volumes, CutSeams(volumes, n, parameters), parameters, unit);
    parameters.atOnce = 500;
    const double found = Energy(volumes, CutSeams(volumes, n, parameters), parameters, unit);
    const double middle = Energy(
        volumes,
        [&] {
          Labels labels(n);
          for (int k = 0; k < n[2]; ++k)
            for (int j = 0; j < n[1]; ++j)
              for (int i = 0; i < n[0]; ++i)
                labels.View()(i, j, k) = i >= n[0] / 2;
          return labels;
        }(),
        parameters, unit);
    EXPECT_GE(found, exact - 1.0);
    EXPECT_LE(found, exact + 0.15 * (middle - exact));
  }
}

// Which labels a cut shows, and how often.
std::vector<std::ptrdiff_t> Counts(const Labels& labels, std::size_t volumes)
{
  std::vector<std::ptrdiff_t> counts(volumes + 1, 0);
  for (const unsigned short label : labels.View())
    ++counts[label == noVolume ? volumes : label];
  return counts;
}

Boxed<float> Scale(const GridBox& box, const std::function<float(int, int, int)>& scale)
{
  return Make(box, scale).value;
}

TEST(SeamCut, CoresAndShadowsDecide)
{
  const std::array<int, 3> n{24, 16, 8};
  const GridBox all{{0, 0, 0}, n};
  // A volume within another has no voxel of its own: it is shown where it has its core, and nothing beyond the ring around that.
  std::vector<CoarseVolume> nested{Noise(all, 1), Noise({{6, 4, 2}, {12, 8, 4}}, 2)};
  EXPECT_EQ(Counts(CutSeams(nested, n), 2), (std::vector<std::ptrdiff_t>{24 * 16 * 8, 0, 0}));
  nested[0].scale =
      Scale(all, [](int i, int j, int k) { return i >= 6 && i < 18 && j >= 4 && j < 12 && k >= 2 && k < 6 ? 0.5f : 1.0f; });
  const auto core = [](int i, int j, int k) { return i >= 10 && i < 14 && j >= 7 && j < 9 && k >= 3 && k < 5; };
  nested[1].scale = Scale(nested[1].inside.box, [&](int i, int j, int k) { return core(i, j, k) ? 1.0f : 0.5f; });
  const Labels withCore = CutSeams(nested, n);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (core(i, j, k)) {
          EXPECT_EQ(withCore.View()(i, j, k), 1);
        }
        if (i <= 6 || i >= 17 || j <= 4 || j >= 11 || k <= 2 || k >= 5) {
          EXPECT_EQ(withCore.View()(i, j, k), 0); // the seam keeps off the border where it can
        }
      }
  // A shadow in the first volume, over its own core too: the second is shown there.
  nested[1] = Noise(all, 3);
  nested[0].scale = Scale(all, [](int, int, int) { return 1.0f; });
  nested[1].scale = Scale(all, [](int, int, int) { return 0.2f; });
  const auto shadow = [](int i, int j, int) { return i >= 8 && i < 15 && j >= 5; };
  nested[0].trust = Scale(all, [&](int i, int j, int k) { return shadow(i, j, k) ? 0.05f : 0.9f; });
  nested[1].trust = Scale(all, [](int, int, int) { return 0.8f; });
  const Labels shadowed = CutSeams(nested, n);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        EXPECT_EQ(shadowed.View()(i, j, k), shadow(i, j, k) ? 1 : 0);
  // And where nothing better is there, a shadow is shown as it is.
  nested[1].inside = {{{0, 0, 0}, {10, 16, 8}}, Volume<unsigned char>({10, 16, 8}, 1)};
  for (Boxed<float>* field : {&nested[1].value, &nested[1].low, &nested[1].scale, &nested[1].trust})
    *field = Scale(nested[1].inside.box, [](int, int, int) { return 0.5f; });
  const Labels alone = CutSeams(nested, n);
  for (int i = 10; i < n[0]; ++i)
    EXPECT_EQ(alone.View()(i, 10, 4), 0);
}

TEST(SeamCut, HardCases)
{
  const std::array<int, 3> n{20, 12, 6};
  const GridBox all{{0, 0, 0}, n};
  const std::ptrdiff_t voxels = 20 * 12 * 6;
  // Identical volumes: one label, the first.
  EXPECT_EQ(Counts(CutSeams({Noise(all, 1), Noise(all, 1)}, n), 2), (std::vector<std::ptrdiff_t>{voxels, 0, 0}));
  // No volume, one, and one that is nowhere.
  EXPECT_EQ(Counts(CutSeams({}, n), 0), (std::vector<std::ptrdiff_t>{voxels}));
  EXPECT_EQ(Counts(CutSeams({Noise(all, 1)}, n), 1), (std::vector<std::ptrdiff_t>{voxels, 0}));
  CoarseVolume nowhere = Noise(all, 2);
  std::fill(nowhere.inside.values.View().begin(), nowhere.inside.values.View().end(), 0);
  EXPECT_EQ(Counts(CutSeams({nowhere, Noise(all, 1), CoarseVolume()}, n), 3), (std::vector<std::ptrdiff_t>{0, voxels, 0, 0}));
  // Volumes that do not touch, and void between.
  EXPECT_EQ(Counts(CutSeams({Noise({{0, 0, 0}, {8, 12, 6}}, 1), Noise({{11, 0, 0}, {9, 12, 6}}, 2)}, n), 2),
            (std::vector<std::ptrdiff_t>{8 * 72, 9 * 72, 3 * 72}));
  // An overlap one voxel thin: each of its voxels shows one of both.
  const Labels thin = CutSeams({Noise({{0, 0, 0}, {11, 12, 6}}, 1), Noise({{10, 0, 0}, {10, 12, 6}}, 2)}, n);
  const auto counts = Counts(thin, 2);
  EXPECT_GE(counts[0], 10 * 72);
  EXPECT_GE(counts[1], 9 * 72);
  EXPECT_EQ(counts[2], 0);
  // Values that are not numbers cost a seam, and no more.
  std::vector<CoarseVolume> holes{Noise({{0, 0, 0}, {14, 12, 6}}, 1), Noise({{6, 0, 0}, {14, 12, 6}}, 2)};
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 8; ++i)
        if (i != 4)
          holes[1].value.values.View()(i, j, k) = std::numeric_limits<float>::quiet_NaN(); // but for the plane x = 10
  const Labels cut = CutSeams(holes, n);
  for (int j = 0; j < 12; ++j) {
    EXPECT_EQ(cut.View()(8, j, 3), 0);
    EXPECT_EQ(cut.View()(12, j, 3), 1);
  }
  // Islands: dust of one volume in another.
  CoarseVolume dust = Noise(all, 4);
  for (std::ptrdiff_t v = 0; v < voxels; ++v)
    dust.inside.values.View()[v] = v % 3 == 0;
  SeamParameters parameters;
  parameters.atOnce = 10;
  EXPECT_EQ(Counts(CutSeams({Noise({{0, 0, 0}, {15, 12, 6}}, 1), dust}, n, parameters), 2)[2], 5 * 72 * 2 / 3);
}

TEST(SeamCut, NoVolumeIsMissedAnywhereAmongMany)
{
  // Three volumes over each other: no set of voxels that showed one of them instead would make the seams better.
  const std::array<int, 3> n{6, 2, 1};
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const std::vector<CoarseVolume> volumes{Noise({{0, 0, 0}, {4, 2, 1}}, 3 * seed), Noise({{1, 0, 0}, {4, 2, 1}}, 3 * seed + 1),
                                            Noise({{2, 0, 0}, {4, 2, 1}}, 3 * seed + 2)};
    SeamParameters parameters;
    // The unit is not known from outside; without a length and borders, and with a ceiling out of reach, it does not matter.
    parameters.length = 0.0;
    parameters.border = 0.0;
    parameters.ceiling = 1000.0;
    parameters.sweeps = 10;
    const Labels cut = CutSeams(volumes, n, parameters);
    const double found = Energy(volumes, cut, parameters, 1.0);
    for (unsigned short v = 0; v < 3; ++v)
      for (unsigned bits = 0; bits < 1u << 12; ++bits) {
        Labels labels = cut;
        bool possible = true;
        for (int voxel = 0; voxel < 12; ++voxel)
          if (bits >> voxel & 1) {
            possible = possible && Inside(volumes[v], {voxel % 6, voxel / 6, 0});
            labels.View()[voxel] = v;
          }
        if (possible) {
          EXPECT_GE(Energy(volumes, labels, parameters, 1.0), found - 3.0); // costs are rounded to 1/64 of some 20 grey levels
        }
      }
  }
}

TEST(SeamCut, TwentyVolumesInARowEachHaveTheirPlace)
{
  const std::array<int, 3> n{124, 14, 1};
  std::vector<CoarseVolume> volumes;
  for (int v = 0; v < 20; ++v)
    volumes.push_back(Noise({{6 * v, 0, 0}, {10, 14, 1}}, static_cast<std::uint64_t>(v)));
  const auto counts = Counts(CutSeams(volumes, n), 20);
  for (int v = 0; v < 20; ++v)
    EXPECT_GE(counts[v], 2 * 14); // two columns are its own
  EXPECT_EQ(counts[20], 0);
}

TEST(SeamCut, ThreadsCancelAndBadInput)
{
  const std::array<int, 3> n{36, 20, 20};
  const std::vector<CoarseVolume> volumes{Noise({{0, 0, 0}, {28, 20, 20}}, 1), Noise({{8, 0, 0}, {28, 20, 20}}, 2),
                                          Noise({{4, 5, 0}, {28, 10, 20}}, 3)};
  SeamParameters parameters;
  parameters.atOnce = 500;
  const Labels many = CutSeams(volumes, n, parameters);
  {
    const ThreadLimit limit(1);
    const Labels one = CutSeams(volumes, n, parameters);
    EXPECT_TRUE(std::equal(many.View().begin(), many.View().end(), one.View().begin()));
  }
  EXPECT_THROW(CutSeams(volumes, n, parameters, Progress([](double done) { return done < 0.3; })), Error);
  const auto bad = [&](const auto& change) {
    SeamParameters wrong;
    change(wrong);
    EXPECT_THROW(CutSeams(volumes, n, wrong), Error);
  };
  bad([](SeamParameters& p) { p.length = -1.0; });
  bad([](SeamParameters& p) { p.ceiling = 0.0; });
  bad([](SeamParameters& p) { p.border = std::numeric_limits<double>::quiet_NaN(); });
  bad([](SeamParameters& p) { p.shadow = 1.5; });
  bad([](SeamParameters& p) { p.sweeps = 0; });
  bad([](SeamParameters& p) { p.atOnce = 0; });
  EXPECT_THROW(CutSeams(volumes, {36, 20, 19}), Error);
}

} // namespace
