// SPDX-License-Identifier: BSD-3-Clause
#include "ClosedBodies.h"
#include "Core/Base/Error.h"
#include "Filters/Phantoms/Anatomy.h"
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <map>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// Coarse, so that many are made quickly; the topology does not depend on it.
AnatomyParameters Coarse(std::uint64_t seed = 1)
{
  AnatomyParameters p;
  p.seed = seed;
  p.detailMm = 4.0;
  p.septa = p.lumps = 60;
  return p;
}

int Count(const TissueSurface& tissue, const std::string& name)
{
  return static_cast<int>(
      std::count_if(tissue.bodies.begin(), tissue.bodies.end(), [&](const TissueSurface::Body& b) { return b.name == name; }));
}

// All bodies whose name is not one of a tube's are seen whole from their middle.
bool IsTube(const std::string& name)
{
  for (const char* tube : {"vein", "rib", "aorta", "cava"})
    if (name.find(tube) != std::string::npos)
      return true;
  return false;
}

bool IsLayer(const std::string& name)
{
  static const std::array<const char*, 6> layers{"skin", "fat", "outer fascia", "muscle", "inner fascia", "trunk"};
  return std::find(layers.begin(), layers.end(), name) != layers.end();
}

void ExpectSound(const TissueSurface& tissue)
{
  tissue.Check();
  const std::vector<BodyShape> shapes = ShapesOf(tissue);
  ASSERT_FALSE(shapes.empty());
  ASSERT_EQ(shapes.front().name, "skin");
  const Eigen::AlignedBox3d trunk = shapes.front().box;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const BodyShape& shape = shapes[i];
    EXPECT_TRUE(shape.closed) << shape.name;
    EXPECT_EQ(shape.euler, 2) << shape.name;
    EXPECT_GT(shape.volume, 0.0) << shape.name;
    EXPECT_GT(shape.thinnest, 1e-3) << shape.name;
    EXPECT_TRUE(trunk.contains(shape.box)) << shape.name << " leaves the trunk";
    EXPECT_TRUE(shape.starShaped || IsTube(shape.name) || IsLayer(shape.name)) << shape.name << " may cut itself";
  }
}

// z of the upper side of a layer, from its triangles: the smallest crossing of a vertical line.
double UpperSide(const TissueSurface& tissue, const std::string& name, double x, double y)
{
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tissue.triangles.size(); ++i) {
    if (tissue.bodies[static_cast<std::size_t>(tissue.bodyOfTriangle[i])].name != name)
      continue;
    const auto corner = [&](std::size_t k) { return Vector3d(tissue.points[tissue.triangles[i][k]].cast<double>()); };
    const Vector3d a = corner(0), b = corner(1), c = corner(2);
    Eigen::Matrix3d m;
    m << a, b, c;
    m.row(2).setOnes();
    if (std::abs(m.determinant()) < 1e-12)
      continue;
    const Vector3d share = m.inverse() * Vector3d(x, y, 1.0);
    if (share.minCoeff() >= -1e-9)
      least = std::min(least, share.dot(Vector3d(a.z(), b.z(), c.z())));
  }
  return least;
}

} // namespace

TEST(Anatomy, BodiesAreClosedAndInTheTrunk)
{
  ExpectSound(MakeAnatomy(AnatomyParameters()));
}

TEST(Anatomy, EveryIndividualIsSound)
{
  for (std::uint64_t seed = 2; seed < 12; ++seed)
    for (const double variation : {0.0, 2.0}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", variation " + std::to_string(variation));
      AnatomyParameters p = Coarse(seed);
      p.variation = variation;
      ExpectSound(MakeAnatomy(p));
    }
}

TEST(Anatomy, TheEndsOfItsRangesAreSound)
{
  for (const bool largest : {false, true}) {
    SCOPED_TRACE(largest);
    AnatomyParameters p;
    for (Parameter& one : Without(Describe(p), {"Seed"}))
      one.SetNumber(std::holds_alternative<bool*>(one.value) ? largest : largest ? one.range.high : one.range.low);
    p.detailMm = 4.0;
    p.septa = std::min(p.septa, 300);
    p.lumps = std::min(p.lumps, 300);
    p.trunkWidthMm = p.trunkLengthMm = p.trunkDepthMm = 380.0;
    ExpectSound(MakeAnatomy(p));
    if (!largest) {
      const TissueSurface bare = MakeAnatomy(p);
      EXPECT_EQ(Count(bare, "liver") + Count(bare, "kidney") + Count(bare, "rib") + Count(bare, "vertebra"), 0);
      EXPECT_EQ(bare.bodies.size(), 4u) << "skin, fat, muscle and what lies behind";
    }
  }
}

