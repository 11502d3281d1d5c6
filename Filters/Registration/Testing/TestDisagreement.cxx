// SPDX-License-Identifier: BSD-3-Clause
// Known shifts between volumes that see one tissue, each with a grain of its own.
#include "Core/Base/Error.h"
#include "Filters/Registration/Disagreement.h"
#include "LocalAlignScene.h"
#include "Testing/Sanitized.h"

using namespace echorama;
using namespace echorama::testing_scene;
using Eigen::Vector3d;

namespace {

/// Waves of 4 to 16 mm in all directions: what an ultrasound volume shows beside its speckle.
class Tissue {
public:
  explicit Tissue(std::uint64_t seed)
  {
    for (std::uint64_t w = 0; w < 60; ++w) {
      Random random(seed, w);
      const double length = random.Uniform(4.0, 16.0);
      waves_.push_back({random.Direction() * (6.283185307179586 / length), random.Uniform(0.0, 6.283185307179586)});
    }
  }
  double operator()(const Vector3d& p) const
  {
    double sum = 0.0;
    for (const auto& [k, phase] : waves_)
      sum += std::cos(k.dot(p) + phase);
    return 100.0 + 5.0 * sum;
  }

private:
  std::vector<std::pair<Vector3d, double>> waves_;
};

// Smoothed noise: what two views do not have in common. Correlated over about two voxels.
Volume<float> Grain(const std::array<int, 3>& dimensions, std::uint64_t seed, double amplitude)
{
  Volume<float> rough(dimensions), smooth(dimensions);
  for (std::ptrdiff_t i = 0; i < rough.View().Size(); ++i)
    rough.View()[i] = static_cast<float>(Random(seed, static_cast<std::uint64_t>(i)).Normal());
  const auto in = rough.View();
  const auto out = smooth.View();
  for (int k = 1; k + 1 < dimensions[2]; ++k)
    for (int j = 1; j + 1 < dimensions[1]; ++j)
      for (int i = 1; i + 1 < dimensions[0]; ++i) {
        float sum = 0.0f;
        for (int n = 0; n < 27; ++n)
          sum += in(i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1);
        out(i, j, k) = static_cast<float>(amplitude) * sum / std::sqrt(27.0f);
      }
  return smooth;
}

ImageGeometry Cube(int side, double spacing, const Vector3d& middle, double turn = 0.0)
{
  ImageGeometry geometry = Box({side, side, side}, Vector3d::Constant(spacing), Vector3d::Zero());
  geometry.direction = Eigen::AngleAxisd(turn, Vector3d(1, -2, 1).normalized()).toRotationMatrix();
  geometry.origin = middle - (geometry.Centre() - geometry.origin);
  return geometry;
}

// A volume that sees a field of the world, with its grain.
Seen Look(const ImageGeometry& geometry, const std::function<double(const Vector3d&)>& field, std::uint64_t seed, double grain)
{
  const Volume<float> noise = Grain(geometry.dimensions, seed, grain);
  const Eigen::Affine3d toIndex = geometry.WorldToIndex();
  return Seen(geometry, [&](const Vector3d& p) {
    const Vector3d at = toIndex * p;
    return static_cast<float>(field(p)) + noise.View()(static_cast<int>(std::lround(at.x())),
                                                       static_cast<int>(std::lround(at.y())),
                                                       static_cast<int>(std::lround(at.z())));
  });
}

DisagreementMap MapOf(const Seen& fixed, const Seen& moving, const DisagreementParameters& p = {})
{
  return Disagreement({{&fixed.pyramid, Pose::Identity(), "fixed"}, {&moving.pyramid, Pose::Identity(), "moving"}}, p);
}

double ShareKnown(const DisagreementMap& map)
{
  return static_cast<double>(map.known) / static_cast<double>(std::max<std::int64_t>(1, map.compared));
}

} // namespace

