// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Tissue/SpherePacking.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <string>

using namespace echorama;
using Eigen::Vector3d;
using Parameters = SpherePackingParameters;

namespace {

// The narrowest gap of all pairs, less the gap wanted: below zero when a pair is too near. Without grids.
double NarrowestGap(const std::vector<Sphere>& spheres, double wanted = 0.0)
{
  double narrowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < spheres.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double reach = spheres[i].radius + spheres[j].radius + wanted;
      const double squared = (spheres[i].centre - spheres[j].centre).squaredNorm();
      if (squared < reach * reach || squared < 4.0 * reach * reach)
        narrowest = std::min(narrowest, std::sqrt(squared) - reach);
    }
  return narrowest;
}

double Fill(const SpherePacking& packing, const Parameters& p)
{
  double sum = 0.0;
  for (const Sphere& sphere : packing.spheres)
    sum += std::pow(sphere.radius, 3);
  return 4.0 / 3.0 * 3.141592653589793 * sum / p.Volume();
}

void ExpectSound(const SpherePacking& packing, const Parameters& p)
{
  EXPECT_GE(NarrowestGap(packing.spheres, p.gapMm), -1e-12);
  EXPECT_NEAR(packing.fillFraction, Fill(packing, p), 1e-9);
  const Vector3d middle = 0.5 * (p.boxMin + p.boxMax);
  const double half = 0.5 * (p.boxMax - p.boxMin).minCoeff();
  for (const Sphere& sphere : packing.spheres) {
    EXPECT_GE(sphere.radius, p.radiusMin);
    EXPECT_LE(sphere.radius, p.radiusMax);
    if (p.region == Parameters::Region::Ball) {
      EXPECT_LE((sphere.centre - middle).norm() + sphere.radius, half + 1e-9);
    } else {
      EXPECT_GE((sphere.centre - p.boxMin).minCoeff(), sphere.radius - 1e-9);
      EXPECT_GE((p.boxMax - sphere.centre).minCoeff(), sphere.radius - 1e-9);
    }
  }
}

