// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Imaging/VoxelTypes.h"
#include "Filters/Stitching/RowSampler.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

template <class T>
struct Scene {
  Volume<T> values;
  Volume<unsigned char> valid;
  PosedVolume<T> Posed(const ImageGeometry& geometry) const { return {values.View(), valid.View(), geometry}; }
};

template <class T>
Scene<T> RandomScene(const std::array<int, 3>& n, Random& random, bool notNumbers = false)
{
  Scene<T> scene{Volume<T>(n), Volume<unsigned char>(n)};
  for (T& v : scene.values.View())
    v = static_cast<T>(random.Uniform(0.0, 200.0));
  for (unsigned char& m : scene.valid.View())
    m = random.Below(10) != 0;
  if constexpr (std::is_floating_point_v<T>)
    if (notNumbers)
      for (T& v : scene.values.View())
        if (random.Below(12) == 0)
          v = random.Below(2) ? std::numeric_limits<T>::quiet_NaN() : std::numeric_limits<T>::infinity();
  return scene;
}

// Every voxel of the grid against Sampler, also outside of the box.
template <class T, class A>
void ExpectAsSampler(const PosedVolume<T>& volume, const ImageGeometry& grid, double tolerance)
{
  const RowSampler<T> rows(volume, grid);
  const Sampler<T> sampler(volume.intensity, volume.valid);
  const Eigen::Affine3d map = volume.geometry.WorldToIndex() * grid.IndexToWorld();
  const GridBox& box = rows.Box();
  std::vector<unsigned char> inside(box.size[0]);
  std::vector<A> values(box.size[0]);
  std::vector<unsigned char> readInside(box.size[0]);
  std::vector<A> readValues(box.size[0]);
  int found = 0;
  for (int k = 0; k < grid.dimensions[2]; ++k)
    for (int j = 0; j < grid.dimensions[1]; ++j) {
      if (box.HasRow(j, k)) {
        rows.Inside(j, k, inside.data());
        rows.Values(j, k, inside.data(), values.data());
        rows.Read(j, k, readInside.data(), readValues.data());
        ASSERT_EQ(readInside, inside) << j << " " << k;
        for (std::size_t i = 0; i < inside.size(); ++i)
          if (inside[i]) {
            ASSERT_EQ(readValues[i], values[i]) << i << " " << j << " " << k;
          }
      }
      for (int i = 0; i < grid.dimensions[0]; ++i) {
        const Eigen::Vector3d at = map * Eigen::Vector3d(i, j, k);
        double value = 0.0;
        const bool real = sampler.Linear(at[0], at[1], at[2], value);
        const bool inBox = box.HasRow(j, k) && i >= box.first[0] && i < box.first[0] + box.size[0];
        ASSERT_EQ(real, inBox && inside[i - box.first[0]] == 1) << i << " " << j << " " << k;
        if (real) {
          ASSERT_NEAR(values[i - box.first[0]], value, tolerance) << i << " " << j << " " << k;
          ++found;
        }
      }
    }
  EXPECT_GT(found, 20);
}

ImageGeometry Grid(std::array<int, 3> dimensions, double spacing)
{
  ImageGeometry grid;
  grid.dimensions = dimensions;
  grid.spacing.setConstant(spacing);
  return grid;
}

} // namespace

TEST(RowSampler, GivesWhatSamplerGives)
{
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    ImageGeometry geometry;
    geometry.dimensions = {11, 9, 7};
    geometry.spacing = {0.8, 1.1, 0.9};
    geometry.direction = ExpRotation(random.Uniform(0.0, 3.0) * random.Direction());
    geometry.origin = Eigen::Vector3d(6.0, 6.0, 6.0) + 3.0 * random.Direction();
    const ImageGeometry grid = Grid({17, 15, 16}, 0.83);
    ExpectAsSampler<unsigned char, float>(RandomScene<unsigned char>(geometry.dimensions, random).Posed(geometry), grid, 1e-3);
    ExpectAsSampler<short, float>(RandomScene<short>(geometry.dimensions, random).Posed(geometry), grid, 1e-3);
    ExpectAsSampler<unsigned short, float>(RandomScene<unsigned short>(geometry.dimensions, random).Posed(geometry), grid, 1e-3);
    ExpectAsSampler<float, float>(RandomScene<float>(geometry.dimensions, random, true).Posed(geometry), grid, 1e-3);
    ExpectAsSampler<double, double>(RandomScene<double>(geometry.dimensions, random, true).Posed(geometry), grid, 1e-9);
  }
}

