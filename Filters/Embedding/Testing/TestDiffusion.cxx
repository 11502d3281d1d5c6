// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/Diffusion.h"
#include "Filters/Embedding/RegionSurface.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Grid = std::array<int, 3>;
using Shape = std::function<bool(double x, double y, double z)>; // voxel indices

const Eigen::Vector3d kUnit = Eigen::Vector3d::Ones();

Volume<unsigned char> Region(const Grid& grid, const Shape& shape)
{
  Volume<unsigned char> region(grid, 0);
  for (int k = 0; k < grid[2]; ++k)
    for (int j = 0; j < grid[1]; ++j)
      for (int i = 0; i < grid[0]; ++i)
        region.View()(i, j, k) = shape(i, j, k) ? 1 : 0;
  return region;
}

// White noise on the surface of a region: nothing varies faster.
DiffusionSources Noise(std::vector<Grid> voxels, int channels = 1, std::uint64_t seed = 7)
{
  DiffusionSources sources;
  sources.voxels = std::move(voxels);
  sources.channels = channels;
  Random random(seed);
  for (std::size_t s = 0; s < sources.voxels.size() * static_cast<std::size_t>(channels); ++s)
    sources.values.push_back(static_cast<float>(random.Uniform(0.0, 255.0)));
  return sources;
}

std::vector<Volume<float>> Diffused(const DiffusionParameters& parameters, const DiffusionSources& sources, const Grid& grid,
                                    const Eigen::Vector3d& spacing = kUnit, VolumeView<const unsigned char> region = {},
                                    VolumeView<const unsigned char> wanted = {}, float start = -1.0f)
{
  std::vector<Volume<float>> results(static_cast<std::size_t>(sources.channels), Volume<float>(grid, start));
  std::vector<VolumeView<float>> views;
  for (auto& result : results)
    views.push_back(result.View());
  Diffuse(parameters, sources, spacing, region, wanted, views);
  return results;
}

DiffusionParameters Exponents(double inside, double outside, bool exact = false)
{
  DiffusionParameters parameters;
  parameters.insideExponent = inside;
  parameters.outsideExponent = outside;
  parameters.exact = exact;
  return parameters;
}

double Naive(const DiffusionSources& sources, const Eigen::Vector3d& spacing, const Grid& at, double d)
{
  double nearest = std::numeric_limits<double>::infinity(), above = 0.0, below = 0.0;
  std::vector<double> distances;
  for (const Grid& voxel : sources.voxels) {
    distances.push_back(Eigen::Vector3d(at[0] - voxel[0], at[1] - voxel[1], at[2] - voxel[2]).cwiseProduct(spacing).norm());
    nearest = std::min(nearest, distances.back());
  }
  for (std::size_t s = 0; s < distances.size(); ++s) {
    if (distances[s] == 0.0)
      return static_cast<double>(sources.values[s]);
    const double weight = std::pow(nearest / distances[s], d);
    above += weight * static_cast<double>(sources.values[s]);
    below += weight;
  }
  return above / below;
}

