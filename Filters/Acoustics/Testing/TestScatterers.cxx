// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "SpeckleTools.h"
#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <set>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

const Eigen::AlignedBox3d smallBox(Vector3d(-10.0, -8.0, 20.0), Vector3d(10.0, 8.0, 40.0));

Scatterers InBox(const Material& material, const ScattererParameters& parameters = {}, const Eigen::AlignedBox3d& box = smallBox)
{
  return Scatterers::Make(parameters, {material}, AllFirst, box);
}

// A displacement that is the same everywhere around the small box.
DisplacementField Shift(const Vector3d& by)
{
  ImageGeometry lattice;
  lattice.dimensions = {12, 12, 12};
  lattice.origin = {-60.0, -60.0, -30.0};
  lattice.spacing = {10.0, 10.0, 10.0};
  return DisplacementField(lattice, std::vector<Vector3d>(12 * 12 * 12, by));
}

std::size_t CountIn(const Listed& list, const Eigen::AlignedBox3d& box)
{
  return static_cast<std::size_t>(
      std::count_if(list.points.begin(), list.points.end(), [&](const Vector3d& point) { return box.contains(point); }));
}

std::string MessageOf(const std::function<void()>& call, Error::Kind kind)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

} // namespace

TEST(Scatterers, FillTheRegionWithTheirDensity)
{
  for (const double density : {0.5, 8.0, 30.0}) {
    const Listed list = ListOf(InBox(Tissue(density)));
    // One per cell of the lattice: only those at the border of the box may be more or fewer.
    EXPECT_NEAR(static_cast<double>(CountIn(list, smallBox)) / (smallBox.volume() * density), 1.0, 0.06) << density;
    double sum = 0.0;
    for (const float amplitude : list.amplitudes) {
      const double strength = static_cast<double>(amplitude) * std::sqrt(density);
      sum += strength;
      EXPECT_NEAR(std::abs(strength), 1.0, 1e-5);
    }
    const auto n = static_cast<double>(list.amplitudes.size());
    EXPECT_NEAR(sum / n, 0.0, 4.0 / std::sqrt(n));
  }
}

TEST(Scatterers, AreThoseOfTheMaterialWhateverIsAskedFor)
{
  // A smaller region finds the same scatterers in it.
  const Eigen::AlignedBox3d part(Vector3d(-3.0, -3.0, 25.0), Vector3d(3.0, 3.0, 31.0));
  const Listed all = ListOf(InBox(Tissue(8.0))), some = ListOf(InBox(Tissue(8.0), {}, part));
  std::set<std::array<int, 3>> places; // in micrometres
  const auto placeOf = [](const Vector3d& p) {
    return std::array<int, 3>{static_cast<int>(std::lround(1e3 * p.x())), static_cast<int>(std::lround(1e3 * p.y())),
                              static_cast<int>(std::lround(1e3 * p.z()))};
  };
  for (const Vector3d& point : all.points)
    places.insert(placeOf(point));
  EXPECT_EQ(CountIn(all, part), CountIn(some, part));
  std::size_t missing = 0;
  for (const Vector3d& point : some.points)
    missing += part.contains(point) && places.count(placeOf(point)) == 0;
  EXPECT_LE(missing, 2u); // rounded the other way
}

TEST(Scatterers, SparserMaterialsKeepASubsetAsLoud)
{
  ScattererParameters parameters;
  parameters.densityPerMm3 = 8.0;
  const Listed dense = ListOf(InBox(Tissue(8.0), parameters)), sparse = ListOf(InBox(Tissue(2.0), parameters));
  EXPECT_NEAR(static_cast<double>(sparse.points.size()) / static_cast<double>(dense.points.size()), 0.25, 0.01);
  double densePower = 0.0, sparsePower = 0.0;
  for (const float a : dense.amplitudes)
    densePower += static_cast<double>(a * a);
  for (const float a : sparse.amplitudes)
    sparsePower += static_cast<double>(a * a);
  EXPECT_NEAR(sparsePower / densePower, 1.0, 0.04);
  std::set<std::array<int, 3>> places;
  const auto placeOf = [](const Vector3d& p) {
    return std::array<int, 3>{static_cast<int>(std::lround(1e3 * p.x())), static_cast<int>(std::lround(1e3 * p.y())),
                              static_cast<int>(std::lround(1e3 * p.z()))};
  };
  for (const Vector3d& point : dense.points)
    places.insert(placeOf(point));
  std::size_t missing = 0;
  for (const Vector3d& point : sparse.points)
    missing += places.count(placeOf(point)) == 0;
  EXPECT_LE(missing, 20u); // of some 13,000, rounded the other way
}