// Rows of many voxels, which are done some at a time; with a hole, with a mask that leaves out nothing, and without one.
TEST(RowSampler, LongRows)
{
  Random random(8);
  for (int trial = 0; trial < 6; ++trial) {
    ImageGeometry geometry;
    geometry.dimensions = {210, 9, 7};
    geometry.direction = ExpRotation(random.Uniform(0.0, 0.02) * random.Direction());
    geometry.origin = 2.0 * random.Direction();
    const ImageGeometry grid = Grid({260, 12, 9}, trial % 2 ? 0.83 : 1.0);
    Scene<unsigned char> bytes = RandomScene<unsigned char>(geometry.dimensions, random);
    Scene<float> floats = RandomScene<float>(geometry.dimensions, random);
    for (unsigned char& valid : bytes.valid.View())
      valid = 1;
    PosedVolume<unsigned char> open = bytes.Posed(geometry);
    ExpectAsSampler<unsigned char, float>(open, grid, 1e-3);
    open.valid = {};
    ExpectAsSampler<unsigned char, float>(open, grid, 1e-3);
    PosedVolume<float> openFloats = floats.Posed(geometry);
    openFloats.valid = {};
    ExpectAsSampler<float, float>(openFloats, grid, 1e-3);
    for (int i = 90; i < 120; ++i)
      bytes.valid.View()(i, 4, 3) = 0;
    ExpectAsSampler<unsigned char, float>(bytes.Posed(geometry), grid, 1e-3);
    floats.values.View()(100, 4, 3) = std::numeric_limits<float>::quiet_NaN();
    openFloats.intensity = floats.values.View();
    ExpectAsSampler<float, double>(openFloats, grid, 1e-3);
  }
}

TEST(RowSampler, TurnedAboutAnAxisOfTheGridNothingIsWrittenBesideTheRow)
{
  // In the last slice no voxel has a neighbour along z, and rows at the corners of the box hardly meet the volume.
  const std::array<int, 3> n{32, 32, 6};
  const Volume<unsigned char> values(n, 1);
  for (const double degrees : {-1.5, 0.7, 40.0}) {
    ImageGeometry geometry = Grid(n, 1.0);
    geometry.direction = Eigen::AngleAxisd(degrees * 3.14159265358979 / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    ImageGeometry grid = Grid({80, 80, 8}, 1.0);
    grid.origin = {-25.0, -25.0, 0.0};
    const RowSampler<unsigned char> rows({values.View(), {}, geometry}, grid);
    const GridBox& box = rows.Box();
    constexpr std::size_t beside = 64;
    const std::size_t width = static_cast<std::size_t>(box.size[0]);
    for (int k = box.first[2]; k < box.first[2] + box.size[2]; ++k)
      for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j) {
        std::vector<unsigned char> inside(width + 2 * beside, 9), read = inside;
        std::vector<float> found(width + 2 * beside, 9.0f);
        rows.Inside(j, k, inside.data() + beside);
        rows.Read(j, k, read.data() + beside, found.data() + beside);
        ASSERT_EQ(read, inside) << degrees << " degrees, row " << j << " of slice " << k;
        for (std::size_t i = 0; i < beside; ++i) {
          ASSERT_EQ(inside[i] + inside[beside + width + i], 18);
          ASSERT_EQ(found[i] + found[beside + width + i], 18.0f) << degrees << " degrees, row " << j << " of slice " << k;
        }
      }
  }
}

TEST(RowSampler, ShiftedAlongItsOwnLattice)
{
  Random random(4);
  for (int trial = 0; trial < 10; ++trial) {
    ImageGeometry geometry;
    geometry.dimensions = {11, 9, 7};
    geometry.origin = {random.Uniform(-4.0, 8.0), random.Uniform(-4.0, 8.0), random.Uniform(-4.0, 8.0)};
    const ImageGeometry grid = Grid({17, 15, 16}, 1.0);
    ExpectAsSampler<unsigned char, float>(RandomScene<unsigned char>(geometry.dimensions, random).Posed(geometry), grid, 1e-3);
    ExpectAsSampler<float, float>(RandomScene<float>(geometry.dimensions, random, true).Posed(geometry), grid, 1e-3);
  }
}

