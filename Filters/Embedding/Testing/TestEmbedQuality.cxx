// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/EmbedQuality.h"
#include "Filters/Embedding/Feather.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

namespace echorama {

namespace {

constexpr auto data = static_cast<unsigned char>(EmbeddedVoxel::Data);
constexpr auto blend = static_cast<unsigned char>(EmbeddedVoxel::Blend);
constexpr auto invented = static_cast<unsigned char>(EmbeddedVoxel::Invented);

struct Scene {
  ImageGeometry grid;
  Volume<float> values;
  Volume<unsigned char> labels;

  Scene(const std::array<int, 3>& n, const std::function<unsigned char(int, int, int)>& label,
        const std::function<double(int, int, int)>& value)
  {
    grid.dimensions = n;
    values = Volume<float>(n);
    labels = Volume<unsigned char>(n);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          labels.View()(i, j, k) = label(i, j, k);
          values.View()(i, j, k) = static_cast<float>(value(i, j, k));
        }
  }

  EmbedQualityReport Measure(const EmbedQualityParameters& parameters = {}) const
  {
    return MeasureEmbedding<float>(values.View(), labels.View(), grid, nullptr, nullptr, parameters);
  }

  EmbedQualityReport Against(const Scene& original, double featherMm) const
  {
    Volume<unsigned char> valid(original.labels.Dimensions());
    for (std::ptrdiff_t at = 0; at < valid.View().Size(); ++at)
      valid.View()[at] = original.labels.View()[at] == data;
    const PosedVolume<float> volume{original.values.View(), valid.View(), original.grid};
    EmbedQualityParameters parameters;
    parameters.featherMm = featherMm;
    parameters.randomSurfaces = 0;
    return MeasureEmbedding<float>(values.View(), labels.View(), grid, &volume, nullptr, parameters);
  }
};

unsigned char Half(int i, int, int)
{
  return i < 24 ? data : invented;
}

unsigned char Ball(int i, int j, int k)
{
  return std::hypot(i - 24.0, j - 24.0, k - 24.0) < 17.0 ? data : invented;
}

double Noise(int i, int j, int k)
{
  return Random(3, static_cast<std::uint64_t>(i + 100 * (j + 100 * k))).Normal();
}

constexpr std::array<int, 3> cube{48, 48, 48};

} // namespace

TEST(EmbedQuality, AStepIsItsHeight)
{
  for (const auto label : {Half, Ball}) {
    const Scene scene(cube, label, [label](int i, int j, int k) { return label(i, j, k) == data ? 100.0 : 107.5; });
    const EmbedQualityReport report = scene.Measure();
    EXPECT_DOUBLE_EQ(report.border.mean, 7.5);
    EXPECT_DOUBLE_EQ(report.border.median, 7.5);
    EXPECT_DOUBLE_EQ(report.border.percentile95, 7.5);
    EXPECT_DOUBLE_EQ(report.border.bias, 7.5);
    EXPECT_EQ(report.reference.percentile95, 0.0); // nothing changes inside
    EXPECT_EQ(report.jumpLimit, 2.0);
    EXPECT_FALSE(report.jumpPasses);
    EXPECT_GT(report.border.patches, 50);
    EXPECT_GT(report.borderMeasured, 0.9);
    EXPECT_TRUE(std::isnan(report.border.deviationRatio)); // nothing varies
    EXPECT_FALSE(report.deviationPasses);
  }
}

TEST(EmbedQuality, DarkOutsideHasANegativeBias)
{
  const Scene scene(cube, Half, [](int i, int, int) { return i < 24 ? 100.0 : 99.0; });
  const EmbedQualityReport report = scene.Measure();
  EXPECT_DOUBLE_EQ(report.border.bias, -1.0);
  EXPECT_DOUBLE_EQ(report.border.percentile95, 1.0);
  EXPECT_TRUE(report.jumpPasses); // nobody sees one grey level
}

TEST(EmbedQuality, ASlopeJumpsByItsRiseOverAShell)
{
  const Scene scene({48, 50, 50}, Half, [](int i, int, int) { return 2.0 * i; });
  const EmbedQualityReport report = scene.Measure();
  EXPECT_NEAR(report.border.mean, 2.0 * 5.0, 1e-9);
  // The same slope inside: up to that across, nothing along it.
  EXPECT_LE(report.reference.percentile95, 12.0);
  EXPECT_GT(report.reference.percentile95, 6.0);
  EXPECT_LT(report.reference.median, 10.0);
}

