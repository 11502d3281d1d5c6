// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/ScatterCounting.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

Material Scattering(double p)
{
  Material material = Clear("scattering", 1540, 1000);
  material.scatterProbability = p;
  return material;
}

std::vector<float> Count(const AcousticScene& scene, const ScatterCounting& parameters,
                         const std::array<int, 3>& dimensions = {101, 1, 1}, double depth = 100.0)
{
  const Volume<float> volume =
      CountScatters(scene, parameters, ProbeGeometry::Linear(20, 0, 0, depth), Pose::Identity(), dimensions);
  return {volume.View().begin(), volume.View().end()};
}

} // namespace

TEST(ScatterCounting, DistancesFollowTheLaw)
{
  // The share of rays that get beyond x is (1 - p)^x, for all p; small p keep their digits.
  for (const double p : {1e-9, 1e-7, 0.02, 0.5, 0.999999}) {
    const double mu = -std::log1p(-p);
    for (const double u : {1e-12, 0.3, 0.7, 1.0 - 1e-12}) {
      const double d = ScatterDistance(p, u);
      EXPECT_NEAR(-std::expm1(-mu * d), u, 1e-12);
    }
    EXPECT_EQ(ScatterDistance(p, 0.0), 0.0);
  }
  EXPECT_NEAR(ScatterDistance(1e-9, 0.3) * 1e-9, -std::log(0.7), 1e-9);
  for (const double u : {0.0, 0.5, 1.0 - 1e-16}) {
    EXPECT_EQ(ScatterDistance(0.0, u), std::numeric_limits<double>::infinity());
    EXPECT_EQ(ScatterDistance(1.0, u), 0.0);
  }
  // Against eqs 3.1 to 3.3 with a fresh number on its own range, where they are stable: the same law.
  Random random(1);
  const double p = 0.03, x = 40.0;
  double mean = 0.0, meanOfText = 0.0, within = 0.0;
  constexpr int count = 200000;
  for (int i = 0; i < count; ++i) {
    const double d = ScatterDistance(p, random.Uniform());
    if (d < x) {
      mean += d;
      within += 1.0;
    }
    const double r = random.Uniform() * (std::pow(1 - p, x) - 1) / std::log(1 - p);
    meanOfText += std::log(r * std::log(1 - p) + 1) / std::log(1 - p) / count;
  }
  EXPECT_NEAR(within / count, 1 - std::pow(1 - p, x), 0.005);
  EXPECT_NEAR(mean / within, meanOfText, 0.1);
}

TEST(ScatterCounting, LooksWhereTheProbeLooks)
{
  const Pose pose(Eigen::Translation3d(10, -20, 30) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 0.5).normalized()));
  TissueSurface surface = Background(Scattering(0.0));
  AddBox(surface, Scattering(1.0), {-50, -50, 40}, {50, 50, 60});
  for (auto& point : surface.points)
    point = (pose * point.cast<double>()).cast<float>();
  const Volume<float> row = CountScatters(AcousticScene(surface), {}, ProbeGeometry::Linear(20, 0, 0, 100), pose, {101, 1, 1});
  EXPECT_NEAR(row.View()[40], 1.0f, 1e-3f);
}

TEST(ScatterCounting, ReceiverHearsWhatLiesAhead)
{
  const Vector3d element(1, 2, 3), ahead(0, 0, 1);
  EXPECT_EQ(ReceiverAttenuation(element, ahead, element + 5 * ahead, 20.0), 1.0);
  EXPECT_EQ(ReceiverAttenuation(element, ahead, element - 5 * ahead, 20.5), 0.0); // behind: not a number elsewhere
  EXPECT_NEAR(ReceiverAttenuation(element, ahead, element + Vector3d(1, 0, 1), 2.0), 0.5, 1e-12);
  EXPECT_EQ(ReceiverAttenuation(element, ahead, element + Vector3d(3, 0, 1), 0.0), 1.0);
  EXPECT_LT(ReceiverAttenuation(element, ahead, element + Vector3d(1, 0, 1), 200.0), 1e-29);
  EXPECT_EQ(ReceiverAttenuation(element, ahead, element, 20.0), 1.0);
}

TEST(ScatterCounting, StraightOnTheCountsAreExponential)
{
  // With a cone of 0 a ray goes straight on: the number of events per mm is mu, all along.
  ScatterCounting parameters;
  parameters.coneDegrees = 0.0;
  parameters.raysPerElement = 20000;
  const AcousticScene scene(Background(Scattering(0.1)));
  const auto row = Count(scene, parameters);
  const double mu = -std::log1p(-0.1);
  for (int i = 1; i < 100; ++i)
    EXPECT_NEAR(row[static_cast<std::size_t>(i)], mu, 0.15 * mu);
  EXPECT_NEAR(std::accumulate(row.begin() + 1, row.end() - 1, 0.0) / 99, mu, 0.01 * mu);
}

