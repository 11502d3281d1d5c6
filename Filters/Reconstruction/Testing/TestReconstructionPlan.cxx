// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Reconstruction/ReconstructionPlan.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

const std::array<int, 3> size{40, 30, 1};

Eigen::Affine3d PoseAt(double z)
{
  return Eigen::Translation3d(0.0, 0.0, z) * Eigen::Scaling(0.5, 0.5, 1.0);
}

SectorParameters Choice(SectorChoice choice)
{
  SectorParameters parameters;
  parameters.choice = choice;
  parameters.rectangle = {10, 19, 5, 24};
  parameters.fan = {20.0, -10.0, -30.0, 30.0, 6.0, 12.0};
  return parameters;
}

std::string RefusalOf(ReconstructionSurvey& survey)
{
  try {
    survey.Finish({}, GridDirections::Fitted, 0.0);
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    return error.what();
  }
  return "";
}

} // namespace

TEST(ReconstructionPlan, TheGridHoldsThePixelsThatCountAndNoOthers)
{
  const Volume<unsigned char> pixels(size, 100);
  const Volume<float> other(size, 1.0f);
  const Volume<unsigned char> nothing(size, 0);
  const auto planOf = [&](SectorChoice choice, const std::optional<ImageGeometry>& given = {}) {
    ReconstructionSurvey survey(Choice(choice));
    EXPECT_FALSE(survey.Add(pixels.View(), {}, std::nullopt)); // no pose
    EXPECT_TRUE(survey.Empty());
    EXPECT_TRUE(survey.Add(pixels.View(), {}, PoseAt(0.0)));
    EXPECT_FALSE(survey.Add(pixels.View(), {}, PoseAt(8.0)));
    EXPECT_FALSE(survey.Add(pixels.View(), nothing.View(), PoseAt(50.0))); // no real pixel
    EXPECT_FALSE(survey.Add(other.View(), {}, PoseAt(60.0)));              // another type
    EXPECT_FALSE(survey.Add(pixels.View(), {}, Eigen::Affine3d(Eigen::Scaling(0.0, 0.5, 1.0))));
    EXPECT_EQ(survey.Seen(), 6);
    return survey.Finish(given, GridDirections::World, 0.5);
  };
  const ReconstructionPlan all = planOf(SectorChoice::All);
  EXPECT_EQ(all.grid.dimensions, (std::array<int, 3>{40, 30, 17}));
  EXPECT_FALSE(all.sector);
  EXPECT_EQ(all.sectorText, "all pixels");

  const ReconstructionPlan rectangle = planOf(SectorChoice::Rectangle);
  EXPECT_EQ(rectangle.grid.dimensions, (std::array<int, 3>{10, 20, 17}));
  EXPECT_NEAR(rectangle.grid.origin[0], 5.0, 1e-9);
  EXPECT_EQ(rectangle.sectorText, "the given rectangle, 200 of 1200 pixels");

  const ReconstructionPlan fan = planOf(SectorChoice::Fan);
  ASSERT_TRUE(fan.sector);
  EXPECT_EQ(fan.sectorText.compare(0, 14, "the given fan,"), 0) << fan.sectorText;
  EXPECT_FALSE(fan.sector->View()(0, 0, 0));
  EXPECT_TRUE(fan.sector->View()(20, 8, 0)); // 9 mm below the apex

  ImageGeometry grid;
  grid.dimensions = {3, 4, 5};
  EXPECT_EQ(planOf(SectorChoice::Rectangle, grid).grid.dimensions, grid.dimensions);
}

TEST(ReconstructionPlan, ASectorIsDetectedInTheFramesThatCount)
{
  ReconstructionSurvey survey(Choice(SectorChoice::Detected));
  Volume<unsigned char> pixels(size);
  for (int frame = 0; frame < 12; ++frame) {
    for (int j = 4; j < 26; ++j)
      for (int i = 6; i < 34; ++i)
        pixels.View()(i, j, 0) = static_cast<unsigned char>(50 + (frame * 37 + i * 11 + j * 7) % 100);
    survey.Add<unsigned char>(pixels.View(), {}, PoseAt(frame));
  }
  const ReconstructionPlan plan = survey.Finish({}, GridDirections::World, 0.5);
  ASSERT_TRUE(plan.sector);
  EXPECT_TRUE(plan.sectorFound);
  EXPECT_FALSE(plan.sector->View()(1, 1, 0));
  EXPECT_TRUE(plan.sector->View()(20, 15, 0));
  EXPECT_NEAR(plan.grid.dimensions[0], 28, 2);
  EXPECT_NEAR(plan.grid.dimensions[1], 22, 2);
}

TEST(ReconstructionPlan, RefusesSweepsWithoutAFrameThatCounts)
{
  const Volume<unsigned char> pixels(size, 100), nothing(size, 0);
  ReconstructionSurvey unplaced(Choice(SectorChoice::All)), unreal(Choice(SectorChoice::All));
  unplaced.Add(pixels.View(), {}, std::nullopt);
  EXPECT_NE(RefusalOf(unplaced).find("none of the 1 frames has a valid pose"), std::string::npos);
  unreal.Add(pixels.View(), nothing.View(), PoseAt(0.0));
  EXPECT_NE(RefusalOf(unreal).find("real pixel"), std::string::npos);
}

TEST(ReconstructionPlan, MasksAreCombined)
{
  Volume<unsigned char> own({3, 1, 1}, 1), sector({3, 1, 1}, 1), store;
  own.View()[0] = 0;
  sector.View()[2] = 0;
  const auto both = BothMasks(own.View(), sector.View(), store);
  EXPECT_EQ(std::vector<unsigned char>(both.begin(), both.end()), (std::vector<unsigned char>{0, 1, 0}));
  EXPECT_EQ(BothMasks({}, sector.View(), store).Data(), sector.View().Data());
  EXPECT_EQ(BothMasks(own.View(), {}, store).Data(), own.View().Data());
  EXPECT_TRUE(BothMasks({}, {}, store).Empty());
}
