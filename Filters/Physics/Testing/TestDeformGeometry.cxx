// SPDX-License-Identifier: BSD-3-Clause
// Deformation against closed forms: affine maps, a fold, overlap without a fold, and brute force over all tetrahedra.
#include "DeformationCases.h"

namespace echorama {
namespace {

using namespace deformation;

TEST(DeformGeometry, AffineFieldsAreExactBothWays)
{
  const ImageGeometry lattice = Oblique();
  const LatticeMap map(lattice, Sampled(lattice, [](const Vector3d& x) { return Vector3d(Affine(x) - x); }));
  const auto points = PointsIn(lattice, 500);
  double scale = 0.0;
  for (const auto& x : points)
    scale = std::max(scale, x.norm());
  auto moved = points;
  std::vector<unsigned char> valid;
  std::vector<Matrix3d> gradients;
  DeformReport report = DeformPoints(With(Forward), map, moved, valid, &gradients);
  EXPECT_EQ(report.count, 500u);
  EXPECT_EQ(report.outside + report.folded + report.folds.folded, 0u);
  EXPECT_EQ(report.folds.tetrahedra, 6u * 5 * 6 * 4);
  EXPECT_NEAR(report.folds.smallestRatio, stretch.determinant(), 1e-12);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((moved[i] - Affine(points[i])).norm(), 1e-12 * scale);
    EXPECT_LT((gradients[i] - stretch).norm(), 1e-12);
    EXPECT_EQ(valid[i], 1);
  }
  report = DeformPoints(With(Backward), map, moved, valid, &gradients);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((moved[i] - points[i]).norm(), 1e-12 * scale);
    EXPECT_LT((gradients[i] - stretch.inverse()).norm(), 1e-11);
  }
}

// The tetrahedra are those that the header tells of: an independent search by all barycentric coordinates finds the same map.
TEST(DeformGeometry, IsLinearInKuhnsTetrahedra)
{
  const ImageGeometry lattice = Oblique({3, 3, 4});
  Random random(8);
  const LatticeMap map(lattice, Sampled(lattice, [&random](const Vector3d&) { return Vector3d(0.5 * random.Direction()); }));
  for (const auto& x : PointsIn(lattice, 300)) {
    const Vector3d index = lattice.WorldToIndex() * x;
    int found = 0;
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i)
          for (const auto& order : latticeOrders) {
            Vector3d corners[4], u[4];
            int at[3] = {i, j, k};
            for (int c = 0; c < 4; ++c) {
              corners[c] = {double(at[0]), double(at[1]), double(at[2])};
              u[c] = map.Displacement(at[0], at[1], at[2]);
              if (c < 3)
                ++at[order[c]];
            }
            Matrix3d edges;
            edges << corners[1] - corners[0], corners[2] - corners[0], corners[3] - corners[0];
            const Vector3d b = edges.inverse() * (index - corners[0]);
            if (b.minCoeff() < 0.0 || b.sum() > 1.0)
              continue;
            ++found;
            const Vector3d truth = (1.0 - b.sum()) * u[0] + b[0] * u[1] + b[1] * u[2] + b[2] * u[3];
            EXPECT_LT((map.DisplacementAt(*map.Find(index, false)) - truth).norm(), 1e-13);
          }
    EXPECT_EQ(found, 1);
  }
}

TEST(DeformGeometry, BackwardUndoesForward)
{
  const ImageGeometry lattice = Oblique({23, 8, 13}, {1.4, 3.1, 2.0});
  const LatticeMap map = Pressed(lattice);
  auto points = PointsIn(lattice, 3000);
  for (int k = 0; k < 13; ++k) // and all points of the lattice: those at its rim are at that of the search's boxes
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 23; ++i)
        points.push_back(lattice.IndexToWorld() * Vector3d(i, j, k));
  auto moved = points;
  std::vector<unsigned char> valid;
  DeformPoints(With(Forward), map, moved, valid);
  double furthest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    furthest = std::max(furthest, (moved[i] - points[i]).norm());
  EXPECT_GT(furthest, 2.0);
  DeformPoints(With(Backward), map, moved, valid);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT((moved[i] - points[i]).norm(), 1e-6 * 1.4);
}

TEST(DeformGeometry, NoDisplacementChangesNoBit)
{
  const ImageGeometry lattice = Oblique();
  const LatticeMap map(lattice, Sampled(lattice, [](const Vector3d&) { return Vector3d(Vector3d::Zero()); }));
  auto points = PointsIn(lattice, 100);
  const auto before = points;
  std::vector<unsigned char> valid;
  DeformPoints(With(Forward), map, points, valid);
  EXPECT_EQ(points, before);
  // An image on a grid that is turned against the lattice comes through its rasterised inverse.
  ImageGeometry geometry;
  geometry.dimensions = {15, 14, 13};
  geometry.origin = lattice.Centre() - Vector3d(7.0, 6.0, 6.0);
  const TestImage image = ImageOf(geometry, [](const Vector3d& x) { return std::sin(x[0] * x[1]) + x[2]; });
  const Out out = Deformed(With(Forward, Deform::Outside::Keep), map, image, geometry);
  EXPECT_EQ(out.values, image.in);
}

