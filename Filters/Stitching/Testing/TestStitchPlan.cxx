// SPDX-License-Identifier: BSD-3-Clause
// The plan and its pieces, textures, gains, and the hard cases, for every method.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Stitching/StitchMemory.h"
#include "StitchScene.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <limits>

using namespace echorama;
using namespace echorama::testing_scene;

namespace {

struct Way {
  StitchMethod method;
  StitchTexture texture;
};

// Every method, and every texture of the one that is there by default.
const Way ways[] = {{StitchMethod::Membrane, StitchTexture::Split}, {StitchMethod::Membrane, StitchTexture::Mix},
                    {StitchMethod::Distance, StitchTexture::Split}, {StitchMethod::Feather, StitchTexture::Split},
                    {StitchMethod::Average, StitchTexture::Mix},    {StitchMethod::Maximum, StitchTexture::Mix}};

StitchParameters By(const Way& way)
{
  StitchParameters parameters;
  parameters.method = way.method;
  parameters.texture = way.texture;
  return parameters;
}

// Independent textures on one lattice, each a box of its own.
template <class T>
void AddTexture(Scene<T>& scene, std::array<int, 3> first, std::array<int, 3> size, double mean, double deviation, int seed)
{
  ImageGeometry geometry;
  geometry.dimensions = size;
  geometry.origin = Eigen::Vector3d(first[0], first[1], first[2]);
  Volume<T> values(size);
  Random random(static_cast<std::uint64_t>(seed));
  for (T& value : values.View())
    value = static_cast<T>(mean + deviation * random.Normal());
  scene.Add(std::move(values), {}, geometry);
}

double DeviationOf(const VolumeView<const float>& values, std::array<int, 3> first, std::array<int, 3> end)
{
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (int k = first[2]; k < end[2]; ++k)
    for (int j = first[1]; j < end[1]; ++j)
      for (int i = first[0]; i < end[0]; ++i) {
        const double value = values(i, j, k);
        sum += value;
        squares += value * value;
        ++count;
      }
  return std::sqrt(squares / count - (sum / count) * (sum / count));
}

template <class T>
void ExpectConstant(const Scene<T>& scene, T value, const char* what, double tolerance)
{
  for (const Way& way : ways) {
    for (const double b : {0.0, 1.5, 1000.0}) {
      StitchParameters parameters = By(way);
      parameters.sharpness = b;
      parameters.allowDisjoint = true;
      const Result<T> result = Stitched(scene, parameters);
      ExpectSoundWeights(result);
      for (std::ptrdiff_t i = 0; i < result.valid.View().Size(); ++i)
        ASSERT_NEAR(result.intensity.View()[i], result.valid.View()[i] ? value : T(0), tolerance)
            << what << ", method " << static_cast<int>(way.method) << ", texture " << static_cast<int>(way.texture) << ", b "
            << b;
    }
  }
}

// A hard case: boxes (first, size) of one value.
using Boxes = std::vector<std::pair<std::array<int, 3>, std::array<int, 3>>>;

} // namespace