TEST(Anatomy, LayersAreAsThickAsTheySay)
{
  AnatomyParameters p = Coarse(3);
  p.septa = 0;
  const TissueSurface tissue = MakeAnatomy(p);
  const std::array<const char*, 6> layers{"skin", "fat", "outer fascia", "muscle", "inner fascia", "trunk"};
  const std::array<double, 5> mean{p.skinMm, p.fatMm, p.fasciaMm, p.muscleMm, p.fasciaMm};
  std::array<double, 5> least, most;
  least.fill(1e9);
  most.fill(0.0);
  for (const double x : {-100.0, -61.0, -20.0, 0.0, 33.0, 80.0, 120.0})
    for (const double y : {-90.0, -41.0, 0.0, 27.0, 88.0}) {
      EXPECT_NEAR(UpperSide(tissue, "skin", x, y), p.standoffMm, 1e-4);
      for (std::size_t i = 0; i < 5; ++i) {
        const double thick = UpperSide(tissue, layers[i + 1], x, y) - UpperSide(tissue, layers[i], x, y);
        least[i] = std::min(least[i], thick);
        most[i] = std::max(most[i], thick);
      }
    }
  for (std::size_t i = 0; i < 5; ++i) {
    const double swing = i == 0 ? 0.25 * p.undulationMm : i % 2 == 0 ? 0.0 : p.undulationMm;
    EXPECT_GE(least[i], mean[i] - swing - 0.05) << layers[i];
    EXPECT_LE(most[i], mean[i] + swing + 0.05) << layers[i];
    EXPECT_GT(most[i] - least[i], swing > 1.0 ? 0.3 * swing : -1.0) << layers[i] << " does not undulate";
  }
}

TEST(Anatomy, WhatCountsWhere)
{
  AnatomyParameters p = Coarse();
  p.variation = 0.0;
  p.septa = p.ribs = 0;
  const TissueSurface tissue = MakeAnatomy(p);
  const auto at = [&](double x, double y, double z) {
    const int body = BodyAt(tissue, {x, y, z});
    return body < 0 ? std::string("gel") : tissue.bodies[static_cast<std::size_t>(body)].name;
  };
  const auto middle = [&](const std::string& name) {
    for (const BodyShape& shape : ShapesOf(tissue))
      if (shape.name == name)
        return Vector3d(shape.box.center());
    return Vector3d(Vector3d::Zero());
  };
  EXPECT_EQ(at(3, 2, 0.5), "gel");
  EXPECT_EQ(at(3, 2, p.standoffMm + 0.5 * p.skinMm), "skin");
  EXPECT_EQ(at(3, 2, p.standoffMm + p.skinMm + 0.5 * p.fatMm), "fat");
  EXPECT_EQ(at(3, 2, p.standoffMm + p.skinMm + p.fatMm + p.fasciaMm + 0.5 * p.muscleMm), "muscle");
  for (const char* name : {"sinus", "gallbladder", "vertebra", "stone"}) {
    const Vector3d m = middle(name);
    EXPECT_EQ(at(m.x(), m.y(), m.z()), name);
  }
  const Vector3d aorta = middle("aorta");
  EXPECT_EQ(at(aorta.x(), aorta.y(), aorta.z()), "aorta");
  const Vector3d liver = middle("liver");
  EXPECT_EQ(at(liver.x() + 200.0, 0, liver.z()), "gel") << "beside the trunk";
}

