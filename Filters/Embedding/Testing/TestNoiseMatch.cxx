// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/BackgroundNoise.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <utility>

namespace {

using namespace echorama;

const ProbeGeometry probe = ProbeGeometry::Convex(1.0, 40.0, 0.8, 40.0, 0.0, 60.0);

// Lengths in mm, halfway down across the fan and along the sweep.
BeamNoiseParameters NoiseOf(double depthMm, double fanMm, double sweepMm)
{
  BeamNoiseParameters p;
  p.depthCorrelationMm = depthMm;
  p.fanCorrelation = fanMm / probe.Fan().Span(30.0);
  p.sweepCorrelation = sweepMm / probe.Sweep().Span(30.0);
  return ResolvingCounts(p, probe);
}

template <class T>
struct Scene {
  Scene(const BeamNoiseParameters& p, double spacing, const Pose& pose = Pose::Identity())
    : probeToWorld(pose), grid(ScanConversionGrid(probe, pose, spacing, std::size_t{1} << 28)), intensity(grid.dimensions),
      valid(grid.dimensions)
  {
    const Volume<float> noise = MakeBeamNoise(p, probe);
    Volume<T> beams(noise.Dimensions());
    std::transform(noise.View().begin(), noise.View().end(), beams.View().begin(),
                   [](float v) { return std::is_integral_v<T> ? static_cast<T>(std::lround(v)) : static_cast<T>(v); });
    ScanConvert<T>(std::as_const(beams).View(), probe, pose, grid, intensity.View(), valid.View());
  }
  PosedVolume<T> Posed() const { return {intensity.View(), valid.View(), grid}; }
  NoiseMatch Match() const { return MatchNoise<T>(Posed(), probe, probeToWorld); }
  Pose probeToWorld;
  ImageGeometry grid;
  Volume<T> intensity;
  Volume<unsigned char> valid;
};

void ExpectLengths(const NoiseMatch::Lengths& lengths, const BeamNoiseParameters& p, double tolerance)
{
  EXPECT_NEAR(lengths.depthMm, p.depthCorrelationMm, tolerance * p.depthCorrelationMm);
  EXPECT_NEAR(lengths.fan, p.fanCorrelation, tolerance * p.fanCorrelation);
  EXPECT_NEAR(lengths.sweep, p.sweepCorrelation, tolerance * p.sweepCorrelation);
  EXPECT_TRUE(lengths.resolved[0] && lengths.resolved[1] && lengths.resolved[2]);
}

// The greatest difference of two distributions that are given by their quantiles.
double Distance(const std::vector<float>& a, const std::vector<float>& b)
{
  double distance = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto at = std::lower_bound(b.begin(), b.end(), a[i]);
    const double rank = static_cast<double>(at - b.begin()) / static_cast<double>(b.size() - 1);
    distance = std::max(distance, std::abs(rank - static_cast<double>(i) / static_cast<double>(a.size() - 1)));
  }
  return distance;
}

// From 1.2 voxels to two thirds of the window.
TEST(NoiseMatch, FindsTheLengthsThatNoiseWasMadeWith)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const auto& mm : {Eigen::Vector3d(0.6, 0.8, 1.0), Eigen::Vector3d(1.0, 2.0, 1.5), Eigen::Vector3d(0.9, 1.2, 1.8)})
    for (const NoiseIntensity kind : {NoiseIntensity::LogCompressed, NoiseIntensity::Rayleigh}) {
      BeamNoiseParameters p = NoiseOf(mm.x(), mm.y(), mm.z());
      p.intensity = kind;
      SCOPED_TRACE(testing::Message() << mm.transpose());
      ExpectLengths(Scene<float>(p, 0.5).Match().lengths, p, 0.15);
    }
}

TEST(NoiseMatch, BeamsNeedNoVolume)
{
  const BeamNoiseParameters p = NoiseOf(1.0, 1.5, 2.0);
  const Volume<float> beams = MakeBeamNoise(p, probe);
  ExpectLengths(MatchBeams(beams.View(), {}, probe).lengths, p, 0.15);
}

TEST(NoiseMatch, CoarseGrainNeedsAWideWindow)
{
  const BeamNoiseParameters p = NoiseOf(1.8, 2.2, 2.2);
  const Volume<float> beams = MakeBeamNoise(p, probe);
  EXPECT_LT(MatchBeams(beams.View(), {}, probe).lengths.depthMm, 0.93 * 1.8);
  NoiseMatchParameters wide;
  wide.windowMm = 4.0;
  ExpectLengths(MatchBeams(beams.View(), {}, probe, wide).lengths, p, 0.15);
}

