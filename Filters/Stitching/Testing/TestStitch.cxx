// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Filters/Stitching/StitchMemory.h"
#include "StitchScene.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

using namespace echorama;
using namespace echorama::testing_scene;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

// The largest step of any weight between neighbouring voxels of the result.
template <class T>
double LargestStep(const Result<T>& result)
{
  const auto valid = result.valid.View();
  const auto& n = valid.Dimensions();
  double step = 0.0;
  for (const auto& volume : result.weights)
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          for (const std::array<int, 3> next : {std::array<int, 3>{i + 1, j, k}, {i, j + 1, k}, {i, j, k + 1}})
            if (next[0] < n[0] && next[1] < n[1] && next[2] < n[2] && valid(i, j, k) && valid(next[0], next[1], next[2]))
              step = std::max(step, std::abs(double{volume.View()(i, j, k)} - volume.View()(next[0], next[1], next[2])));
  return step;
}

// The equations as they are written, by brute force over a grid of a few voxels; masks are whole-grid.
std::vector<double> ReferenceWeights(const std::vector<std::vector<char>>& masks, const ImageGeometry& grid, double b)
{
  const int n = static_cast<int>(masks.size()), voxels = static_cast<int>(masks[0].size());
  const auto place = [&grid](int at) {
    const auto& d = grid.dimensions;
    return Eigen::Vector3d(at % d[0], at / d[0] % d[1], at / d[0] / d[1]).cwiseProduct(grid.spacing).eval();
  };
  const auto distance = [&](const std::vector<char>& region, int from) {
    double nearest = infinite;
    for (int at = 0; at < voxels; ++at)
      if (region[at])
        nearest = std::min(nearest, (place(at) - place(from)).norm());
    return nearest;
  };
  std::vector<std::vector<char>> pure(n, std::vector<char>(voxels)), empty = pure;
  for (int i = 0; i < n; ++i)
    for (int at = 0; at < voxels; ++at) {
      bool others = false;
      for (int j = 0; j < n; ++j)
        others = others || (j != i && masks[j][at]);
      pure[i][at] = masks[i][at] && !others;
      empty[i][at] = !masks[i][at] && others;
    }
  // Depths: how far the region of the others is.
  std::vector<std::vector<double>> depths(n, std::vector<double>(voxels));
  for (int i = 0; i < n; ++i)
    for (int at = 0; at < voxels; ++at)
      depths[i][at] = masks[i][at] ? distance(empty[i], at) : 0.0;
  for (int i = 0; i < n; ++i) {
    if (std::accumulate(pure[i].begin(), pure[i].end(), 0) > 0)
      continue;
    bool core = false;
    for (int at = 0; at < voxels; ++at) {
      double deepest = 0.0;
      for (int j = 0; j < n; ++j)
        deepest = std::max(deepest, depths[j][at]);
      pure[i][at] = masks[i][at] && depths[i][at] >= deepest * (1.0 - 1e-7);
      core = core || pure[i][at];
    }
    if (!core) {
      const double most = *std::max_element(depths[i].begin(), depths[i].end());
      for (int at = 0; at < voxels; ++at)
        pure[i][at] = masks[i][at] && depths[i][at] >= most * (1.0 - 1e-7);
    }
  }
  std::vector<double> weights(static_cast<std::size_t>(n) * voxels);
  for (int at = 0; at < voxels; ++at) {
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      if (!masks[i][at])
        continue;
      const double p = distance(pure[i], at), e = distance(empty[i], at);
      const bool alone = std::none_of(masks.begin(), masks.end(), [&](const auto& m) { return &m != &masks[i] && m[at]; });
      const double s = alone ? 1.0 : std::isinf(e) ? 1.0 : e / (p + e);
      sum += weights[static_cast<std::size_t>(i) * voxels + at] = std::pow(s, b);
    }
    for (int i = 0; i < n && sum > 0.0; ++i)
      weights[static_cast<std::size_t>(i) * voxels + at] /= sum;
  }
  return weights;
}

} // namespace