TEST(EmbedQuality, WithoutAStepIsWhatNoiseAloneGives)
{
  const Scene scene(cube, Half, [](int i, int j, int k) { return 80.0 + 12.0 * Noise(i, j, k); });
  const EmbedQualityReport report = scene.Measure();
  // Means of 125 voxels on either side; the mean size of a normal number is 0.8 of its deviation.
  const double deviation = 12.0 * std::sqrt(2.0 / 125.0);
  EXPECT_NEAR(report.border.mean, 0.8 * deviation, 0.3);
  EXPECT_NEAR(report.border.percentile95, 1.96 * deviation, 0.8);
  EXPECT_NEAR(report.reference.mean, 0.8 * deviation, 0.6); // the sides of so small a region cut many patches
  EXPECT_NEAR(report.border.bias, 0.0, 0.4);
  EXPECT_NEAR(report.border.deviationRatio, 1.0, 0.03);
  EXPECT_NEAR(report.reference.deviationRatio, 1.0, 0.03);
  EXPECT_TRUE(report.deviationPasses);
}

TEST(EmbedQuality, AStepShowsThroughNoiseThatHidesNone)
{
  const Scene scene(cube, Ball,
                    [](int i, int j, int k) { return (Ball(i, j, k) == data ? 80.0 : 92.0) + 12.0 * Noise(i, j, k); });
  const EmbedQualityReport report = scene.Measure();
  EXPECT_NEAR(report.border.mean, 12.0, 0.3);
  EXPECT_FALSE(report.jumpPasses);
  const Scene same(cube, Ball, [](int i, int j, int k) { return 80.0 + 3.0 * Noise(i, j, k); });
  EXPECT_TRUE(same.Measure().jumpPasses);
}

TEST(EmbedQuality, DeviationsHaveTheirRatio)
{
  for (const double factor : {0.5, 0.9, 1.1, 1.4}) {
    const Scene scene(cube, Ball, [factor](int i, int j, int k) {
      return 1000.0 + (Ball(i, j, k) == data ? 10.0 : 10.0 * factor) * Noise(i, j, k);
    });
    const EmbedQualityReport report = scene.Measure();
    EXPECT_NEAR(report.border.deviationRatio, factor, 0.03 * factor);
    EXPECT_LT(report.border.deviationRatio5, factor);
    EXPECT_GT(report.border.deviationRatio95, factor);
    EXPECT_EQ(report.deviationPasses, std::abs(factor - 1.0) < 0.15);
    EXPECT_NEAR(report.reference.deviationRatio, 1.0, 0.03);
  }
}

TEST(EmbedQuality, SlopesAreNoTexture)
{
  const Scene scene(cube, Ball, [](int i, int j, int k) {
    return 10.0 * Noise(i, j, k) + (Ball(i, j, k) == data ? 6.0 * i - 4.0 * j + 5.0 * k : 20.0);
  });
  EXPECT_NEAR(scene.Measure().border.deviationRatio, 1.0, 0.03);
}

TEST(EmbedQuality, BlendsAreSeenAndNoReference)
{
  // Blended voxels vary a lot: they are inside of the border, but not what is compared with.
  const auto label = [](int i, int j, int k) {
    return Ball(i, j, k) == data && std::hypot(i - 24.0, j - 24.0, k - 24.0) >= 14.0 ? blend : Ball(i, j, k);
  };
  const Scene scene(cube, label, [&label](int i, int j, int k) { return label(i, j, k) == blend ? 50.0 + i : 50.0; });
  const EmbedQualityReport report = scene.Measure();
  EXPECT_EQ(report.reference.percentile95, 0.0);
  EXPECT_GT(report.border.percentile95, 5.0);
  EXPECT_EQ(report.data + report.blend + report.invented, 48 * 48 * 48);
  EXPECT_GT(report.blend, 1000);
}

TEST(EmbedQuality, SpacingAndPoseDoNotMatter)
{
  Scene scene(
      {24, 48, 16}, [](int i, int j, int k) { return Ball(2 * i, j, 3 * k); },
      [](int i, int j, int k) { return Ball(2 * i, j, 3 * k) == data ? 30.0 : 20.0; });
  scene.grid.spacing = {2.0, 1.0, 3.0};
  const EmbedQualityReport plain = scene.Measure();
  EXPECT_DOUBLE_EQ(plain.border.median, 10.0);
  EXPECT_GT(plain.border.patches, 30);
  scene.grid = scene.grid.Moved(Pose(Eigen::Translation3d(10, 20, 30) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX())));
  EXPECT_EQ(scene.Measure().border.patches, plain.border.patches);
}

TEST(EmbedQuality, ShellsAreMillimetresThick)
{
  // 2 grey levels per mm along voxels of 2 mm.
  Scene scene(
      {24, 50, 50}, [](int i, int, int) { return i < 12 ? data : invented; }, [](int i, int, int) { return 4.0 * i; });
  scene.grid.spacing = {2.0, 1.0, 1.0};
  const EmbedQualityReport report = scene.Measure();
  EXPECT_GT(report.borderMeasured, 0.9);
  EXPECT_NEAR(report.border.mean, 10.0, 3.0); // 20 if shells were counted in voxels
}