// Gain, offset, grain, and geometries that are turned against each other and the world: the shift is found nearly everywhere.
TEST(Disagreement, AKnownShiftIsFoundBlockByBlock)
{
  const Tissue texture(3);
  const Vector3d shift(1.3, -0.8, 0.45);
  const Seen fixed = Look(Cube(56, 0.9, {0, 0, 0}, 0.4), texture, 1, 10.0);
  const Seen moving = Look(
      Cube(60, 0.8, {6, 2, -3}, -0.2), [&](const Vector3d& p) { return 0.4 * texture(p - shift) + 60.0; }, 2, 4.0);
  const DisagreementMap map = MapOf(fixed, moving);
  EXPECT_GT(map.compared, 150);
  EXPECT_GT(ShareKnown(map), 0.9);
  double squares = 0.0, scores = 0.0, lengths = 0.0;
  int count = 0;
  for (const LocalShift& each : map.shifts)
    if (each.knownDirections == 3) {
      squares += (each.shift - shift).squaredNorm();
      scores += (each.shift - shift).squaredNorm() / (3.0 * each.errorMm * each.errorMm);
      lengths += each.mm;
      ++count;
    }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(squares / count), 0.25) << "mm";
  EXPECT_NEAR(lengths / count, shift.norm(), 0.1);
  // What it claims of its error holds, and not by claiming anything.
  EXPECT_LT(scores / count, 1.5);
  EXPECT_GT(scores / count, 0.05);
}

TEST(Disagreement, WhereVolumesAgreeItIsNothing)
{
  const Tissue texture(5);
  const Seen fixed = Look(Cube(56, 0.9, {0, 0, 0}), texture, 1, 10.0),
             moving = Look(Cube(56, 0.9, {5, 0, 0}, 0.3), texture, 2, 10.0);
  const DisagreementMap map = MapOf(fixed, moving);
  EXPECT_GT(ShareKnown(map), 0.9);
  double sum = 0.0;
  for (const LocalShift& each : map.shifts)
    sum += each.mm;
  EXPECT_LT(sum / static_cast<double>(map.known), 0.15) << "mm";
}