// Compressed so far that a layer turns inside out: x + u goes up to 4, back to 2, and up again.
TEST(DeformGeometry, FoldsAreToldAndMasked)
{
  ImageGeometry lattice;
  lattice.dimensions = {7, 3, 3};
  const double goes[7] = {0, 2, 4, 3, 2, 4, 6}; // cells 2 and 3 are inside out
  const LatticeMap map(lattice, Sampled(lattice, [&goes](const Vector3d& x) {
                         return Vector3d(goes[static_cast<int>(std::lround(x[0]))] - x[0], 0.0, 0.0);
                       }));
  std::vector<Vector3d> points{{0.5, 1.1, 0.3}, {2.5, 0.2, 1.0}, {5.5, 1.0, 1.0}};
  std::vector<unsigned char> valid;
  ExpectThrow([&] { DeformPoints(With(Forward), map, points, valid); }, Error::Kind::NotPossible,
              {"48 of the 144", "cell (2, 0, 0)", "is -1", "MaskFolds"});
  DeformReport report = DeformPoints(With(Forward, Deform::Outside::Refuse, true), map, points, valid);
  EXPECT_EQ(report.folds.folded, 48u);
  EXPECT_EQ(report.folded, 1u);
  EXPECT_EQ(valid, (std::vector<unsigned char>{1, 0, 1}));
  EXPECT_NEAR(points[1][0], 3.5, 1e-12); // where it went can be told all the same

  // Backward: from 2 to 4 three layers lie over each other.
  points = {{1.0, 1.1, 0.3}, {3.3, 0.2, 1.0}, {4.7, 1.0, 1.0}};
  report = DeformPoints(With(Backward, Deform::Outside::Refuse, true), map, points, valid);
  EXPECT_EQ(valid, (std::vector<unsigned char>{1, 0, 1}));
  EXPECT_NEAR(points[0][0], 0.5, 1e-12);
  EXPECT_NEAR(points[2][0], 5.35, 1e-12);

  ImageGeometry grid = lattice;
  grid.dimensions = {60, 2, 2};
  grid.origin = {0.05, 0.4, 0.7};
  grid.spacing = {0.1, 1.0, 1.0};
  const TestImage image = ImageOf(lattice, [](const Vector3d& x) { return 10.0 * x[0]; });
  ExpectThrow([&] { Deformed(With(Forward), map, image, grid); }, Error::Kind::NotPossible, {"folds 48"});
  const Out out = Deformed(With(Forward, Deform::Outside::Refuse, true), map, image, grid);
  EXPECT_EQ(out.report.folded, 20u * 4);
  for (std::size_t i = 0; i < 60; ++i) {
    const double y = 0.05 + 0.1 * static_cast<double>(i);
    EXPECT_EQ(out.valid[i], y < 2.0 || y > 4.0) << y;
    if (y < 2.0) {
      EXPECT_NEAR(out.values[i], 5.0 * y, 1e-10);
    }
  }
}

// A sheet that is wound once and a half around an axis folds nowhere, and still lies over itself.
TEST(DeformGeometry, OverlapWithoutAFoldIsTold)
{
  ImageGeometry lattice;
  lattice.dimensions = {61, 3, 3};
  const auto wound = [](const Vector3d& x) {
    const double angle = x[0] / 60.0 * 3.0 * 3.14159265358979;
    return Vector3d((10.0 - x[1]) * std::sin(angle), -(10.0 - x[1]) * std::cos(angle), x[2]);
  };
  const LatticeMap map(lattice, Sampled(lattice, [&](const Vector3d& x) { return Vector3d(wound(x) - x); }));
  ImageGeometry grid;
  grid.dimensions = {45, 45, 2};
  grid.origin = {-11.03, -11.02, 0.6};
  grid.spacing = {0.5, 0.5, 0.5};
  const TestImage image = ImageOf(lattice, [](const Vector3d& x) { return x[1]; });
  ExpectThrow([&] { Deformed(With(Forward), map, image, grid); }, Error::Kind::NotPossible, {"several places", "voxels"});
  const Out out = Deformed(With(Forward, Deform::Outside::Refuse, true), map, image, grid);
  EXPECT_EQ(out.report.folds.folded, 0u);
  for (int j = 0; j < 45; ++j)
    for (int i = 0; i < 45; ++i) {
      const Vector3d y = grid.IndexToWorld() * Vector3d(i, j, 0);
      const double radius = std::hypot(y[0], y[1]);
      if (radius > 8.1 && radius < 9.9 && std::abs(y[0]) > 0.2) { // the first half turn has x > 0 and is covered again
        EXPECT_EQ(out.valid[static_cast<std::size_t>(45 * j + i)], y[0] < 0.0 ? 1 : 0) << y.transpose();
      }
    }
  std::vector<Vector3d> points{{9.0, 0.3, 1.0}, {-9.0, 0.3, 1.0}};
  std::vector<unsigned char> valid;
  ExpectThrow([&] { DeformPoints(With(Backward), map, points, valid); }, Error::Kind::NotPossible,
              {"several places to 1 points"});
}

