// SPDX-License-Identifier: BSD-3-Clause
// Deformation against closed forms: affine maps, a fold, overlap without a fold, and brute force over all tetrahedra.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Physics/DeformedCells.h"
#include "Filters/Physics/DeformedSources.h"
#include "Filters/Physics/DeformGeometry.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

namespace echorama {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Deform = DeformGeometryParameters;

ImageGeometry Oblique(std::array<int, 3> dimensions = {6, 7, 5}, const Vector3d& spacing = {4.0, 3.0, 5.0})
{
  ImageGeometry lattice;
  lattice.dimensions = dimensions;
  lattice.spacing = spacing;
  lattice.origin = {-7.0, 11.0, 3.0};
  lattice.direction =
      (Eigen::AngleAxisd(0.4, Vector3d::UnitX()) * Eigen::AngleAxisd(-0.7, Vector3d(1, 2, 3).normalized())).toRotationMatrix();
  return lattice;
}

template <class Field>
std::vector<Vector3d> Sampled(const ImageGeometry& lattice, const Field& field)
{
  std::vector<Vector3d> values;
  for (int k = 0; k < lattice.dimensions[2]; ++k)
    for (int j = 0; j < lattice.dimensions[1]; ++j)
      for (int i = 0; i < lattice.dimensions[0]; ++i)
        values.push_back(field(lattice.IndexToWorld() * Vector3d(i, j, k)));
  return values;
}

// Points all over a lattice, \a margin inside of it in index units.
std::vector<Vector3d> PointsIn(const ImageGeometry& lattice, int count, double margin = 0.0, std::uint64_t seed = 3)
{
  Random random(seed);
  std::vector<Vector3d> points;
  for (int n = 0; n < count; ++n) {
    Vector3d index;
    for (int axis = 0; axis < 3; ++axis)
      index[axis] = random.Uniform(margin, lattice.dimensions[static_cast<std::size_t>(axis)] - 1 - margin);
    points.push_back(lattice.IndexToWorld() * index);
  }
  return points;
}

// A bump that presses and bulges; its derivative stays below 1.
struct Bump {
  Vector3d centre;
  double mm = 3.0, sigma = 9.0;
  Vector3d operator()(const Vector3d& x) const
  {
    const Vector3d d = x - centre;
    const double g = std::exp(-d.squaredNorm() / (2.0 * sigma * sigma));
    return mm * g * Vector3d(0.3 * std::sin(0.2 * d[1]), -0.5 * std::cos(0.15 * d[0]), 1.0);
  }
};

LatticeMap Pressed(const ImageGeometry& lattice, double mm = 3.0)
{
  return {lattice, Sampled(lattice, Bump{lattice.Centre(), mm})};
}

Deform With(Deform::Direction direction, Deform::Outside outside = Deform::Outside::Refuse, bool maskFolds = false)
{
  Deform p;
  p.direction = direction;
  p.outside = outside;
  p.maskFolds = maskFolds;
  return p;
}

constexpr auto Forward = Deform::Direction::Forward;
constexpr auto Backward = Deform::Direction::Backward;

// The kind and message of what a function throws.
template <class Function>
std::pair<int, std::string> Thrown(const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    return {static_cast<int>(error.GetKind()), error.what()};
  }
  return {-1, "nothing was thrown"};
}