double Largest(const Volume<float>& a, const Volume<float>& b)
{
  double largest = 0.0;
  for (std::ptrdiff_t at = 0; at < a.View().Size(); ++at) {
    const double difference = std::abs(static_cast<double>(a.View()[at]) - static_cast<double>(b.View()[at]));
    largest = std::isfinite(difference) ? std::max(largest, difference) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

Shape Ball(double x0, double y0, double z0, double radius)
{
  return [=](double x, double y, double z) { return std::hypot(x - x0, y - y0, z - z0) <= radius; };
}

struct Scene {
  const char* name;
  Grid grid;
  Eigen::Vector3d spacing;
  Shape shape;
};

std::vector<Scene> Scenes()
{
  const Grid cube{48, 48, 48};
  const Shape ball = Ball(24, 23, 22, 13), hole = Ball(27, 22, 24, 6), island = Ball(43, 43, 40, 3);
  return {
      {"a ball with a hole and an island", cube, kUnit,
       [=](double x, double y, double z) { return (ball(x, y, z) && !hole(x, y, z)) || island(x, y, z); }},
      {"a thin shell", cube, kUnit,
       [](double x, double y, double z) { return std::abs(std::hypot(x - 24, y - 24, z - 24) - 17) < 0.9; }},
      {"touching the border", cube, kUnit, Ball(2, 45, 24, 15)},
      {"filling the grid", {40, 44, 48}, kUnit, [](double, double, double) { return true; }},
      {"long voxels",
       {64, 50, 21},
       {0.3, 0.35, 1.1},
       [](double x, double y, double z) { return std::hypot(0.3 * x - 9, 0.35 * y - 8, 1.1 * z - 11) < 5.5; }},
      {"a few slices", {90, 80, 4}, {1, 1, 2}, Ball(40, 45, 1, 22)},
      {"one slice",
       {150, 120, 1},
       {0.5, 0.5, 3},
       [](double x, double y, double) { return std::hypot(x - 70, y - 50) < 30 && std::hypot(x - 60, y - 50) > 9; }},
      {"one row", {300, 1, 1}, kUnit, [](double x, double, double) { return x > 100 && x < 140; }},
  };
}

} // namespace

TEST(Diffusion, ExactIsTheSum)
{
  const Grid grid{11, 9, 8};
  const Eigen::Vector3d spacing(0.4, 0.7, 1.3);
  const Volume<unsigned char> region = Region(grid, Ball(5, 4, 4, 2.6));
  const DiffusionSources sources = Noise(SurfaceOf(region.View()));
  for (const double d : {1.0, 2.0, 3.5, 4.0, 5.0, 6.0, 8.0, 16.0, 32.0, 64.0}) {
    const auto result = Diffused(Exponents(d, d, true), sources, grid, spacing);
    for (int k = 0; k < grid[2]; ++k)
      for (int j = 0; j < grid[1]; ++j)
        for (int i = 0; i < grid[0]; ++i)
          ASSERT_NEAR(result[0].View()(i, j, k), Naive(sources, spacing, {i, j, k}, d), 2e-3)
              << "d = " << d << " at " << i << " " << j << " " << k;
  }
}

TEST(Diffusion, FastAgreesWithExactForAllShapes)
{
  for (const Scene& scene : Scenes())
    for (const double d : {4.0, 6.0}) {
      const Volume<unsigned char> region = Region(scene.grid, scene.shape);
      const DiffusionSources sources = Noise(SurfaceOf(region.View()));
      const auto exact = Diffused(Exponents(d, d, true), sources, scene.grid, scene.spacing);
      const auto fast = Diffused(Exponents(d, d), sources, scene.grid, scene.spacing);
      EXPECT_LT(Largest(exact[0], fast[0]), 0.5) << scene.name << ", d = " << d << ", " << sources.voxels.size() << " sources";
    }
}

TEST(Diffusion, FastAgreesWithExactForAllExponents)
{
  ECHORAMA_SKIP_SANITIZED();
  const Grid grid{56, 56, 56};
  const Volume<unsigned char> region = Region(grid, Ball(26, 27, 30, 14));
  const DiffusionSources sources = Noise(SurfaceOf(region.View()));
  for (const double d : {1.0, 2.0, 3.5, 8.0, 16.0, 32.0, 64.0})
    EXPECT_LT(Largest(Diffused(Exponents(d, d, true), sources, grid)[0], Diffused(Exponents(d, d), sources, grid)[0]), 0.75)
        << "d = " << d;
}

TEST(Diffusion, FastAgreesWithExactForScatteredSources)
{
  const Grid grid{60, 50, 40};
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{30}, std::size_t{700}, std::size_t{4000}}) {
    Volume<unsigned char> taken(grid, 0);
    std::vector<Grid> voxels;
    Random random(3);
    while (voxels.size() < count) {
      const Grid voxel{static_cast<int>(random.Below(60)), static_cast<int>(random.Below(50)),
                       static_cast<int>(random.Below(40))};
      if (!taken.View()(voxel[0], voxel[1], voxel[2]))
        voxels.push_back(voxel);
      taken.View()(voxel[0], voxel[1], voxel[2]) = 1;
    }
    const DiffusionSources sources = Noise(std::move(voxels));
    EXPECT_LT(Largest(Diffused(Exponents(4, 4, true), sources, grid)[0], Diffused(Exponents(4, 4), sources, grid)[0]), 0.5)
        << count << " sources";
  }
}

TEST(Diffusion, AccuracyIsHeeded)
{
  ECHORAMA_SKIP_SANITIZED();
  const Grid grid{64, 64, 64};
  const Volume<unsigned char> region = Region(grid, Ball(30, 32, 31, 17));
  const DiffusionSources sources = Noise(SurfaceOf(region.View()));
  const auto exact = Diffused(Exponents(4, 4, true), sources, grid);
  for (const double accuracy : {0.02, 0.002, 0.0002}) {
    DiffusionParameters parameters = Exponents(4, 4);
    parameters.accuracy = accuracy;
    EXPECT_LT(Largest(exact[0], Diffused(parameters, sources, grid)[0]), 255.0 * accuracy);
  }
}

