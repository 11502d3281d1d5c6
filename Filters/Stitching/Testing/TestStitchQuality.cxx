// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/StitchQuality.h"
#include <cmath>
#include <deque>
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

using Value = std::function<float(int, int, int)>;

// Boxes of a grid of 1 mm, with values by place, and what was made of them.
struct Scene {
  ImageGeometry grid;
  std::deque<Volume<float>> values;
  std::vector<StitchInput> inputs;

  explicit Scene(std::array<int, 3> dimensions) { grid.dimensions = dimensions; }

  void Add(std::array<int, 3> first, std::array<int, 3> size, const Value& value)
  {
    ImageGeometry geometry;
    geometry.dimensions = size;
    geometry.origin = Eigen::Vector3d(first[0], first[1], first[2]);
    values.emplace_back(size);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i)
          values.back().View()(i, j, k) = value(first[0] + i, first[1] + j, first[2] + k);
    const Volume<float>& stored = values.back();
    inputs.push_back({PosedVolume<float>{stored.View(), {}, geometry}, "volume " + std::to_string(inputs.size() + 1)});
  }

  StitchQualityReport Measure(const Value& result, int stride = 1, const AnyPosedVolume* reference = nullptr) const
  {
    const Volume<float> stitched = Made(result);
    return MeasureStitch<float>(inputs, grid, stitched.View(), {}, reference, {stride});
  }

  Volume<float> Made(const Value& result) const
  {
    Volume<float> stitched(grid.dimensions);
    for (int k = 0; k < grid.dimensions[2]; ++k)
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i)
          stitched.View()(i, j, k) = result(i, j, k);
    return stitched;
  }
};

Value Constant(float value)
{
  return [value](int, int, int) { return value; };
}

// White noise of standard deviation 10 about a level, another for each seed.
Value Speckle(std::uint64_t seed, float level = 100.0f, float deviation = 10.0f)
{
  return [=](int i, int j, int k) {
    Random random(seed, static_cast<std::uint64_t>((k * 1000 + j) * 1000 + i));
    return level + deviation * static_cast<float>(random.Normal());
  };
}

// Two boxes that share x in [20, 40) of [0, 60).
Scene Pair(const Value& a, const Value& b, int slices = 24)
{
  Scene scene({60, 32, slices});
  scene.Add({0, 0, 0}, {40, 32, slices}, a);
  scene.Add({20, 0, 0}, {40, 32, slices}, b);
  return scene;
}

Value Chosen(const Value& a, const Value& b, int cut)
{
  return [=](int i, int j, int k) { return i < cut ? a(i, j, k) : b(i, j, k); };
}

Value Weighed(const Value& a, const Value& b, const std::function<double(int)>& weight)
{
  return [=](int i, int j, int k) {
    const double w = i < 20 ? 1.0 : i >= 40 ? 0.0 : weight(i);
    return static_cast<float>(w * a(i, j, k) + (1.0 - w) * b(i, j, k));
  };
}

Value Mean(const Value& a, const Value& b)
{
  return Weighed(a, b, [](int) { return 0.5; });
}

Value Ramp(const Value& a, const Value& b)
{
  return Weighed(a, b, [](int i) { return (39.5 - i) / 20.0; });
}

} // namespace

TEST(StitchQuality, AStepAtTheBorderIsASeam)
{
  for (const int slices : {24, 1}) {
    const Value dark = Constant(100.0f), bright = Constant(120.0f);
    const Scene scene = Pair(dark, bright, slices);
    const StitchQualityReport step = scene.Measure(Mean(dark, bright));
    // 10 grey over a thousandth of the level.
    EXPECT_GT(step.seamMean, 50.0);
    EXPECT_NEAR(step.seamGradient, 1.0, 1e-6);
    EXPECT_GT(step.borders.faces, 0);
    EXPECT_TRUE(std::isnan(step.textureKept)); // there is none
    // The ramp is no step: it changes over a window by what windows in it change.
    const StitchQualityReport ramp = scene.Measure(Ramp(dark, bright));
    EXPECT_LT(ramp.seamMean, 0.6 * step.seamMean);
    // Nothing to see.
    const StitchQualityReport alike = Pair(dark, dark, slices).Measure(dark);
    EXPECT_DOUBLE_EQ(alike.seamMean, 1.0);
    EXPECT_DOUBLE_EQ(alike.seamGradient, 1.0);
  }
}

