// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/Embed.h"
#include "Filters/Embedding/LocalStatistics.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {

namespace {

const Eigen::Vector3d spacing(1.0, 1.0, 1.0);
constexpr std::array<int, 3> size{84, 72, 60};

// Data in an ellipsoid, brighter towards +x and of more contrast there, in a fan-like form that leaves the corners out.
template <class T>
struct Scene {
  Volume<unsigned char> region, form, labels;
  Volume<float> noise;
  Volume<T> data;

  explicit Scene(const std::array<int, 3>& n = size) : region(n), form(n), labels(n, 9), noise(n), data(n)
  {
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          Random random(4, static_cast<std::uint64_t>((k * n[1] + j) * n[0] + i));
          const Eigen::Vector3d at(2.0 * i / (n[0] - 1) - 1.0, 2.0 * j / (n[1] - 1) - 1.0,
                                   n[2] > 1 ? 2.0 * k / (n[2] - 1) - 1.0 : 0.0);
          region.View()(i, j, k) = at.norm() < 0.7;
          form.View()(i, j, k) = std::abs(at[0]) + std::abs(at[1]) < 1.6;
          if (region.View()(i, j, k)) {
            const double mean = 90.0 + 50.0 * at[0];
            data.View()(i, j, k) = static_cast<T>(mean * (1.0 + 0.2 * std::sqrt(3.0) * random.Uniform(-1.0, 1.0)));
          }
          noise.View()(i, j, k) = static_cast<float>(10.0 + 3.0 * random.Normal());
        }
  }

  Volume<T> Run(const EmbedParameters& parameters, const Progress& progress = {})
  {
    Volume<T> result = data;
    Volume<float> background = noise;
    Embed<T>(parameters, region.View(), spacing, background.View(), form.View(), result.View(), labels.View(), progress);
    return result;
  }
  EmbeddedVoxel LabelAt(std::ptrdiff_t at) const { return static_cast<EmbeddedVoxel>(labels.View()[at]); }
};

template <class T>
void CheckTruth()
{
  Scene<T> scene;
  for (const double feather : {0.0, 4.0}) {
    EmbedParameters parameters;
    parameters.featherMm = feather;
    const Volume<T> result = scene.Run(parameters);
    for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at) {
      const EmbeddedVoxel label = scene.LabelAt(at);
      if (scene.region.View()[at]) {
        ASSERT_TRUE(label == EmbeddedVoxel::Data || (feather > 0.0 && label == EmbeddedVoxel::Blend));
      } else {
        ASSERT_EQ(label, scene.form.View()[at] ? EmbeddedVoxel::Invented : EmbeddedVoxel::Outside);
      }
      if (label == EmbeddedVoxel::Data) {
        ASSERT_EQ(result.View()[at], scene.data.View()[at]);
      }
      if (label == EmbeddedVoxel::Outside) {
        ASSERT_EQ(result.View()[at], T(0));
      }
    }
  }
}

} // namespace

TEST(Embed, DataAreUntouchedAndLabelsTellTheTruth)
{
  CheckTruth<unsigned char>();
  CheckTruth<unsigned short>();
  CheckTruth<float>();
}

// A shell of the background beside the data has their mean and contrast, wherever one looks; the noise had neither.
TEST(Embed, BackgroundLooksAsTheDataBesideIt)
{
  Scene<unsigned char> scene;
  EmbedParameters parameters;
  parameters.featherMm = 2.0;
  const Volume<unsigned char> result = scene.Run(parameters);
  Volume<unsigned char> invented(size);
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at)
    invented.View()[at] = scene.LabelAt(at) == EmbeddedVoxel::Invented;
  const LocalStatistics outside(VolumeView<const unsigned char>(result.View()), invented.View(), spacing, 3.0);
  const LocalStatistics inside(VolumeView<const unsigned char>(scene.data.View()), scene.region.View(), spacing, 3.0);
  int places = 0;
  for (int k = 10; k < 50; k += 8)
    for (int j = 8; j < 64; j += 8)
      for (int i = 1; i < size[0] - 1; ++i) // where the row crosses the border
        if (scene.region.View()(i, j, k) != scene.region.View()(i + 1, j, k)) {
          float mean[2], deviation[2];
          inside.Row(j, k, i, i + 1, &mean[0], &deviation[0]);
          outside.Row(j, k, i, i + 1, &mean[1], &deviation[1]);
          EXPECT_NEAR(mean[1], mean[0], 9.0) << i << " " << j << " " << k;
          EXPECT_NEAR(deviation[1], deviation[0], 0.2 * deviation[0]) << i << " " << j << " " << k;
          ++places;
        }
  EXPECT_GT(places, 40);
}

