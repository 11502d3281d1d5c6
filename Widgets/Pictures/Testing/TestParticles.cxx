// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Widgets/Pictures/Particles.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {
namespace {

// Odd sizes, so that the last blocks are cut; an oblique grid; a third of the voxels is not real.
template <class T>
struct Scene {
  std::array<int, 3> n{13, 10, 7};
  Volume<T> intensity{n};
  Volume<unsigned char> valid{n, 1};
  ImageGeometry geometry;

  Scene()
  {
    Random random(11);
    for (T& voxel : intensity.View())
      voxel = static_cast<T>(random.Below(200));
    for (unsigned char& real : valid.View())
      real = random.Below(3) != 0;
    for (int k = 0; k < 3; ++k) // one block of 3 without any
      for (int j = 3; j < 6; ++j)
        for (int i = 6; i < 9; ++i)
          valid.View()(i, j, k) = 0;
    geometry.dimensions = n;
    geometry.spacing = {0.5, 0.7, 1.1};
    geometry.origin = {10.0, -20.0, 30.0};
    geometry.direction = ExpRotation({0.3, -0.2, 0.5});
  }
  PosedVolume<T> Posed() const { return {intensity.View(), valid.View(), geometry}; }
};

// The same by the definition, block after block.
template <class T>
Particles ByForce(const PosedVolume<T>& volume, const ParticleParameters& p, int block)
{
  const auto& n = volume.intensity.Dimensions();
  Particles particles;
  for (int z = 0; z < n[2]; z += block)
    for (int y = 0; y < n[1]; y += block)
      for (int x = 0; x < n[0]; x += block) {
        double sum = 0.0;
        int real = 0, all = 0;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (int k = z; k < std::min(z + block, n[2]); ++k)
          for (int j = y; j < std::min(y + block, n[1]); ++j)
            for (int i = x; i < std::min(x + block, n[0]); ++i) {
              middle += Eigen::Vector3d(i, j, k);
              ++all;
              const double value = static_cast<double>(volume.intensity(i, j, k));
              if (volume.valid(i, j, k) != 0 && std::isfinite(value)) {
                sum += value;
                ++real;
              }
            }
        const double grey = sum / real;
        if (real == 0 || grey < p.minimum || grey > p.maximum)
          continue;
        const double value = std::round(std::clamp((grey - p.black) * (255.0 / (p.white - p.black)), 0.0, 255.0));
        const double one = p.valueOpacity ? p.opacity * value / 255.0 : p.opacity;
        const double layers = static_cast<double>(real) / (block * block * block) * (static_cast<double>(block) / p.downsampling);
        const double alpha = std::round(255.0 * (1.0 - std::pow(1.0 - one, layers)));
        if (alpha == 0.0)
          continue;
        const Eigen::Vector3d place = volume.geometry.IndexToWorld() * (middle / all);
        for (int axis = 0; axis < 3; ++axis)
          particles.positions.push_back(static_cast<float>(place[axis]));
        particles.values.push_back(static_cast<std::uint8_t>(value));
        particles.alphas.push_back(static_cast<std::uint8_t>(alpha));
      }
  return particles;
}

void ExpectSame(const Particles& a, const Particles& b)
{
  EXPECT_EQ(a.values, b.values);
  EXPECT_EQ(a.alphas, b.alphas);
  ASSERT_EQ(a.positions.size(), b.positions.size());
  for (std::size_t i = 0; i < a.positions.size(); ++i)
    ASSERT_NEAR(a.positions[i], b.positions[i], 1e-4) << i;
}

template <class T>
class ParticlesOf : public ::testing::Test {
};
using VoxelTypes = ::testing::Types<unsigned char, short, unsigned short, float, double>;
TYPED_TEST_SUITE(ParticlesOf, VoxelTypes);

TYPED_TEST(ParticlesOf, AreMeansOfBlocks)
{
  const Scene<TypeParam> scene;
  for (const int downsampling : {1, 2, 3, 5, 64})
    for (const int coarser : {0, 3})
      for (const bool byValue : {true, false}) {
        ParticleParameters p;
        p.downsampling = downsampling;
        p.block = coarser > 0 ? downsampling + coarser : 0;
        p.valueOpacity = byValue;
        p.minimum = 40.0;
        p.maximum = 150.0;
        p.black = 20.0;
        p.white = 140.0;
        const Particles particles = MakeParticles(scene.Posed(), p);
        ExpectSame(particles, ByForce(scene.Posed(), p, downsampling + coarser));
        EXPECT_EQ(particles.block, downsampling + coarser);
        EXPECT_NEAR(particles.sizeMm, (downsampling + coarser) * std::cbrt(0.5 * 0.7 * 1.1), 1e-4);
        EXPECT_EQ(particles.Count() > 0, downsampling < 64); // so little of so large a block is not seen
      }
}

TYPED_TEST(ParticlesOf, DisplayTheirBlocks)
{
  const Scene<TypeParam> scene;
  ParticleParameters p;
  p.downsampling = 1;
  p.opacity = 1.0;
  p.valueOpacity = false;
  p.minimum = 30.0;
  for (const int block : {1, 2, 3}) {
    p.block = block;
    const DisplayVolume display = MakeDisplayVolume(scene.Posed(), p);
    const Particles particles = ByForce(scene.Posed(), p, block);
    std::vector<std::uint8_t> shown;
    for (const unsigned char value : display.values.View())
      if (value > 0)
        shown.push_back(value);
    EXPECT_EQ(shown, particles.values); // none of them is black
    EXPECT_EQ(display.values.Dimensions(), (std::array<int, 3>{(12 + block) / block, (9 + block) / block, (6 + block) / block}));
    EXPECT_EQ(display.first, Eigen::Vector3d::Constant((block - 1) / 2.0));
  }
}

TEST(Particles, WithoutAValidRegionAndWithHoles)
{
  Scene<float> scene;
  PosedVolume<float> volume = scene.Posed();
  scene.valid = Volume<unsigned char>(scene.n, 1);
  for (std::ptrdiff_t i = 0; i < volume.intensity.Size(); i += 3)
    scene.intensity.View()[i] = i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
  const Particles wanted = ByForce(scene.Posed(), {}, 2);
  volume.valid = {};
  ExpectSame(MakeParticles(volume, {}), wanted);
}

// The look of a coarse level: as opaque as the layers that it stands for.
TEST(Particles, KeepTheOpacityOfWhatTheyStandFor)
{
  const Volume<unsigned char> grey({8, 8, 8}, 255);
  ImageGeometry geometry;
  geometry.dimensions = {8, 8, 8};
  ParticleParameters p;
  p.downsampling = 1;
  p.opacity = 0.2;
  const auto through = [](const Particles& particles, int layers) { // light that passes so many
    return std::pow(1.0 - particles.alphas[0] / 255.0, layers);
  };
  const Particles fine = MakeParticles<unsigned char>({grey.View(), {}, geometry}, p);
  p.block = 4;
  const Particles coarse = MakeParticles<unsigned char>({grey.View(), {}, geometry}, p);
  EXPECT_EQ(fine.Count(), 512u);
  EXPECT_EQ(coarse.Count(), 8u);
  EXPECT_NEAR(through(fine, 8), through(coarse, 2), 0.01);
}

TEST(Particles, StayWithinTheBudget)
{
  const Scene<short> scene;
  ParticleParameters p;
  p.downsampling = 1;
  p.minimum = 0.0;
  for (const int budget : {100000, 300, 50, 7, 1}) {
    p.budget = budget;
    const Particles particles = MakeParticles(scene.Posed(), p);
    EXPECT_LE(particles.Count(), static_cast<std::size_t>(budget));
    EXPECT_GT(particles.Count(), 0u);
    ExpectSame(particles, ByForce(scene.Posed(), p, particles.block));
    if (particles.block > 1) { // it is the next that fits, or one that the estimate gave: never less than an eighth
      EXPECT_GT(particles.Count() * 27, static_cast<std::size_t>(budget));
    }
  }
}

TEST(Particles, DoNotDependOnThreads)
{
  const Scene<float> scene;
  const Particles many = MakeParticles(scene.Posed(), {});
  const auto order = BackToFront({{&many.positions, {0.1, 0.2, 0.3}, 1.0}});
  const ThreadLimit one(1);
  const Particles few = MakeParticles(scene.Posed(), {});
  EXPECT_EQ(many.positions, few.positions);
  EXPECT_EQ(many.values, few.values);
  EXPECT_EQ(many.alphas, few.alphas);
  EXPECT_EQ(order, BackToFront({{&few.positions, {0.1, 0.2, 0.3}, 1.0}}));
}

TEST(Particles, Refuse)
{
  const Scene<short> scene;
  const auto with = [](auto change) {
    ParticleParameters p;
    change(p);
    return p;
  };
  for (const ParticleParameters& p : {with([](auto& q) { q.downsampling = 0; }), with([](auto& q) { q.downsampling = 65; }),
                                      with([](auto& q) { q.block = 1; }), with([](auto& q) { q.opacity = 1.5; }),
                                      with([](auto& q) { q.opacity = std::nan(""); }), with([](auto& q) { q.white = 0.0; }),
                                      with([](auto& q) { q.minimum = std::nan(""); }), with([](auto& q) { q.budget = 0; })})
    EXPECT_THROW(MakeParticles(scene.Posed(), p), Error);
  auto wrong = scene.Posed();
  wrong.geometry.dimensions = {13, 10, 8};
  EXPECT_THROW(MakeParticles(wrong, {}), Error);
}

TEST(Particles, LieInTheBoxOfWhatIsReal)
{
  Scene<float> scene;
  scene.valid = Volume<unsigned char>(scene.n, 0);
  EXPECT_TRUE(RealBox(scene.Posed()).isEmpty());
  scene.valid.View()(4, 7, 2) = scene.valid.View()(9, 3, 5) = scene.valid.View()(12, 9, 6) = 1;
  scene.intensity.View()(12, 9, 6) = std::nanf("");
  EXPECT_EQ(RealBox(scene.Posed()).min(), Eigen::Vector3i(4, 3, 2));
  EXPECT_EQ(RealBox(scene.Posed()).max(), Eigen::Vector3i(9, 7, 5));
}

TEST(Particles, AreEmptyWhereNothingIsReal)
{
  Scene<short> scene;
  scene.valid = Volume<unsigned char>(scene.n, 0);
  EXPECT_EQ(MakeParticles(scene.Posed(), {}).Count(), 0u);
  EXPECT_TRUE(BackToFront({}).empty());
  const std::vector<float> none;
  EXPECT_TRUE(BackToFront({{&none, {0, 0, 1}, 0.0}}).empty());
}

// Against a sort by the depths of the moved points.
TEST(Particles, OfSeveralVolumesAreSortedTogether)
{
  Random random(5);
  std::vector<std::vector<float>> sets(3);
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t i = 0; i < 3 * (1000 + 100 * s); ++i)
      sets[s].push_back(static_cast<float>(100.0 * random.Uniform()));
  const Eigen::Vector3d towards = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
  std::vector<ParticleDepths> depths;
  std::vector<double> wanted;
  for (std::size_t s = 0; s < 3; ++s) {
    const Pose pose = MotionAbout({1, 2, 3}, {0.2 * static_cast<double>(s), 0.3, -0.1}, {10, 20.0 * static_cast<double>(s), 30});
    depths.push_back({&sets[s], pose.linear().transpose() * towards, towards.dot(pose.translation())});
    for (std::size_t i = 0; i < sets[s].size(); i += 3)
      wanted.push_back(towards.dot(pose * Eigen::Vector3d(sets[s][i], sets[s][i + 1], sets[s][i + 2])));
  }
  const auto order = BackToFront(depths);
  ASSERT_EQ(order.size(), wanted.size());
  std::vector<int> seen(wanted.size(), 0);
  const auto [low, high] = std::minmax_element(wanted.begin(), wanted.end());
  const double step = (*high - *low) / 65535.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    ++seen[order[i]];
    if (i > 0) {
      EXPECT_GE(wanted[order[i]], wanted[order[i - 1]] - step - 1e-4);
    }
  }
  EXPECT_EQ(seen, std::vector<int>(wanted.size(), 1));
}

} // namespace
} // namespace echorama