TEST(NoiseMatch, IsTheSameForBytesAndForAnyPose)
{
  const BeamNoiseParameters p = NoiseOf(1.0, 1.5, 1.5);
  ExpectLengths(Scene<unsigned char>(p, 0.6, MotionAbout({10, 0, 30}, {0.4, -0.3, 0.8}, {50, -20, 5})).Match().lengths, p, 0.15);
}

TEST(NoiseMatch, NoiseFromAMatchIsLikeTheNoiseThatWasMatched)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.4, 1.6);
  const NoiseMatch first = Scene<float>(p, 0.5).Match();
  const BeamNoiseParameters like = NoiseLike(first, probe, probe);
  ExpectLengths(first.lengths, like, 1e-9);
  const NoiseMatch second = Scene<float>(like, 0.5).Match();
  EXPECT_NEAR(second.lengths.depthMm, first.lengths.depthMm, 0.1 * first.lengths.depthMm);
  EXPECT_NEAR(second.lengths.fan, first.lengths.fan, 0.1 * first.lengths.fan);
  EXPECT_NEAR(second.lengths.sweep, first.lengths.sweep, 0.1 * first.lengths.sweep);
  EXPECT_LT(Distance(first.quantiles, second.quantiles), 0.06);
  EXPECT_NEAR(second.mean, first.mean, 1.0);
}

// Bright and dark regions, and a gain that falls with depth, are none of the grain.
TEST(NoiseMatch, ASceneUnderTheNoiseDoesNotMatter)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.2, 1.2);
  Scene<float> scene(p, 0.5);
  const VolumeView<float> view = scene.intensity.View();
  for (int k = 0; k < scene.grid.dimensions[2]; ++k)
    for (int j = 0; j < scene.grid.dimensions[1]; ++j)
      for (int i = 0; i < scene.grid.dimensions[0]; ++i)
        view(i, j, k) =
            view(i, j, k) * (1.0f + 0.5f * std::sin(0.08f * static_cast<float>(i + j))) + 0.3f * static_cast<float>(k);
  ExpectLengths(scene.Match().lengths, p, 0.12);
}

TEST(NoiseMatch, OnlyTheValidRegionCounts)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.2, 1.2);
  Scene<float> scene(p, 0.5);
  // Half of the fan holds something else, which is not real.
  for (int k = 0; k < scene.grid.dimensions[2]; ++k)
    for (int j = 0; j < scene.grid.dimensions[1]; ++j)
      for (int i = 0; i < scene.grid.dimensions[0] / 2; ++i) {
        scene.valid.View()(i, j, k) = 0;
        scene.intensity.View()(i, j, k) = j % 2 ? 1e6f : std::numeric_limits<float>::quiet_NaN();
      }
  ExpectLengths(scene.Match().lengths, p, 0.12);
}

TEST(NoiseMatch, SaysWhenTheGridIsTooCoarse)
{
  const NoiseMatch match = Scene<float>(NoiseOf(0.3, 0.3, 0.3), 1.0).Match();
  EXPECT_FALSE(match.lengths.resolved[0] || match.lengths.resolved[1] || match.lengths.resolved[2]);
  EXPECT_GE(match.lengths.depthMm, 0.3); // a bound
  EXPECT_LT(match.lengths.depthMm, 1.2);
}

TEST(NoiseMatch, BandsOfDepthAreMeasuredByThemselves)
{
  // The grain of the deeper half is twice as long.
  BeamNoiseParameters fine = NoiseOf(0.6, 1.2, 1.2), coarse = fine;
  coarse.depthCorrelationMm = 1.2;
  Volume<float> beams = MakeBeamNoise(fine, probe);
  const Volume<float> deep = MakeBeamNoise(coarse, probe);
  for (int k = 0; k < fine.steps; ++k)
    for (int j = 0; j < fine.elements; ++j)
      std::copy(deep.View().Row(j, k) + fine.samples / 2, deep.View().Row(j, k) + fine.samples,
                beams.View().Row(j, k) + fine.samples / 2);
  const NoiseMatch match = MatchBeams(std::as_const(beams).View(), {}, probe);
  ASSERT_EQ(match.bands.size(), 4u);
  EXPECT_NEAR(match.bands[0].lengths.depthMm, 0.6, 0.06);
  EXPECT_NEAR(match.bands[3].lengths.depthMm, 1.2, 0.12);
  EXPECT_NEAR(match.bands[3].fromMm, 45.0, 0.5);
}

