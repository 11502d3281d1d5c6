// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/Feather.h"
#include "Filters/Embedding/LocalStatistics.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {

namespace {

const Eigen::Vector3d spacing(0.5, 1.0, 1.0);
constexpr std::array<int, 3> size{60, 40, 24};

struct Scene {
  Volume<unsigned char> region{size}, form{size, 1}, labels{size, 9};
  Volume<float> weights{size}, background{size};
  Volume<unsigned char> data{size};

  // Data with x from 20 on, of another texture than the background.
  Scene()
  {
    for (std::ptrdiff_t at = 0; at < region.View().Size(); ++at) {
      Random random(2, static_cast<std::uint64_t>(at));
      region.View()[at] = at % size[0] >= 20;
      data.View()[at] = static_cast<unsigned char>(100.0 + 50.0 * random.Uniform());
      background.View()[at] = static_cast<float>(100.0 + 50.0 * random.Uniform());
    }
  }

  Volume<unsigned char> Run(const FeatherParameters& parameters)
  {
    Volume<unsigned char> result = data;
    FeatherWeights(parameters, region.View(), form.View(), spacing, weights.View());
    Feather<unsigned char>(parameters, weights.View(), region.View(), background.View(), form.View(), spacing, result.View(),
                           labels.View());
    return result;
  }
};

} // namespace

TEST(Feather, WeightsAreARamp)
{
  Scene scene;
  FeatherWeights({4.0, false, 3.0}, scene.region.View(), {}, spacing, scene.weights.View());
  for (int i = 0; i < size[0]; ++i) // the first voxel of the data lies 0.5 mm from the last that is none
    EXPECT_FLOAT_EQ(scene.weights.View()(i, 7, 3), i < 20 ? 0.0f : std::min(1.0f, 0.5f * static_cast<float>(i - 19) / 4.0f));
}

TEST(Feather, DeepDataAreUntouchedAndLabelsSayWhatIsWhat)
{
  Scene scene;
  for (const bool keep : {false, true}) {
    const Volume<unsigned char> result = scene.Run({4.0, keep, 3.0});
    std::ptrdiff_t changed = 0;
    for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at) {
      const int i = static_cast<int>(at % size[0]);
      const auto label = static_cast<EmbeddedVoxel>(scene.labels.View()[at]);
      EXPECT_EQ(label, i < 20 ? EmbeddedVoxel::Invented : i < 27 ? EmbeddedVoxel::Blend : EmbeddedVoxel::Data);
      if (label == EmbeddedVoxel::Data) {
        ASSERT_EQ(result.View()[at], scene.data.View()[at]);
      }
      if (label == EmbeddedVoxel::Invented) {
        ASSERT_EQ(result.View()[at], static_cast<unsigned char>(std::floor(scene.background.View()[at] + 0.5f)));
      }
      changed += label == EmbeddedVoxel::Blend && result.View()[at] != scene.data.View()[at];
    }
    EXPECT_GT(changed, 5000);
  }
}

TEST(Feather, RadiusZeroIsAHardBorder)
{
  Scene scene;
  const Volume<unsigned char> result = scene.Run({0.0, true, 3.0});
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at)
    if (scene.region.View()[at]) {
      ASSERT_EQ(result.View()[at], scene.data.View()[at]);
    }
}

TEST(Feather, ARadiusBeyondTheDataBlendsAll)
{
  Scene scene;
  scene.Run({1000.0, true, 3.0});
  for (const unsigned char label : scene.labels.View())
    ASSERT_NE(label, static_cast<unsigned char>(EmbeddedVoxel::Data));
}