TEST(Scatterers, FollowTheirMaterials)
{
  Material loud = Tissue(8.0), clear = Tissue(8.0), faint = Tissue(8.0);
  loud.backscatterDb = 20.0;
  clear.backscatterDb = Material::clearDb;
  faint.backscatterDb = -20.0;
  const auto byX = [](const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials) {
    for (std::size_t i = 0; i < count; ++i)
      materials[i] = points[i].x() < -5.0f ? 0 : points[i].x() < 0.0f ? 1 : points[i].x() < 5.0f ? 2 : -1;
  };
  const Listed list = ListOf(Scatterers::Make({}, {loud, clear, faint}, byX, smallBox));
  double loudPower = 0.0, faintPower = 0.0;
  for (std::size_t i = 0; i < list.points.size(); ++i) {
    const double x = list.points[i].x(), power = std::pow(static_cast<double>(list.amplitudes[i]), 2);
    EXPECT_FALSE(x > -4.999 && x < -0.001) << "in clear fluid";
    EXPECT_FALSE(x > 5.001) << "where there is nothing";
    if (smallBox.contains(list.points[i]))
      (x < -5.0 ? loudPower : faintPower) += power;
  }
  EXPECT_NEAR(10.0 * std::log10(loudPower / faintPower), 40.0, 0.4);
}

TEST(Scatterers, ANewSeedIsNewTissue)
{
  ScattererParameters other;
  other.seed = 2;
  const Listed a = ListOf(InBox(Tissue(8.0))), b = ListOf(InBox(Tissue(8.0))), c = ListOf(InBox(Tissue(8.0), other));
  EXPECT_EQ(a.amplitudes, b.amplitudes);
  EXPECT_EQ(a.points, b.points);
  ASSERT_EQ(a.amplitudes.size(), c.amplitudes.size());
  double product = 0.0;
  for (std::size_t i = 0; i < a.amplitudes.size(); ++i)
    product += 8.0 * static_cast<double>(a.amplitudes[i]) * static_cast<double>(c.amplitudes[i]);
  EXPECT_NEAR(product / static_cast<double>(a.amplitudes.size()), 0.0, 0.02);
}

TEST(Scatterers, GoAlongWithTheMaterial)
{
  const Vector3d by(3.0, -2.0, 5.0);
  const DisplacementField shift = Shift(by);
  ScattererParameters moved;
  moved.displacement = &shift;
  Eigen::AlignedBox3d there = smallBox;
  there.translate(by);
  const Listed rest = ListOf(InBox(Tissue(8.0))), gone = ListOf(InBox(Tissue(8.0), moved, there));
  // Every one that rests well inside is found again, moved.
  std::set<std::array<int, 3>> places;
  const auto placeOf = [](const Vector3d& p) {
    return std::array<int, 3>{static_cast<int>(std::floor(100.0 * p.x())), static_cast<int>(std::floor(100.0 * p.y())),
                              static_cast<int>(std::floor(100.0 * p.z()))};
  };
  for (const Vector3d& point : gone.points)
    places.insert(placeOf(point - by));
  std::size_t missing = 0, all = 0;
  for (const Vector3d& point : rest.points)
    if (smallBox.contains(point)) {
      ++all;
      missing += places.count(placeOf(point)) == 0;
    }
  EXPECT_GT(all, 50000u);
  EXPECT_LT(missing, all / 1000); // over the edge of a place by rounding
}

TEST(Scatterers, AStretchedMaterialIsThinner)
{
  ImageGeometry lattice;
  lattice.dimensions = {12, 12, 12};
  lattice.origin = {-60.0, -60.0, -30.0};
  lattice.spacing = {10.0, 10.0, 10.0};
  std::vector<Vector3d> coefficients;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i)
        coefficients.emplace_back(0.2 * (-60.0 + 10.0 * i), 0.0, 0.0); // x becomes 1.2 x: linear fields are exact
  const DisplacementField stretch(lattice, coefficients);
  ScattererParameters parameters;
  parameters.displacement = &stretch;
  const Listed list = ListOf(InBox(Tissue(8.0), parameters));
  EXPECT_NEAR(static_cast<double>(CountIn(list, smallBox)) / (8.0 * smallBox.volume() / 1.2), 1.0, 0.02);
}

TEST(Scatterers, DoNotDependOnThreads)
{
  Scatterers one, two;
  {
    const ThreadLimit limit(1);
    one = InBox(Tissue(8.0));
  }
  {
    const ThreadLimit limit(2);
    two = InBox(Tissue(8.0));
  }
  const Listed a = ListOf(one), b = ListOf(two);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.amplitudes, b.amplitudes);
}

TEST(Scatterers, OnlyWantedBricksAreMade)
{
  const Eigen::AlignedBox3d corner(Vector3d(-10.0, -8.0, 20.0), Vector3d(-6.0, -4.0, 24.0));
  const Scatterers some = Scatterers::Make({}, {Tissue(8.0)}, AllFirst, smallBox,
                                           [&](const Eigen::AlignedBox3d& box) { return box.intersects(corner); });
  EXPECT_LT(some.Count(), 8u * 9u * 9u * 9u);
  EXPECT_EQ(CountIn(ListOf(some), corner), CountIn(ListOf(InBox(Tissue(8.0))), corner));
  EXPECT_GE(some.MemoryBytes(), 16 * some.Count());
  EXPECT_LT(some.MemoryBytes(), 40 * some.Count());
}

