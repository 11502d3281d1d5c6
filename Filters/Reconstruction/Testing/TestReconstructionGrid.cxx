// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
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
      const double angle = k * Pi / 18.0;
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

namespace {

// One image: where its first pixel lies, and how large its pixels are; along the axes of the world.
FramePlace ImageAt(const Eigen::Vector3d& origin, double across, double down, const std::array<int, 4>& pixels)
{
  FramePlace place;
  place.imageToWorld.linear().diagonal() << across, down, 1.0;
  place.imageToWorld.translation() = origin;
  place.pixels = pixels;
  return place;
}

} // namespace

TEST(ReconstructionGrid, IsTheSmallestThatHoldsAllPixels)
{
  // Centres of pixels from (4, -3.4, 7) to (14.5, 6.2, 11.9).
  const std::vector<FramePlace> places{ImageAt({1.0, -5.0, 7.0}, 0.5, 0.8, {6, 27, 2, 14}),
                                       ImageAt({1.0, -5.0, 11.9}, 0.5, 0.8, {10, 20, 5, 8})};
  const ImageGeometry grid = ReconstructionGrid(places, GridDirections::World, 0.7);
  EXPECT_LT((grid.origin - Eigen::Vector3d(4.0, -3.4, 7.0)).norm(), 1e-12);
  EXPECT_EQ(grid.dimensions, (std::array<int, 3>{16, 15, 8})); // 10.5, 9.6 and 4.9 mm: 15 steps, 13.7, 7
  EXPECT_LT((grid.spacing - Eigen::Vector3d::Constant(0.7)).norm(), 1e-15);
  EXPECT_EQ(grid.direction, Eigen::Matrix3d::Identity());
}

TEST(ReconstructionGrid, ItsSpacingIsTheMeanOfTheLongerEdges)
{
  const std::vector<FramePlace> places{ImageAt({0.0, 0.0, 0.0}, 0.5, 0.8, {0, 9, 0, 9}),
                                       ImageAt({0.0, 0.0, 2.0}, 1.2, 0.6, {0, 9, 0, 9}),
                                       ImageAt({0.0, 0.0, 4.0}, 0.4, 0.4, {0, 9, 0, 9})};
  for (const auto directions : {GridDirections::World, GridDirections::Fitted})
    EXPECT_NEAR(ReconstructionGrid(places, directions).spacing[1], 0.8, 1e-12);
}

// As many images point one way as the other: then the grid points along the axis of the world that is nearest.
TEST(ReconstructionGrid, ATieIsDecidedByTheWorld)
{
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Matrix3d rotation = ExpRotation({0.1, -0.15, 0.2});
    auto places = StraightSweep(rotation, 12);
    for (std::size_t k = 0; k < places.size(); ++k) {
      places[k].imageToWorld.linear().col(0) *= k % 2 ? sign : -sign;
      places[k].imageToWorld.linear().col(2) *= k % 2 ? sign : -sign;
    }
    const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted);
    EXPECT_LT((grid.direction - rotation).cwiseAbs().maxCoeff(), 1e-9) << sign;
  }
}

TEST(ReconstructionGrid, PrincipalDirectionsKeepTheOrderAndTheSenseOfTheImages)
{
  for (const double sense : {1.0, -1.0}) {
    std::vector<FramePlace> places;
    for (int k = 0; k < 40; ++k)
      places.push_back(ImageAt(Eigen::Vector3d(4.0, 0.0, sense * 4.0) * k, 1.0, 1.0, {0, 20, 0, 20}));
    const ImageGeometry grid = ReconstructionGrid(places, GridDirections::Fitted, 1.0);
    // The corners spread along (1, 0, +-1), but for the width of the images along x: half the arc tangent of twice the
    // covariance over the difference of the variances.
    const double steps = 16.0 * (40.0 * 40.0 - 1.0) / 12.0, angle = 0.5 * std::atan2(2.0 * steps, 100.0);
    const Eigen::Vector3d along(std::cos(angle), 0.0, sense * std::sin(angle));
    EXPECT_LT((grid.direction.col(0) - along).norm(), 1e-6) << sense;
    EXPECT_LT((grid.direction.col(1) - Eigen::Vector3d::UnitY()).norm(), 1e-6) << sense;
    EXPECT_LT((grid.direction.col(2) - along.cross(Eigen::Vector3d::UnitY())).norm(), 1e-6) << sense;
    ExpectInside(grid, places);
  }
}