TEST(StitchPlan, HardCasesAreSoundInEveryMethod)
{
  ECHORAMA_SKIP_SANITIZED();
  std::vector<std::pair<const char*, Boxes>> cases{
      {"identical", {{{0, 0, 0}, {9, 8, 7}}, {{0, 0, 0}, {9, 8, 7}}}},
      {"three identical beside one",
       {{{0, 0, 0}, {8, 8, 4}}, {{0, 0, 0}, {8, 8, 4}}, {{0, 0, 0}, {8, 8, 4}}, {{5, 0, 0}, {9, 8, 4}}}},
      {"nested", {{{0, 0, 0}, {17, 16, 9}}, {{4, 5, 2}, {6, 6, 5}}}},
      {"one voxel within", {{{0, 0, 0}, {7, 7, 7}}, {{3, 3, 3}, {1, 1, 1}}}},
      {"covered by two", {{{0, 0, 0}, {12, 8, 4}}, {{8, 0, 0}, {12, 8, 4}}, {{4, 0, 0}, {10, 8, 4}}}},
      {"neck", {{{0, 0, 0}, {8, 8, 3}}, {{7, 7, 0}, {8, 8, 3}}}},
      {"overlap one voxel thin", {{{0, 0, 0}, {8, 8, 8}}, {{7, 0, 0}, {8, 8, 8}}}},
      {"pure next to empty", {{{0, 0, 0}, {8, 16, 4}}, {{4, 0, 0}, {8, 8, 4}}, {{8, 4, 0}, {8, 12, 4}}}},
      {"islands", {{{0, 0, 0}, {20, 4, 4}}, {{0, 2, 0}, {3, 6, 4}}, {{10, 2, 0}, {3, 6, 4}}}},
      {"apart", {{{0, 0, 0}, {5, 5, 5}}, {{9, 0, 0}, {5, 5, 5}}}},
      {"touching", {{{0, 0, 0}, {5, 5, 5}}, {{5, 0, 0}, {5, 5, 5}}}},
      {"1 x N x N", {{{0, 0, 0}, {1, 13, 11}}, {{0, 6, 3}, {1, 13, 11}}}},
      {"N x 1 x N", {{{0, 0, 0}, {13, 1, 11}}, {{6, 0, 3}, {13, 1, 11}}}},
      {"one slice", {{{0, 0, 0}, {17, 13, 1}}, {{5, 6, 0}, {17, 13, 1}}}},
      {"a line", {{{0, 0, 0}, {17, 1, 1}}, {{11, 0, 0}, {17, 1, 1}}}},
      {"power of two", {{{0, 0, 0}, {16, 16, 16}}, {{8, 0, 0}, {16, 16, 16}}}},
      {"prime", {{{0, 0, 0}, {13, 11, 7}}, {{5, 3, 2}, {17, 11, 7}}}},
  };
  Boxes chain;
  for (int v = 0; v < 20; ++v)
    chain.push_back({{3 * v, v % 3, 0}, {10, 8, 3}});
  cases.push_back({"twenty in a chain", chain});
  for (const auto& [name, boxes] : cases) {
    SCOPED_TRACE(name);
    Scene<unsigned char> bytes;
    Scene<float> floats;
    for (const auto& [first, size] : boxes) {
      bytes.AddBox(first, size, 77);
      floats.AddBox(first, size, 77.3f);
    }
    ExpectConstant<unsigned char>(bytes, 77, name, 0.0);
    ExpectConstant<float>(floats, 77.3f, name, 77.3e-6);
    if (HasFatalFailure())
      return;
  }
}

TEST(StitchPlan, TurnedVolumesOfDifferentSpacingAndHolesAreSound)
{
  Scene<float> scene;
  Random random(3);
  for (int v = 0; v < 3; ++v) {
    ImageGeometry geometry;
    geometry.dimensions = {19, 23, 17};
    geometry.spacing = Eigen::Vector3d(0.7 + 0.3 * v, 1.0, 1.3 - 0.2 * v);
    geometry.origin = Eigen::Vector3d(6.0 * v, 1.0, -2.0);
    geometry = geometry.Moved(MotionAbout(geometry.Centre(), 0.4 * v * random.Direction(), {0.0, 0.0, 0.0}));
    Volume<float> values(geometry.dimensions, 5.25f);
    Volume<unsigned char> mask(geometry.dimensions, 1);
    for (std::ptrdiff_t at = 0; at < values.View().Size(); ++at) {
      if (random.Below(50) == 0)
        values.View()[at] = std::numeric_limits<float>::quiet_NaN();
      if (random.Below(50) == 0) {
        mask.View()[at] = 0;
        values.View()[at] = 1e30f;
      }
    }
    scene.Add(std::move(values), std::move(mask), geometry);
  }
  for (const Way& way : ways) {
    const Result<float> result = Stitched(scene, By(way));
    ExpectSoundWeights(result);
    for (std::ptrdiff_t i = 0; i < result.valid.View().Size(); ++i)
      ASSERT_NEAR(result.intensity.View()[i], result.valid.View()[i] ? 5.25f : 0.0f, 5.25e-6)
          << static_cast<int>(way.method) << " " << static_cast<int>(way.texture);
  }
}