TEST(NoiseMatch, TheSameForAnyNumberOfThreads)
{
  const Scene<float> scene(NoiseOf(1.0, 1.5, 2.0), 1.0);
  const auto match = [&scene](int threads) {
    const ThreadLimit limit(threads);
    return scene.Match();
  };
  const NoiseMatch one = match(1), two = match(2);
  EXPECT_EQ(one.lengths.depthMm, two.lengths.depthMm);
  EXPECT_EQ(one.lengths.fan, two.lengths.fan);
  EXPECT_EQ(one.quantiles, two.quantiles);
}

TEST(NoiseMatch, ASinglePlaneHasNoSweep)
{
  ProbeGeometry plane = probe;
  plane.sweepAngle = plane.sweepWidth = 0.0;
  const BeamNoiseParameters p = NoiseOf(0.8, 1.2, 1.2);
  const Volume<float> beams = MakeBeamNoise(p, plane);
  NoiseMatchParameters wide;
  wide.windowMm = 3.0; // a plane has few grains in a window
  const NoiseMatch match = MatchBeams(beams.View(), {}, plane, wide);
  EXPECT_NEAR(match.lengths.depthMm, p.depthCorrelationMm, 0.15 * p.depthCorrelationMm);
  EXPECT_NEAR(match.lengths.fan, p.fanCorrelation, 0.15 * p.fanCorrelation);
  EXPECT_EQ(match.lengths.sweep, 0.0);
  EXPECT_EQ(NoiseLike(match, plane, plane).sweepCorrelation, 0.0);
}

TEST(NoiseMatch, LengthsAcrossAWiderFanAreTheSameInMm)
{
  NoiseMatch match;
  match.lengths.depthMm = 1.0;
  match.lengths.fan = match.lengths.sweep = 0.02;
  match.quantiles = {0.0f, 1.0f};
  ProbeGeometry wide = probe;
  wide.fanAngle *= 2.0;
  wide.fanWidth *= 2.0;
  const BeamNoiseParameters p = NoiseLike(match, probe, wide);
  EXPECT_NEAR(p.fanCorrelation, 0.01, 1e-9);
  EXPECT_NEAR(p.sweepCorrelation, 0.02, 1e-9);
  EXPECT_EQ(p.depthCorrelationMm, 1.0);
}

// Speckle in a box of the fan, walls beyond it, and water that is not quite black: a few levels of receiver noise, one per voxel.
Scene<unsigned char> Tank(const BeamNoiseParameters& p, double halfWidthMm)
{
  Scene<unsigned char> tank(p, 0.5);
  const auto& n = tank.grid.dimensions;
  const Eigen::Affine3d toWorld = tank.grid.IndexToWorld();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Eigen::Vector3d at = toWorld * Eigen::Vector3d(i, j, k);
        Random random(9, static_cast<std::uint64_t>((k * n[1] + j) * n[0] + i));
        unsigned char& voxel = tank.intensity.View()(i, j, k);
        if (std::abs(at.x()) < halfWidthMm && std::abs(at.y()) < halfWidthMm && std::abs(at.z() - 30.0) < 12.0)
          continue;
        voxel = static_cast<unsigned char>(std::max(0.0, 3.5 + 1.7 * random.Normal()));
        if (std::abs(at.z() - 50.0) < 1.5 || std::abs(at.z() - 8.0 - 0.1 * at.x()) < 1.0) // thicker than any grain
          voxel = static_cast<unsigned char>(220.0 + 8.0 * random.Uniform());
      }
  return tank;
}

TEST(NoiseMatch, WaterAndWallsAreNoSpeckle)
{
  for (const NoiseIntensity kind : {NoiseIntensity::LogCompressed, NoiseIntensity::Rayleigh}) {
    BeamNoiseParameters p = NoiseOf(0.9, 1.3, 1.5);
    p.intensity = kind;
    p.mean = kind == NoiseIntensity::Rayleigh ? 60.0 : 100.0;
    const Scene<unsigned char> tank = Tank(p, 11.0);
    const NoiseMatch match = tank.Match();
    ExpectLengths(match.lengths, p, 0.15);
    double box = 0.0, real = 0.0;
    for (std::ptrdiff_t at = 0; at < tank.valid.View().Size(); ++at)
      real += tank.valid.View()[at];
    box = 22.0 * 22.0 * 24.0 / (0.5 * 0.5 * 0.5);
    EXPECT_NEAR(match.speckleShare, box / real, 0.35 * box / real);
    // As many grains as the integral of their autocorrelation makes: 2.13 lengths along each axis (a little more by
    // interpolation).
    const double grains = 22.0 * 22.0 * 24.0 / (std::pow(2.13, 3) * 0.9 * 1.3 * 1.5);
    EXPECT_NEAR(match.grains, grains, 0.45 * grains);
    EXPECT_NEAR(match.mean, p.mean, 0.15 * p.mean);
  }
}

