// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include "Filters/Stitching/Benchmarks/StitchOffsets.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Labels = Volume<unsigned short>;

CoarseVolume Make(const GridBox& box, const std::function<float(int, int, int)>& low)
{
  CoarseVolume volume;
  volume.inside = {box, Volume<unsigned char>(box.size, 1)};
  volume.low = {box, Volume<float>(box.size)};
  for (int k = 0; k < box.size[2]; ++k)
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i)
        volume.low.values.View()(i, j, k) = low(box.first[0] + i, box.first[1] + j, box.first[2] + k);
  volume.value = volume.low;
  return volume;
}

Labels Halves(const std::array<int, 3>& n, int from)
{
  Labels labels(n);
  for (std::ptrdiff_t v = 0; v < labels.View().Size(); ++v)
    labels.View()[v] = v % n[0] >= from;
  return labels;
}

float At(const Boxed<float>& field, int i, int j, int k)
{
  return field.Row(j, k)[i - field.box.first[0]];
}

TEST(StitchOffsets, MeetHalfWayAndEndWhereAVolumeIsAlone)
{
  // Constants 100 and 140, overlap x = 10 ... 29, seam between 19 and 20: straight lines.
  for (const std::array<int, 3>& n : {std::array<int, 3>{40, 9, 1}, {40, 7, 5}}) {
    const std::vector<CoarseVolume> volumes{Make({{0, 0, 0}, {30, n[1], n[2]}}, [](int, int, int) { return 100.0f; }),
                                            Make({{10, 0, 0}, {30, n[1], n[2]}}, [](int, int, int) { return 140.0f; })};
    const auto fields = OffsetFields(volumes, Halves(n, 20), Eigen::Vector3d(1.0, 1.0, 1.0));
    ASSERT_EQ(fields.size(), 2u);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < 40; ++i) {
          // Voxels 9 and 30 are alone: 0; voxels 19 and 20 meet at 120.
          if (i < 30) {
            const double first = i <= 9 ? 0.0 : i < 19 ? 20.0 * (i - 9) / 10.0 : 20.0;
            EXPECT_NEAR(At(fields[0], i, j, k), first, 0.1) << i;
          }
          if (i >= 10) {
            const double second = i >= 30 ? 0.0 : i > 20 ? -20.0 * (30 - i) / 10.0 : -20.0;
            EXPECT_NEAR(At(fields[1], i, j, k), second, 0.1) << i;
          }
        }
  }
}

TEST(StitchOffsets, AlongEveryAxis)
{
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<int, 3> n{5, 5, 5}, size, first{0, 0, 0};
    n[axis] = 40;
    size = n;
    size[axis] = 30;
    first[axis] = 10;
    Labels labels(n);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          labels.View()(i, j, k) = std::array<int, 3>{i, j, k}[axis] >= 20;
    const auto fields = OffsetFields({Make({{0, 0, 0}, size}, [](int, int, int) { return 100.0f; }),
                                      Make({first, size}, [](int, int, int) { return 140.0f; })},
                                     labels, Eigen::Vector3d(1.0, 1.0, 1.0));
    for (int x = 0; x < 30; ++x) {
      std::array<int, 3> at{2, 2, 2};
      at[axis] = x;
      EXPECT_NEAR(At(fields[0], at[0], at[1], at[2]), x <= 9 ? 0.0 : x < 19 ? 2.0 * (x - 9) : 20.0, 0.1) << axis << " " << x;
    }
  }
}

TEST(StitchOffsets, RowsFarApartGoTheirOwnWay)
{
  const std::array<int, 3> n{40, 24, 1};
  const auto half = [&](double spacingY) {
    const auto fields = OffsetFields({Make({{0, 0, 0}, {30, 24, 1}}, [](int, int, int) { return 100.0f; }),
                                      Make({{10, 0, 0}, {30, 24, 1}}, [](int, int j, int) { return j < 12 ? 80.0f : 120.0f; })},
                                     Halves(n, 17), Eigen::Vector3d(1.0, spacingY, 1.0));
    return At(fields[0], 13, 2, 0);
  };
  EXPECT_NEAR(half(50.0), -10.0 * 4.0 / 7.0, 0.3);
  EXPECT_NEAR(half(0.02), 0.0, 1.0); // close together: their mean
}

TEST(StitchOffsets, FollowTheDifferenceAlongTheSeam)
{
  const std::array<int, 3> n{40, 24, 1};
  const auto difference = [](int j) { return static_cast<float>(10.0 + j); };
  const std::vector<CoarseVolume> volumes{
      Make({{0, 0, 0}, {30, 24, 1}}, [](int i, int, int) { return static_cast<float>(i); }),
      Make({{10, 0, 0}, {30, 24, 1}}, [&](int i, int j, int) { return static_cast<float>(i) - difference(j); })};
  const auto fields = OffsetFields(volumes, Halves(n, 17), Eigen::Vector3d(1.0, 1.0, 1.0));
  for (int j = 0; j < 24; ++j) {
    EXPECT_NEAR(At(fields[0], 16, j, 0), -0.5f * difference(j), 1e-4);
    EXPECT_NEAR(At(fields[1], 17, j, 0), 0.5f * difference(j), 1e-4);
    EXPECT_EQ(At(fields[0], 5, j, 0), 0.0f);
    EXPECT_EQ(At(fields[1], 35, j, 0), 0.0f);
    for (int i = 0; i < 30; ++i) {
      EXPECT_LE(At(fields[0], i, j, 0), 0.0f);
      EXPECT_GE(At(fields[0], i, j, 0), -0.5f * difference(23) - 1e-3f);
    }
  }
}