TEST(Stitch, TwoSlabsGiveALinearRamp)
{
  // [0, 30) and [20, 50): in the overlap [20, 30) p counts from 19 and e to 30.
  for (const int slices : {1, 5}) {
    Scene<float> scene;
    scene.AddBox({0, 0, 0}, {30, 40, slices}, 100.0f);
    scene.AddBox({20, 0, 0}, {30, 40, slices}, 200.0f);
    for (const double b : {1.0, 1.5, 4.0}) {
      const Result<float> result = Stitched(scene, With(StitchMethod::Distance, b));
      ExpectSoundWeights(result);
      for (int i = 0; i < 50; ++i) {
        const double s0 = i < 20 ? 1.0 : i >= 30 ? 0.0 : (30.0 - i) / 11.0, s1 = 1.0 - s0;
        const double w = std::pow(s0, b) / (std::pow(s0, b) + std::pow(s1, b));
        EXPECT_NEAR(result.weights[0].View()(i, 20, slices / 2), w, 1e-5);
        EXPECT_NEAR(result.intensity.View()(i, 20, slices / 2), 200.0 - 100.0 * w, 1e-3);
      }
    }
  }
}

TEST(Stitch, WeightsAreThoseOfTheEquations)
{
  Random random(21);
  for (int trial = 0; trial < 30; ++trial) {
    const std::array<int, 3> n = trial % 3 ? std::array<int, 3>{12, 10, 1} : std::array<int, 3>{7, 6, 6};
    const int count = 2 + static_cast<int>(random.Below(4));
    Scene<float> scene;
    ImageGeometry geometry;
    geometry.dimensions = n;
    geometry.spacing = trial % 2 ? Eigen::Vector3d(1.0, 1.0, 1.0) : Eigen::Vector3d(0.5, 0.75, 1.25);
    std::vector<std::vector<char>> masks;
    for (int v = 0; v < count; ++v) {
      Volume<unsigned char> mask(n);
      Volume<float> values(n);
      const Eigen::Vector3d centre(random.Uniform(2, n[0] - 2), random.Uniform(2, n[1] - 2), 0.5 * n[2]);
      const double radius = random.Uniform(2.0, 7.0);
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            mask.View()(i, j, k) = (Eigen::Vector3d(i, j, k) - centre).norm() < radius;
            values.View()(i, j, k) = static_cast<float>(random.Uniform(0.0, 255.0));
          }
      masks.emplace_back(mask.View().begin(), mask.View().end());
      scene.Add(std::move(values), std::move(mask), geometry);
    }
    const double b = trial % 4 == 0 ? 1.0 : trial % 4 == 1 ? 1.5 : trial % 4 == 2 ? 2.0 : 7.3;
    StitchParameters parameters = With(StitchMethod::Distance, b);
    parameters.allowDisjoint = true;
    const Result<float> result = Stitched(scene, parameters);
    ASSERT_EQ(result.grid.dimensions, n);
    ExpectSoundWeights(result);
    const std::vector<double> truth = ReferenceWeights(masks, result.grid, b);
    const std::ptrdiff_t voxels = result.valid.View().Size();
    for (std::ptrdiff_t at = 0; at < voxels; ++at) {
      double blended = 0.0;
      for (int v = 0; v < count; ++v) {
        ASSERT_NEAR(result.weights[v].View()[at], truth[v * voxels + at], 2e-5)
            << "trial " << trial << " volume " << v << " voxel " << at;
        blended += truth[v * voxels + at] * scene.values[v].View()[at];
      }
      ASSERT_NEAR(result.intensity.View()[at], blended, 0.01);
    }
  }
}

TEST(Stitch, ThreeShapesAgreeWithPureAndEmptyRegions)
{
  // A square, a triangle and a circle: alone each has all the weight, beside itself none, and the blend is continuous.
  const std::array<int, 3> n{120, 100, 1};
  Scene<unsigned char> scene;
  for (int shape = 0; shape < 3; ++shape) {
    Volume<unsigned char> mask(n);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        mask.View()(i, j, 0) = shape == 0   ? i >= 5 && i < 65 && j >= 5 && j < 65
                               : shape == 1 ? j >= 30 && j < 95 && std::abs(i - 75) < (j - 25) * 0.6
                                            : std::hypot(i - 78, j - 35) < 32;
    ImageGeometry geometry;
    geometry.dimensions = n;
    scene.Add(Volume<unsigned char>(n, static_cast<unsigned char>(60 + 70 * shape)), std::move(mask), geometry);
  }
  const Result<unsigned char> result = Stitched(scene);
  ExpectSoundWeights(result);
  for (int v = 0; v < 3; ++v)
    for (std::ptrdiff_t at = 0; at < result.valid.View().Size(); ++at)
      if (result.coverage.View()[at] <= 1 || !scene.masks[v].View()[at]) {
        ASSERT_EQ(result.weights[v].View()[at], scene.masks[v].View()[at] ? 1.0f : 0.0f);
      }
}