TEST(StitchQuality, AHardChangeInsideTheOverlapIsASeam)
{
  for (const int slices : {24, 1}) {
    const Value a = Speckle(1, 100.0f, 5.0f), b = Speckle(2, 120.0f, 5.0f);
    const Scene scene = Pair(a, b, slices);
    const StitchQualityReport cut = scene.Measure(Chosen(a, b, 31));
    EXPECT_GT(cut.cuts.faces, 10);
    EXPECT_GT(cut.cuts.mean, 8.0);
    EXPECT_EQ(cut.seamMean, std::max(cut.cuts.mean, cut.borders.mean));
    EXPECT_NEAR(cut.borders.mean, 1.0, 0.05);
    // Also where nothing but the level tells which volume is shown.
    const Value dark = Constant(100.0f), bright = Constant(120.0f);
    EXPECT_GT(Pair(dark, bright, slices).Measure(Chosen(dark, bright, 31)).cuts.mean, 50.0);
  }
  // One level, one texture: the cut is there, and cannot be seen.
  const Value a = Speckle(1), b = Speckle(2);
  const StitchQualityReport hidden = Pair(a, b).Measure(Chosen(a, b, 31));
  EXPECT_GT(hidden.cuts.faces, 500);
  EXPECT_NEAR(hidden.seamMean, 1.0, 0.1);
  EXPECT_NEAR(hidden.seamGradient, 1.0, 0.1);
  // One level, two textures: only the gradient sees it.
  const Value coarse = Speckle(3, 100.0f, 20.0f);
  const StitchQualityReport rough = Pair(a, coarse).Measure(Chosen(a, coarse, 31));
  EXPECT_NEAR(rough.cuts.mean, 1.0, 0.15);
  EXPECT_GT(rough.cuts.gradient, 3.0);
}

TEST(StitchQuality, SlopesAreNoSeams)
{
  // Anatomy that varies: a perfect stitch is the anatomy, whether there is texture on it or not.
  for (const float deviation : {0.0f, 6.0f}) {
    const auto anatomy = [=](std::uint64_t seed) {
      const Value noise = Speckle(seed, 0.0f, deviation);
      return [=](int i, int j, int k) {
        return 100.0f + 30.0f * std::sin(0.2f * static_cast<float>(i)) + 2.0f * static_cast<float>(j) + noise(i, j, k);
      };
    };
    const Value both = anatomy(4);
    const StitchQualityReport perfect = Pair(both, both).Measure(both);
    EXPECT_NEAR(perfect.seamMean, 1.0, 1e-6);
    EXPECT_NEAR(perfect.seamGradient, 1.0, 1e-6);
    EXPECT_NEAR(perfect.textureKept, 1.0, 1e-6);
    EXPECT_NEAR(perfect.snr, perfect.snrSources, 1e-6);
  }
}

TEST(StitchQuality, AMeanOfTwoKeepsSeventyOnePercentOfTheirSpeckle)
{
  const Value a = Speckle(1), b = Speckle(2);
  for (const int slices : {24, 1}) {
    const Scene scene = Pair(a, b, slices);
    const StitchQualityReport mean = scene.Measure(Mean(a, b));
    EXPECT_NEAR(mean.textureKept, std::sqrt(0.5), slices > 1 ? 0.01 : 0.03);
    EXPECT_NEAR(mean.snr / mean.snrSources, std::sqrt(2.0), slices > 1 ? 0.02 : 0.06);
    EXPECT_GT(mean.borders.gradient, 1.3); // the texture changes there
    EXPECT_EQ(mean.overlapVoxels, 20 * 32 * slices);
    EXPECT_EQ(mean.overlapWindows, 16 * 28 * std::max(1, slices - 4));
    // The means of three: more is lost.
    const StitchQualityReport chosen = scene.Measure(Chosen(a, b, 30));
    EXPECT_NEAR(chosen.textureKept, 1.0, slices > 1 ? 0.01 : 0.03);
  }
  Scene three = Pair(a, b);
  const Value c = Speckle(3);
  three.Add({10, 0, 0}, {40, 32, 24}, c);
  const StitchQualityReport mean =
      three.Measure([&](int i, int j, int k) { return (a(i, j, k) + b(i, j, k) + c(i, j, k)) / 3.0f; });
  EXPECT_NEAR(mean.textureKept, std::sqrt(1.0 / 3.0), 0.02);
}

TEST(StitchQuality, NoiseThatIsAddedIsNoTextureKept)
{
  // More texture than there was is told as such: above 1.
  const Value a = Speckle(1), b = Speckle(2), extra = Speckle(5, 0.0f);
  const StitchQualityReport report =
      Pair(a, b).Measure([&](int i, int j, int k) { return Chosen(a, b, 30)(i, j, k) + extra(i, j, k); });
  EXPECT_NEAR(report.textureKept, std::sqrt(2.0), 0.03);
}