TEST(StitchPlan, PiecesAreThoseOfTheWholeToTheLastBit)
{
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {31, 24, 18}, 90.0, 20.0, 1);
  AddTexture(scene, {14, 3, 2}, {29, 22, 19}, 110.0, 15.0, 2);
  AddTexture(scene, {8, 11, 5}, {24, 26, 17}, 100.0, 25.0, 3);
  for (const Way& way : ways) {
    const StitchParameters parameters = By(way);
    const Result<float> whole = Stitched(scene, parameters);
    const StitchPlan plan(parameters, scene.inputs, whole.grid, {sizeof(float), true, true});
    for (const GridBox& box : {GridBox{{0, 0, 0}, {whole.grid.dimensions[0], whole.grid.dimensions[1], 1}},
                               GridBox{{5, 7, 3}, {20, 15, 9}}, GridBox{{17, 12, 6}, {1, 1, 1}}}) {
      Volume<float> intensity(box.size), spread(box.size),
          weights[3] = {Volume<float>(box.size), Volume<float>(box.size), Volume<float>(box.size)};
      Volume<unsigned char> valid(box.size), coverage(box.size);
      plan.Render<float>(box, {intensity.View(),
                               valid.View(),
                               coverage.View(),
                               {weights[0].View(), weights[1].View(), weights[2].View()},
                               spread.View()});
      for (int k = 0; k < box.size[2]; ++k)
        for (int j = 0; j < box.size[1]; ++j)
          for (int i = 0; i < box.size[0]; ++i) {
            const int x = i + box.first[0], y = j + box.first[1], z = k + box.first[2];
            ASSERT_EQ(intensity.View()(i, j, k), whole.intensity.View()(x, y, z)) << static_cast<int>(way.method);
            ASSERT_EQ(valid.View()(i, j, k), whole.valid.View()(x, y, z));
            ASSERT_EQ(coverage.View()(i, j, k), whole.coverage.View()(x, y, z));
            for (int v = 0; v < 3; ++v)
              ASSERT_EQ(weights[v].View()(i, j, k), whole.weights[v].View()(x, y, z));
          }
    }
    EXPECT_THROW(plan.Render<float>({{0, 0, 0}, {999, 1, 1}}, {}), Error);
  }
}

TEST(StitchPlan, ThreadsDoNotMatter)
{
  ECHORAMA_SKIP_SANITIZED();
  Scene<short> scene;
  AddTexture(scene, {0, 0, 0}, {33, 30, 21}, 90.0, 20.0, 1);
  AddTexture(scene, {15, 3, 2}, {30, 28, 21}, 110.0, 15.0, 2);
  for (const Way& way : ways) {
    const Result<short> many = Stitched(scene, By(way));
    const ThreadLimit one(1);
    const Result<short> alone = Stitched(scene, By(way));
    EXPECT_TRUE(std::equal(many.intensity.View().begin(), many.intensity.View().end(), alone.intensity.View().begin()))
        << static_cast<int>(way.method) << " " << static_cast<int>(way.texture);
  }
}

TEST(StitchPlan, MembranesOfTwoSlabsAreARamp)
{
  // Between slabs that overlap by ten voxels the smoothest surface is the straight ramp, at eleven steps.
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {30, 12, 9}, 0.0f);
  scene.AddBox({20, 0, 0}, {30, 12, 9}, 11.0f);
  const Result<float> result = Stitched(scene, With(StitchMethod::Membrane, 1.0));
  for (int i = 0; i < 50; ++i)
    EXPECT_NEAR(result.intensity.View()(i, 5, 4), i < 20 ? 0.0 : i >= 30 ? 11.0 : i - 19.0, 11.0 / 512) << i;
}