TEST(StitchOffsets, HardCases)
{
  const std::array<int, 3> n{20, 6, 1};
  const Eigen::Vector3d spacing(1.0, 1.0, 1.0);
  // Volumes that only touch, or that agree: nothing to do.
  const auto all = [](const std::vector<Boxed<float>>& fields, float value) {
    for (const auto& field : fields)
      for (const float offset : field.values.View())
        if (offset != value)
          return false;
    return true;
  };
  EXPECT_TRUE(all(OffsetFields({Make({{0, 0, 0}, {10, 6, 1}}, [](int, int, int) { return 1.0f; }),
                                Make({{10, 0, 0}, {10, 6, 1}}, [](int, int, int) { return 9.0f; })},
                               Halves(n, 10), spacing),
                  0.0f));
  EXPECT_TRUE(all(OffsetFields({Make({{0, 0, 0}, n}, [](int i, int, int) { return static_cast<float>(i); }),
                                Make({{0, 0, 0}, n}, [](int i, int, int) { return static_cast<float>(i); })},
                               Halves(n, 10), spacing),
                  0.0f));
  // Identical masks: no voxel is alone, so the whole of each moves half-way.
  const auto fields = OffsetFields(
      {Make({{0, 0, 0}, n}, [](int, int, int) { return 10.0f; }), Make({{0, 0, 0}, n}, [](int, int, int) { return 30.0f; })},
      Halves(n, 10), spacing);
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(At(fields[0], i, 3, 0), 10.0f, 1e-3);
    EXPECT_NEAR(At(fields[1], i, 3, 0), -10.0f, 1e-3);
  }
  // A volume that is shown nowhere has no seam; an overlap one voxel thin; no volume at all; not a number.
  Labels first(n, 0);
  EXPECT_TRUE(all(OffsetFields({Make({{0, 0, 0}, n}, [](int, int, int) { return 10.0f; }),
                                Make({{5, 1, 0}, {6, 3, 1}}, [](int, int, int) { return 30.0f; })},
                               first, spacing),
                  0.0f));
  const auto thin = OffsetFields({Make({{0, 0, 0}, {11, 6, 1}}, [](int, int, int) { return 10.0f; }),
                                  Make({{10, 0, 0}, {10, 6, 1}}, [](int, int, int) { return 30.0f; })},
                                 Halves(n, 10), spacing);
  EXPECT_EQ(At(thin[0], 9, 2, 0), 10.0f);
  EXPECT_EQ(At(thin[1], 10, 2, 0), -10.0f);
  EXPECT_EQ(At(thin[0], 8, 2, 0), 0.0f);
  EXPECT_TRUE(OffsetFields({}, first, spacing).empty());
  EXPECT_EQ(OffsetFields({CoarseVolume()}, first, spacing).size(), 1u);
  for (const auto& field :
       OffsetFields({Make({{0, 0, 0}, n}, [](int, int, int) { return std::numeric_limits<float>::quiet_NaN(); }),
                     Make({{0, 0, 0}, n}, [](int, int, int) { return 30.0f; })},
                    Halves(n, 10), spacing))
    for (const float offset : field.values.View())
      EXPECT_EQ(offset, 0.0f);
  EXPECT_THROW(OffsetFields({Make({{0, 0, 0}, {21, 6, 1}}, [](int, int, int) { return 0.0f; })}, first, spacing), Error);
}

TEST(StitchOffsets, ThreadsAndCancel)
{
  const std::array<int, 3> n{40, 24, 12};
  const std::vector<CoarseVolume> volumes{
      Make({{0, 0, 0}, {30, 24, 12}}, [](int i, int j, int k) { return static_cast<float>((i * 3 + j * 5 + k) % 7); }),
      Make({{10, 0, 0}, {30, 24, 12}}, [](int i, int j, int k) { return static_cast<float>((i + j * 2 + k * 3) % 11); })};
  const Labels labels = Halves(n, 20);
  const Eigen::Vector3d spacing(1.0, 0.7, 1.3);
  const auto many = OffsetFields(volumes, labels, spacing);
  const ThreadLimit limit(1);
  const auto one = OffsetFields(volumes, labels, spacing);
  for (int v = 0; v < 2; ++v)
    EXPECT_TRUE(std::equal(many[v].values.View().begin(), many[v].values.View().end(), one[v].values.View().begin()));
  EXPECT_THROW(OffsetFields(volumes, labels, spacing, Progress([](double done) { return done < 0.4; })), Error);
}

} // namespace