template <class Function>
void ExpectThrow(const Function& function, Error::Kind kind, const std::vector<std::string>& words)
{
  const auto [thrown, message] = Thrown(function);
  EXPECT_EQ(thrown, static_cast<int>(kind)) << message;
  for (const auto& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << message << " does not say " << word;
}

const Matrix3d stretch = (Matrix3d() << 0.9, 0.2, -0.1, 0.05, 1.15, 0.1, -0.2, 0.1, 0.8).finished();
const Vector3d shift(2.0, -3.0, 1.5);
Vector3d Affine(const Vector3d& x)
{
  return stretch * x + shift;
}

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

// Where every voxel of a grid that is turned against the lattice comes from: the inverse, against the map itself.
TEST(DeformGeometry, SourcesOfVoxelsAreTheInverse)
{
  const ImageGeometry lattice = Oblique({12, 13, 9}, {2.5, 2.0, 3.0});
  const LatticeMap map = Pressed(lattice);
  ImageGeometry grid = Oblique({40, 37, 33}, {0.9, 0.8, 1.0});
  grid.direction = Eigen::AngleAxisd(0.3, Vector3d(3, 1, -1).normalized()).toRotationMatrix() * lattice.direction;
  grid.origin += lattice.Centre() - grid.Centre();
  std::size_t found = 0;
  std::vector<unsigned char> kinds(grid.VoxelCount(), 9);
  double worst = 0.0;
  const ThreadLimit one(1); // the visitor below sums
  const SourceCounts counts = VisitRestPlaces(map, false, grid, [&](const SourceSlab& slab) {
    std::size_t at = 0;
    for (int k = slab.firstSlice; k < slab.firstSlice + slab.slices; ++k)
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i, ++at) {
          kinds[(static_cast<std::size_t>(k) * 37 + static_cast<std::size_t>(j)) * 40 + static_cast<std::size_t>(i)] =
              static_cast<unsigned char>(slab.kinds[at]);
          if (slab.kinds[at] != SourceKind::Found)
            continue;
          ++found;
          const auto place = map.Find(slab.sources[at], false);
          ASSERT_TRUE(place) << slab.sources[at].transpose();
          const Vector3d went = lattice.IndexToWorld() * slab.sources[at] + map.DisplacementAt(*place);
          worst = std::max(worst, (went - grid.IndexToWorld() * Vector3d(i, j, k)).norm());
        }
  });
  EXPECT_LT(worst, 1e-10);
  EXPECT_EQ(counts.folded, 0u);
  EXPECT_EQ(counts.outside + found, grid.VoxelCount());
  // No voxel is forgotten: the search by boxes, which shares nothing with the rows, finds the same ones.
  const DeformedCells cells(map, map.WorldToIndex(), 0.0);
  const DeformedSearch search(cells);
  std::size_t there = 0;
  for (int k = 0; k < 33; k += 3)
    for (int j = 0; j < 37; j += 2)
      for (int i = 0; i < 40; ++i) {
        const auto place = search.Find(map.WorldToIndex() * grid.IndexToWorld() * Vector3d(i, j, k));
        there += place ? 1 : 0;
        EXPECT_EQ(place.has_value(),
                  kinds[(static_cast<std::size_t>(k) * 37 + static_cast<std::size_t>(j)) * 40 + static_cast<std::size_t>(i)] ==
                      static_cast<unsigned char>(SourceKind::Found))
            << i << ' ' << j << ' ' << k;
      }
  EXPECT_GT(there, 1000u);
}

// A cube of a lattice that is as fine as the voxels, moved by whole ones: faces and edges of tetrahedra run through all voxel
// centres.
TEST(DeformGeometry, VoxelsOnFacesAreFound)
{
  ImageGeometry lattice;
  lattice.dimensions = {9, 9, 9};
  const LatticeMap map(lattice, std::vector<Vector3d>(729, Vector3d(2.0, 0.0, -1.0)));
  ImageGeometry grid = lattice;
  grid.dimensions = {13, 9, 10};
  grid.origin = {0.0, 0.0, -1.0};
  std::size_t found = 0;
  const ThreadLimit one(1);
  const auto counts = VisitRestPlaces(map, false, grid, [&](const SourceSlab& slab) {
    std::size_t at = 0;
    for (int k = slab.firstSlice; k < slab.firstSlice + slab.slices; ++k)
      for (int j = 0; j < 9; ++j)
        for (int i = 0; i < 13; ++i, ++at)
          if (slab.kinds[at] == SourceKind::Found) {
            ++found;
            EXPECT_LT((slab.sources[at] - Vector3d(i - 2, j, k)).norm(), 1e-12);
          }
  });
  EXPECT_EQ(found, 729u);
  EXPECT_EQ(counts.outside, 13u * 9 * 10 - 729);
}

struct TestImage {
  ImageGeometry geometry;
  std::vector<double> in;
  std::vector<unsigned char> real;
};

// An image of a function of the place.
template <class Function>
TestImage ImageOf(const ImageGeometry& geometry, const Function& function)
{
  TestImage image{geometry, {}, {}};
  for (int k = 0; k < geometry.dimensions[2]; ++k)
    for (int j = 0; j < geometry.dimensions[1]; ++j)
      for (int i = 0; i < geometry.dimensions[0]; ++i)
        image.in.push_back(function(geometry.IndexToWorld() * Vector3d(i, j, k)));
  return image;
}

struct Out {
  std::vector<double> values;
  std::vector<unsigned char> valid;
  DeformReport report;
};