TEST(StitchPlan, MembranesOfThickOverlapsAreFoundAtEveryOtherVoxel)
{
  // The same ramp, however the overlap lies in the coarser grid: off by one voxel of it at most, and monotonous.
  for (const int first : {20, 21}) {
    Scene<float> scene;
    scene.AddBox({0, 0, 0}, {60, 30, 24}, 0.0f);
    scene.AddBox({first, 0, 0}, {60, 30, 24}, 100.0f);
    StitchParameters parameters = With(StitchMethod::Membrane, 1.0);
    const int overlap = 60 - first;
    const Result<float> result = Stitched(scene, parameters);
    EXPECT_EQ(StitchPlan(parameters, scene.inputs, result.grid, {}).Factor(), 2);
    parameters.planStep = 1;
    EXPECT_EQ(StitchPlan(parameters, scene.inputs, result.grid, {}).Factor(), 1);
    const auto shown = [&](int i) { return result.intensity.View()(i, 15, 12); };
    for (int i = 0; i < first + 60; ++i) {
      const double ramp = std::clamp(100.0 * (i - first + 1) / (overlap + 1), 0.0, 100.0);
      EXPECT_NEAR(shown(i), ramp, 100.0 / overlap) << i;
      EXPECT_TRUE(i == 0 || shown(i) >= shown(i - 1)) << i;
      if (i < first || i >= 60) {
        EXPECT_EQ(shown(i), ramp) << "who is alone shows nothing of others";
      }
    }
  }
  Scene<float> thin;
  thin.AddBox({0, 0, 0}, {60, 30, 24}, 0.0f);
  thin.AddBox({50, 0, 0}, {60, 30, 24}, 100.0f);
  EXPECT_EQ(StitchPlan(With(StitchMethod::Membrane, 1.0), thin.inputs, StitchGrid(thin.geometries), {}).Factor(), 1);
}

TEST(StitchPlan, ACoarsePlanKnowsThinOverlapsFromNone)
{
  // A single layer of voxels between those that the coarser grid looks at.
  Scene<float> touching, apart;
  for (Scene<float>* scene : {&touching, &apart})
    scene->AddBox({0, 0, 0}, {30, 30, 30}, 10.0f);
  touching.AddBox({29, 0, 0}, {30, 30, 30}, 20.0f);
  apart.AddBox({30, 0, 0}, {30, 30, 30}, 20.0f);
  StitchParameters parameters = With(StitchMethod::Membrane, 1.0);
  parameters.planStep = 4;
  const StitchPlan plan(parameters, touching.inputs, StitchGrid(touching.geometries), {});
  EXPECT_EQ(plan.Factor(), 4);
  EXPECT_THROW(StitchPlan(parameters, apart.inputs, StitchGrid(apart.geometries), {}), Error);
  parameters.allowDisjoint = true;
  EXPECT_NO_THROW(StitchPlan(parameters, apart.inputs, StitchGrid(apart.geometries), {}));
}

TEST(StitchPlan, TextureIsKeptWhereVolumesAreIndependent)
{
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {60, 40, 30}, 100.0, 20.0, 1);
  AddTexture(scene, {20, 0, 0}, {60, 40, 30}, 100.0, 20.0, 2);
  const std::array<int, 3> first{38, 3, 3}, end{42, 37, 27}; // the middle of the overlap, where they weigh the same
  const auto kept = [&](const Way& way) { return DeviationOf(Stitched(scene, By(way)).intensity.View(), first, end) / 20.0; };
  EXPECT_NEAR(kept({StitchMethod::Membrane, StitchTexture::Mix}), std::sqrt(0.5), 0.03);
  EXPECT_GT(kept({StitchMethod::Membrane, StitchTexture::Split}), 0.93);
  EXPECT_LT(kept({StitchMethod::Membrane, StitchTexture::Split}), 1.07);
}