TEST(Stitch, ConstantsStayConstant)
{
  Random random(22);
  for (const StitchMethod method :
       {StitchMethod::Distance, StitchMethod::Feather, StitchMethod::Average, StitchMethod::Maximum}) {
    Scene<short> scene;
    Scene<float> floats;
    for (int v = 0; v < 4; ++v) {
      ImageGeometry geometry;
      geometry.dimensions = {20, 18, 16};
      geometry.spacing = {0.7, 0.8, 0.9};
      geometry.direction = ExpRotation(0.3 * random.Direction());
      geometry.origin = 4.0 * random.Direction();
      Volume<unsigned char> mask(geometry.dimensions);
      for (unsigned char& m : mask.View())
        m = random.Below(20) != 0;
      scene.Add(Volume<short>(geometry.dimensions, -313), mask, geometry);
      floats.Add(Volume<float>(geometry.dimensions, 0.1f), mask, geometry);
    }
    const Result<short> result = Stitched(scene, With(method));
    const Result<float> floatResult = Stitched(floats, With(method));
    for (std::ptrdiff_t at = 0; at < result.valid.View().Size(); ++at) {
      ASSERT_EQ(result.intensity.View()[at], result.valid.View()[at] ? -313 : 0);
      ASSERT_EQ(floatResult.intensity.View()[at], floatResult.valid.View()[at] ? 0.1f : 0.0f);
    }
    ExpectSoundWeights(result);
  }
}

TEST(Stitch, OtherMethods)
{
  Scene<unsigned char> scene;
  scene.AddBox({0, 0, 0}, {30, 41, 1}, 100);
  scene.AddBox({20, 0, 0}, {30, 41, 1}, 201);
  const Result<unsigned char> average = Stitched(scene, With(StitchMethod::Average)),
                              maximum = Stitched(scene, With(StitchMethod::Maximum)),
                              feather = Stitched(scene, With(StitchMethod::Feather));
  for (const auto* result : {&average, &maximum, &feather})
    ExpectSoundWeights(*result);
  for (int i = 0; i < 50; ++i) {
    const bool a = i < 30, b = i >= 20;
    EXPECT_EQ(average.intensity.View()(i, 20, 0), a && b ? 151 : a ? 100 : 201); // 150.5 is rounded up
    EXPECT_EQ(maximum.intensity.View()(i, 20, 0), b ? 201 : 100);
    EXPECT_EQ(maximum.weights[1].View()(i, 20, 0), b ? 1.0f : 0.0f);
    if (a && b) {
      const double da = 30 - i, db = i - 19;
      EXPECT_NEAR(feather.weights[0].View()(i, 20, 0), da / (da + db), 1e-5);
    }
  }
}

TEST(Stitch, SharpnessFromAverageToHardEdge)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {30, 20, 4}, 100.0f);
  scene.AddBox({11, 0, 0}, {30, 20, 4}, 200.0f);
  const Result<float> flat = Stitched(scene, With(StitchMethod::Distance, 0.0)),
                      hard = Stitched(scene, With(StitchMethod::Distance, 1000.0));
  ExpectSoundWeights(flat);
  ExpectSoundWeights(hard);
  for (int i = 11; i < 30; ++i) {
    EXPECT_EQ(flat.weights[0].View()(i, 5, 1), 0.5f);
    EXPECT_EQ(hard.weights[0].View()(i, 5, 1), i < 20 ? 1.0f : i == 20 ? 0.5f : 0.0f);
  }
}

