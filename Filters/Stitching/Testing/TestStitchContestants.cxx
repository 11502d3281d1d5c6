// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Stitching/Benchmarks/StitchContestants.h"
#include "StitchScene.h"
#include <cmath>

using namespace echorama;
using namespace echorama::testing_scene;

namespace {

// Two boxes of constants that overlap by twenty voxels.
Scene<float> TwoBoxes(float first, float second)
{
  Scene<float> scene;
  scene.AddBox({0, 0, 0}, {40, 12, 9}, first);
  scene.AddBox({20, 0, 0}, {40, 12, 9}, second);
  return scene;
}

Boxed<float> Ramp(const GridBox& box, float start, float step)
{
  Boxed<float> field{box, Volume<float>(box.size)};
  for (int j = 0; j < box.size[1]; ++j)
    for (int i = 0; i < box.size[0]; ++i)
      field.values.View()(i, j, 0) = start + step * static_cast<float>(box.first[0] + i);
  return field;
}

} // namespace

TEST(StitchContestants, ConstantsStayAndCoverageCounts)
{
  const Scene<float> scene = TwoBoxes(50.0f, 50.0f);
  const ImageGeometry grid = StitchGrid(scene.geometries);
  for (const auto stitch : {StitchByMultiband, StitchByOffsets, StitchBySeams}) {
    const ContestantStitch result = stitch(scene.inputs, grid);
    for (int i = 0; i < 60; ++i) {
      EXPECT_NEAR(result.values.View()(i, 5, 4), 50.0f, 1e-3f) << i;
      EXPECT_EQ(result.coverage.View()(i, 5, 4), i >= 20 && i < 40 ? 2 : 1) << i;
    }
  }
}

TEST(StitchContestants, VolumesMeetInTheMiddle)
{
  const Scene<float> scene = TwoBoxes(100.0f, 140.0f);
  const ImageGeometry grid = StitchGrid(scene.geometries);
  const ContestantStitch offsets = StitchByOffsets(scene.inputs, grid), bands = StitchByMultiband(scene.inputs, grid);
  for (int i = 1; i < 60; ++i) { // offsets: each is itself where it is alone, and from there they go to 120
    const double peleg = offsets.values.View()(i, 5, 4), burt = bands.values.View()(i, 5, 4);
    EXPECT_LT(peleg - offsets.values.View()(i - 1, 5, 4), 4.0) << i;
    EXPECT_LT(burt - bands.values.View()(i - 1, 5, 4), 4.0) << i;
    if (i < 20 || i >= 40) {
      EXPECT_NEAR(peleg, i < 20 ? 100.0 : 140.0, 0.1) << i;
    }
  }
  EXPECT_NEAR(offsets.values.View()(29, 5, 4), 120.0, 2.5);
  EXPECT_NEAR(bands.values.View()(29, 5, 4), 120.0, 4.0);
}

TEST(StitchContestants, LargestScaleIsTheLargestShare)
{
  const std::array<int, 3> n{9, 2, 1};
  std::vector<CoarseVolume> volumes(2);
  for (int v = 0; v < 2; ++v) {
    const GridBox box{{2 * v, 0, 0}, {7, 2, 1}};
    volumes[v].inside = {box, Volume<unsigned char>(box.size, 1)};
  }
  EXPECT_EQ(LargestScale(volumes, n).View()(6, 0, 0), 0); // equals: the first
  EXPECT_EQ(LargestScale(volumes, n).View()(7, 0, 0), 1);
  volumes[0].scale = Ramp(volumes[0].inside.box, 1.0f, -0.1f);
  volumes[1].scale = Ramp(volumes[1].inside.box, 0.0f, 0.1f);
  volumes[1].trust = Ramp(volumes[1].inside.box, 1.0f, 0.0f);
  for (int i = 0; i < 7; ++i)
    volumes[1].trust.values.View()(i, 1, 0) = 0.1f;
  const Volume<unsigned short> labels = LargestScale(volumes, n);
  for (int i = 0; i < 9; ++i) {
    EXPECT_EQ(labels.View()(i, 0, 0), i > 5 ? 1 : 0); // 5 is equal but for rounding: 0.5 and 0.5
    EXPECT_EQ(labels.View()(i, 1, 0), i > 6 ? 1 : 0);
  }
}