TEST(ScatterCounting, ProbabilitiesAtTheirEnds)
{
  ScatterCounting parameters;
  for (const double clarity : {0.0, 200.0}) {
    parameters.clarity = clarity;
    const auto nothing = Count(AcousticScene(Background(Scattering(0.0))), parameters);
    EXPECT_EQ(*std::max_element(nothing.begin(), nothing.end()), 0.0f);
    const auto hardly = Count(AcousticScene(Background(Scattering(1e-9))), parameters);
    for (const float value : hardly)
      EXPECT_TRUE(value >= 0.0f && value < 1e-2f);
    const auto solid = Count(AcousticScene(Background(Scattering(1.0))), parameters);
    EXPECT_NEAR(solid[0], 1.0f, 1e-5f); // all at the element
    EXPECT_EQ(solid[1], 0.0f);
    for (const double p : {1e-7, 0.5, 0.999999})
      for (const float value : Count(AcousticScene(Background(Scattering(p))), parameters))
        EXPECT_TRUE(std::isfinite(value) && value >= 0.0f);
  }
  TissueSurface surface = Background(Scattering(0.0)); // a solid below clear fluid: one echo, at its surface
  AddBox(surface, Scattering(1.0), {-50, -50, 40}, {50, 50, 60});
  parameters.clarity = 20.0;
  const auto row = Count(AcousticScene(surface), parameters);
  EXPECT_NEAR(row[40], 1.0f, 1e-3f);
  EXPECT_NEAR(std::accumulate(row.begin(), row.end(), 0.0), 1.0, 1e-3);
}

TEST(ScatterCounting, LowerClarityHearsMore)
{
  const AcousticScene scene(Background(Scattering(0.05)));
  double last = std::numeric_limits<double>::infinity();
  for (const double clarity : {0.0, 5.0, 20.0, 200.0}) {
    ScatterCounting parameters;
    parameters.clarity = clarity;
    const auto row = Count(scene, parameters);
    const double sum = std::accumulate(row.begin(), row.end(), 0.0);
    EXPECT_LT(sum, last);
    last = sum;
  }
}

TEST(ScatterCounting, ReverberationAtItsDepth)
{
  // Two plates in clear fluid. The way back is straight, so a detour counts half.
  TissueSurface surface = Background(Scattering(0.0));
  Material plate = Clear("plate", 1540, 3000);
  AddBox(surface, plate, {-500, -500, 30}, {500, 500, 31});
  AddBox(surface, plate, {-500, -500, 50}, {500, 500, 51});
  ScatterCounting parameters;
  parameters.raysPerElement = 4096;
  parameters.clarity = 0.0;
  const auto row = Count(AcousticScene(surface), parameters, {1001, 1, 1});
  const auto at = [&row](double depth) { return row[static_cast<std::size_t>(std::lround(depth * 10))]; };
  EXPECT_NEAR(at(30), 0.25f, 1e-3f); // R = ((3 - 1) / (3 + 1))^2
  // What comes to the second plate has passed two faces. Its echo, and that of what it sends up to either face of the first:
  // out 50 + 19, back 31, is half of 100; out 50 + 20, back 30, likewise.
  EXPECT_NEAR(at(50), 0.25 * 0.75 * 0.75 * (1.0 + 0.25 + 0.75 * 0.25), 0.005);
  EXPECT_EQ(at(40), 0.0f);
}

TEST(ScatterCounting, SameForAnyNumberOfThreadsAndSeeded)
{
  TissueSurface surface = Background(Scattering(0.03));
  AddSphere(surface, StandardMaterial("liver"), {0, 0, 40}, 15, 3);
  const AcousticScene scene(surface);
  for (const Sampling sampling : {Sampling::Random, Sampling::Stratified, Sampling::Sobol}) {
    ScatterCounting parameters;
    parameters.sampling = sampling;
    parameters.raysPerElement = 64;
    const auto many = Count(scene, parameters, {64, 16, 1});
    {
      const ThreadLimit limit(1);
      EXPECT_EQ(many, Count(scene, parameters, {64, 16, 1}));
    }
    parameters.seed = 2;
    EXPECT_NE(many, Count(scene, parameters, {64, 16, 1}));
  }
}

TEST(ScatterCounting, RefusesAbsurdParameters)
{
  const AcousticScene scene(Background(Scattering(0.1)));
  const auto refuses = [&scene](const ScatterCounting& parameters) { EXPECT_THROW(Count(scene, parameters), Error); };
  for (const double bad : {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    ScatterCounting parameters;
    parameters.clarity = bad;
    refuses(parameters);
    parameters = {};
    parameters.coneDegrees = bad;
    refuses(parameters);
    parameters = {};
    parameters.assumedSoundSpeed = bad;
    refuses(parameters);
  }
  ScatterCounting parameters;
  parameters.raysPerElement = 0;
  refuses(parameters);
  parameters = {};
  parameters.maxEvents = 0;
  refuses(parameters);
  EXPECT_THROW(Count(scene, {}, {1, 1, 1}), Error);
}

TEST(ScatterCounting, StopsOnRequest)
{
  const AcousticScene scene(Background(Scattering(0.1)));
  const Progress stop([](double) { return false; });
  EXPECT_THROW(CountScatters(scene, {}, ProbeGeometry::Linear(20, 0, 0, 100), Pose::Identity(), {64, 64, 1}, stop), Error);
}