// Half way the plain mean of two textures has 0.71 of their deviation.
TEST(Feather, TextureIsKept)
{
  Scene scene;
  const auto deviation = [&scene](bool keep) {
    const Volume<unsigned char> result = scene.Run({10.0, keep, 3.0});
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j) {
        const double value = result.View()(29, j, k); // weight one half
        sum += value;
        squares += value * value;
        count += 1.0;
      }
    return std::sqrt(squares / count - sum * sum / (count * count));
  };
  const double whole = 50.0 / std::sqrt(12.0);
  EXPECT_NEAR(deviation(false), whole * std::sqrt(0.5), 0.06 * whole);
  EXPECT_NEAR(deviation(true), whole, 0.08 * whole);
}

TEST(Feather, ConstantsMeetInARampAndStayConstant)
{
  Scene scene;
  scene.data = Volume<unsigned char>(size, 80);
  scene.background = Volume<float>(size, 80.0f);
  const Volume<unsigned char> same = scene.Run({5.0, true, 3.0});
  for (const unsigned char value : same.View())
    ASSERT_EQ(value, 80);
  scene.background = Volume<float>(size, 40.0f);
  const Volume<unsigned char> result = scene.Run({10.0, false, 3.0});
  EXPECT_EQ(result.View()(19, 3, 3), 40);
  EXPECT_EQ(result.View()(29, 3, 3), 60);
  EXPECT_EQ(result.View()(39, 3, 3), 80);
}

TEST(Feather, LocalMeansThatAreKnownAreTakenAndNotMeasured)
{
  Scene scene;
  const FeatherParameters parameters{4.0, true, 3.0};
  const Volume<unsigned char> measured = scene.Run(parameters);
  const auto with = [&](VolumeView<const unsigned char> seen) {
    Volume<unsigned char> result = scene.data;
    const LocalStatistics own(seen, scene.region.View(), spacing, 3.0);
    Feather<unsigned char>(parameters, scene.weights.View(), scene.region.View(), scene.background.View(), scene.form.View(),
                           spacing, result.View(), scene.labels.View(), {}, &own);
    return result;
  };
  const auto same = [&](const Volume<unsigned char>& result) {
    return std::equal(result.View().begin(), result.View().end(), measured.View().begin());
  };
  EXPECT_TRUE(same(with(scene.data.View())));
  EXPECT_FALSE(same(with(Volume<unsigned char>(size, 20).View())));
}

// The closed form, voxel by voxel, with local means that are measured over whole rows. Labels of an earlier run say nothing.
TEST(Feather, BlendsAreMeansAboutWhichTextureIsRestored)
{
  for (const bool keep : {false, true})
    // All of a row, a part, its end (beyond as many voxels as there are rows), and a border of a single voxel.
    for (const auto& [from, radius] : {std::pair(0, 12.0), std::pair(20, 12.0), std::pair(50, 12.0), std::pair(20, 0.8)}) {
      Scene scene;
      const FeatherParameters parameters{radius, keep, 3.0};
      for (std::ptrdiff_t at = 0; at < scene.region.View().Size(); ++at) {
        scene.region.View()[at] = at % size[0] >= from && at / size[0] % size[1] >= 2; // two rows of each slice are background
        scene.background.View()[at] += 0.4f * static_cast<float>(at % size[0]);        // and neither is flat
        scene.data.View()[at] = static_cast<unsigned char>(scene.data.View()[at] - at % size[0] / 2);
      }
      const LocalStatistics own(VolumeView<const unsigned char>(scene.data.View()), scene.region.View(), spacing, 3.0),
          others(VolumeView<const float>(scene.background.View()), scene.form.View(), spacing, 3.0);
      for (const char* run : {"first", "second"}) {
        const Volume<unsigned char> result = scene.Run(parameters);
        std::vector<float> mean(size[0]), otherMean(size[0]), unused(size[0]);
        int wrong = 0, blended = 0;
        for (int k = 0; k < size[2]; ++k)
          for (int j = 2; j < size[1]; ++j) {
            own.Row(j, k, 0, size[0], mean.data(), unused.data());
            others.Row(j, k, 0, size[0], otherMean.data(), unused.data());
            for (int i = from; i < size[0]; ++i) {
              const double w = scene.weights.View()(i, j, k), b = scene.background.View()(i, j, k);
              if (w >= 1.0)
                continue;
              double value = w * scene.data.View()(i, j, k) + (1.0 - w) * b;
              if (keep) {
                const double base = w * mean[i] + (1.0 - w) * otherMean[i];
                value = base + (value - base) / std::hypot(w, 1.0 - w);
              }
              wrong += std::abs(result.View()(i, j, k) - std::min(value, 255.0)) > 0.501;
              ++blended;
            }
          }
        EXPECT_EQ(wrong, 0) << run << " run, keep " << keep << ", from " << from << ", radius " << radius;
        EXPECT_GT(blended, 900);
      }
    }
}