TEST(StitchQuality, ReliabilityTellsWhichTextureCounts)
{
  const Value a = Speckle(1), flat = Speckle(2, 20.0f, 1.0f);
  Scene scene = Pair(a, flat);
  const Value shown = Chosen(a, flat, 40);
  EXPECT_GT(scene.Measure(shown).textureKept, 1.5); // over the mean of 10 and 1
  const Volume<float> trust({40, 32, 24}, 0.0f);
  scene.inputs[1].reliability = trust.View();
  EXPECT_NEAR(scene.Measure(shown).textureKept, 1.0, 0.02);
}

TEST(StitchQuality, WindowsLieWhereTheResultIsValid)
{
  const Value a = Speckle(1), b = Speckle(2);
  const Scene scene = Pair(a, b);
  Volume<float> stitched = scene.Made(Mean(a, b));
  const StitchQualityReport whole = MeasureStitch<float>(scene.inputs, scene.grid, stitched.View(), {}, nullptr, {1});
  // Half of it is not valid, and full of rubbish that must not count.
  Volume<unsigned char> valid(scene.grid.dimensions, 1);
  for (int k = 0; k < 24; ++k)
    for (int j = 16; j < 32; ++j)
      for (int i = 0; i < 60; ++i) {
        valid.View()(i, j, k) = 0;
        stitched.View()(i, j, k) = (i + j) % 2 ? 1e6f : std::numeric_limits<float>::quiet_NaN();
      }
  const StitchQualityReport half = MeasureStitch<float>(scene.inputs, scene.grid, stitched.View(), valid.View(), nullptr, {1});
  EXPECT_EQ(half.overlapVoxels, whole.overlapVoxels / 2);
  EXPECT_EQ(half.overlapWindows, 16 * 12 * 20);
  EXPECT_NEAR(half.textureKept, whole.textureKept, 0.01);
  EXPECT_NEAR(half.seamGradient, whole.seamGradient, 0.2);
}

TEST(StitchQuality, ThinOverlapsAndNone)
{
  // One voxel thin: no window fits into it, and no volume reaches across; what is within the volumes is the measure.
  const Value a = Speckle(1), b = Speckle(2, 140.0f);
  Scene thin({60, 32, 12});
  thin.Add({0, 0, 0}, {31, 32, 12}, a);
  thin.Add({30, 0, 0}, {30, 32, 12}, b);
  const StitchQualityReport report = thin.Measure(Chosen(a, b, 30));
  EXPECT_EQ(report.overlapVoxels, 32 * 12);
  EXPECT_EQ(report.overlapWindows, 0);
  EXPECT_TRUE(std::isnan(report.textureKept));
  EXPECT_GT(report.seamMean, 10.0);
  // None, side by side.
  Scene none({60, 32, 12});
  none.Add({0, 0, 0}, {30, 32, 12}, a);
  none.Add({30, 0, 0}, {30, 32, 12}, b);
  const StitchQualityReport beside = none.Measure(Chosen(a, b, 30));
  EXPECT_EQ(beside.overlapVoxels, 0);
  EXPECT_GT(beside.seamMean, 10.0);
  EXPECT_EQ(beside.cuts.faces, 0);
  EXPECT_TRUE(std::isnan(beside.cuts.mean));
  // None, apart; and a single volume.
  Scene apart({60, 32, 12});
  apart.Add({0, 0, 0}, {20, 32, 12}, a);
  EXPECT_TRUE(std::isnan(apart.Measure(a).seamMean));
  apart.Add({40, 0, 0}, {20, 32, 12}, b);
  EXPECT_TRUE(std::isnan(apart.Measure(Chosen(a, b, 30)).seamMean));
}

TEST(StitchQuality, GridsOfAFewVoxels)
{
  for (const std::array<int, 3>& n :
       {std::array<int, 3>{1, 32, 32}, {32, 1, 32}, {32, 32, 2}, {3, 32, 32}, {1, 1, 64}, {1, 1, 1}}) {
    Scene scene(n);
    const Value a = Speckle(1), b = Speckle(2);
    scene.Add({0, 0, 0}, {n[0], n[1], std::max(1, n[2] * 3 / 4)}, a);
    const int first = n[2] / 4;
    scene.Add({0, 0, first}, {n[0], n[1], n[2] - first}, b);
    const StitchQualityReport report = scene.Measure([&](int i, int j, int k) { return k < n[2] / 2 ? a(i, j, k) : b(i, j, k); });
    EXPECT_FALSE(report.seamMean < 0.0);
    if (n[0] * n[1] * n[2] > 1000) {
      EXPECT_NEAR(report.textureKept, 1.0, 0.1) << n[0] << " " << n[1] << " " << n[2];
    }
  }
}