TEST(Stitch, ChainsWithoutPureRegionsShowNoSeam)
{
  // Volumes 50 long, each 20 further: all but the ends are covered by their neighbours. Each ramp is at least 15 voxels
  // long, so with b = 1.5 no weight may step by more than 2 b / 15 = 0.2; a seam is a step of a third or a half.
  for (const int count : {2, 3, 4, 7, 20})
    for (const int slices : {1, 9}) {
      if (slices > 1 && count > 4)
        continue;
      Scene<float> scene;
      for (int v = 0; v < count; ++v)
        scene.AddBox({20 * v, 0, 0}, {50, 30, slices}, v % 2 ? 140.0f : 100.0f); // gains that differ
      const Result<float> result = Stitched(scene);
      ExpectSoundWeights(result);
      EXPECT_LT(LargestStep(result), 0.2) << count << " volumes, " << slices << " slices";
      EXPECT_GT(LargestStep(Stitched(scene, With(StitchMethod::Average))), 0.3);
      // Every volume has the most weight at its own middle.
      for (int v = 0; v < count; ++v)
        EXPECT_GT(result.weights[v].View()(20 * v + 25, 15, slices / 2), 0.4);
      double step = 0.0;
      for (int i = 0; i + 1 < result.grid.dimensions[0]; ++i)
        step = std::max(step, std::abs(double{result.intensity.View()(i + 1, 15, 0)} - result.intensity.View()(i, 15, 0)));
      EXPECT_LT(step, 0.2 * 40.0);
    }
}

TEST(Stitch, NestedVolumeFadesAtItsBorder)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {61, 61, 1}, 100.0f);
  scene.AddBox({20, 20, 0}, {21, 21, 1}, 200.0f);
  const Result<float> result = Stitched(scene);
  ExpectSoundWeights(result);
  EXPECT_NEAR(result.weights[1].View()(30, 30, 0), 0.5, 1e-6);
  EXPECT_LT(LargestStep(result), 0.1);
}

TEST(Stitch, IdenticalVolumesShareEvenly)
{
  for (const int count : {2, 3, 5}) {
    Scene<unsigned short> scene;
    for (int v = 0; v < count; ++v)
      scene.AddBox({0, 0, 0}, {12, 10, 8}, static_cast<unsigned short>(1000 * (v + 1)));
    const Result<unsigned short> result = Stitched(scene);
    for (std::ptrdiff_t at = 0; at < result.valid.View().Size(); ++at) {
      ASSERT_EQ(result.intensity.View()[at], 500 * (count + 1));
      ASSERT_EQ(result.coverage.View()[at], count);
      for (const auto& weights : result.weights)
        ASSERT_NEAR(weights.View()[at], 1.0 / count, 1e-6);
    }
  }
}

TEST(Stitch, IdenticalVolumesBesideAThirdShowNoSeam)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {60, 40, 1}, 100.0f);
  scene.AddBox({0, 0, 0}, {60, 40, 1}, 140.0f);
  scene.AddBox({30, 0, 0}, {60, 40, 1}, 200.0f);
  const Result<float> result = Stitched(scene);
  ExpectSoundWeights(result);
  EXPECT_LT(LargestStep(result), 0.2);
}

TEST(Stitch, ThinOverlapNeckAndTouchingRegions)
{
  // One voxel of overlap; and a mask that narrows to a neck of one voxel.
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {20, 10, 3}, 10.0f);
  scene.AddBox({19, 0, 0}, {20, 10, 3}, 20.0f);
  Result<float> result = Stitched(scene);
  ExpectSoundWeights(result);
  EXPECT_FLOAT_EQ(result.intensity.View()(19, 5, 1), 15.0f);
  EXPECT_FLOAT_EQ(result.intensity.View()(18, 5, 1), 10.0f);

  Scene<float> neck;
  ImageGeometry geometry;
  geometry.dimensions = {21, 21, 1};
  Volume<unsigned char> left(geometry.dimensions), right(geometry.dimensions);
  for (int j = 0; j < 21; ++j)
    for (int i = 0; i < 21; ++i) {
      left.View()(i, j, 0) = i < 8 || j == 10;
      right.View()(i, j, 0) = i > 12 || j == 10;
    }
  neck.Add(Volume<float>(geometry.dimensions, 10.0f), std::move(left), geometry);
  neck.Add(Volume<float>(geometry.dimensions, 20.0f), std::move(right), geometry);
  result = Stitched(neck);
  ExpectSoundWeights(result);
  EXPECT_FLOAT_EQ(result.intensity.View()(10, 10, 0), 15.0f);
}