TEST(Feather, WhereTheBackgroundEndsDataDoNotFade)
{
  Scene scene;
  for (std::ptrdiff_t at = 0; at < scene.form.View().Size(); ++at)
    scene.form.View()[at] = at % size[0] >= 20; // the form is the region of the data
  const Volume<unsigned char> result = scene.Run({5.0, true, 3.0});
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at) {
    ASSERT_EQ(result.View()[at], scene.region.View()[at] ? scene.data.View()[at] : 0);
    ASSERT_EQ(scene.labels.View()[at],
              static_cast<unsigned char>(scene.region.View()[at] ? EmbeddedVoxel::Data : EmbeddedVoxel::Outside));
  }
}

TEST(Feather, ABackgroundThatIsNoNumberIsNone)
{
  Scene scene;
  scene.background = Volume<float>(size, std::numeric_limits<float>::quiet_NaN());
  const Volume<unsigned char> result = scene.Run({5.0, false, 3.0});
  EXPECT_EQ(result.View()(3, 3, 3), 0);
  EXPECT_EQ(scene.labels.View()(3, 3, 3), static_cast<unsigned char>(EmbeddedVoxel::Outside));
  EXPECT_EQ(result.View()(21, 3, 3), scene.data.View()(21, 3, 3));
}

TEST(Feather, IntegersAreRoundedAndClamped)
{
  Scene scene;
  scene.background = Volume<float>(size, -12.0f);
  EXPECT_EQ(scene.Run({0.0, false, 3.0}).View()(3, 3, 3), 0);
  scene.background = Volume<float>(size, 300.0f);
  EXPECT_EQ(scene.Run({0.0, false, 3.0}).View()(3, 3, 3), 255);
  scene.background = Volume<float>(size, 12.5f);
  EXPECT_EQ(scene.Run({0.0, false, 3.0}).View()(3, 3, 3), 13);
}

TEST(Feather, RefusesBadInput)
{
  Scene scene;
  EXPECT_THROW(scene.Run({-1.0, true, 3.0}), Error);
  EXPECT_THROW(scene.Run({std::numeric_limits<double>::quiet_NaN(), true, 3.0}), Error);
  EXPECT_THROW(scene.Run({1.0, true, 0.0}), Error);
  scene.background = Volume<float>({4, 4, 4});
  EXPECT_THROW(scene.Run({1.0, true, 3.0}), Error);
}

TEST(Feather, ItsDepthFollowsTheResolution)
{
  const Eigen::Vector3d fine(0.2, 0.2, 0.25);
  EXPECT_DOUBLE_EQ(FeatherDepth(0.45, fine), 0.9);
  EXPECT_DOUBLE_EQ(FeatherDepth(0.1, fine), 0.6); // never less than three voxels
  EXPECT_DOUBLE_EQ(FeatherDepth(0.0, fine), 0.8); // not known
  EXPECT_DOUBLE_EQ(FeatherDepth(1.8, {0.8, 0.8, 0.8}), 3.0);
  EXPECT_DOUBLE_EQ(FeatherDepth(0.0, {2.0, 2.0, 2.0}), 3.0);
}

} // namespace echorama
