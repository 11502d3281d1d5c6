// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Stitching/SmoothRows.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

// A field of blocks with random values, in a box of the lattice.
struct Field {
  ImageGeometry grid;
  BlockLattice blocks;
  Boxed<float> values;

  Field(const std::array<int, 3>& dimensions, double scale, const GridBox& box)
  {
    grid.dimensions = dimensions;
    grid.spacing = {0.5, 0.5, 1.0};
    grid.origin = {3.0, -7.0, 11.0};
    blocks = BlocksOf(grid, scale);
    values.box = box.Empty() ? GridBox{{0, 0, 0}, blocks.geometry.dimensions} : box;
    values.values = Volume<float>(values.box.size);
    Random random(4);
    for (float& value : values.values.View())
      value = static_cast<float>(random.Uniform(0.0, 255.0));
  }
  CoarseSampler Sampler() const
  {
    return CoarseSampler(RowSampler<float>({values.values.View(), {}, Cropped(blocks.geometry, values.box)}, grid));
  }
  int First(int axis) const { return values.box.first[axis] * blocks.size[axis]; }
  int End(int axis) const
  {
    return std::min(grid.dimensions[axis], (values.box.first[axis] + values.box.size[axis]) * blocks.size[axis]);
  }
};

// All voxels in blocks of the field, the rows in \a order of j.
template <class A>
void ExpectTheSampler(const Field& field, double tolerance, bool downwards)
{
  SmoothRows<A> rows(field.blocks, field.values);
  const CoarseSampler sampler = field.Sampler();
  const int first = field.First(0), end = field.End(0);
  const std::vector<unsigned char> wanted(static_cast<std::size_t>(end - first), 1);
  std::vector<A> found(wanted.size()), expected(wanted.size());
  for (int k = field.First(2); k < field.End(2); ++k)
    for (int row = field.First(1); row < field.End(1); ++row) {
      const int j = downwards ? field.End(1) - 1 - (row - field.First(1)) : row;
      ASSERT_TRUE(rows.Row(j, k, first, end, wanted.data(), found.data()));
      sampler.Row(j, k, first, end, wanted.data(), nothing, expected.data());
      for (std::size_t i = 0; i < found.size(); ++i)
        ASSERT_NEAR(found[i], expected[i], tolerance) << i << " " << j << " " << k;
    }
}

} // namespace

TEST(SmoothRows, AreThoseOfTheSamplerToTheLastBit)
{
  for (const double scale : {1.0, 2.0, 4.0})
    for (const bool downwards : {false, true}) {
      ExpectTheSampler<float>(Field({37, 18, 11}, scale, {}), 0.0, downwards);
      ExpectTheSampler<double>(Field({37, 18, 11}, scale, {}), 0.0, downwards);
    }
  ExpectTheSampler<float>(Field({40, 1, 1}, 2.0, {}), 0.0, false);
  ExpectTheSampler<float>(Field({19, 17, 1}, 2.0, {}), 0.0, false);
}

TEST(SmoothRows, BlocksOfAnyWidth)
{
  ExpectTheSampler<float>(Field({37, 18, 11}, 3.0, {}), 2e-4, false); // the sampler rounds thirds
  ExpectTheSampler<double>(Field({37, 18, 11}, 5.0, {}), 1e-9, false);
}

// Within a box of the lattice voxels have neighbours that the field knows nothing of: there the last block goes on.
TEST(SmoothRows, OfAPartOfTheLattice)
{
  ExpectTheSampler<float>(Field({37, 18, 11}, 2.0, {{3, 2, 1}, {9, 4, 3}}), 0.0, false);
}

TEST(SmoothRows, SayWhereTheyAreNotNumbers)
{
  Field field({37, 18, 11}, 2.0, {});
  field.values.values.View()(5, 4, 3) = nothing; // voxels 10 and 11, and one on either side
  SmoothRows<float> rows(field.blocks, field.values);
  std::vector<float> values(37);
  for (int missing = 0; missing < 37; ++missing) {
    std::vector<unsigned char> wanted(37, 2); // another bit
    wanted[static_cast<std::size_t>(missing)] = 1;
    EXPECT_EQ(rows.Row(8, 3, 0, 37, wanted.data(), values.data()), missing < 9 || missing > 12) << missing;
    EXPECT_TRUE(rows.Row(14, 3, 0, 37, wanted.data(), values.data()));
  }
}