TEST(Embed, WithoutContrastTheNoiseKeepsItsOwn)
{
  Scene<float> scene;
  EmbedParameters parameters;
  parameters.matchContrast = false; // mean 10, deviation 3: a contrast of 0.3
  const Volume<float> result = scene.Run(parameters);
  const LocalStatistics all(VolumeView<const float>(result.View()), scene.form.View(), spacing, 3.0);
  float mean = 0.0f, deviation = 0.0f;
  all.Row(36, 4, 42, 43, &mean, &deviation); // beyond the data, above their middle
  EXPECT_NEAR(mean, 90.0f, 9.0f);
  EXPECT_NEAR(deviation / mean, 0.3f, 0.05f);
}

TEST(Embed, ConstantInConstantOut)
{
  for (const double exponent : {1.0, 4.0, 64.0}) {
    Scene<float> scene;
    for (std::ptrdiff_t at = 0; at < scene.data.View().Size(); ++at)
      scene.data.View()[at] = scene.region.View()[at] ? 77.25f : 0.0f;
    EmbedParameters parameters;
    parameters.diffusion.insideExponent = parameters.diffusion.outsideExponent = exponent;
    const Volume<float> result = scene.Run(parameters);
    for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at)
      ASSERT_NEAR(result.View()[at], scene.LabelAt(at) == EmbeddedVoxel::Outside ? 0.0f : 77.25f, 77.25e-6f);
  }
}

TEST(Embed, AnechoicDataAtTheBorderStayDark)
{
  Scene<unsigned char> scene;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = size[0] / 2; i < size[0]; ++i)
        scene.data.View()(i, j, k) = 0; // zero, and valid
  const Volume<unsigned char> result = scene.Run({});
  double dark = 0.0, bright = 0.0, count = 0.0;
  for (int k = 26; k < 34; ++k)
    for (int j = 32; j < 40; ++j)
      for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(scene.labels.View()(size[0] - 3 - i, j, k), static_cast<unsigned char>(EmbeddedVoxel::Invented));
        dark += result.View()(size[0] - 3 - i, j, k);
        bright += result.View()(2 + i, j, k);
        count += 1.0;
      }
  EXPECT_LT(dark / count, 3.0); // what is bright on the other side is heard a little (d = 4)
  EXPECT_GT(bright / count, 35.0);
}

// A wall that runs out of dark data: it ends there, and does not light up the background around it.
TEST(Embed, AWallDoesNotMakeTheBackgroundBright)
{
  Scene<unsigned char> scene;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (scene.region.View()(i, j, k)) {
          Random random(5, static_cast<std::uint64_t>((k * size[1] + j) * size[0] + i));
          scene.data.View()(i, j, k) = static_cast<unsigned char>(j == 36 || j == 37 ? 200.0 : 8.0 + 4.0 * random.Uniform());
        }
  const Volume<unsigned char> result = scene.Run({});
  double beside = 0.0, count = 0.0;
  for (int k = 24; k < 36; ++k)
    for (int j = 30; j < 44; ++j)
      for (int i = 0; i < 10; ++i)
        if (scene.LabelAt(&result.View()(i, j, k) - result.View().Data()) == EmbeddedVoxel::Invented) {
          beside += result.View()(i, j, k);
          count += 1.0;
        }
  ASSERT_GT(count, 800.0);
  EXPECT_NEAR(beside / count, 10.0, 4.0); // the mean of the data there is 40
}

TEST(Embed, HolesIslandsAndAThinShell)
{
  Scene<unsigned short> scene;
  scene.region.View()(42, 36, 30) = 0; // a hole of one voxel
  for (int k = 20; k < 26; ++k)
    for (int j = 30; j < 36; ++j)
      for (int i = 40; i < 46; ++i)
        scene.region.View()(i, j, k) = 0;
  scene.region.View()(4, 36, 30) = 1; // an island of one
  scene.data.View()(4, 36, 30) = 500;
  Volume<unsigned short> result = scene.Run({});
  EXPECT_EQ(scene.labels.View()(42, 36, 30), static_cast<unsigned char>(EmbeddedVoxel::Invented));
  EXPECT_NEAR(result.View()(42, 33, 23), 90, 60);
  EXPECT_EQ(scene.labels.View()(4, 36, 30), static_cast<unsigned char>(EmbeddedVoxel::Blend));

  // A hole that is smaller than a block of the diffusion is filled from its own walls, not from the border of the data.
  Scene<float> core;
  for (std::ptrdiff_t at = 0; at < core.data.View().Size(); ++at)
    core.data.View()[at] = core.region.View()[at] ? 30.0f : 0.0f;
  for (int k = 18; k < 42; ++k)
    for (int j = 24; j < 48; ++j)
      for (int i = 30; i < 54; ++i)
        core.data.View()(i, j, k) = 150.0f;
  core.region.View()(42, 36, 30) = 0;
  EXPECT_NEAR(core.Run({}).View()(42, 36, 30), 150.0f, 8.0f);

  Scene<unsigned char> shell;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        shell.region.View()(i, j, k) = k == 30;
  for (std::ptrdiff_t at = 0; at < shell.data.View().Size(); ++at)
    shell.data.View()[at] = shell.region.View()[at] ? 120 : 0;
  const Volume<unsigned char> filled = shell.Run({});
  EXPECT_EQ(filled.View()(40, 30, 5), 120);
  EXPECT_EQ(shell.labels.View()(40, 30, 30), static_cast<unsigned char>(EmbeddedVoxel::Blend));
}