TEST(RowSampler, ImagesAndSingleRows)
{
  Random random(5);
  for (const std::array<int, 3> n : {std::array<int, 3>{40, 30, 1}, {1, 30, 20}, {30, 1, 20}}) {
    ImageGeometry geometry;
    geometry.dimensions = n;
    geometry.origin = {1.3, 1.6, 1.2};
    const ImageGeometry grid = Grid({40, 40, 20}, 1.0);
    ExpectAsSampler<unsigned char, float>(RandomScene<unsigned char>(n, random).Posed(geometry), grid, 1e-3);
    geometry.direction = ExpRotation({0.02, 0.3, 0.05});
    ExpectAsSampler<float, float>(RandomScene<float>(n, random).Posed(geometry), grid, 1e-3);
  }
}

TEST(RowSampler, WholeShiftsCopy)
{
  Random random(6);
  const Scene<float> scene = RandomScene<float>({9, 8, 7}, random, true);
  ImageGeometry geometry = Grid({9, 8, 7}, 0.7);
  geometry.direction = ExpRotation({0.3, 0.4, -0.2});
  ImageGeometry grid = geometry;
  grid.dimensions = {14, 14, 14};
  grid.origin = geometry.IndexToWorld() * Eigen::Vector3d(-3.0, -2.0, -4.0);
  const RowSampler<float> rows(scene.Posed(geometry), grid);
  EXPECT_EQ(rows.Box().first, (std::array<int, 3>{3, 2, 4}));
  EXPECT_EQ(rows.Box().size, (std::array<int, 3>{9, 8, 7}));
  std::vector<unsigned char> inside(9);
  std::vector<float> values(9);
  for (int k = 0; k < 7; ++k)
    for (int j = 0; j < 8; ++j) {
      rows.Inside(j + 2, k + 4, inside.data());
      rows.Values(j + 2, k + 4, inside.data(), values.data());
      for (int i = 0; i < 9; ++i) {
        const float truth = scene.values.View()(i, j, k);
        EXPECT_EQ(inside[i], scene.valid.View()(i, j, k) && std::isfinite(truth));
        if (inside[i]) {
          EXPECT_EQ(values[i], truth);
        }
      }
    }
}

TEST(RowSampler, FarAwayIsAnEmptyBox)
{
  Random random(7);
  const Scene<short> scene = RandomScene<short>({5, 5, 5}, random);
  ImageGeometry geometry = Grid({5, 5, 5}, 1.0);
  geometry.origin = {1e9, -1e12, 3.0};
  EXPECT_TRUE(RowSampler<short>(scene.Posed(geometry), Grid({20, 20, 20}, 1.0)).Box().Empty());
}

TEST(RowSampler, ReadsThroughADisplacement)
{
  Random random(9);
  const Scene<short> scene = RandomScene<short>({14, 12, 10}, random);
  ImageGeometry geometry = Grid({14, 12, 10}, 1.5);
  geometry.origin = {3.0, -4.0, 5.0};
  geometry.direction = ExpRotation({0.2, 0.4, -0.3});
  const ImageGeometry grid = Grid({40, 40, 40}, 1.0);
  ImageGeometry lattice = Grid({5, 5, 5}, 8.0);
  std::vector<Eigen::Vector3d> coefficients(125);
  for (auto& c : coefficients)
    c = 4.0 * random.Direction();
  const DisplacementField field(lattice, coefficients), none(lattice);
  const RowSampler<short> rows(scene.Posed(geometry), grid, &field);
  const Sampler<short> sampler(scene.values.View(), scene.valid.View());
  const Eigen::Affine3d toIndex = geometry.WorldToIndex();
  const GridBox& box = rows.Box();
  std::vector<unsigned char> inside(static_cast<std::size_t>(box.size[0]));
  std::vector<float> values(inside.size());
  int read = 0;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j) {
      if (box.HasRow(j, k)) {
        rows.Inside(j, k, inside.data());
        rows.Values(j, k, inside.data(), values.data());
      }
      for (int i = 0; i < 40; ++i) {
        const Eigen::Vector3d x = grid.IndexToWorld() * Eigen::Vector3d(i, j, k), p = toIndex * (x + field.At(x));
        double truth = 0.0;
        const bool isInside = sampler.Linear(p[0], p[1], p[2], truth);
        const int at = i - box.first[0];
        const bool inBox = box.HasRow(j, k) && at >= 0 && at < box.size[0];
        ASSERT_EQ(isInside, inBox && inside[static_cast<std::size_t>(at)]);
        if (isInside) {
          EXPECT_NEAR(values[static_cast<std::size_t>(at)], truth, 1e-4);
          ++read;
        }
      }
    }
  EXPECT_GT(read, 1000);
  EXPECT_EQ(RowSampler<short>(scene.Posed(geometry), grid, &none).Box().size,
            RowSampler<short>(scene.Posed(geometry), grid).Box().size);
}
