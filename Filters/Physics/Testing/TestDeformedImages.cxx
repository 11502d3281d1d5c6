// SPDX-License-Identifier: BSD-3-Clause
// Images that follow a lattice: where each voxel is read, against the map itself and closed forms.
#include "DeformationCases.h"

namespace echorama {
namespace {

using namespace deformation;

// Where every voxel of a grid that is turned against the lattice comes from: the inverse, against the map itself.
TEST(DeformedImages, SourcesOfVoxelsAreTheInverse)
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
TEST(DeformedImages, VoxelsOnFacesAreFound)
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

// Linear functions survive trilinear sampling, so an image of one shows the inverse itself.
TEST(DeformedImages, ImagesFollowAffineFields)
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

TEST(DeformedImages, TheInverseFieldLeadsBack)
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

TEST(DeformedImages, ImagesOutsideAreRefusedMaskedKeptOrFollow)
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
TEST(DeformedImages, NearestIsTheClampedMap)
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

TEST(DeformedImages, TypesAndLabels)
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

TEST(DeformedImages, ImagesReachHalfAVoxelBeyondTheirCentres)
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

TEST(DeformedImages, CanBeStopped)
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