TEST(Embed, OneVoxelAndNone)
{
  ECHORAMA_SKIP_SANITIZED();
  Scene<unsigned char> scene;
  scene.region = Volume<unsigned char>(size);
  try {
    scene.Run({});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    EXPECT_NE(std::string(error.what()).find("no voxel of the data is valid"), std::string::npos);
  }
  scene.region.View()(42, 36, 30) = 1;
  scene.data.View()(42, 36, 30) = 33;
  const Volume<unsigned char> result = scene.Run({});
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at)
    ASSERT_EQ(result.View()[at], scene.form.View()[at] ? 33 : 0);
}

TEST(Embed, DataWhereverTheFormIs)
{
  ECHORAMA_SKIP_SANITIZED();
  Scene<unsigned char> scene;
  scene.region = Volume<unsigned char>(size, 1);
  const Volume<unsigned char> result = scene.Run({});
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at)
    ASSERT_EQ(result.View()[at], scene.data.View()[at]);
}

TEST(Embed, ASingleSlice)
{
  Scene<unsigned char> scene({90, 80, 1});
  const Volume<unsigned char> result = scene.Run({});
  double sum = 0.0, count = 0.0;
  for (int i = 36; i < 54; ++i)
    for (int j = 2; j < 10; ++j) {
      ASSERT_EQ(scene.labels.View()(i, j, 0), static_cast<unsigned char>(EmbeddedVoxel::Invented));
      sum += result.View()(i, j, 0);
      count += 1.0;
    }
  EXPECT_NEAR(sum / count, 90.0, 10.0);
}

TEST(Embed, AFeatherLargerThanTheDataAndHugeExponents)
{
  Scene<float> scene;
  EmbedParameters parameters;
  parameters.featherMm = 1e6;
  parameters.diffusion.insideExponent = parameters.diffusion.outsideExponent = 64.0;
  const Volume<float> result = scene.Run(parameters);
  for (std::ptrdiff_t at = 0; at < result.View().Size(); ++at) {
    ASSERT_TRUE(std::isfinite(result.View()[at]));
    ASSERT_NE(scene.LabelAt(at), EmbeddedVoxel::Data);
  }
}

TEST(Embed, NoiseThatIsNoneGivesASmoothBackground)
{
  Scene<float> scene;
  scene.noise = Volume<float>(size);
  scene.noise.View()(3, 36, 30) = std::numeric_limits<float>::quiet_NaN();
  const Volume<float> result = scene.Run({});
  EXPECT_NEAR(result.View()(3, 36, 30), result.View()(4, 36, 30), 1.0f);
  EXPECT_NEAR(result.View()(3, 36, 30), 58.0f, 10.0f);
}

TEST(Embed, DoesNotDependOnThreads)
{
  ECHORAMA_SKIP_SANITIZED();
  Scene<float> scene;
  const Volume<float> many = scene.Run({});
  const ThreadLimit one(1);
  const Volume<float> single = scene.Run({});
  EXPECT_TRUE(std::equal(many.View().begin(), many.View().end(), single.View().begin()));
}

TEST(Embed, StopsOnRequestAndRefusesBadParameters)
{
  Scene<unsigned char> scene;
  double last = 0.0;
  EXPECT_THROW(scene.Run({}, Progress([&last](double fraction) {
                           last = fraction;
                           return fraction < 0.6;
                         })),
               Error);
  EXPECT_GE(last, 0.6);
  for (const auto& [change, name] : std::vector<std::pair<void (*)(EmbedParameters&), std::string>>{
           {[](EmbedParameters& p) { p.featherMm = -1.0; }, "FeatherMm"},
           {[](EmbedParameters& p) { p.smoothMm = 0.0; }, "SmoothMm"},
           {[](EmbedParameters& p) { p.diffusionVoxels = 0; }, "DiffusionVoxels"},
           {[](EmbedParameters& p) { p.diffusion.outsideExponent = 0.5; }, "OutsideExponent"}}) {
    EmbedParameters parameters;
    change(parameters);
    try {
      scene.Run(parameters);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
  scene.form = Volume<unsigned char>({3, 3, 3}, 1);
  EXPECT_THROW(scene.Run({}), Error);
}

} // namespace echorama
