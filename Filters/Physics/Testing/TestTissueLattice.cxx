// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Physics/TissueLattice.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// Boxes from one corner to the other; a later one replaces what it covers.
struct Box {
  const char* material;
  Eigen::Vector3f low, high;
};

TissueSurface SurfaceOf(const std::vector<Box>& boxes)
{
  TissueSurface surface = echorama::testing::Background(StandardMaterial("air"));
  for (const Box& box : boxes)
    echorama::testing::AddBox(surface, StandardMaterial(box.material), box.low, box.high);
  return surface;
}

TissueLatticeParameters CellsOf(double spacingMm)
{
  TissueLatticeParameters parameters;
  parameters.spacingMm = spacingMm;
  return parameters;
}

// Sums over the cells at one place of a layer, from the front to the back: kPa mm and g/cm^3 mm.
struct Column {
  double stiffness = 0.0, weight = 0.0;
};

Column ColumnOf(const TissueBody& body, int i, int j)
{
  const auto& nodes = body.nodes.dimensions;
  Column column;
  for (int k = 0; k + 1 < nodes[2]; ++k) {
    const int material = body.cells[static_cast<std::size_t>((k * (nodes[1] - 1) + j) * (nodes[0] - 1) + i)];
    if (material < 0)
      continue;
    const TissueMaterial& tissue = body.materials[static_cast<std::size_t>(material)];
    column.stiffness += tissue.youngKPa * body.nodes.spacing.z();
    column.weight += tissue.densityGPerCm3 * body.nodes.spacing.z();
  }
  return column;
}

// Skin of 2 mm on fat, in cells of 5 mm: wherever its cells begin, it is all there.
TEST(TissueLattice, SkinThatIsThinnerThanACellIsNotLost)
{
  for (const float shift : {0.0f, 0.6f, 1.3f, 2.2f, 3.1f, 4.4f}) {
    // A post beside the layers moves the lattice, which covers all.
    const TissueSurface surface = SurfaceOf(
        {{"fat", {0, 0, 0}, {20, 20, 30}}, {"skin", {0, 0, 0}, {20, 20, 2}}, {"muscle", {25, 0, -shift}, {35, 20, 30}}});
    const TissueBody body = TissueBodyOf(surface, CellsOf(5.0));
    const Column column = ColumnOf(body, 1, 1);
    constexpr double apart = 1.25; // mm, of the points
    EXPECT_NEAR(column.stiffness, 2.0 * 100.0 + 28.0 * 3.0, apart * 100.0) << "shift " << shift;
    EXPECT_NEAR(column.weight, 2.0 * 1.1 + 28.0 * 0.95, apart * 1.1) << "shift " << shift;
  }
}

TEST(TissueLattice, WholeCellsAreOfTheirMaterialAlone)
{
  const TissueBody body =
      TissueBodyOf(SurfaceOf({{"fat", {0, 0, 0}, {20, 20, 20}}, {"bone", {5, 5, 5}, {15, 15, 15}}}), CellsOf(5.0));
  ASSERT_EQ(body.cells.size(), 64u);
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const auto& tissue =
            body.materials.at(static_cast<std::size_t>(body.cells[static_cast<std::size_t>((k * 4 + j) * 4 + i)]));
        const bool isBone = i % 3 && j % 3 && k % 3;
        EXPECT_EQ(tissue.rigid, isBone);
        EXPECT_DOUBLE_EQ(tissue.youngKPa, isBone ? 1e4 : 3.0);
      }
}

TEST(TissueLattice, GasAndWhatLiesInItIsNoTissue)
{
  TissueSurface surface = SurfaceOf({{"fat", {0, 0, 0}, {20, 20, 20}}, {"air", {5, 5, 5}, {15, 15, 15}}});
  const TissueBody body = TissueBodyOf(surface, CellsOf(5.0));
  EXPECT_EQ(std::count(body.cells.begin(), body.cells.end(), -1), 8);
}

} // namespace