TEST(StitchPlan, ADifferenceInBrightnessIsSpreadOverTheOverlapInEveryTexture)
{
  // Two textures of different mean: the mean of each plane across the overlap must rise steadily, without a jump.
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {70, 40, 40}, 80.0, 5.0, 1);
  AddTexture(scene, {30, 0, 0}, {70, 40, 40}, 120.0, 5.0, 2);
  for (const StitchTexture texture : {StitchTexture::Mix, StitchTexture::Split}) {
    const Result<float> result = Stitched(scene, By({StitchMethod::Membrane, texture}));
    double before = 80.0;
    for (int i = 25; i < 75; ++i) {
      double mean = 0.0;
      for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
          mean += result.intensity.View()(i, j, k) / 1600.0;
      EXPECT_LT(std::abs(mean - before), 3.0) << "plane " << i << ", texture " << static_cast<int>(texture);
      before = mean;
    }
    EXPECT_NEAR(before, 120.0, 1.0);
  }
}

TEST(StitchPlan, GainsAreEqualizedOnRequest)
{
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {40, 30, 20}, 100.0, 20.0, 1);
  ImageGeometry geometry = scene.geometries[0];
  geometry.origin[0] = 20.0;
  Volume<float> values(geometry.dimensions);
  Random random(5);
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 40; ++i) {
        // The same anatomy, seen at another gain.
        const double same = i < 20 ? scene.values[0].View()(i + 20, j, k) : 100.0 + 20.0 * random.Normal();
        values.View()(i, j, k) = static_cast<float>(0.8 * same + 30.0);
      }
  scene.Add(std::move(values), {}, geometry);
  StitchParameters parameters;
  const auto stepAcross = [&] {
    const Result<float> result = Stitched(scene, parameters);
    const std::array<int, 3> leftFirst{2, 2, 2}, leftEnd{18, 28, 18}, rightFirst{42, 2, 2}, rightEnd{58, 28, 18};
    return DeviationOf(result.intensity.View(), rightFirst, rightEnd) / DeviationOf(result.intensity.View(), leftFirst, leftEnd);
  };
  EXPECT_NEAR(stepAcross(), 0.8, 0.05);
  parameters.equalizeGain = true;
  EXPECT_NEAR(stepAcross(), 1.0, 0.05);
  const StitchPlan plan(parameters, scene.inputs, StitchGrid(scene.geometries), {});
  EXPECT_NEAR(plan.Gain()[1] / plan.Gain()[0], 1.25, 0.02);
  EXPECT_NEAR(plan.Gain()[1] * (0.8 * 100.0 + 30.0) + plan.Offset()[1], plan.Gain()[0] * 100.0 + plan.Offset()[0], 0.5);
}

TEST(StitchPlan, SpreadSaysHowFarVolumesAreApart)
{
  Scene<unsigned char> scene;
  scene.AddBox({0, 0, 0}, {20, 6, 4}, 100);
  scene.AddBox({10, 0, 0}, {20, 6, 4}, 130);
  scene.AddBox({15, 0, 0}, {20, 6, 4}, 90);
  const ImageGeometry grid = StitchGrid(scene.geometries);
  Volume<unsigned char> intensity(grid.dimensions), valid = intensity, coverage = intensity;
  Volume<float> spread(grid.dimensions, -1.0f);
  Stitch<unsigned char>({}, scene.inputs, grid, {intensity.View(), valid.View(), coverage.View(), {}, spread.View()});
  for (int i = 0; i < 35; ++i)
    EXPECT_EQ(spread.View()(i, 3, 2), i < 10 ? 0.0f : i < 15 ? 30.0f : i < 30 ? 40.0f : 0.0f) << i;
}