TEST(EmbedQuality, AFlatBorderIsMeasuredWhereverItLies)
{
  for (int border = 20; border < 31; ++border) {
    const Scene scene(
        {48, 50, 50}, [border](int i, int, int) { return i < border ? data : invented; },
        [border](int i, int, int) { return i < border ? 30.0 : 20.0; });
    const EmbedQualityReport report = scene.Measure();
    EXPECT_GT(report.borderMeasured, 0.9) << border;
    EXPECT_NEAR(report.border.median, 10.0, 1e-9) << border;
  }
}

TEST(EmbedQuality, HolesIslandsAndThinShells)
{
  // A hole and an island of four voxels, and a sheet of one: each is a border.
  const auto hole = [](int i, int j, int k) { return i > 8 && i < 13 && j > 8 && j < 13 && k > 8 && k < 13; };
  const Scene holed(
      cube, [&](int i, int j, int k) { return hole(i, j, k) ? invented : data; },
      [&](int i, int j, int k) { return hole(i, j, k) ? 5.0 : 1.0; });
  EXPECT_DOUBLE_EQ(holed.Measure().border.bias, 4.0);
  const Scene island(
      cube, [&](int i, int j, int k) { return hole(i, j, k) ? data : invented; },
      [&](int i, int j, int k) { return hole(i, j, k) ? 5.0 : 1.0; });
  EXPECT_DOUBLE_EQ(island.Measure().border.bias, -4.0);
  const Scene sheet(
      cube, [](int i, int, int) { return i == 20 ? data : invented; }, [](int i, int, int) { return i == 20 ? 9.0 : 1.0; });
  EXPECT_DOUBLE_EQ(sheet.Measure().border.bias, -8.0);
}

TEST(EmbedQuality, WhatCannotBeMeasuredIsNotANumber)
{
  const auto value = [](int, int, int) { return 3.0; };
  for (const auto& label : {data, invented, static_cast<unsigned char>(0)}) {
    const EmbedQualityReport report = Scene(
                                          {9, 9, 9}, [label](int, int, int) { return label; }, value)
                                          .Measure();
    EXPECT_EQ(report.border.patches, 0);
    EXPECT_TRUE(std::isnan(report.border.mean) && std::isnan(report.border.deviationRatio) && std::isnan(report.borderMeasured));
    EXPECT_FALSE(report.jumpPasses || report.deviationPasses);
    EXPECT_TRUE(std::isnan(report.crop.share));
    EXPECT_EQ(report.altered, -1);
  }
  // A single seen voxel is no patch.
  const Scene one(
      {9, 9, 9}, [](int i, int j, int k) { return i == 4 && j == 4 && k == 4 ? data : invented; }, value);
  EXPECT_EQ(one.Measure().border.patches, 0);
  EXPECT_EQ(one.Measure().borderMeasured, 0.0);
  EXPECT_EQ(Scene(
                {1, 1, 1}, [](int, int, int) { return data; }, value)
                .Measure()
                .data,
            1);
}

TEST(EmbedQuality, ASingleSlice)
{
  const Scene scene({48, 48, 1}, Half, [](int i, int, int) { return i < 24 ? 100.0 : 90.0; });
  const EmbedQualityReport report = scene.Measure();
  EXPECT_DOUBLE_EQ(report.border.median, 10.0);
  EXPECT_GE(report.border.patches, 8);
  EXPECT_GT(report.reference.patches, 0);
}

TEST(EmbedQuality, NumbersThatAreNotFiniteDoNotCount)
{
  const Scene scene(cube, Half, [](int i, int j, int) { return j % 4 == 0 ? NAN : i < 24 ? 100.0 : 90.0; });
  EXPECT_DOUBLE_EQ(scene.Measure().border.median, 10.0);
}

TEST(EmbedQuality, LiesAreCounted)
{
  const Scene original(cube, Ball, [](int i, int j, int k) { return 50.0 + Noise(i, j, k); });
  Scene embedded = original;
  EmbedQualityReport report = embedded.Against(original, 0.0);
  EXPECT_EQ(report.altered, 0);
  EXPECT_EQ(report.pretended, 0);
  EXPECT_EQ(report.lost, 0);

  embedded.values.View()(24, 24, 24) = std::nextafter(embedded.values.View()(24, 24, 24), 1e9f); // the last bit
  embedded.labels.View()(1, 1, 1) = data;                                                        // nothing was seen there
  embedded.labels.View()(2, 1, 1) = blend;
  embedded.labels.View()(24, 24, 23) = blend; // deep inside
  embedded.labels.View()(8, 24, 24) = blend;  // two voxels below the border
  report = embedded.Against(original, 2.0);
  EXPECT_EQ(report.altered, 1);
  EXPECT_EQ(report.pretended, 2);
  EXPECT_EQ(report.lost, 1);
  EXPECT_EQ(embedded.Against(original, 0.5).lost, 2);
}