TEST(NoiseMatch, CountsTheGrains)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.2, 1.2);
  const NoiseMatch all = Scene<float>(p, 0.5).Match();
  EXPECT_GT(all.speckleShare, 0.95);
  EXPECT_GT(all.grains, NoiseMatch::leastGrains);
  const NoiseMatch few = Tank(p, 4.0).Match();
  EXPECT_LT(few.grains, NoiseMatch::leastGrains);
  EXPECT_GT(few.grains, 20.0);
}

// Water alone, and water with walls: nothing to measure.
TEST(NoiseMatch, RefusesATankWithoutSpeckle)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.2, 1.2);
  Scene<unsigned char> tank = Tank(p, 0.0);
  for (unsigned char& voxel : tank.intensity.View())
    voxel = voxel < 20 ? voxel / 3 : voxel; // cut off at black, mostly
  try {
    tank.Match();
    ADD_FAILURE() << "it was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
    EXPECT_NE(std::string(error.what()).find("too little texture"), std::string::npos) << error.what();
  }
}

TEST(NoiseMatch, TheBackgroundOfATankIsAsFineAsItsVoxels)
{
  const BeamNoiseParameters p = NoiseOf(0.9, 1.9, 1.9); // what the window can tell
  const BackgroundNoise enough = NoiseBehind(Scene<float>(p, 0.5).Posed(), {probe, Pose::Identity()});
  EXPECT_NEAR(enough.parameters.depthCorrelationMm, 0.9, 0.15 * 0.9);
  EXPECT_NEAR(enough.grainMm, std::cbrt(0.9 * 1.9 * 1.9), 0.15 * 1.48);
  EXPECT_TRUE(enough.reason.empty());
  for (const double halfWidthMm : {0.0, 4.0}) { // nothing, and too little
    const BackgroundNoise guess = NoiseBehind(Tank(p, halfWidthMm).Posed(), {probe, Pose::Identity()});
    EXPECT_EQ(guess.grainMm, 0.0);
    EXPECT_LT(guess.grains, NoiseMatch::leastGrains);
    EXPECT_NEAR(guess.parameters.depthCorrelationMm, 1.0, 1e-9);
    EXPECT_NEAR(guess.parameters.fanCorrelation * probe.Fan().Span(30.0), 1.5, 1e-9);
    EXPECT_NEAR(guess.parameters.sweepCorrelation * probe.Sweep().Span(30.0), 1.5, 0.2);
    EXPECT_NO_THROW(MakeBeamNoise(guess.parameters, probe));
  }
}

TEST(NoiseMatch, RefusesWhatHasNoTexture)
{
  const auto refused = [](const PosedVolume<float>& volume, Error::Kind kind, const std::string& part) {
    try {
      MatchNoise<float>(volume, probe, Pose::Identity());
      ADD_FAILURE() << part << ": it was not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), kind);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  Scene<float> scene(NoiseOf(1.0, 2.0, 2.0), 1.5);
  Volume<float> constant(scene.grid.dimensions, 80.0f);
  refused({std::as_const(constant).View(), scene.valid.View(), scene.grid}, Error::Kind::NotPossible, "too little texture");
  Volume<unsigned char> one(scene.grid.dimensions);
  one.View()(20, 20, 20) = 1;
  refused({scene.intensity.View(), std::as_const(one).View(), scene.grid}, Error::Kind::NotPossible, "too little texture");
  ImageGeometry elsewhere = scene.grid;
  elsewhere.origin.x() += 1000.0;
  refused({scene.intensity.View(), scene.valid.View(), elsewhere}, Error::Kind::NotPossible, "0 samples");
  ImageGeometry other = scene.grid;
  ++other.dimensions[0];
  refused({scene.intensity.View(), scene.valid.View(), other}, Error::Kind::BadInput, "do not agree");
  NoiseMatchParameters bad;
  bad.depthBands = 0;
  EXPECT_THROW(MatchNoise<float>(scene.Posed(), probe, Pose::Identity(), bad), Error);
  Pose scaled = Pose::Identity();
  scaled.linear() *= 2.0;
  EXPECT_THROW(MatchNoise<float>(scene.Posed(), probe, scaled), Error);
  EXPECT_THROW(MatchNoise<float>(scene.Posed(), probe, Pose::Identity(), {}, Progress([](double) { return false; })), Error);
}

} // namespace