TEST(DeformGeometry, PointsOutsideAreRefusedMaskedKeptOrFollow)
{
  ImageGeometry lattice;
  lattice.dimensions = {4, 4, 4};
  const auto field = [](const Vector3d& x) { return Vector3d(0.1 * x[1], 0.2, 0.05 * x[0] * x[2]); };
  const LatticeMap map(lattice, Sampled(lattice, field));
  const std::vector<Vector3d> points{{1.0, 1.5, 2.0}, {4.0, 1.0, -2.0}, {-1.0, 9.0, 1.0}};
  std::vector<unsigned char> valid;
  auto moved = points;
  ExpectThrow([&] { DeformPoints(With(Forward), map, moved, valid); }, Error::Kind::BadInput,
              {"2 of 3 points", "(4, 1, -2)", "Outside"});
  EXPECT_EQ(moved, points);
  auto report = DeformPoints(With(Forward, Deform::Outside::Mask), map, moved, valid);
  EXPECT_EQ(report.outside, 2u);
  EXPECT_EQ(valid, (std::vector<unsigned char>{1, 0, 0}));
  EXPECT_EQ(moved[1], points[1]);
  EXPECT_GT((moved[0] - points[0]).norm(), 0.1);
  moved = points;
  report = DeformPoints(With(Forward, Deform::Outside::Keep), map, moved, valid);
  EXPECT_EQ(report.outside, 2u);
  EXPECT_EQ(valid, (std::vector<unsigned char>{1, 1, 1}));
  EXPECT_EQ(moved[2], points[2]);
  moved = points;
  std::vector<Matrix3d> gradients;
  DeformPoints(With(Forward, Deform::Outside::Nearest), map, moved, valid, &gradients);
  EXPECT_LT((moved[1] - (points[1] + field({3, 1, 0}))).norm(), 1e-12);
  EXPECT_LT((moved[2] - (points[2] + field({0, 3, 1}))).norm(), 1e-12);
  // Beyond the face x = 3 nothing changes with x; beyond z = 0 nothing with z.
  EXPECT_LT((gradients[1] - (Matrix3d() << 1, 0.1, 0, 0, 1, 0, 0, 0, 1).finished()).norm(), 1e-12);
  DeformPoints(With(Backward, Deform::Outside::Nearest), map, moved, valid);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT((moved[i] - points[i]).norm(), 1e-10) << i;

  // Backward, what is empty now but lay in the lattice was not kept.
  const LatticeMap gone(lattice, std::vector<Vector3d>(64, Vector3d(10.0, 0.0, 0.0)));
  moved = {{1.0, 1.0, 1.0}, {11.0, 1.0, 1.0}, {5.0, 1.0, 1.0}};
  DeformPoints(With(Backward, Deform::Outside::Keep), gone, moved, valid);
  EXPECT_EQ(valid, (std::vector<unsigned char>{0, 1, 1}));
  EXPECT_LT((moved[1] - Vector3d(1, 1, 1)).norm(), 1e-12);
  EXPECT_EQ(moved[2], Vector3d(5, 1, 1));
}