// A shift that grows along x: the map follows it, and its blocks lie where they say.
TEST(Disagreement, AShiftThatVariesIsFollowed)
{
  const Tissue texture(7);
  const auto shiftAt = [](const Vector3d& p) { return Vector3d(0.0, 0.08 * p.x(), 0.0); };
  const Seen fixed = Look(Cube(64, 0.9, {0, 0, 0}), texture, 1, 6.0);
  const Seen moving = Look(
      Cube(64, 0.9, {0, 0, 0}), [&](const Vector3d& p) { return texture(p - shiftAt(p)); }, 2, 6.0);
  const DisagreementMap map = MapOf(fixed, moving);
  const auto& n = map.geometry.dimensions;
  double squares = 0.0, slope = 0.0, across = 0.0;
  int count = 0;
  for (int at = 0; at < n[0] * n[1] * n[2]; ++at) {
    const LocalShift& each = map.shifts[static_cast<std::size_t>(at)];
    if (each.knownDirections < 3)
      continue;
    const Vector3d place = map.geometry.IndexToWorld() * Vector3d(at % n[0], at / n[0] % n[1], at / (n[0] * n[1]));
    squares += (each.shift - shiftAt(place)).squaredNorm();
    slope += each.shift.y() * place.x();
    across += place.x() * place.x();
    ++count;
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(std::sqrt(squares / count), 0.3);
  EXPECT_NEAR(slope / across, 0.08, 0.008);
}

// The aperture problem: of a plane only how far it went along its normal can be known.
TEST(Disagreement, AnEdgeTellsItsNormalAlone)
{
  const Vector3d normal = Vector3d(2, 1, -1).normalized(), shift(1.5, 0.5, 1.0);
  const auto edge = [&](const Vector3d& p) { return 100.0 + 60.0 * std::tanh(normal.dot(p) / 2.0); };
  const Seen fixed = Look(Cube(48, 0.9, {0, 0, 0}), edge, 1, 4.0);
  const Seen moving = Look(
      Cube(48, 0.9, {0, 0, 0}), [&](const Vector3d& p) { return edge(p - shift); }, 2, 4.0);
  const DisagreementMap map = MapOf(fixed, moving);
  int single = 0, sideways = 0, off = 0;
  for (const LocalShift& each : map.shifts) {
    single += each.knownDirections == 1;
    if (each.knownDirections == 0)
      continue;
    const double along = each.shift.dot(normal), across = (each.shift - along * normal).norm();
    EXPECT_NEAR(each.known.trace(), each.knownDirections, 1e-9);
    EXPECT_LT((each.known * each.shift - each.shift).norm(), 1e-9);
    sideways += each.knownDirections > 1 || across > 0.2 * std::abs(along) + 0.05;
    off += std::abs(along - shift.dot(normal)) > 3.0 * each.errorMm;
  }
  EXPECT_GT(single, 80);
  EXPECT_EQ(sideways, 0);
  // Blocks that an edge only touches see its end fade, which looks as if it had moved.
  EXPECT_LT(off, 0.15 * single);
}

// Nothing in common: uniform regions, and grain that is each volume's own.
TEST(Disagreement, WhereThereIsNothingToSeeNothingIsTold)
{
  const auto flat = [](const Vector3d&) { return 100.0; };
  // A corner differs, so that the volumes as a whole are not constant.
  const auto nearlyFlat = [](const Vector3d& p) { return p.minCoeff() > 18.0 ? 200.0 : 100.0; };
  const Seen uniform = Look(Cube(48, 0.9, {0, 0, 0}), nearlyFlat, 1, 0.0),
             again = Look(Cube(48, 0.9, {2, 0, 0}), nearlyFlat, 2, 0.0);
  const DisagreementMap none = MapOf(uniform, again);
  EXPECT_GT(none.compared, 100);
  EXPECT_LE(none.known, 8) << "the corner";
  const Seen one = Look(Cube(64, 0.9, {0, 0, 0}), flat, 1, 20.0), other = Look(Cube(64, 0.9, {0, 0, 0}), flat, 2, 20.0);
  const DisagreementMap chance = MapOf(one, other);
  EXPECT_GT(chance.compared, 300);
  EXPECT_LT(ShareKnown(chance), 0.01);
  // A gain that goes up with depth is no texture.
  const auto ramp = [](const Vector3d& p) { return 100.0 + 2.0 * p.z(); };
  const DisagreementMap depth = MapOf(Look(Cube(64, 0.9, {0, 0, 0}), ramp, 1, 8.0), Look(Cube(64, 0.9, {0, 0, 0}), ramp, 2, 8.0));
  EXPECT_LT(ShareKnown(depth), 0.01);
}

// Two bodies that have nothing to do with each other agree nowhere, whatever the size of what they show.
TEST(Disagreement, DifferentTissuesDoNotAgreeByChance)
{
  ECHORAMA_SKIP_SANITIZED();
  const DisagreementMap fine =
      MapOf(Look(Cube(64, 0.9, {0, 0, 0}), Tissue(21), 1, 5.0), Look(Cube(64, 0.9, {0, 0, 0}), Tissue(22), 2, 5.0));
  const DisagreementMap coarse =
      MapOf(Look(Cube(64, 0.9, {0, 0, 0}), Texture(21), 1, 5.0), Look(Cube(64, 0.9, {0, 0, 0}), Texture(22), 2, 5.0));
  EXPECT_LT(ShareKnown(fine), 0.05);
  EXPECT_LT(ShareKnown(coarse), 0.05);
}

// What repeats fits in several places, and what lies beyond the search in none: neither is told.
TEST(Disagreement, WhatIsAmbiguousOrTooFarIsNotTold)
{
  const auto waves = [](const Vector3d& p) {
    const double k = 2.0 * 3.14159265358979 / 6.0; // per mm: three periods fit into the search
    return 100.0 + 30.0 * std::sin(k * p.x()) * std::sin(k * p.y()) * std::sin(k * p.z());
  };
  const DisagreementMap repeats =
      MapOf(Look(Cube(56, 0.9, {0, 0, 0}), waves, 1, 5.0), Look(Cube(56, 0.9, {0, 0, 0}), waves, 2, 5.0));
  EXPECT_LT(ShareKnown(repeats), 0.02);
  const Tissue texture(9);
  const Vector3d far(14.0, 0.0, 0.0);
  const DisagreementMap beyond =
      MapOf(Look(Cube(64, 0.9, {0, 0, 0}), texture, 1, 6.0),
            Look(
                Cube(64, 0.9, {0, 0, 0}), [&](const Vector3d& p) { return texture(p - far); }, 2, 6.0));
  int small = 0;
  for (const LocalShift& each : beyond.shifts)
    small += each.knownDirections == 3 && each.mm < 2.0;
  EXPECT_LT(small, 0.02 * static_cast<double>(beyond.compared)) << "that agree by chance";
}

TEST(Disagreement, ValidRegionsAreKeptAndTheWorstPairIsTold)
{
  const Tissue texture(11);
  const float nan = std::nanf("");
  const auto cut = [&](const Seen& whole) {
    return Seen(whole.geometry, [&](const Vector3d& p) {
      const Vector3d at = whole.geometry.WorldToIndex() * p;
      return p.x() > 4.0 ? nan
                         : whole.voxels.View()(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())),
                                               static_cast<int>(std::lround(at.z())));
    });
  };
  const Seen one = Look(Cube(56, 0.9, {0, 0, 0}), texture, 1, 6.0);
  const Seen two = cut(Look(Cube(56, 0.9, {0, 0, 0}), texture, 2, 6.0));
  const Seen three = Look(
      Cube(56, 0.9, {0, 0, 0}), [&](const Vector3d& p) { return texture(p - Vector3d(0, 2.0, 0)); }, 3, 6.0);
  const DisagreementMap cutMap = MapOf(one, two);
  EXPECT_GT(cutMap.known, 50);
  const auto& n = cutMap.geometry.dimensions;
  const double last = (cutMap.geometry.IndexToWorld() * Vector3d(n[0] - 1, 0, 0)).x();
  EXPECT_LE(last, 4.0 + 1e-9) << "blocks with more than half outside are not compared";
  double sum = 0.0;
  for (const LocalShift& each : cutMap.shifts)
    sum += each.mm;
  EXPECT_LT(sum / static_cast<double>(cutMap.known), 0.2) << "the border is no edge";
  // Three: the third disagrees with both others by 2 mm.
  const std::vector<PlacedVolume> all{
      {&one.pyramid, Pose::Identity(), "1"}, {&two.pyramid, Pose::Identity(), "2"}, {&three.pyramid, Pose::Identity(), "3"}};
  const DisagreementMap map = Disagreement(all);
  int third = 0, known = 0;
  for (std::size_t i = 0; i < map.shifts.size(); ++i) {
    known += map.fixed[i] >= 0;
    third += map.moving[i] == 2 && std::abs(map.shifts[i].mm - 2.0) < 0.5;
  }
  EXPECT_GT(known, 100);
  EXPECT_GT(third, 0.95 * known);
  // A pose that moves it back is taken into account.
  std::vector<PlacedVolume> aligned = all;
  aligned[2].volumeToWorld.translation() = Vector3d(0, -2.0, 0);
  const DisagreementMap agreed = Disagreement(aligned);
  double most = 0.0;
  for (const LocalShift& each : agreed.shifts)
    most += each.mm / static_cast<double>(std::max<std::int64_t>(1, agreed.known));
  EXPECT_LT(most, 0.2);
}

