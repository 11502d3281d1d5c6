// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Embedding/LatticeNoise.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;

ImageGeometry Grid()
{
  ImageGeometry grid;
  grid.dimensions = {96, 80, 64};
  grid.spacing = {0.5, 0.6, 0.7};
  return grid;
}

struct Moments {
  double mean = 0.0, deviation = 0.0;
};

Moments MomentsOf(VolumeView<const float> noise)
{
  Moments m;
  for (float value : noise)
    m.mean += value / static_cast<double>(noise.Size());
  for (float value : noise)
    m.deviation += (value - m.mean) * (value - m.mean) / static_cast<double>(noise.Size());
  m.deviation = std::sqrt(m.deviation);
  return m;
}

double NeighbourCorrelation(VolumeView<const float> noise, const Moments& m)
{
  double sum = 0.0;
  for (std::ptrdiff_t i = 0; i + 1 < noise.Size(); ++i)
    sum += (noise[i] - m.mean) * (noise[i + 1] - m.mean);
  return sum / (m.deviation * m.deviation * static_cast<double>(noise.Size() - 1));
}

TEST(LatticeNoise, WhiteNoiseHasMeanAndDeviationAndNoGrain)
{
  const Volume<float> noise = MakeWhiteNoise({}, Grid().dimensions);
  const Moments m = MomentsOf(noise.View());
  EXPECT_NEAR(m.mean, 40.0, 0.15);
  EXPECT_NEAR(m.deviation, 20.0, 0.1);
  EXPECT_NEAR(NeighbourCorrelation(noise.View(), m), 0.0, 0.006);
}

TEST(LatticeNoise, PerlinNoiseHasMeanAndDeviationAndIsSmooth)
{
  LatticeNoiseParameters p;
  p.cellMm = 2.5;
  Moments mean;
  for (p.seed = 1; p.seed <= 4; ++p.seed) {
    const Volume<float> noise = MakePerlinNoise(p, Grid());
    const Moments m = MomentsOf(noise.View());
    mean.mean += 0.25 * m.mean;
    mean.deviation += 0.25 * m.deviation;
    EXPECT_GT(NeighbourCorrelation(noise.View(), m), 0.8);
  }
  EXPECT_NEAR(mean.mean, 40.0, 0.8);
  EXPECT_NEAR(mean.deviation, 20.0, 0.8);
}

TEST(LatticeNoise, OneOctaveOfPerlinNoiseIsTheMeanAtTheCornersOfItsCells)
{
  LatticeNoiseParameters p;
  p.octaves = 1;
  p.cellMm = 4.0;
  ImageGeometry grid = Grid();
  grid.spacing.setConstant(1.0);
  const Volume<float> noise = MakePerlinNoise(p, grid);
  for (int k = 0; k < 64; k += 4)
    for (int j = 0; j < 80; j += 4)
      for (int i = 0; i < 96; i += 4)
        EXPECT_EQ(noise.View()(i, j, k), 40.0f);
  EXPECT_NE(noise.View()(2, 1, 3), 40.0f);
}

TEST(LatticeNoise, DependsOnTheSeedAndNotOnThreads)
{
  const auto both = [](std::uint64_t seed, int threads) {
    const ThreadLimit limit(threads);
    LatticeNoiseParameters p;
    p.seed = seed;
    const Volume<float> white = MakeWhiteNoise(p, {20, 20, 20}), perlin = MakePerlinNoise(p, Grid());
    std::vector<float> all(white.View().begin(), white.View().end());
    all.insert(all.end(), perlin.View().begin(), perlin.View().end());
    return all;
  };
  EXPECT_EQ(both(1, 1), both(1, 2));
  EXPECT_NE(both(1, 1), both(2, 1));
}

TEST(LatticeNoise, RefusesWhatIsOutOfRange)
{
  const auto refused = [](const LatticeNoiseParameters& p, const std::string& name) {
    try {
      MakePerlinNoise(p, Grid());
      ADD_FAILURE() << name << " was not refused";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  };
  LatticeNoiseParameters p;
  p.cellMm = 0.6;
  refused(p, "cellMm");
  p = {};
  p.octaves = 0;
  refused(p, "Octaves");
  p = {};
  p.deviation = -1.0;
  refused(p, "Deviation");
  EXPECT_THROW(MakeWhiteNoise({}, {0, 1, 1}), Error);
  EXPECT_THROW(MakePerlinNoise({}, Grid(), Progress([](double) { return false; })), Error);
}

} // namespace