TEST(Stitch, VoxelsThatAreNoNumbersAreNotReal)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {30, 10, 3}, 10.0f);
  scene.AddBox({20, 0, 0}, {30, 10, 3}, 20.0f);
  scene.values[0].View()(25, 5, 1) = std::numeric_limits<float>::quiet_NaN();
  scene.values[0].View()(5, 5, 1) = std::numeric_limits<float>::infinity();
  const Result<float> result = Stitched(scene);
  ExpectSoundWeights(result);
  EXPECT_EQ(result.intensity.View()(25, 5, 1), 20.0f);
  EXPECT_EQ(result.valid.View()(5, 5, 1), 0);
  for (const float value : result.intensity.View())
    ASSERT_TRUE(std::isfinite(value));
}

TEST(Stitch, TypesMayDiffer)
{
  Volume<unsigned char> bytes({30, 10, 3}, 7);
  Volume<double> doubles({30, 10, 3}, 1e6);
  ImageGeometry a, b;
  a.dimensions = b.dimensions = {30, 10, 3};
  b.origin[0] = 20.0;
  const std::vector<StitchInput> inputs{{PosedVolume<unsigned char>{bytes.View(), {}, a}, "a"},
                                        {PosedVolume<double>{doubles.View(), {}, b}, "b"}};
  const ImageGeometry grid = StitchGrid({a, b});
  Volume<unsigned short> result(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions), coverage(grid.dimensions);
  Stitch<unsigned short>({}, inputs, grid, {result.View(), valid.View(), coverage.View(), {}});
  EXPECT_EQ(result.View()(0, 0, 0), 7);
  EXPECT_EQ(result.View()(49, 0, 0), 65535); // clamped
}

TEST(Stitch, ThreadsDoNotMatter)
{
  Random random(23);
  Scene<unsigned char> scene;
  for (int v = 0; v < 4; ++v) {
    ImageGeometry geometry;
    geometry.dimensions = {24, 22, 20};
    geometry.direction = ExpRotation(0.4 * random.Direction());
    geometry.origin = 8.0 * random.Direction();
    Volume<unsigned char> values(geometry.dimensions);
    for (unsigned char& value : values.View())
      value = static_cast<unsigned char>(random.Below(256));
    scene.Add(std::move(values), {}, geometry);
  }
  for (const StitchMethod method :
       {StitchMethod::Distance, StitchMethod::Feather, StitchMethod::Average, StitchMethod::Maximum}) {
    const Result<unsigned char> many = Stitched(scene, With(method));
    const ThreadLimit limit(1);
    const Result<unsigned char> one = Stitched(scene, With(method));
    EXPECT_TRUE(std::equal(one.intensity.View().begin(), one.intensity.View().end(), many.intensity.View().begin()));
    for (int v = 0; v < 4; ++v)
      EXPECT_TRUE(std::equal(one.weights[v].View().begin(), one.weights[v].View().end(), many.weights[v].View().begin()));
  }
}

