// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Reconstruction/ReconstructionGrid.h"
#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <string>

using namespace echorama;

namespace {

// A straight sweep of 40 x 30 pixels of 0.5 mm, 2 mm apart along z, turned by a rotation.
std::vector<FramePlace> StraightSweep(const Eigen::Matrix3d& rotation, int frames = 11)
{
  std::vector<FramePlace> places;
  for (int k = 0; k < frames; ++k) {
    FramePlace place;
    place.imageToWorld.linear() = rotation * 0.5;
    place.imageToWorld.translation() = rotation * Eigen::Vector3d(3.0, -4.0, 2.0 * k);
    place.pixels = {0, 39, 0, 29};
    places.push_back(place);
  }
  return places;
}

void ExpectInside(const ImageGeometry& grid, const std::vector<FramePlace>& places)
{
  for (const FramePlace& place : places)
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector3d at =
          grid.WorldToIndex() *
          (place.imageToWorld * Eigen::Vector3d(place.pixels[corner & 1 ? 1 : 0], place.pixels[corner & 2 ? 3 : 2], 0.0));
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GE(at[axis], -1e-5);
        EXPECT_LE(at[axis], grid.dimensions[static_cast<std::size_t>(axis)] - 1 + 1e-5);
      }
    }
}

std::string MessageOf(const std::function<void()>& call)
{
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(ReconstructionGrid, FollowsATurnedSweep)
{
  const Eigen::Matrix3d rotation = ExpRotation({0.4, -0.9, 0.3});
  const auto places = StraightSweep(rotation);
  const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted);
  EXPECT_LT((grid.direction - rotation).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(grid.dimensions, (std::array<int, 3>{40, 30, 41}));
  EXPECT_NEAR(grid.spacing[0], 0.5, 1e-12);
  grid.Check("grid");
  ExpectInside(grid, places);

  const ImageGeometry world = ReconstructionGrid(places, GridDirections::World, 1.0);
  EXPECT_EQ(world.direction, Eigen::Matrix3d::Identity());
  EXPECT_GT(world.VoxelCount(), ReconstructionGrid(places, GridDirections::Fitted, 1.0).VoxelCount() * 2);
  ExpectInside(world, places);
}

TEST(ReconstructionGrid, OneFrameIsOneSlice)
{
  const auto places = StraightSweep(ExpRotation({0.4, -0.9, 0.3}), 1);
  EXPECT_EQ(ReconstructionGrid(places, GridDirections::Fitted).dimensions, (std::array<int, 3>{40, 30, 1}));
}

TEST(ReconstructionGrid, AnObliqueSweepIsAlongItsPrincipalDirections)
{
  // The probe is pulled along its own array: images all in planes that lie almost in the direction of motion.
  std::vector<FramePlace> places;
  for (int k = 0; k < 40; ++k) {
    FramePlace place;
    place.imageToWorld.translation() = Eigen::Vector3d(4.0, 0.0, 4.0) * k;
    place.pixels = {0, 20, 0, 20};
    places.push_back(place);
  }
  const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted, 1.0),
                      world = ReconstructionGrid(places, GridDirections::World, 1.0);
  ExpectInside(grid, places);
  EXPECT_LT(grid.VoxelCount() * 3, world.VoxelCount());
  EXPECT_NEAR(grid.direction.determinant(), 1.0, 1e-9);
}

// A probe that is turned about its own axis: no direction is the mean of all, or both axes of the images have the same.
TEST(ReconstructionGrid, ImagesThatTurnAllTheWayHaveAGrid)
{
  for (const int turn : {0, 1, 2, 3}) {
    std::vector<FramePlace> places;
    for (int k = 0; k < 36; ++k) {
      FramePlace place;
      const double angle = k * 3.14159265358979323846 / 18.0;
      place.imageToWorld.linear() = ExpRotation(turn == 3 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                          : Eigen::Vector3d(angle * Eigen::Vector3d::Unit(turn)));
      if (turn == 3 && k % 2) { // columns and rows exchanged in every other image
        place.imageToWorld.linear().col(0).swap(place.imageToWorld.linear().col(1));
        place.imageToWorld.linear().col(2) *= -1.0;
      }
      place.imageToWorld.translation() = Eigen::Vector3d(0.0, 0.0, k);
      place.pixels = {-20, 20, 0, 30};
      places.push_back(place);
    }
    const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted, 1.0);
    grid.Check("grid");
    EXPECT_TRUE(grid.direction.allFinite()) << turn;
    ExpectInside(grid, places);
  }
}

TEST(ReconstructionGrid, TheOrderOfFramesDoesNotMatter)
{
  const Eigen::Matrix3d rotation = ExpRotation({0.4, -0.9, 0.3});
  auto places = StraightSweep(rotation, 12);
  for (const std::size_t k : {0u, 1u, 5u}) { // turned over, about their first rows
    places[k].imageToWorld.linear().col(0) *= -1.0;
    places[k].imageToWorld.linear().col(2) *= -1.0;
  }
  const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted);
  EXPECT_LT((grid.direction - rotation).cwiseAbs().maxCoeff(), 1e-9) << "as most of them lie";
  std::reverse(places.begin(), places.end());
  const ImageGeometry other = ReconstructionGrid(places, GridDirections::Fitted);
  EXPECT_LT((other.direction - grid.direction).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(other.dimensions, grid.dimensions);
}

TEST(ReconstructionGrid, RefusesWhatCannotBe)
{
  auto places = StraightSweep(Eigen::Matrix3d::Identity());
  EXPECT_THROW(ReconstructionGrid({}, GridDirections::Fitted), Error);
  EXPECT_THROW(ReconstructionGrid(places, GridDirections::Fitted, -1.0), Error);
  EXPECT_THROW(ReconstructionGrid(places, GridDirections::Fitted, std::numeric_limits<double>::quiet_NaN()), Error);
  EXPECT_NE(MessageOf([&] { ReconstructionGrid(places, GridDirections::World, 1e-9); }).find("SpacingMm"), std::string::npos);
  places[3].imageToWorld.linear().col(1).setZero();
  EXPECT_NE(MessageOf([&] { ReconstructionGrid(places, GridDirections::World); }).find("singular"), std::string::npos);
}

TEST(ReconstructionGrid, TooMuchMemoryIsRefusedWithASpacingThatFits)
{
  const auto places = StraightSweep(Eigen::Matrix3d::Identity());
  const ImageGeometry grid = ReconstructionGrid(places, GridDirections::World, 0.01);
  const std::string message = MessageOf([&] { CheckMemory(grid, 12.0, 100.0); });
  EXPECT_NE(message.find("MB"), std::string::npos) << message;
  const std::size_t at = message.find("SpacingMm = ");
  ASSERT_NE(at, std::string::npos) << message;
  const double spacing = std::stod(message.substr(at + 12));
  EXPECT_GT(spacing, 0.01);
  EXPECT_NO_THROW(CheckMemory(ReconstructionGrid(places, GridDirections::World, spacing), 12.0, 100.0));
  EXPECT_THROW(CheckMemory(ReconstructionGrid(places, GridDirections::World, 0.7 * spacing), 12.0, 100.0), Error);
  EXPECT_NO_THROW(CheckMemory(ReconstructionGrid(places, GridDirections::World, 1.0), 12.0, 0.0));
  // The grid that a user of Plus met in practice: 4e11 voxels.
  ImageGeometry huge = grid;
  huge.dimensions = {7349, 7349, 7348};
  EXPECT_THROW(CheckMemory(huge, 12.0, 0.0), Error);
  EXPECT_THROW(CheckMemory(grid, 12.0, -1.0), Error);
}