std::string MessageOf(const Parameters& p)
{
  try {
    PackSpheres(p);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

Parameters Small(Parameters::Method method = Parameters::Method::Random)
{
  Parameters p;
  p.method = method;
  p.boxMin = {-20, 10, 5};
  p.boxMax = {20, 40, 30};
  p.radiusMin = 0.6;
  p.radiusMax = 5.0;
  return p;
}

} // namespace

TEST(SpherePacking, NeverOverlapsAndReachesTheFill)
{
  for (const auto method : {Parameters::Method::Random, Parameters::Method::EmptySpace})
    for (const auto region : {Parameters::Region::Box, Parameters::Region::Ball})
      for (const double gap : {0.0, 0.3}) {
        Parameters p = Small(method);
        p.region = region;
        p.gapMm = gap;
        const SpherePacking packing = PackSpheres(p);
        ExpectSound(packing, p);
        EXPECT_FALSE(packing.saturated);
        EXPECT_NEAR(packing.fillFraction, 0.3, 1e-4);
        EXPECT_GT(packing.spheres.size(), 10u);
      }
}

TEST(SpherePacking, SpheresOfManyOrdersOfMagnitude)
{
  for (const auto method : {Parameters::Method::Random, Parameters::Method::EmptySpace}) {
    Parameters p = Small(method);
    p.radiusMin = 0.01;
    p.radiusMax = 12.0;
    p.count = 2000;
    p.fillFraction = 0.5;
    const SpherePacking packing = PackSpheres(p);
    ExpectSound(packing, p);
  }
}

TEST(SpherePacking, EmptySpaceMakesThemTouch)
{
  Parameters p = Small(Parameters::Method::EmptySpace);
  p.fillFraction = 0.4;
  const SpherePacking packing = PackSpheres(p);
  EXPECT_NEAR(NarrowestGap(packing.spheres), 0.0, 1e-9); // tangent, and still apart
  int touching = 0;
  for (std::size_t i = 0; i < packing.spheres.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Sphere &a = packing.spheres[i], &b = packing.spheres[j];
      touching += (a.centre - b.centre).norm() - a.radius - b.radius < 1e-9;
    }
  EXPECT_GT(touching, static_cast<int>(packing.spheres.size()) / 2);
}

TEST(SpherePacking, RadiiFollowTheirDistribution)
{
  Parameters p = Small();
  p.boxMax = {180, 210, 205};
  p.radiusMin = 1.0;
  p.radiusMax = 4.0;
  p.fillFraction = 1.0;
  p.count = 20000;
  const auto share = [&p](double below) { // of radii
    const auto spheres = PackSpheres(p).spheres;
    EXPECT_EQ(spheres.size(), 20000u);
    return static_cast<double>(std::count_if(spheres.begin(), spheres.end(), [&](const Sphere& s) { return s.radius < below; })) /
           20000.0;
  };
  p.radii = Parameters::Radii::Uniform;
  EXPECT_NEAR(share(2.0), 1.0 / 3.0, 0.012); // 3.6 standard deviations
  p.radii = Parameters::Radii::LogUniform;
  EXPECT_NEAR(share(2.0), 0.5, 0.012);
  p.radii = Parameters::Radii::PowerLaw;
  p.exponent = 3.0;
  EXPECT_NEAR(share(2.0), (1.0 - 1.0 / 4.0) / (1.0 - 1.0 / 16.0), 0.012);
  p.exponent = 1.0; // the log-uniform law
  EXPECT_NEAR(share(2.0), 0.5, 0.012);
  p.exponent = -2.0;
  EXPECT_NEAR(share(2.0), 7.0 / 63.0, 0.012);
}

TEST(SpherePacking, PlacesAreUniform)
{
  Parameters p = Small();
  p.radiusMin = p.radiusMax = 0.2;
  p.fillFraction = 1.0;
  p.count = 8000;
  const auto spheres = PackSpheres(p).spheres;
  Vector3d mean = Vector3d::Zero();
  int octant = 0;
  for (const Sphere& sphere : spheres) {
    mean += sphere.centre / 8000.0;
    octant += (sphere.centre.array() < Eigen::Array3d(0, 25, 17.5)).all();
  }
  EXPECT_LT((mean - Vector3d(0, 25, 17.5)).cwiseQuotient(Vector3d(40, 30, 25)).norm(), 0.012);
  EXPECT_NEAR(octant / 8000.0, 0.125, 0.015);
}

TEST(SpherePacking, SaturationEnds)
{
  for (const auto method : {Parameters::Method::Random, Parameters::Method::EmptySpace}) {
    Parameters p = Small(method);
    p.fillFraction = 1.0;
    p.misses = 500;
    p.radiusMin = 1.0;
    const SpherePacking packing = PackSpheres(p);
    EXPECT_TRUE(packing.saturated);
    EXPECT_GT(packing.fillFraction, 0.4);
    EXPECT_LT(packing.fillFraction, 0.74);
    ExpectSound(packing, p);
  }
  // Equal spheres, one after the other at random: saturation is known to lie at 0.384 (less near the walls).
  Parameters p = Small();
  p.radiusMin = p.radiusMax = 0.8;
  p.fillFraction = 0.7;
  p.misses = 3000;
  const SpherePacking packing = PackSpheres(p);
  EXPECT_TRUE(packing.saturated);
  EXPECT_GT(packing.fillFraction, 0.27);
  EXPECT_LT(packing.fillFraction, 0.384);
}

// What tells quickly that there is no room must never be wrong: each sphere lies where a plain search finds room first.
TEST(SpherePacking, TheFirstPlaceWithRoomIsTaken)
{
  for (const auto region : {Parameters::Region::Box, Parameters::Region::Ball})
    for (const double gap : {0.0, 0.25})
      for (const double radiusMin : {0.8, 0.5}) { // equal ones, and some sizes
        Parameters p = Small();
        p.boxMax = {-5, 25, 20};
        p.region = region;
        p.radii = Parameters::Radii::Uniform;
        p.radiusMin = radiusMin;
        p.radiusMax = 0.8;
        p.gapMm = gap;
        p.misses = 4000;
        p.fillFraction = radiusMin == p.radiusMax ? 0.4 : gap > 0.0 ? 0.19 : 0.32; // no size may be given up on the way
        const SpherePacking packing = PackSpheres(p);
        ASSERT_EQ(packing.saturated, radiusMin == p.radiusMax);
        EXPECT_GT(packing.tries, 15 * static_cast<std::int64_t>(packing.spheres.size())) << "near saturation";
        Random random(p.seed, 1);
        const Vector3d middle = 0.5 * (p.boxMin + p.boxMax);
        std::vector<Sphere> plain;
        for (const Sphere& sphere : packing.spheres) {
          const double r = sphere.radius;
          for (bool free = false; !free;) {
            Vector3d place;
            if (region == Parameters::Region::Ball) {
              const double share = std::cbrt(random.Uniform());
              place = middle + (0.5 * (p.boxMax - p.boxMin).minCoeff() - r) * share * random.Direction();
            } else
              for (int axis = 0; axis < 3; ++axis)
                place[axis] = p.boxMin[axis] + r + (p.boxMax[axis] - p.boxMin[axis] - 2.0 * r) * random.Uniform();
            free = std::none_of(plain.begin(), plain.end(), [&](const Sphere& other) {
              const double reach = r + gap + other.radius;
              return (other.centre - place).squaredNorm() < reach * reach;
            });
            if (free)
              plain.push_back({place, r});
          }
          ASSERT_EQ(plain.back().centre, sphere.centre) << "sphere " << plain.size();
        }
      }
}

TEST(SpherePacking, FewAndNone)
{
  for (const auto method : {Parameters::Method::Random, Parameters::Method::EmptySpace}) {
    Parameters p = Small(method);
    p.count = 0;
    EXPECT_TRUE(PackSpheres(p).spheres.empty());
    EXPECT_FALSE(PackSpheres(p).saturated);
    p.count = 7;
    EXPECT_EQ(PackSpheres(p).spheres.size(), 7u);
    p.count = 100;
    p.fillFraction = 0.0;
    EXPECT_TRUE(PackSpheres(p).spheres.empty());
    p.fillFraction = 1.0;
    p.radiusMin = p.radiusMax = 12.5; // as wide as the box is deep
    p.misses = 50;
    const SpherePacking packing = PackSpheres(p);
    ASSERT_EQ(packing.spheres.size(), 1u);
    EXPECT_TRUE(packing.saturated);
    EXPECT_NEAR(packing.spheres[0].centre.z(), 17.5, 1e-9);
  }
}

TEST(SpherePacking, SameSeedSamePackingOnAnyThreads)
{
  for (const auto method : {Parameters::Method::Random, Parameters::Method::EmptySpace}) {
    Parameters p = Small(method);
    const SpherePacking first = PackSpheres(p);
    const ThreadLimit one(1);
    const SpherePacking again = PackSpheres(p);
    ASSERT_EQ(first.spheres.size(), again.spheres.size());
    for (std::size_t i = 0; i < first.spheres.size(); ++i) {
      EXPECT_EQ(first.spheres[i].centre, again.spheres[i].centre);
      EXPECT_EQ(first.spheres[i].radius, again.spheres[i].radius);
    }
    p.seed = 2;
    EXPECT_NE(PackSpheres(p).spheres[0].centre, first.spheres[0].centre);
  }
}

TEST(SpherePacking, ThinAndLongBoxes)
{
  Parameters p;
  p.boxMin = {-1e5, 0, 0};
  p.boxMax = {1e5, 1.2, 1.2};
  p.radiusMin = 0.05;
  p.radiusMax = 0.6;
  p.count = 3000;
  ExpectSound(PackSpheres(p), p);
  p.boxMin = {0, 0, 0};
  p.boxMax = {300, 300, 2};
  p.radiusMin = 0.3;
  p.radiusMax = 1.0;
  ExpectSound(PackSpheres(p), p);
}

TEST(SpherePacking, CanBeStopped)
{
  Parameters p = Small();
  p.fillFraction = 1.0;
  EXPECT_THROW(PackSpheres(p, Progress([](double fraction) {
                             EXPECT_GE(fraction, 0.0);
                             EXPECT_LE(fraction, 1.0);
                             return fraction < 0.3;
                           })),
               Error);
}

TEST(SpherePacking, RefusesWithTheNameOfTheNumber)
{
  const auto expect = [](const char* word, const auto& spoil) {
    Parameters p = Small();
    spoil(p);
    EXPECT_NE(MessageOf(p).find(word), std::string::npos) << MessageOf(p);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect("RadiusMax is ", [](Parameters& p) { p.radiusMax = 12.6; }); // the box is 25 mm deep
  expect("12.5", [](Parameters& p) { p.radiusMax = 12.6; });
  expect("RadiusMax is ", [](Parameters& p) { p.radiusMax = 0.5; });
  expect("RadiusMin is ", [](Parameters& p) { p.radiusMin = 0.0; });
  expect("RadiusMin is ", [nan](Parameters& p) { p.radiusMin = nan; });
  expect("box", [](Parameters& p) { p.boxMax.y() = p.boxMin.y(); });
  expect("BoxMin is ", [nan](Parameters& p) { p.boxMin.x() = nan; });
  expect("GapMm is ", [](Parameters& p) { p.gapMm = -0.1; });
  expect("FillFraction is ", [](Parameters& p) { p.fillFraction = 1.1; });
  expect("FillFraction is ", [nan](Parameters& p) { p.fillFraction = nan; });
  expect("Count is ", [](Parameters& p) { p.count = -1; });
  expect("Misses is ", [](Parameters& p) { p.misses = 0; });
  expect("Exponent is ", [nan](Parameters& p) { p.exponent = nan; });
  expect("more than 5000000 spheres", [](Parameters& p) { p.radiusMin = p.radiusMax = 0.01; });
}