TEST(StitchQuality, MeasuresAgainstAReference)
{
  const Value a = Constant(100.0f), b = Constant(110.0f);
  const Scene scene = Pair(a, b);
  Scene truth({60, 32, 24});
  truth.Add({0, 0, 0}, {50, 32, 24}, Constant(102.0f)); // what it does not know does not count
  const StitchQualityReport report = scene.Measure(Mean(a, b), 3, &truth.inputs[0].volume);
  EXPECT_NEAR(report.errorOverlap, 3.0, 1e-6);
  EXPECT_NEAR(report.errorOutside, (20 * 2.0 + 10 * 8.0) / 30.0, 1e-6);
  EXPECT_TRUE(std::isnan(scene.Measure(Mean(a, b)).errorOverlap));
}

TEST(StitchQuality, AStrideOfThreeTellsTheSame)
{
  const Value a = Speckle(1, 100.0f), b = Speckle(2, 108.0f);
  const Scene scene = Pair(a, b, 48);
  const StitchQualityReport all = scene.Measure(Mean(a, b)), some = scene.Measure(Mean(a, b), 3);
  EXPECT_NEAR(some.seamMean, all.seamMean, 0.15 * all.seamMean);
  EXPECT_NEAR(some.seamGradient, all.seamGradient, 0.1 * all.seamGradient);
  EXPECT_NEAR(some.textureKept, all.textureKept, 0.02);
  EXPECT_NEAR(some.snr, all.snr, 0.3);
  EXPECT_NEAR(static_cast<double>(some.borders.faces), static_cast<double>(all.borders.faces) / 9.0,
              0.1 * static_cast<double>(all.borders.faces));
  EXPECT_EQ(some.overlapVoxels, all.overlapVoxels);
}

TEST(StitchQuality, GainsAloneChangeNoRatio)
{
  // All grey levels times ten: the same ratios.
  const Value a = Speckle(1), b = Speckle(2, 110.0f);
  const auto tenfold = [](const Value& value) { return [=](int i, int j, int k) { return 10.0f * value(i, j, k); }; };
  const StitchQualityReport once = Pair(a, b).Measure(Ramp(a, b)),
                            ten = Pair(tenfold(a), tenfold(b)).Measure(tenfold(Ramp(a, b)));
  EXPECT_NEAR(ten.seamMean, once.seamMean, 1e-3);
  EXPECT_NEAR(ten.seamGradient, once.seamGradient, 1e-3);
  EXPECT_NEAR(ten.textureKept, once.textureKept, 1e-3);
}

TEST(StitchQuality, BadInput)
{
  const Value a = Speckle(1), b = Speckle(2);
  const Scene scene = Pair(a, b);
  const Volume<float> stitched = scene.Made(a), small({5, 5, 5});
  EXPECT_THROW(MeasureStitch<float>({}, scene.grid, stitched.View(), {}), Error);
  EXPECT_THROW(MeasureStitch<float>(scene.inputs, scene.grid, small.View(), {}), Error);
  EXPECT_THROW(MeasureStitch<float>(scene.inputs, scene.grid, stitched.View(), {}, nullptr, {0}), Error);
  EXPECT_THROW(
      MeasureStitch<float>(scene.inputs, scene.grid, stitched.View(), {}, nullptr, {1}, Progress([](double) { return false; })),
      Error);
  std::vector<StitchInput> bad = scene.inputs;
  std::get<PosedVolume<float>>(bad[1].volume).geometry.dimensions[0] = 7;
  EXPECT_THROW(MeasureStitch<float>(bad, scene.grid, stitched.View(), {}), Error);
}

TEST(StitchQuality, DoesNotDependOnTheNumberOfThreads)
{
  const Value a = Speckle(1), b = Speckle(2);
  const Scene scene = Pair(a, b, 40);
  const StitchQualityReport many = scene.Measure(Ramp(a, b));
  const ThreadLimit limit(1);
  const StitchQualityReport one = scene.Measure(Ramp(a, b));
  EXPECT_EQ(one.seamMean, many.seamMean);
  EXPECT_EQ(one.seamGradient, many.seamGradient);
  EXPECT_EQ(one.textureKept, many.textureKept);
}