TEST(StitchPlan, AShadowTakesTheDetailsOfTheVolumeThatSees)
{
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {40, 30, 20}, 100.0, 20.0, 1);
  AddTexture(scene, {10, 0, 0}, {40, 30, 20}, 100.0, 20.0, 2);
  // The first is dark where it lies in shadow, and says so.
  Volume<float> trust({40, 30, 20}, 1.0f);
  for (int k = 0; k < 20; ++k)
    for (int j = 10; j < 20; ++j)
      for (int i = 12; i < 24; ++i) {
        trust.View()(i, j, k) = 0.0f;
        scene.values[0].View()(i, j, k) = 0.0f;
      }
  scene.inputs[0].reliability = trust.View();
  const Result<float> result = Stitched(scene, By({StitchMethod::Membrane, StitchTexture::Split}));
  double error = 0.0;
  for (int k = 4; k < 16; ++k)
    for (int j = 13; j < 17; ++j)
      for (int i = 15; i < 21; ++i)
        error += std::abs(result.intensity.View()(i, j, k) - scene.values[1].View()(i - 10, j, k)) / (12 * 4 * 6);
  EXPECT_LT(error, 6.0); // the first still counts by its floor of 0.01, times at most 3^1.5, with values that are 100 off
}

TEST(StitchPlan, ACoarsePlanComesCloseToTheExactOne)
{
  // Smooth volumes that differ: the plan alone decides what is in the overlap.
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {120, 60, 50}, 80.0f);
  scene.AddBox({60, 8, 4}, {120, 60, 50}, 120.0f);
  for (const StitchMethod method : {StitchMethod::Membrane, StitchMethod::Distance}) {
    StitchParameters parameters;
    parameters.method = method;
    const Result<float> exact = Stitched(scene, parameters);
    std::vector<ImageGeometry> volumes = scene.geometries;
    parameters.maximumMemoryGb = 1e-9 * CostOfStitch(parameters, volumes, exact.grid, {sizeof(float)}).planBytes;
    const StitchCost cost = CostOfStitch(parameters, volumes, exact.grid, {sizeof(float)});
    EXPECT_EQ(cost.planFactor, 2);
    const StitchPlan plan(parameters, scene.inputs, exact.grid, {sizeof(float)});
    EXPECT_EQ(plan.Factor(), 2);
    const auto& n = exact.grid.dimensions;
    const GridBox slab{{0, 0, 10}, {n[0], n[1], 2}};
    Volume<float> intensity(slab.size);
    Volume<unsigned char> valid(slab.size), coverage(slab.size);
    plan.Render<float>(slab, {intensity.View(), valid.View(), coverage.View(), {}});
    double largest = 0.0, sum = 0.0;
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          ASSERT_EQ(coverage.View()(i, j, k), exact.coverage.View()(i, j, k + 10)) << "where volumes are is always exact";
          const double error = std::abs(intensity.View()(i, j, k) - exact.intensity.View()(i, j, k + 10));
          largest = std::max(largest, error);
          sum += error / static_cast<double>(intensity.View().Size());
        }
    EXPECT_LT(sum, 0.5);
    // Where pure and empty regions touch the weights jump, and a coarse grid knows only roughly where.
    EXPECT_LT(largest, 20.0);
  }
}

TEST(StitchPlan, PairsFarApartArePlannedAsIfTheyWereAlone)
{
  // More voxels than 32 bits count, a hundred thousand of which are of a volume: their plan takes what these need. Membranes are
  // coarsened by the indices of voxels: the same, where the pairs are a multiple of all steps apart.
  Scene<float> pair, both;
  AddTexture(pair, {0, 0, 0}, {40, 30, 30}, 90.0, 20.0, 1);
  AddTexture(pair, {25, 4, 3}, {40, 30, 30}, 110.0, 15.0, 2);
  const std::array<int, 3> far{2048, 2048, 1024};
  AddTexture(both, {0, 0, 0}, {20, 20, 20}, 90.0, 20.0, 3);
  AddTexture(both, {12, 0, 0}, {20, 20, 20}, 90.0, 20.0, 4);
  AddTexture(both, far, {40, 30, 30}, 90.0, 20.0, 1);
  AddTexture(both, {far[0] + 25, far[1] + 4, far[2] + 3}, {40, 30, 30}, 110.0, 15.0, 2);
  for (const StitchMethod method : {StitchMethod::Membrane, StitchMethod::Feather, StitchMethod::Average}) {
    StitchParameters parameters;
    parameters.method = method;
    parameters.texture = StitchTexture::Mix; // the correlation of textures is measured over all volumes
    const Result<float> alone = Stitched(pair, parameters);
    parameters.maximumMemoryGb = 0.1;
    const ImageGeometry grid = StitchGrid(both.geometries);
    ASSERT_GT(grid.VoxelCount(), std::size_t{1} << 32);
    const StitchPlan plan(parameters, both.inputs, grid, {sizeof(float)});
    EXPECT_EQ(plan.Factor(), 1);
    const GridBox box{far, alone.grid.dimensions};
    Volume<float> intensity(box.size);
    Volume<unsigned char> valid(box.size), coverage(box.size);
    plan.Render<float>(box, {intensity.View(), valid.View(), coverage.View(), {}});
    EXPECT_TRUE(std::equal(intensity.View().begin(), intensity.View().end(), alone.intensity.View().begin()))
        << static_cast<int>(method);
    EXPECT_TRUE(std::equal(coverage.View().begin(), coverage.View().end(), alone.coverage.View().begin()));
  }
}