TEST(Disagreement, DoesNotDependOnThreadsAndCanBeStopped)
{
  const Tissue texture(13);
  const Seen one = Look(Cube(40, 0.9, {0, 0, 0}), texture, 1, 6.0), two = Look(Cube(40, 0.9, {3, 0, 0}, 0.2), texture, 2, 6.0);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return MapOf(one, two);
  };
  const DisagreementMap a = run(1), b = run(0);
  ASSERT_EQ(a.shifts.size(), b.shifts.size());
  EXPECT_GT(a.known, 20);
  for (std::size_t i = 0; i < a.shifts.size(); ++i) {
    EXPECT_EQ(a.shifts[i].shift, b.shifts[i].shift);
    EXPECT_EQ(a.shifts[i].errorMm, b.shifts[i].errorMm);
  }
  double last = 0.0;
  const std::vector<PlacedVolume> volumes{{&one.pyramid, Pose::Identity(), "1"}, {&two.pyramid, Pose::Identity(), "2"}};
  const Progress stop([&](double fraction) {
    EXPECT_GE(fraction, last - 1e-9);
    last = fraction;
    return fraction < 0.4;
  });
  try {
    Disagreement(volumes, {}, stop);
    ADD_FAILURE() << "it was not stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

// Where blocks can be follows from geometries alone: each map is a part of it at whole blocks, and the whole of it is needed.
TEST(Disagreement, TheGridHoldsEveryMap)
{
  const Tissue texture(19);
  const Seen one = Look(Cube(40, 0.9, {0, 0, 0}, 0.4), texture, 1, 2.0),
             two = Look(Cube(44, 0.8, {7, 3, -4}, -0.3), texture, 2, 2.0);
  DisagreementParameters p;
  p.blockMm = 7.0;
  const DisagreementMap map = MapOf(one, two, p);
  const ImageGeometry grid = DisagreementGrid({one.geometry, two.geometry}, p);
  ASSERT_GT(map.known, 50);
  const Vector3d offset = (map.geometry.origin - grid.origin).cwiseQuotient(grid.spacing);
  EXPECT_EQ(map.geometry.spacing, grid.spacing);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    EXPECT_NEAR(offset[axis], std::round(offset[axis]), 1e-9);
    EXPECT_GE(offset[axis], -1e-9);
    EXPECT_LE(std::round(offset[axis]) + map.geometry.dimensions[a], grid.dimensions[a]);
    // No wider than the overlap: its volumes are 36 mm wide, 62 mm at most across their corners.
    EXPECT_LE(grid.dimensions[a] * grid.spacing[axis], 62.0);
  }
  // Volumes that fill their grids along the world's axes tell something in all but blocks at the end, half of which nobody sees.
  const Seen first = Look(Cube(40, 0.9, {0, 0, 0}), texture, 1, 2.0), second = Look(Cube(40, 0.9, {0, 0, 0}), texture, 2, 2.0);
  const DisagreementMap full = MapOf(first, second, p);
  const ImageGeometry whole = DisagreementGrid({first.geometry, second.geometry}, p);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_LE(full.geometry.dimensions[axis], whole.dimensions[axis]);
    EXPECT_GE(full.geometry.dimensions[axis], whole.dimensions[axis] - 2);
  }
  // None: one block, as of the map.
  EXPECT_EQ(DisagreementGrid({one.geometry, Cube(24, 0.9, {200, 0, 0})}).VoxelCount(), 1u);
  EXPECT_THROW(DisagreementGrid({one.geometry}), Error);
  p.stepMm = 0.01;
  EXPECT_THROW(DisagreementGrid({one.geometry, two.geometry}, p), Error);
}

TEST(Disagreement, RefusesWhatItCannotDo)
{
  const Tissue texture(15);
  const Seen one = Look(Cube(24, 0.9, {0, 0, 0}), texture, 1, 6.0), far = Look(Cube(24, 0.9, {200, 0, 0}), texture, 2, 6.0);
  const PlacedVolume placed{&one.pyramid, Pose::Identity(), "1"};
  EXPECT_THROW(Disagreement({placed}), Error);
  DisagreementParameters p;
  p.searchMm = 0.0;
  EXPECT_THROW(Disagreement({placed, placed}, p), Error);
  p = {};
  p.stepMm = 0.01;
  EXPECT_THROW(Disagreement({placed, placed}, p), Error);
  // Volumes that do not touch: an empty map.
  const DisagreementMap map = MapOf(one, far);
  EXPECT_EQ(map.compared, 0);
  EXPECT_EQ(map.known, 0);
  EXPECT_EQ(map.shifts.size(), map.geometry.VoxelCount());
}