TEST(Stitch, ReliabilityMultipliesTheWeights)
{
  // Two volumes on one lattice, the second shadowed (0) in a part and NaN in another; random trust elsewhere.
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {30, 20, 5}, 100.0f);
  scene.AddBox({10, 0, 0}, {30, 20, 5}, 200.0f);
  const std::vector<std::pair<StitchMethod, double>> methods{
      {StitchMethod::Distance, 1.5}, {StitchMethod::Distance, 0.0}, {StitchMethod::Feather, 1.0}, {StitchMethod::Average, 1.0}};
  Volume<float> trusts[2] = {Volume<float>({30, 20, 5}), Volume<float>({30, 20, 5})};
  Random random(4);
  for (Volume<float>& trust : trusts)
    for (float& value : trust.View())
      value = static_cast<float>(random.Uniform());
  for (int j = 5; j < 10; ++j)
    for (int i = 0; i < 30; ++i) {
      trusts[1].View()(i, j, 2) = 0.0f;
      trusts[1].View()(i, j, 3) = std::numeric_limits<float>::quiet_NaN();
      trusts[1].View()(i, j, 4) = 7.0f; // counts as 1
    }
  for (const auto& [method, b] : methods) {
    scene.inputs[0].reliability = scene.inputs[1].reliability = {};
    const Result<float> plain = Stitched(scene, With(method, b));
    scene.inputs[0].reliability = trusts[0].View();
    scene.inputs[1].reliability = trusts[1].View();
    const Result<float> trusted = Stitched(scene, With(method, b));
    ExpectSoundWeights(trusted);
    for (int k = 0; k < 5; ++k)
      for (int j = 0; j < 20; ++j)
        for (int i = 0; i < 40; ++i) {
          const double w0 = plain.weights[0].View()(i, j, k), w1 = plain.weights[1].View()(i, j, k);
          const auto floored = [](double r) { return r > 0.01 ? std::min(r, 1.0) : 0.01; };
          const double r0 = i < 30 ? floored(trusts[0].View()(i, j, k)) : 0.0;
          const double r1 = i >= 10 ? floored(trusts[1].View()(i - 10, j, k)) : 0.0;
          const double expected = r0 * w0 / (r0 * w0 + r1 * w1);
          ASSERT_NEAR(trusted.weights[0].View()(i, j, k), expected, 1e-5) << i << " " << j << " " << k;
          ASSERT_NEAR(trusted.intensity.View()(i, j, k), 200.0 - 100.0 * expected, 1e-3);
        }
    // Without the views of the weights the same comes out.
    Volume<float> alone(trusted.intensity.Dimensions());
    Volume<unsigned char> valid(alone.Dimensions()), coverage(alone.Dimensions());
    Stitch<float>(With(method, b), scene.inputs, trusted.grid, {alone.View(), valid.View(), coverage.View(), {}});
    EXPECT_TRUE(std::equal(alone.View().begin(), alone.View().end(), trusted.intensity.View().begin()));
  }
  // Full trust changes nothing, to the last bit; a floor of 1 neither.
  scene.inputs[0].reliability = scene.inputs[1].reliability = {};
  const Result<float> plain = Stitched(scene);
  StitchParameters blind = With(StitchMethod::Distance);
  blind.reliabilityFloor = 1.0;
  const Volume<float> full({30, 20, 5}, 1.0f);
  for (const bool floor : {false, true}) {
    scene.inputs[0].reliability = floor ? trusts[0].View() : full.View();
    scene.inputs[1].reliability = floor ? trusts[1].View() : full.View();
    const Result<float> same = Stitched(scene, floor ? blind : With(StitchMethod::Distance));
    EXPECT_TRUE(std::equal(same.intensity.View().begin(), same.intensity.View().end(), plain.intensity.View().begin()));
  }
}

TEST(Stitch, RefusesWithTheReason)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {10, 10, 3}, 1.0f);
  EXPECT_NE(ErrorOf(scene).find("at least two volumes, got 1"), std::string::npos);
  scene.AddBox({5, 0, 0}, {10, 10, 3}, 1.0f);
  EXPECT_EQ(ErrorOf(scene), "no error");
  EXPECT_NE(ErrorOf(scene, With(StitchMethod::Distance, -0.1)).find("Sharpness"), std::string::npos);
  EXPECT_NE(ErrorOf(scene, With(StitchMethod::Distance, 1001.0)).find("Sharpness"), std::string::npos);
  EXPECT_NE(ErrorOf(scene, With(StitchMethod::Distance, std::nan(""))).find("Sharpness"), std::string::npos);

  StitchParameters careless;
  careless.reliabilityFloor = 0.0;
  EXPECT_NE(ErrorOf(scene, careless).find("ReliabilityFloor"), std::string::npos);
  const Volume<float> small({10, 10, 2}, 1.0f);
  scene.inputs[1].reliability = small.View();
  EXPECT_NE(ErrorOf(scene).find("volume 2: its reliability"), std::string::npos);
  scene.inputs[1].reliability = {};

  scene.AddBox({40, 0, 0}, {10, 10, 3}, 1.0f);
  EXPECT_NE(ErrorOf(scene).find("volume 3 overlaps no other volume"), std::string::npos);
  StitchParameters parameters;
  parameters.allowDisjoint = true;
  EXPECT_EQ(ErrorOf(scene, parameters), "no error");

  ImageGeometry geometry;
  geometry.dimensions = {10, 10, 3};
  Scene<float> withEmpty;
  withEmpty.AddBox({0, 0, 0}, {10, 10, 3}, 1.0f);
  withEmpty.Add(Volume<float>(geometry.dimensions), Volume<unsigned char>(geometry.dimensions, 0), geometry);
  EXPECT_NE(ErrorOf(withEmpty).find("volume 2: no voxel is valid"), std::string::npos) << "not that volume 1 overlaps none";
  scene.Add(Volume<float>(geometry.dimensions), Volume<unsigned char>(geometry.dimensions, 0), geometry);
  EXPECT_NE(ErrorOf(scene, parameters).find("volume 4: no voxel is valid and finite"), std::string::npos);
}