TEST(Scatterers, FindBesideMissesNone)
{
  const Scatterers all = InBox(Tissue(8.0));
  constexpr double radius = 2.5;
  double largest = 0.0; // of the bricks
  for (const Scatterers::Brick& brick : all.Bricks())
    largest = std::max(largest, static_cast<double>(brick.halfSize.norm()));
  struct Line {
    Vector3d from, direction;
    double length;
  };
  for (const Line& line : {Line{{-6.0, 2.0, 18.0}, {0.5, -0.3, 0.8}, 25.0}, Line{{7.0, 1.0, 27.0}, {-0.9, 0.2, 0.3}, 14.0},
                           Line{{-2.0, -6.0, 30.0}, {0.3, 0.9, -0.2}, 0.5}}) {
    const Vector3d direction = line.direction.normalized();
    std::vector<std::uint32_t> found;
    all.FindBeside(
        line.from, direction, line.length, [](double, double) { return radius; }, found);
    const std::set<std::uint32_t> set(found.begin(), found.end());
    EXPECT_EQ(set.size(), found.size()) << "each once";
    EXPECT_LT(set.size(), all.Bricks().size() / 2);
    for (std::uint32_t b = 0; b < all.Bricks().size(); ++b) {
      const Scatterers::Brick& brick = all.Bricks()[b];
      const Vector3d centre = brick.centre - line.from;
      if (set.count(b)) { // nor is much more found
        EXPECT_LT((centre - centre.dot(direction) * direction).norm(), radius + largest + 1e-3);
        EXPECT_GT(centre.dot(direction), -largest - 1e-3);
        EXPECT_LT(centre.dot(direction), line.length + largest + 1e-3);
        continue;
      }
      for (std::uint32_t i = 0; i < brick.count; ++i) {
        const Vector3d place = centre + Vector3d(static_cast<double>(all.X(brick)[i]), static_cast<double>(all.Y(brick)[i]),
                                                 static_cast<double>(all.Z(brick)[i]));
        const double s = place.dot(direction);
        if (s >= 0.0 && s <= line.length) {
          ASSERT_GT((place - s * direction).norm(), radius);
        }
      }
    }
  }
}

TEST(Scatterers, EmptyScenesAreEmpty)
{
  Material clear = Tissue(0.0);
  EXPECT_EQ(InBox(clear).Count(), 0u);
  EXPECT_EQ(InBox(Tissue(8.0), {}, Eigen::AlignedBox3d()).Count(), 0u);
  EXPECT_EQ(Scatterers::Make({}, {}, AllFirst, smallBox).Count(), 0u);
  EXPECT_EQ(Scatterers::At({}, {}).Count(), 0u);
  std::vector<std::uint32_t> found;
  Scatterers().FindBeside(
      Vector3d::Zero(), Vector3d::UnitZ(), 10.0, [](double, double) { return 1.0; }, found);
  EXPECT_TRUE(found.empty());
}

TEST(Scatterers, RefuseWhatIsOutOfRange)
{
  ScattererParameters parameters;
  parameters.densityPerMm3 = 1001.0;
  EXPECT_NE(MessageOf([&] { InBox(Tissue(8.0), parameters); }, Error::Kind::InvalidParameter).find("DensityPerMm3"),
            std::string::npos);
  parameters = {};
  parameters.maxBytes = 1e5;
  const std::string message = MessageOf([&] { InBox(Tissue(8.0), parameters); }, Error::Kind::TooLarge);
  EXPECT_NE(message.find("maxBytes"), std::string::npos);
  EXPECT_NE(message.find("densityPerMm3"), std::string::npos);
  const Eigen::AlignedBox3d huge(Vector3d::Constant(-1e6), Vector3d::Constant(1e6));
  EXPECT_NE(MessageOf([&] { InBox(Tissue(8.0), {}, huge); }, Error::Kind::TooLarge).find("densityPerMm3"), std::string::npos);
  const Eigen::AlignedBox3d away(Vector3d::Constant(1e8), Vector3d::Constant(1e8 + 1.0));
  MessageOf([&] { InBox(Tissue(8.0), {}, away); }, Error::Kind::InvalidParameter);
  MessageOf([&] { InBox(Tissue(-1.0)); }, Error::Kind::InvalidParameter);
  MessageOf([] { Scatterers::At({Vector3d::Zero()}, {}); }, Error::Kind::BadInput);
  MessageOf([] { Scatterers::At({Vector3d::Constant(std::nan(""))}, {1.0f}); }, Error::Kind::BadInput);
  MessageOf([] { Scatterers::Make({}, {Tissue(8.0)}, AllFirst, smallBox, {}, Progress([](double) { return false; })); },
            Error::Kind::Cancelled);
}