TEST(EmbedQuality, TheGridMayBeLarger)
{
  // The original is a piece, from voxel (10, 4, 6) on, of the embedded volume.
  Scene original(
      {20, 20, 20}, [](int, int, int) { return data; }, [](int i, int j, int k) { return Noise(i, j, k); });
  Scene embedded(
      cube, [](int i, int j, int k) { return i >= 10 && i < 30 && j >= 4 && j < 24 && k >= 6 && k < 26 ? data : invented; },
      [](int i, int j, int k) { return Noise(i - 10, j - 4, k - 6); });
  embedded.grid = embedded.grid.Moved(Pose(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())));
  original.grid.direction = embedded.grid.direction;
  original.grid.origin = embedded.grid.IndexToWorld() * Eigen::Vector3d(10, 4, 6);
  EmbedQualityReport report = embedded.Against(original, 3.0);
  EXPECT_EQ(report.altered, 0);
  EXPECT_EQ(report.pretended, 0);
  EXPECT_EQ(report.lost, 0);
  // One that is shifted by a voxel, and one by half a voxel.
  original.grid.origin = embedded.grid.IndexToWorld() * Eigen::Vector3d(11, 4, 6);
  report = embedded.Against(original, 3.0);
  EXPECT_GT(report.altered, 7000);
  EXPECT_EQ(report.pretended, 400);
  original.grid.origin = embedded.grid.IndexToWorld() * Eigen::Vector3d(10.5, 4, 6);
  EXPECT_THROW(embedded.Against(original, 3.0), Error);
  // What lies beyond the embedded grid is lost.
  original.grid.origin = embedded.grid.IndexToWorld() * Eigen::Vector3d(40, 4, 6);
  EXPECT_GT(embedded.Against(original, 3.0).lost, 1000);
}

TEST(EmbedQuality, ThreadsDoNotMatterTheSeedDoes)
{
  const Scene scene(cube, Ball, [](int i, int j, int k) { return 50.0 + i + 10.0 * Noise(i, j, k); });
  EmbedQualityParameters other;
  other.seed = 2;
  const EmbedQualityReport many = scene.Measure(), reseeded = scene.Measure(other);
  const ThreadLimit limit(1);
  const EmbedQualityReport one = scene.Measure();
  EXPECT_EQ(many.border.mean, one.border.mean);
  EXPECT_EQ(many.reference.percentile95, one.reference.percentile95);
  EXPECT_EQ(many.reference.deviationRatio, one.reference.deviationRatio);
  EXPECT_NE(many.reference.mean, reseeded.reference.mean);
  EXPECT_EQ(many.border.mean, reseeded.border.mean);
}

TEST(EmbedQuality, BadInputIsRefused)
{
  const Scene scene({9, 9, 9}, Ball, [](int, int, int) { return 1.0; });
  const auto refuses = [&](auto change) {
    EmbedQualityParameters parameters;
    change(parameters);
    EXPECT_THROW(scene.Measure(parameters), Error);
  };
  refuses([](EmbedQualityParameters& p) { p.shellMm = 0.0; });
  refuses([](EmbedQualityParameters& p) { p.shellMm = NAN; });
  refuses([](EmbedQualityParameters& p) { p.leastJump = -1.0; });
  refuses([](EmbedQualityParameters& p) { p.mostDeviation = 1.1; });
  refuses([](EmbedQualityParameters& p) { p.featherMm = -1.0; });
  refuses([](EmbedQualityParameters& p) { p.randomSurfaces = -1; });
  EXPECT_THROW(MeasureEmbedding<float>(scene.values.View(), {}, scene.grid), Error);
  const Progress stop([](double) { return false; });
  EXPECT_THROW(MeasureEmbedding<float>(scene.values.View(), scene.labels.View(), scene.grid, nullptr, nullptr, {}, stop), Error);
  // Shells thinner than a voxel or wider than the grid are no error: there is nothing to measure.
  EmbedQualityParameters odd;
  odd.shellMm = 1e-6;
  EXPECT_EQ(scene.Measure(odd).border.patches, 0);
  odd.shellMm = 1e200;
  EXPECT_EQ(scene.Measure(odd).border.patches, 0);
}

} // namespace echorama