TEST(Anatomy, CountsAreThoseAskedFor)
{
  AnatomyParameters p = Coarse();
  p.cysts = 3;
  p.darkLesions = 1;
  p.brightLesions = 0;
  p.lesionRadiusMm = 5.0;
  p.ribs = 4;
  p.stones = 3;
  p.septa = 9;
  const TissueSurface tissue = MakeAnatomy(p);
  EXPECT_EQ(Count(tissue, "cyst"), 3);
  EXPECT_EQ(Count(tissue, "dark lesion"), 1);
  EXPECT_EQ(Count(tissue, "bright lesion"), 0);
  EXPECT_EQ(Count(tissue, "rib"), 4);
  EXPECT_EQ(Count(tissue, "stone"), 3);
  EXPECT_GE(Count(tissue, "portal vein"), 8) << "a tree, not a stump";
  EXPECT_EQ(Count(tissue, "portal vein"), Count(tissue, "portal vein wall"));
  EXPECT_GE(Count(tissue, "hepatic vein"), 8);
  EXPECT_LE(Count(tissue, "septum of fat") + Count(tissue, "septum of muscle"), 9);
  // Lumens come after all walls, so that blood flows through where branches meet.
  std::size_t lastWall = 0, firstLumen = tissue.bodies.size();
  for (std::size_t i = 0; i < tissue.bodies.size(); ++i) {
    if (tissue.bodies[i].name == "portal vein wall")
      lastWall = i;
    if (tissue.bodies[i].name == "portal vein")
      firstLumen = std::min(firstLumen, i);
  }
  EXPECT_LT(lastWall, firstLumen);
}

TEST(Anatomy, TreesGrowInEveryIndividual)
{
  for (std::uint64_t seed = 1; seed < 9; ++seed) {
    const TissueSurface tissue = MakeAnatomy(Coarse(seed));
    EXPECT_GE(Count(tissue, "portal vein"), 5) << "seed " << seed;
    EXPECT_GE(Count(tissue, "hepatic vein"), 5) << "seed " << seed;
    EXPECT_EQ(Count(tissue, "cyst") + Count(tissue, "dark lesion") + Count(tissue, "bright lesion"), 6) << "seed " << seed;
  }
}

TEST(Anatomy, OneSeedOneAnatomy)
{
  const TissueSurface a = MakeAnatomy(Coarse()), b = MakeAnatomy(Coarse()), other = MakeAnatomy(Coarse(2));
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_NE(a.points, other.points);
  // A change in the liver leaves the kidney alone.
  AnatomyParameters p = Coarse();
  p.cysts = 7;
  const auto box = [](const TissueSurface& tissue, const char* name) {
    for (const BodyShape& shape : ShapesOf(tissue))
      if (shape.name == name)
        return shape.box;
    return Eigen::AlignedBox3d();
  };
  const TissueSurface more = MakeAnatomy(p);
  for (const char* name : {"kidney", "gallbladder", "stone", "liver"})
    EXPECT_TRUE(box(a, name).isApprox(box(more, name), 0.0)) << name;
}

TEST(Anatomy, AbsurdNumbersAreRefusedWithTheirRange)
{
  AnatomyParameters p;
  for (Parameter& one : Without(Describe(p), {"Seed"})) {
    if (std::holds_alternative<bool*>(one.value))
      continue;
    const double right = one.Number();
    for (const double wrong : {one.range.low - 1.0, one.range.high + 1.0, std::numeric_limits<double>::quiet_NaN()}) {
      if (std::isnan(wrong) && !std::holds_alternative<double*>(one.value))
        continue;
      one.SetNumber(wrong);
      try {
        MakeAnatomy(p);
        ADD_FAILURE() << one.name << " = " << wrong << " was not refused";
      } catch (const Error& error) {
        EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
        EXPECT_NE(std::string(error.what()).find(one.name + " is"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("must be in ["), std::string::npos) << error.what();
      }
    }
    one.SetNumber(right);
  }
  EXPECT_NO_THROW(p.Check());
}

TEST(Anatomy, ATrunkWithoutRoomIsRefused)
{
  AnatomyParameters p;
  p.trunkDepthMm = 100.0;
  try {
    MakeAnatomy(p);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("TrunkDepthMm is 100 mm; the organs need"), std::string::npos) << error.what();
  }
  p.organScale = 0.5;
  p.spine = false;
  p.fatMm = 5.0;
  EXPECT_NO_THROW(p.Check());
}

TEST(Anatomy, StopsWhenAsked)
{
  const Progress stop([](double fraction) { return fraction < 0.4; });
  EXPECT_THROW(MakeAnatomy(Coarse(), stop), Error);
}