Out Deformed(const Deform& p, const LatticeMap& map, const TestImage& image, const ImageGeometry& grid,
             const Progress& progress = {})
{
  Out out{std::vector<double>(grid.VoxelCount(), -9.0), std::vector<unsigned char>(grid.VoxelCount(), 9), {}};
  DeformedImage d;
  d.geometry = image.geometry;
  if (!image.real.empty())
    d.real = {image.real.data(), image.geometry.dimensions};
  d.grid = grid;
  d.writers = {MixedArray<double>(image.in.data(), out.values.data(), 1)};
  d.valid = {out.valid.data(), grid.dimensions};
  out.report = DeformImage(p, map, d, progress);
  return out;
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

// Linear functions survive trilinear sampling, so an image of one shows the inverse itself.
TEST(DeformGeometry, ImagesFollowAffineFields)
{
  const ImageGeometry lattice = Oblique();
  const LatticeMap map(lattice, Sampled(lattice, [](const Vector3d& x) { return Vector3d(Affine(x) - x); }));
  const Vector3d slope(0.3, -1.1, 0.7);
  ImageGeometry geometry = Oblique({31, 28, 30}, {0.7, 0.7, 0.7});
  geometry.origin += lattice.Centre() - geometry.Centre();
  const TestImage image = ImageOf(geometry, [&](const Vector3d& x) { return slope.dot(x) + 5.0; });
  ImageGeometry grid = geometry;
  grid.origin += Affine(lattice.Centre()) - lattice.Centre();
  std::size_t compared = 0;
  const Out forward = Deformed(With(Forward, Deform::Outside::Mask), map, image, grid);
  const Out backward = Deformed(With(Backward, Deform::Outside::Mask), map, image, geometry);
  std::size_t voxel = 0;
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 28; ++j)
      for (int i = 0; i < 31; ++i, ++voxel) {
        const Vector3d y = grid.IndexToWorld() * Vector3d(i, j, k), x = stretch.inverse() * (y - shift);
        const Vector3d at = geometry.WorldToIndex() * x, cell = lattice.WorldToIndex() * x;
        const auto inside = [](const Vector3d& index, const ImageGeometry& box, double margin) {
          for (int axis = 0; axis < 3; ++axis)
            if (!(index[axis] > margin && index[axis] < box.dimensions[static_cast<std::size_t>(axis)] - 1 - margin))
              return false;
          return true;
        };
        if (inside(at, geometry, 1e-6) && inside(cell, lattice, 1e-6)) {
          ++compared;
          ASSERT_EQ(forward.valid[voxel], 1);
          EXPECT_NEAR(forward.values[voxel], slope.dot(x) + 5.0, 1e-11);
        } else if (!inside(at, geometry, -0.5 - 1e-6) || !inside(cell, lattice, -1e-6)) {
          EXPECT_EQ(forward.valid[voxel], 0);
          EXPECT_EQ(forward.values[voxel], 0.0);
        }
        const Vector3d here = geometry.IndexToWorld() * Vector3d(i, j, k), there = geometry.WorldToIndex() * Affine(here);
        if (inside(there, geometry, 1e-6) && inside(lattice.WorldToIndex() * here, lattice, 1e-6)) {
          ++compared;
          ASSERT_EQ(backward.valid[voxel], 1);
          EXPECT_NEAR(backward.values[voxel], slope.dot(Affine(here)) + 5.0, 1e-11);
        }
      }
  EXPECT_GT(compared, 10000u);
}