TEST(ReconstructionGrid, WithAnotherSpacingItIsTheSameBox)
{
  ImageGeometry grid;
  grid.dimensions = {40, 30, 41};
  grid.spacing.setConstant(0.5);
  grid.origin = {1.0, 2.0, 3.0};
  grid.direction = ExpRotation({0.4, -0.9, 0.3});
  const ImageGeometry wider = WithSpacing(grid, 1.0); // 19.5, 14.5 and 20 mm
  EXPECT_EQ(wider.dimensions, (std::array<int, 3>{21, 16, 21}));
  EXPECT_EQ(wider.spacing, Eigen::Vector3d::Constant(1.0));
  EXPECT_EQ(wider.origin, grid.origin);
  EXPECT_EQ(wider.direction, grid.direction);
  EXPECT_EQ(WithSpacing(grid, 0.1).dimensions, (std::array<int, 3>{196, 146, 201})); // rounding adds no layer
  EXPECT_EQ(WithSpacing(grid, 1e-12).dimensions[0], std::numeric_limits<int>::max());
}

TEST(ReconstructionGrid, WhatIsTooLargeForAnyComputer)
{
  const auto places = StraightSweep(Eigen::Matrix3d::Identity());                 // 19.5 x 14.5 x 20 mm
  EXPECT_NO_THROW(ReconstructionGrid(places, GridDirections::World, 2e-4));       // 7e14 voxels
  EXPECT_THROW(ReconstructionGrid(places, GridDirections::World, 1.6e-4), Error); // 1.4e15
  EXPECT_THROW(ReconstructionGrid(places, GridDirections::World, std::numeric_limits<double>::infinity()), Error);
}

TEST(ReconstructionGrid, MemoryIsCountedToTheByte)
{
  ImageGeometry grid;
  grid.dimensions = {100, 100, 100};
  EXPECT_NO_THROW(CheckMemory(grid, 12.0, 12.0));
  EXPECT_EQ(
      MessageOf([&] { CheckMemory(grid, 12.0, 11.9); }),
      "a volume of 100 x 100 x 100 voxels takes 12 MB to make, more than the 12 MB allowed (MemoryLimitMb); SpacingMm = 1.1 "
      "would fit");
  EXPECT_EQ(
      MessageOf([&] { CheckMemory(grid, 9.0, 1.5); }),
      "a volume of 100 x 100 x 100 voxels takes 9 MB to make, more than the 1.5 MB allowed (MemoryLimitMb); SpacingMm = 1.9 "
      "would fit");
  // In a box that is no multiple of the spacing as well, the suggestion is the least of two digits, but for a step or so.
  grid.dimensions = {313, 57, 91};
  grid.spacing.setConstant(0.37);
  for (double limit = 0.2; limit < 18.0; limit *= 1.1) {
    const std::string message = MessageOf([&] { CheckMemory(grid, 12.0, limit); });
    EXPECT_NE(message.find("a volume of 313 x 57 x 91 voxels takes 19 MB"), std::string::npos) << message;
    EXPECT_NE(message.find("allowed (MemoryLimitMb)"), std::string::npos) << message;
    const std::size_t at = message.find("SpacingMm = ");
    ASSERT_NE(at, std::string::npos) << message;
    const double spacing = std::stod(message.substr(at + 12));
    const auto bytes = [&](double mm) { return 12.0 * static_cast<double>(WithSpacing(grid, mm).VoxelCount()); };
    EXPECT_LE(bytes(spacing), limit * 1e6) << message;
    EXPECT_GT(bytes(0.88 * spacing), limit * 1e6) << message;
  }
}