TEST(Diffusion, EachSideHasItsExponent)
{
  // The jump of the exponent is far from the sources, so lattices that mixed the two would show.
  const Grid grid{64, 64, 64};
  const DiffusionSources sources = Noise(SurfaceOf(Region(grid, Ball(12, 32, 32, 8)).View()));
  const Volume<unsigned char> region = Region(grid, [](double x, double y, double) { return x + 0.3 * y > 45; });
  const auto mixed = Diffused(Exponents(6, 2), sources, grid, kUnit, region.View());
  const auto six = Diffused(Exponents(6, 6, true), sources, grid), two = Diffused(Exponents(2, 2, true), sources, grid);
  for (std::ptrdiff_t at = 0; at < region.View().Size(); ++at)
    ASSERT_NEAR(mixed[0].View()[at], (region.View()[at] ? six : two)[0].View()[at], 0.5);
}

TEST(Diffusion, ConstantsStay)
{
  ECHORAMA_SKIP_SANITIZED();
  const Grid grid{50, 40, 30};
  const Volume<unsigned char> region = Region(grid, Ball(25, 20, 15, 9));
  DiffusionSources sources = Noise(SurfaceOf(region.View()));
  for (const float constant : {0.0f, 97.3f, -1e-3f, 6e4f}) {
    std::fill(sources.values.begin(), sources.values.end(), constant);
    for (const bool exact : {false, true})
      for (const double d : {1.0, 3.5, 6.0, 64.0}) {
        const auto result = Diffused(Exponents(d, d, exact), sources, grid);
        for (const float value : result[0].View())
          ASSERT_EQ(value, constant);
      }
  }
}

TEST(Diffusion, HugeExponentsAreTheNearestSource)
{
  const Grid grid{40, 12, 12};
  DiffusionSources sources;
  sources.voxels = {{3, 6, 6}, {30, 5, 6}};
  sources.values = {10.0f, 200.0f};
  const auto result = Diffused(Exponents(64, 64), sources, grid);
  for (const int i : {0, 5, 12})
    EXPECT_NEAR(result[0].View()(i, 6, 6), 10.0f, 1e-2f);
  for (const int i : {22, 27, 39})
    EXPECT_NEAR(result[0].View()(i, 6, 6), 200.0f, 1e-2f);
}

TEST(Diffusion, SourcesKeepTheirValuesAndNothingLeavesTheRange)
{
  for (const Scene& scene : Scenes()) {
    const Volume<unsigned char> region = Region(scene.grid, scene.shape);
    const DiffusionSources sources = Noise(SurfaceOf(region.View()));
    const auto result = Diffused(Exponents(6, 4), sources, scene.grid, scene.spacing, region.View());
    for (std::size_t s = 0; s < sources.voxels.size(); ++s)
      ASSERT_EQ(result[0].View()(sources.voxels[s][0], sources.voxels[s][1], sources.voxels[s][2]), sources.values[s]);
    const auto [least, most] = std::minmax_element(sources.values.begin(), sources.values.end());
    for (const float value : result[0].View())
      ASSERT_TRUE(value >= *least && value <= *most) << scene.name;
  }
}

TEST(Diffusion, ThreadsDoNotMatter)
{
  const Grid grid{50, 45, 40};
  const Volume<unsigned char> region = Region(grid, Ball(22, 20, 18, 11));
  const DiffusionSources sources = Noise(SurfaceOf(region.View()));
  const auto many = Diffused(Exponents(6, 4), sources, grid, kUnit, region.View());
  const ThreadLimit one(1);
  EXPECT_EQ(Largest(many[0], Diffused(Exponents(6, 4), sources, grid, kUnit, region.View())[0]), 0.0);
}

TEST(Diffusion, ChannelsAgreeWithSingleRuns)
{
  const Grid grid{45, 40, 36};
  const Volume<unsigned char> region = Region(grid, Ball(22, 20, 18, 10));
  const DiffusionSources all = Noise(SurfaceOf(region.View()), 4);
  for (const bool exact : {false, true}) {
    const auto together = Diffused(Exponents(6, 4, exact), all, grid, kUnit, region.View());
    for (std::size_t channel = 0; channel < 4; ++channel) {
      DiffusionSources one;
      one.voxels = all.voxels;
      const auto begin = all.values.begin() + static_cast<std::ptrdiff_t>(channel * all.voxels.size());
      one.values.assign(begin, begin + static_cast<std::ptrdiff_t>(all.voxels.size()));
      EXPECT_EQ(Largest(together[channel], Diffused(Exponents(6, 4, exact), one, grid, kUnit, region.View())[0]), 0.0);
    }
  }
}