TEST(Stitch, StatesTheMemoryAndASpacingThatFits)
{
  ImageGeometry a, b;
  a.dimensions = b.dimensions = {300, 300, 300};
  b.origin[0] = 100.0;
  StitchParameters parameters;
  parameters.maximumMemoryGb = 0.1;
  const GridBox whole{{0, 0, 0}, {400, 300, 300}};
  try {
    CheckStitch(parameters, {a, b}, StitchGrid({a, b}), {}, whole);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::TooLarge);
    const std::string message = error.what();
    EXPECT_NE(message.find("400 x 300 x 300"), std::string::npos) << message;
    const std::size_t at = message.find("SpacingMm = ");
    ASSERT_NE(at, std::string::npos) << message;
    const double spacing = std::stod(message.substr(at + 12));
    EXPECT_GT(spacing, 1.0);
    EXPECT_LT(spacing, 4.0);
    const ImageGeometry fitting = StitchGrid({a, b}, spacing);
    EXPECT_NO_THROW(CheckStitch(parameters, {a, b}, fitting, {}, {{0, 0, 0}, fitting.dimensions}));
  }
}

TEST(Stitch, StopsWhenAsked)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {40, 40, 40}, 1.0f);
  scene.AddBox({20, 0, 0}, {40, 40, 40}, 1.0f);
  double last = 0.0;
  const Progress watch([&last](double fraction) {
    EXPECT_GE(fraction, last - 1e-9);
    last = fraction;
    return true;
  });
  Stitched(scene, With(StitchMethod::Distance), 0.0, watch);
  EXPECT_GT(last, 0.9);
  EXPECT_LE(last, 1.0);
  EXPECT_THROW(Stitched(scene, With(StitchMethod::Distance), 0.0, Progress([](double fraction) { return fraction < 0.5; })),
               Error);
}

TEST(Stitch, ADisplacementSaysWhereAVolumeIsRead)
{
  // A volume that is read 2 mm to the right everywhere is the volume, put 2 mm to the left.
  Scene<float> pushed, placed;
  Random random(31);
  for (int v = 0; v < 2; ++v) {
    ImageGeometry geometry;
    geometry.dimensions = {20, 16, 12};
    geometry.origin = Eigen::Vector3d(12.0 * v, 0.0, 0.0);
    Volume<float> values(geometry.dimensions);
    for (float& value : values.View())
      value = static_cast<float>(random.Uniform(0.0, 100.0));
    pushed.Add(values, {}, geometry);
    geometry.origin[0] -= 2.0 * v;
    placed.Add(values, {}, geometry);
  }
  ImageGeometry lattice;
  lattice.dimensions = {9, 9, 9};
  lattice.spacing.setConstant(10.0);
  lattice.origin.setConstant(-30.0);
  const DisplacementField field(lattice, std::vector<Eigen::Vector3d>(729, {2.0, 0.0, 0.0}));
  pushed.inputs[1].displacement = &field;
  const auto a = Stitched(pushed), b = Stitched(placed);
  const auto& n = b.grid.dimensions;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        EXPECT_EQ(a.coverage.View()(i, j, k), b.coverage.View()(i, j, k));
        EXPECT_NEAR(a.intensity.View()(i, j, k), b.intensity.View()(i, j, k), 1e-3);
      }
  EXPECT_EQ(ReachOf(pushed.inputs[1]).dimensions, (std::array<int, 3>{24, 20, 16}));
  EXPECT_EQ(ReachOf(pushed.inputs[0]).dimensions, pushed.geometries[0].dimensions);
}