TEST(DeformGeometry, TheInverseFieldLeadsBack)
{
  const ImageGeometry lattice = Oblique({12, 13, 9}, {2.5, 2.0, 3.0});
  const LatticeMap map = Pressed(lattice);
  const ImageGeometry grid = Oblique({12, 13, 11}, {2.2, 1.9, 2.0});
  std::vector<Vector3d> field(grid.VoxelCount());
  std::vector<unsigned char> valid(grid.VoxelCount());
  DeformedImage d;
  d.geometry = d.grid = grid;
  d.valid = {valid.data(), grid.dimensions};
  d.displacements = {field.data(), grid.dimensions};
  DeformImage(With(Forward, Deform::Outside::Mask), map, d);
  std::size_t voxel = 0, there = 0;
  for (int k = 0; k < 11; ++k)
    for (int j = 0; j < 13; ++j)
      for (int i = 0; i < 12; ++i, ++voxel)
        if (valid[voxel]) {
          ++there;
          const Vector3d y = grid.IndexToWorld() * Vector3d(i, j, k), x = y + field[voxel];
          EXPECT_LT((x + map.DisplacementAt(*map.Find(map.WorldToIndex() * x, false)) - y).norm(), 1e-10);
        } else {
          EXPECT_EQ(field[voxel], Vector3d::Zero());
        }
  EXPECT_GT(there, 500u);
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

TEST(DeformGeometry, ImagesOutsideAreRefusedMaskedKeptOrFollow)
{
  ImageGeometry lattice;
  lattice.dimensions = {5, 5, 5};
  lattice.spacing = {2, 2, 2};
  lattice.origin = {10, 10, 10};
  const LatticeMap map(lattice, std::vector<Vector3d>(125, Vector3d(4.0, 0.0, 0.0)));
  ImageGeometry geometry;
  geometry.dimensions = {29, 29, 29};
  TestImage image = ImageOf(geometry, [](const Vector3d& x) { return x[0] + 100.0 * x[1] + 10000.0 * x[2]; });
  ExpectThrow([&] { Deformed(With(Forward), map, image, geometry); }, Error::Kind::BadInput,
              {std::to_string(29 * 29 * 29 - 729) + " of " + std::to_string(29 * 29 * 29), "Outside"});
  ExpectThrow([&] { Deformed(With(Backward), map, image, geometry); }, Error::Kind::BadInput, {"Outside"});
  const auto at = [](int i, int j, int k) { return static_cast<std::size_t>((k * 29 + j) * 29 + i); };
  const Out masked = Deformed(With(Forward, Deform::Outside::Mask), map, image, geometry);
  const Out kept = Deformed(With(Forward, Deform::Outside::Keep), map, image, geometry);
  const Out nearest = Deformed(With(Forward, Deform::Outside::Nearest), map, image, geometry);
  for (int k = 0; k < 29; ++k)
    for (int j = 0; j < 29; ++j)
      for (int i = 0; i < 29; ++i) {
        const std::size_t v = at(i, j, k);
        const bool side = j >= 10 && j <= 18 && k >= 10 && k <= 18, now = side && i >= 14 && i <= 22,
                   then = side && i >= 10 && i <= 18;
        EXPECT_EQ(masked.valid[v], now);
        EXPECT_EQ(kept.valid[v], now || !then);
        EXPECT_EQ(nearest.valid[v], i >= 4);
        const double own = image.in[v];
        if (now) {
          EXPECT_NEAR(masked.values[v], own - 4.0, 1e-9);
        }
        if (kept.valid[v]) {
          EXPECT_NEAR(kept.values[v], now ? own - 4.0 : own, 1e-9);
        }
        if (i >= 4) {
          EXPECT_NEAR(nearest.values[v], own - 4.0, 1e-9);
        }
      }
  // What is not real need not lie in the lattice.
  image.real.assign(image.in.size(), 0);
  for (int k = 10; k <= 18; ++k)
    for (int j = 10; j <= 18; ++j)
      for (int i = 10; i <= 18; ++i)
        image.real[at(i, j, k)] = i == 12 ? 0 : 1;
  const Out real = Deformed(With(Forward), map, image, geometry);
  EXPECT_EQ(std::accumulate(real.valid.begin(), real.valid.end(), std::size_t(0)), 8u * 81);
  EXPECT_EQ(real.valid[at(16, 12, 12)], 0);
  EXPECT_EQ(real.valid[at(17, 12, 12)], 1);
}

// With Nearest the layers around the lattice are the clamped map, at any distance and angle.
TEST(DeformGeometry, NearestIsTheClampedMap)
{
  const ImageGeometry lattice = Oblique({5, 4, 5}, {3.0, 3.0, 3.0});
  const LatticeMap map = Pressed(lattice, 2.0);
  ImageGeometry grid;
  grid.dimensions = {30, 30, 30};
  grid.spacing = {9.0, 9.0, 9.0}; // reaches 80 cells beyond: layers become thicker
  grid.origin = lattice.Centre() - grid.Centre();
  std::size_t found = 0;
  const ThreadLimit one(1);
  VisitRestPlaces(map, true, grid, [&](const SourceSlab& slab) {
    std::size_t at = 0;
    for (int k = slab.firstSlice; k < slab.firstSlice + slab.slices; ++k)
      for (int j = 0; j < 30; ++j)
        for (int i = 0; i < 30; ++i, ++at) {
          ASSERT_EQ(slab.kinds[at], SourceKind::Found);
          ++found;
          const Vector3d went = lattice.IndexToWorld() * slab.sources[at] + map.DisplacementAt(*map.Find(slab.sources[at], true));
          EXPECT_LT((went - grid.IndexToWorld() * Vector3d(i, j, k)).norm(), 1e-9);
        }
  });
  EXPECT_EQ(found, 27000u);
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

TEST(DeformGeometry, TypesAndLabels)
{
  ImageGeometry lattice;
  lattice.dimensions = {5, 3, 3};
  const LatticeMap map(lattice, std::vector<Vector3d>(45, Vector3d(0.25, 0.0, 0.0)));
  std::vector<unsigned char> bytes(90), bytesOut(90, 7);
  std::vector<std::int64_t> labels(45), labelsOut(45, 7);
  for (std::size_t i = 0; i < 45; ++i) {
    bytes[2 * i] = static_cast<unsigned char>(10 * (i % 5));
    bytes[2 * i + 1] = static_cast<unsigned char>(200 + i / 5);
    labels[i] = static_cast<std::int64_t>(i % 5) << 40;
  }
  std::vector<unsigned char> valid(45);
  DeformedImage d;
  d.geometry = d.grid = lattice;
  d.valid = {valid.data(), lattice.dimensions};
  d.writers = {MixedArray<unsigned char>(bytes.data(), bytesOut.data(), 2), NearestArray(labels.data(), labelsOut.data(), 8)};
  DeformImage(With(Forward), map, d);
  for (std::size_t i = 0; i < 45; ++i) {
    const auto x = static_cast<int>(i % 5);
    EXPECT_EQ(valid[i], x > 0);
    EXPECT_EQ(bytesOut[2 * i], x > 0 ? 10 * x - 2 : 0); // 10 x - 2.5, halves up
    EXPECT_EQ(bytesOut[2 * i + 1], x > 0 ? 200 + static_cast<int>(i / 5) : 0);
    EXPECT_EQ(labelsOut[i], x > 0 ? static_cast<std::int64_t>(x) << 40 : 0);
  }
  Deform p = With(Forward);
  p.nearestVoxel = true;
  DeformImage(p, map, d);
  EXPECT_EQ(bytesOut[4], 20);
}

TEST(DeformGeometry, ImagesReachHalfAVoxelBeyondTheirCentres)
{
  ImageGeometry lattice; // a single cell
  lattice.dimensions = {2, 2, 2};
  lattice.spacing = {20, 20, 20};
  lattice.origin = {-10, -10, -10};
  ImageGeometry geometry;
  geometry.dimensions = {5, 3, 3};
  const TestImage image = ImageOf(geometry, [](const Vector3d& x) { return 10.0 + x[0]; });
  const auto row = [&](double shift) {
    const LatticeMap map(lattice, std::vector<Vector3d>(8, Vector3d(shift, 0.0, 0.0)));
    const Out out = Deformed(With(Forward), map, image, geometry);
    return std::vector<double>(out.values.begin(), out.values.begin() + 5);
  };
  const auto near = [](const std::vector<double>& a, const std::vector<double>& b) {
    for (std::size_t i = 0; i < 5; ++i)
      EXPECT_NEAR(a[i], b[i], 1e-12);
  };
  near(row(0.25), {10, 10.75, 11.75, 12.75, 13.75});
  near(row(0.75), {0, 10.25, 11.25, 12.25, 13.25});
  near(row(-0.25), {10.25, 11.25, 12.25, 13.25, 14});
  near(row(-0.75), {10.75, 11.75, 12.75, 13.75, 0});
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

TEST(DeformGeometry, CanBeStopped)
{
  const ImageGeometry lattice = Oblique({12, 13, 9}, {2.5, 2.0, 3.0});
  const LatticeMap map = Pressed(lattice);
  const TestImage image = ImageOf(Oblique({40, 40, 40}, {0.5, 0.5, 0.5}), [](const Vector3d& x) { return x[0]; });
  double told = 0.0;
  ExpectThrow(
      [&] {
        Deformed(With(Forward, Deform::Outside::Mask), map, image, image.geometry, Progress([&told](double fraction) {
                   told = std::max(told, fraction);
                   return fraction < 0.4;
                 }));
      },
      Error::Kind::Cancelled, {"stopped"});
  EXPECT_GE(told, 0.4);
}

} // namespace
} // namespace echorama