TEST(Diffusion, OnlyWantedVoxelsAreTouched)
{
  const Grid grid{60, 50, 40};
  const Volume<unsigned char> region = Region(grid, Ball(25, 20, 18, 11));
  const DiffusionSources sources = Noise(SurfaceOf(region.View()));
  const Volume<unsigned char> wanted =
      Region(grid, [](double x, double y, double z) { return x > 48 || (y < 9 && z > 20) || (std::fmod(x + y + z, 7) == 0); });
  const auto all = Diffused(Exponents(6, 4), sources, grid, kUnit, region.View());
  const auto some = Diffused(Exponents(6, 4), sources, grid, kUnit, region.View(), wanted.View(), -3.0f);
  for (std::ptrdiff_t at = 0; at < wanted.View().Size(); ++at)
    if (wanted.View()[at])
      ASSERT_NEAR(some[0].View()[at], all[0].View()[at], 0.5);
    else
      ASSERT_EQ(some[0].View()[at], -3.0f);
}

TEST(Diffusion, BadInputIsNamed)
{
  const Grid grid{8, 8, 8};
  const auto kind = [&](DiffusionParameters parameters, const DiffusionSources& sources, const Eigen::Vector3d& spacing = kUnit,
                        VolumeView<const unsigned char> region = {}) {
    try {
      Diffused(parameters, sources, grid, spacing, region);
    } catch (const Error& error) {
      return error.GetKind();
    }
    return Error::Kind::Cancelled;
  };
  const DiffusionSources good = Noise({{1, 2, 3}, {4, 5, 6}});
  const auto changed = [&good](const std::function<void(DiffusionSources&)>& change) {
    DiffusionSources sources = good;
    change(sources);
    return sources;
  };
  using Kind = Error::Kind;
  EXPECT_EQ(kind(Exponents(0.5, 4), good), Kind::InvalidParameter);
  EXPECT_EQ(kind(Exponents(6, 65), good), Kind::InvalidParameter);
  EXPECT_EQ(kind(Exponents(6, std::nan("")), good), Kind::InvalidParameter);
  DiffusionParameters sloppy;
  sloppy.accuracy = 0.0;
  EXPECT_EQ(kind(sloppy, good), Kind::InvalidParameter);
  EXPECT_EQ(kind({}, good, {1, 0, 1}), Kind::InvalidParameter);
  EXPECT_EQ(kind({}, changed([](DiffusionSources& s) { s.channels = 5; })), Kind::InvalidParameter);
  EXPECT_EQ(kind({}, {}), Kind::BadInput);
  EXPECT_EQ(kind({}, changed([](DiffusionSources& s) { s.values.pop_back(); })), Kind::BadInput);
  EXPECT_EQ(kind({}, changed([](DiffusionSources& s) { s.values[0] = std::nanf(""); })), Kind::BadInput);
  EXPECT_EQ(kind({}, changed([](DiffusionSources& s) { s.voxels[1] = {4, 8, 6}; })), Kind::BadInput);
  EXPECT_EQ(kind({}, changed([](DiffusionSources& s) { s.voxels[1] = s.voxels[0]; })), Kind::BadInput);
  const Volume<unsigned char> other({8, 8, 9});
  EXPECT_EQ(kind({}, good, kUnit, other.View()), Kind::BadInput);
  EXPECT_THROW(Diffuse({}, good, kUnit, {}, {}, {}), Error);
}

TEST(Diffusion, CanBeStopped)
{
  const Grid grid{40, 40, 40};
  const DiffusionSources sources = Noise(SurfaceOf(Region(grid, Ball(20, 20, 20, 10)).View()));
  for (const double stop : {0.0, 0.04, 0.2, 0.5}) {
    double last = 0.0;
    Volume<float> result(grid);
    try {
      Diffuse({}, sources, kUnit, {}, {}, {result.View()}, Progress([&](double fraction) {
                EXPECT_GE(fraction, last);
                last = fraction;
                return fraction < stop;
              }));
      FAIL() << "it went on after " << stop;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
    }
  }
}
