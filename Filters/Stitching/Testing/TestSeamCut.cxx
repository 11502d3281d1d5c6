// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/SeamCut.h"
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

} // namespace
