// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/BeamNoise.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <string>

namespace {

using namespace echorama;

const ProbeGeometry convex = ProbeGeometry::Convex(1.1, 40.0, 0.9, 30.0, 0.0, 100.0);

BeamNoiseParameters Small(NoiseIntensity intensity = NoiseIntensity::Rayleigh)
{
  BeamNoiseParameters p;
  p.samples = 120;
  p.elements = 100;
  p.steps = 80;
  p.intensity = intensity;
  p.mean = intensity == NoiseIntensity::Rayleigh ? 1.0 : 40.0;
  p.depthCorrelationMm = p.fanCorrelation = p.sweepCorrelation = 0.0;
  return p;
}

// Lengths in samples of a volume of these counts.
BeamNoiseParameters WithLengths(BeamNoiseParameters p, double depth, double fan, double sweep)
{
  p.depthCorrelationMm = depth * (convex.depthMax - convex.depthMin) / (p.samples - 1);
  p.fanCorrelation = fan / (p.elements - 1);
  p.sweepCorrelation = sweep / (p.steps - 1);
  return p;
}

struct Moments {
  double mean = 0.0, deviation = 0.0;
};

Moments MomentsOf(VolumeView<const float> noise)
{
  double sum = 0.0, squares = 0.0;
  for (float value : noise) {
    sum += value;
    squares += static_cast<double>(value) * value;
  }
  const double mean = sum / static_cast<double>(noise.Size());
  return {mean, std::sqrt(squares / static_cast<double>(noise.Size()) - mean * mean)};
}

// Of the squares, whose mean is known to be \a power.
double Correlation(VolumeView<const float> noise, int axis, int lag, double power)
{
  std::array<int, 3> shift{0, 0, 0};
  shift[static_cast<std::size_t>(axis)] = lag;
  const auto& n = noise.Dimensions();
  double products = 0.0, squares = 0.0;
  for (int k = 0; k + shift[2] < n[2]; ++k)
    for (int j = 0; j + shift[1] < n[1]; ++j)
      for (int i = 0; i + shift[0] < n[0]; ++i) {
        const double a = noise(i, j, k), b = noise(i + shift[0], j + shift[1], k + shift[2]);
        products += (a * a - power) * (b * b - power);
        squares += 0.5 * ((a * a - power) * (a * a - power) + (b * b - power) * (b * b - power));
      }
  return products / squares;
}

void ExpectRefused(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry, const std::string& name)
{
  try {
    MakeBeamNoise(parameters, geometry);
    ADD_FAILURE() << name << " was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

// The envelope of fully developed speckle: mean sqrt(pi / 2), deviation sqrt(2 - pi / 2) of unit normals; their quotient is
// 1.913, and each probability is 1 - exp(-r^2 / 2).
TEST(BeamNoise, IsRayleighDistributed)
{
  for (const double length : {0.0, 2.0}) {
    const Volume<float> noise = MakeBeamNoise(WithLengths(Small(), length, length, length), convex);
    const Moments moments = MomentsOf(noise.View());
    const double grains = static_cast<double>(noise.View().Size()) / std::max(1.0, 10.0 * length * length * length);
    const double sigma = 0.5227 / std::sqrt(grains);
    EXPECT_NEAR(moments.mean, 1.0, 5.0 * sigma) << length;
    EXPECT_NEAR(moments.mean / moments.deviation, 1.9131, length > 0.0 ? 0.03 : 0.01) << length;
    std::vector<float> sorted(noise.View().begin(), noise.View().end());
    std::sort(sorted.begin(), sorted.end());
    double distance = 0.0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      const double envelope = sorted[i] * 1.2533141373155003;
      distance = std::max(distance, std::abs(-std::expm1(-0.5 * envelope * envelope) -
                                             (static_cast<double>(i) + 0.5) / static_cast<double>(sorted.size())));
    }
    EXPECT_LT(distance, 2.0 / std::sqrt(grains)) << length; // 1.95 has a probability of 1e-3
  }
}

TEST(BeamNoise, ItsRealAndImaginaryPartsHaveNoPreferredPhase)
{
  // A bad sine or cosine shows in the fourth moment of the envelope: 8 of unit normals.
  const Volume<float> noise = MakeBeamNoise(Small(), convex);
  double fourth = 0.0;
  for (float value : noise.View())
    fourth += std::pow(value * 1.2533141373155003, 4.0);
  EXPECT_NEAR(fourth / static_cast<double>(noise.View().Size()), 8.0, 0.15);
}

// The filter exp(-x^2 / (2 s^2)) of the field gives its power the correlation exp(-lag^2 / (2 s^2)) = 2^-(lag / length)^2.
TEST(BeamNoise, ThePowerHasTheAskedCorrelation)
{
  const double length[3] = {4.0, 2.0, 3.0};
  const Volume<float> noise = MakeBeamNoise(WithLengths(Small(), length[0], length[1], length[2]), convex);
  const double power = 4.0 / 3.14159265358979;
  for (int axis = 0; axis < 3; ++axis)
    for (int lag = 1; lag <= 6; ++lag)
      EXPECT_NEAR(Correlation(noise.View(), axis, lag, power), std::pow(0.5, lag * lag / (length[axis] * length[axis])), 0.03)
          << "axis " << axis << " lag " << lag;
}

TEST(BeamNoise, NeighboursAreIndependentAtLengthZero)
{
  const Volume<float> noise = MakeBeamNoise(Small(), convex);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(Correlation(noise.View(), axis, 1, 4.0 / 3.14159265358979), 0.0, 0.006);
}

TEST(BeamNoise, IsAlikeUpToItsEdges)
{
  BeamNoiseParameters p = WithLengths(Small(), 3.0, 3.0, 3.0);
  // Means over many seeds: each sample of the first and last layers against those inside.
  std::array<double, 6> edges{};
  double middle = 0.0;
  constexpr int seeds = 8;
  for (int seed = 0; seed < seeds; ++seed) {
    p.seed = static_cast<std::uint64_t>(seed);
    const Volume<float> noise = MakeBeamNoise(p, convex);
    const VolumeView<const float> view = noise.View();
    const auto& n = view.Dimensions();
    for (std::size_t side = 0; side < 6; ++side) {
      const std::size_t axis = side / 2;
      double sum = 0.0;
      std::size_t count = 0;
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const int at[3] = {i, j, k};
            if (at[axis] == (side % 2 ? n[axis] - 1 : 0)) {
              sum += static_cast<double>(view(i, j, k)) * view(i, j, k);
              ++count;
            }
          }
      edges[side] += sum / static_cast<double>(count) / seeds;
    }
    const Moments moments = MomentsOf(view);
    middle += (moments.mean * moments.mean + moments.deviation * moments.deviation) / seeds;
  }
  for (double edge : edges)
    EXPECT_NEAR(edge, middle, 0.06 * middle);
}

TEST(BeamNoise, NoLatticeShowsWhereTheSamplesResolveTheGrain)
{
  // A plane of beams with three samples to a length, read with linear interpolation halfway between samples.
  BeamNoiseParameters p = WithLengths(Small(), 3.0, 3.0, 3.0);
  const Volume<float> noise = MakeBeamNoise(p, convex);
  const VolumeView<const float> view = noise.View();
  Volume<float> halfway({p.samples - 1, p.elements - 1, p.steps - 1});
  for (int k = 0; k < p.steps - 1; ++k)
    for (int j = 0; j < p.elements - 1; ++j)
      for (int i = 0; i < p.samples - 1; ++i) {
        float sum = 0.0f;
        for (int corner = 0; corner < 8; ++corner)
          sum += 0.125f * view(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
        halfway.View()(i, j, k) = sum;
      }
  const double quotient = MomentsOf(halfway.View()).deviation / MomentsOf(view).deviation;
  EXPECT_GT(quotient, 0.93);
  EXPECT_LT(quotient, 0.96); // closed form: 0.945
}

TEST(BeamNoise, LogCompressedGreysHaveTheMeanAndTheDeviationOfTheLogarithm)
{
  BeamNoiseParameters p = Small(NoiseIntensity::LogCompressed);
  p.mean = 120.0; // hardly anything is cut: the deviation is 5.57 dB
  const Moments moments = MomentsOf(MakeBeamNoise(p, convex).View());
  EXPECT_NEAR(moments.mean, 120.0, 0.2);
  EXPECT_NEAR(moments.deviation, 5.57 * 255.0 / 60.0, 0.3);
  p.mean = 10.0; // much is cut at 0
  const Volume<float> dark = MakeBeamNoise(p, convex);
  EXPECT_NEAR(MomentsOf(dark.View()).mean, 10.0, 0.1);
  EXPECT_EQ(*std::min_element(dark.View().begin(), dark.View().end()), 0.0f);
}

TEST(BeamNoise, HistogramNoiseHasTheGivenQuantiles)
{
  BeamNoiseParameters p = Small(NoiseIntensity::Histogram);
  p.quantiles = {0.0f, 0.0f, 10.0f, 30.0f, 100.0f};
  const Volume<float> noise = MakeBeamNoise(p, convex);
  std::vector<float> sorted(noise.View().begin(), noise.View().end());
  std::sort(sorted.begin(), sorted.end());
  const auto quantile = [&sorted](double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  };
  EXPECT_EQ(quantile(0.24), 0.0f);
  EXPECT_NEAR(quantile(0.375), 5.0, 0.15);
  EXPECT_NEAR(quantile(0.5), 10.0, 0.15);
  EXPECT_NEAR(quantile(0.75), 30.0, 0.3);
  EXPECT_NEAR(quantile(0.875), 65.0, 0.6);
  EXPECT_LE(sorted.back(), 100.0f);
}

TEST(BeamNoise, DependsOnTheSeedAndNotOnThreads)
{
  BeamNoiseParameters p = WithLengths(Small(NoiseIntensity::LogCompressed), 2.0, 1.0, 0.0);
  const auto make = [&p](int threads) {
    const ThreadLimit limit(threads);
    const Volume<float> noise = MakeBeamNoise(p, convex);
    return std::vector<float>(noise.View().begin(), noise.View().end());
  };
  const auto one = make(1);
  EXPECT_EQ(one, make(2));
  p.seed = 2;
  EXPECT_NE(one, make(1));
}

TEST(BeamNoise, APartIsThatOfTheWhole)
{
  const BeamNoiseParameters p = WithLengths(Small(NoiseIntensity::LogCompressed), 2.0, 1.4, 1.0);
  const Volume<float> whole = MakeBeamNoise(p, convex);
  const std::array<int, 3> all = BeamNoiseSize(p, convex);
  ASSERT_EQ(whole.Dimensions(), all);
  for (const int odd : {0, 1}) {
    const std::array<int, 3> first{16 + odd, 31, 5}, size{67, 40, 9};
    const Volume<float> part = MakeBeamNoise(p, convex, first, size);
    ASSERT_EQ(part.Dimensions(), size);
    int wrong = 0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i)
          wrong += part.View()(i, j, k) != whole.View()(i + first[0], j + first[1], k + first[2]);
    EXPECT_EQ(wrong, 0) << odd;
  }
  EXPECT_THROW(MakeBeamNoise(p, convex, {0, 0, 0}, {all[0], all[1], all[2] + 1}), Error);
  EXPECT_THROW(MakeBeamNoise(p, convex, {-1, 0, 0}, {2, 2, 2}), Error);
}

TEST(BeamNoise, OtherLengthsSmoothTheSameNoise)
{
  const Volume<float> rough = MakeBeamNoise(WithLengths(Small(), 0.9, 0.9, 0.9), convex);
  const Volume<float> smooth = MakeBeamNoise(WithLengths(Small(), 1.4, 1.4, 1.4), convex);
  double products = 0.0;
  for (std::ptrdiff_t i = 0; i < rough.View().Size(); ++i)
    products += (rough.View()[i] - 1.0) * (smooth.View()[i] - 1.0);
  EXPECT_GT(products / static_cast<double>(rough.View().Size()), 0.5 * 0.5227 * 0.5227);
}

TEST(BeamNoise, ASinglePlaneHasOneStep)
{
  ProbeGeometry plane = convex;
  plane.sweepAngle = plane.sweepWidth = 0.0;
  const Volume<float> noise = MakeBeamNoise(Small(), plane);
  EXPECT_EQ(noise.Dimensions(), (std::array<int, 3>{120, 100, 1}));
  const ImageGeometry grid = ScanConversionGrid(plane, Pose::Identity(), 1.0, 1 << 20);
  Volume<float> image(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions);
  ScanConvert<float>(noise.View(), plane, Pose::Identity(), grid, image.View(), valid.View());
  EXPECT_GT(std::count(valid.View().begin(), valid.View().end(), 1), 5000);
}

TEST(BeamNoise, TheSmallestAndTheLongestWork)
{
  BeamNoiseParameters p = Small();
  p.samples = p.elements = p.steps = 2;
  EXPECT_EQ(MakeBeamNoise(p, convex).View().Size(), 8);
  p.samples = 50;
  p.elements = 5;
  p.steps = 4;
  p.depthCorrelationMm = 25.0;
  p.fanCorrelation = p.sweepCorrelation = 0.25;
  const Volume<float> longest = MakeBeamNoise(p, convex);
  for (float value : longest.View())
    EXPECT_TRUE(std::isfinite(value) && value >= 0.0f);
}

TEST(BeamNoise, RefusesWhatIsOutOfRangeByName)
{
  const auto with = [](const std::function<void(BeamNoiseParameters&)>& change) {
    BeamNoiseParameters p = Small(NoiseIntensity::LogCompressed);
    change(p);
    return p;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused(with([](auto& p) { p.samples = 1; }), convex, "Samples");
  ExpectRefused(with([](auto& p) { p.elements = 0; }), convex, "Elements");
  ExpectRefused(with([](auto& p) { p.steps = 1; }), convex, "Steps");
  ExpectRefused(with([](auto& p) { p.depthCorrelationMm = 26.0; }), convex, "DepthCorrelationMm");
  ExpectRefused(with([](auto& p) { p.fanCorrelation = -0.1; }), convex, "FanCorrelation");
  ExpectRefused(with([nan](auto& p) { p.sweepCorrelation = nan; }), convex, "SweepCorrelation");
  ExpectRefused(with([](auto& p) { p.mean = 255.0; }), convex, "Mean");
  ExpectRefused(with([](auto& p) { p.dynamicRangeDb = 5.0; }), convex, "DynamicRangeDb");
  ExpectRefused(with([](auto& p) {
                  p.intensity = NoiseIntensity::Rayleigh;
                  p.mean = 0.0;
                }),
                convex, "Mean");
  ExpectRefused(with([](auto& p) { p.intensity = NoiseIntensity::Histogram; }), convex, "quantiles");
  ExpectRefused(with([](auto& p) {
                  p.intensity = NoiseIntensity::Histogram;
                  p.quantiles = {1.0f, 0.0f};
                }),
                convex, "quantiles");
  ProbeGeometry bad = convex;
  bad.depthMax = -1.0;
  ExpectRefused(Small(), bad, "depth");
}

TEST(BeamNoise, StopsOnRequest)
{
  int calls = 0;
  try {
    MakeBeamNoise(Small(), convex, Progress([&calls](double) { return ++calls < 3; }));
    ADD_FAILURE() << "it did not stop";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

TEST(BeamNoise, CountsResolveTheLengthsWithinTheLimit)
{
  BeamNoiseParameters p;
  p.depthCorrelationMm = 1.0;
  p.fanCorrelation = 0.01;
  p.sweepCorrelation = 0.0;
  p.steps = 33;
  const BeamNoiseParameters fine = ResolvingCounts(p, convex, 3.0);
  EXPECT_EQ(fine.samples, 301);
  EXPECT_EQ(fine.elements, 301);
  EXPECT_EQ(fine.steps, 33);
  const BeamNoiseParameters few = ResolvingCounts(p, convex, 3.0, 1e5);
  EXPECT_LE(static_cast<double>(few.samples) * few.elements * few.steps, 1e5);
  EXPECT_NEAR(few.samples / 301.0, few.steps / 33.0, 0.05);
}

} // namespace