TEST(DeformGeometry, ALatticeMayHaveHoles)
{
  ImageGeometry lattice;
  lattice.dimensions = {6, 4, 4};
  std::vector<Vector3d> u = Sampled(lattice, [](const Vector3d& x) { return Vector3d(0.5, 0.1 * x[0], 0.0); });
  std::vector<unsigned char> exists(u.size(), 1);
  for (std::size_t at = 0; at < u.size(); ++at)
    if (at % 6 >= 4) { // from x = 4 on
      exists[at] = 0;
      u[at].setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  const LatticeMap map(lattice, u, exists);
  std::vector<Vector3d> points{{3.0, 1.0, 2.5}, {3.0 + 1e-12, 1.3, 2.5}, {3.2, 1.0, 1.0}, {2.9, 3.0, 3.0}};
  std::vector<unsigned char> valid;
  std::vector<Matrix3d> gradients;
  const auto report = DeformPoints(With(Forward, Deform::Outside::Mask), map, points, valid, &gradients);
  EXPECT_EQ(report.folds.tetrahedra, 6u * 3 * 3 * 3);
  EXPECT_EQ(valid, (std::vector<unsigned char>{1, 1, 0, 1})); // the face of what exists belongs to it
  EXPECT_LT((points[0] - Vector3d(3.5, 1.3, 2.5)).norm(), 1e-12);
  for (const std::size_t i : {0u, 1u, 3u})
    EXPECT_LT((gradients[i] - (Matrix3d() << 1, 0, 0, 0.1, 1, 0, 0, 0, 1).finished()).norm(), 1e-12) << i;
  DeformPoints(With(Backward, Deform::Outside::Mask), map, points, valid);
  EXPECT_LT((points[0] - Vector3d(3.0, 1.0, 2.5)).norm(), 1e-12);
  std::fill(exists.begin(), exists.end(), static_cast<unsigned char>(0));
  const LatticeMap nothing(lattice, u, exists);
  ExpectThrow([&] { DeformPoints(With(Forward, Deform::Outside::Mask), nothing, points, valid); }, Error::Kind::BadInput,
              {"known nowhere"});
}

TEST(DeformGeometry, ThreadsDoNotMatter)
{
  const ImageGeometry lattice = Oblique({12, 13, 9}, {2.5, 2.0, 3.0});
  const LatticeMap map = Pressed(lattice, 30.0); // folds
  ImageGeometry geometry = Oblique({60, 50, 40}, {0.5, 0.5, 0.6});
  const TestImage image = ImageOf(geometry, [](const Vector3d& x) { return std::sin(x[0]) + std::cos(x[1] * x[2]); });
  std::vector<Out> outs;
  std::vector<std::vector<Vector3d>> moved;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    outs.push_back(Deformed(With(Forward, Deform::Outside::Keep, true), map, image, geometry));
    moved.push_back(PointsIn(lattice, 9000));
    std::vector<unsigned char> valid;
    DeformPoints(With(Backward, Deform::Outside::Keep, true), map, moved.back(), valid);
    EXPECT_GT(outs.back().report.folded, 0u);
    EXPECT_EQ(outs.back().values, outs.front().values);
    EXPECT_EQ(outs.back().valid, outs.front().valid);
    EXPECT_EQ(outs.back().report.folds.smallestCell, outs.front().report.folds.smallestCell);
    EXPECT_EQ(moved.back(), moved.front());
  }
}

TEST(DeformGeometry, RefusesWhatIsNoDisplacement)
{
  const ImageGeometry lattice = Oblique();
  auto u = Sampled(lattice, Bump{lattice.Centre()});
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e7}) {
    auto spoilt = u;
    spoilt[(2 * 7 + 3) * 6 + 4][1] = bad;
    ExpectThrow([&] { LatticeMap(lattice, spoilt); }, Error::Kind::BadInput, {"lattice point (4, 3, 2)", "not finite"});
  }
  ExpectThrow([&] { LatticeMap(lattice, std::vector<Vector3d>(5)); }, Error::Kind::BadInput, {"210 points", "5 vectors"});
  u[(2 * 7 + 6) * 6 + 5][0] = std::numeric_limits<double>::quiet_NaN();
  ExpectThrow([&] { LatticeMap(lattice, u); }, Error::Kind::BadInput, {"lattice point (5, 6, 2)"});
  u[(2 * 7 + 6) * 6 + 5][0] = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ImageGeometry flat = lattice;
    flat.dimensions[axis] = 1;
    ExpectThrow([&] { LatticeMap(flat, Sampled(flat, Bump{flat.Centre()})); }, Error::Kind::BadInput,
                {"single point along axis " + std::to_string(axis)});
  }
  const LatticeMap map(lattice, u);
  std::vector<Vector3d> points = PointsIn(lattice, 4);
  points[2][0] = std::numeric_limits<double>::quiet_NaN();
  std::vector<unsigned char> valid;
  ExpectThrow([&] { DeformPoints(With(Forward), map, points, valid); }, Error::Kind::BadInput, {"point 2", "not finite"});
  points.clear();
  EXPECT_EQ(DeformPoints(With(Forward), map, points, valid).count, 0u);
  EXPECT_TRUE(valid.empty());
  EXPECT_EQ(DeformPoints(With(Backward), map, points, valid).count, 0u);
  TestImage empty;
  ExpectThrow([&] { Deformed(With(Forward), map, empty, lattice); }, Error::Kind::BadInput, {"the image", "dimension"});
}

} // namespace
} // namespace echorama