TEST(StitchPlan, CostIsStatedFirstAndSlabsFit)
{
  ImageGeometry a, b;
  a.dimensions = b.dimensions = {300, 300, 300};
  b.origin[0] = 100.0;
  const ImageGeometry grid = StitchGrid({a, b});
  StitchParameters parameters;
  const StitchCost free = CostOfStitch(parameters, {a, b}, grid, {1});
  EXPECT_EQ(free.planFactor, 1);
  EXPECT_EQ(free.slabs, 1);
  EXPECT_EQ(free.outputBytes, 3.0 * 400 * 300 * 300);
  // An output four times what is allowed.
  parameters.maximumMemoryGb = 0.25e-9 * free.outputBytes;
  const StitchCost tight = CostOfStitch(parameters, {a, b}, grid, {1});
  EXPECT_GT(tight.planFactor, 1);
  EXPECT_LE(tight.planBytes, 0.5 * tight.allowedBytes);
  ASSERT_GE(tight.slabs, 4);
  const int slices = (300 + tight.slabs - 1) / tight.slabs;
  EXPECT_NO_THROW(CheckStitch(parameters, {a, b}, grid, {1}, {{0, 0, 0}, {400, 300, slices}}));
  EXPECT_THROW(CheckStitch(parameters, {a, b}, grid, {1}, {{0, 0, 0}, {400, 300, 300}}), Error);
  // Spread and weights count.
  EXPECT_EQ(CostOfStitch({}, {a, b}, grid, {1, true, true}).voxelBytes, 3.0 + 4.0 + 8.0);
}

TEST(StitchPlan, RefusesWhatCannotBe)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {10, 10, 3}, 1.0f);
  scene.AddBox({5, 0, 0}, {10, 10, 3}, 1.0f);
  const auto wrong = [&](double StitchParameters::*field, double value) {
    StitchParameters parameters;
    parameters.*field = value;
    return ErrorOf(scene, parameters);
  };
  EXPECT_NE(wrong(&StitchParameters::detailScale, 0.5).find("DetailScale"), std::string::npos);
  EXPECT_NE(wrong(&StitchParameters::detailScale, std::nan("")).find("DetailScale"), std::string::npos);
  EXPECT_NE(wrong(&StitchParameters::detailSharpness, -1.0).find("DetailSharpness"), std::string::npos);
  EXPECT_NE(wrong(&StitchParameters::membraneTolerance, 0.0).find("MembraneTolerance"), std::string::npos);
}

TEST(StitchPlan, EveryMethodStopsWhenAsked)
{
  Scene<float> scene;
  AddTexture(scene, {0, 0, 0}, {40, 30, 20}, 100.0, 20.0, 1);
  AddTexture(scene, {20, 0, 0}, {40, 30, 20}, 100.0, 20.0, 2);
  for (const Way& way : ways)
    for (const double at : {0.1, 0.5, 0.9})
      EXPECT_THROW(Stitched(scene, By(way), 0.0, Progress([at](double fraction) { return fraction < at; })), Error)
          << static_cast<int>(way.method) << " " << at;
}
