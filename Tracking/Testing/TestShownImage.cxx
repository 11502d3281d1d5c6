// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ShownImage.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

StreamedImage ImageAt(const std::string& name, double time)
{
  StreamedImage image;
  image.name = name;
  image.time = time;
  image.geometry.dimensions = {4, 3, 1};
  image.voxels = std::make_shared<const std::vector<unsigned char>>(12);
  return image;
}

// A tool that was seen from 1 to 2 s, with the image fixed to it.
struct Scene {
  PoseStream stream;
  LiveTransforms transforms;

  explicit Scene(const Eigen::Vector3d& scale = Eigen::Vector3d::Constant(0.5))
    : transforms(stream, {{"Image", "Probe", Eigen::Affine3d(Eigen::Scaling(scale)), TransformStatus::Valid, {}, ""}})
  {
    for (const double time : {1.0, 1.5, 2.0})
      stream.Add({"ProbeToTracker", time, NaN, Pose(Eigen::Translation3d(10.0 * time, 0.0, 0.0)), TransformStatus::Valid});
  }
  std::optional<ShownImage> Choose(const std::vector<StreamedImage>& images, double time = NaN) const
  {
    return ChooseImage(images, transforms, "Image", "Tracker", time);
  }
};

} // namespace

TEST(ShownImage, TheWorldIsTheFrameThatMostToolsAreSeenIn)
{
  EXPECT_EQ(UsualWorld({"ProbeToTracker", "StylusToReference", "NeedleToTracker"}), "Tracker");
  EXPECT_EQ(UsualWorld({"ProbeToTracker", "StylusToReference"}), "Reference"); // the first in the order of bytes
  EXPECT_EQ(UsualWorld({"nonsense"}), "");
}

TEST(ShownImage, IsTheNewestThatCanBePlaced)
{
  const Scene scene;
  const auto shown = scene.Choose({ImageAt("old", 1.0), ImageAt("placed", 1.5), ImageAt("ahead of its poses", 9.0)});
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->image.name, "placed");
  ASSERT_TRUE(shown->imageToWorld);
  EXPECT_NEAR(shown->imageToWorld->translation().x(), 15.0, 1e-9);
  EXPECT_NEAR(shown->geometry.origin[0], 15.0, 1e-9);
  EXPECT_NEAR(shown->geometry.spacing[0], 0.5, 1e-12);
}

TEST(ShownImage, WithoutAPlaceItIsTheNewestWhereTheSenderPutsIt)
{
  const Scene scene;
  auto images = {ImageAt("first", 8.0), ImageAt("second", 9.0)};
  const auto shown = scene.Choose(images);
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->image.name, "second");
  EXPECT_FALSE(shown->imageToWorld);
  EXPECT_EQ(shown->geometry.origin, Eigen::Vector3d::Zero());
  EXPECT_FALSE(scene.Choose({}));
}

TEST(ShownImage, SlicesThatWouldBeMirroredHaveNoPlace)
{
  StreamedImage image = ImageAt("volume", 1.5);
  image.geometry.dimensions[2] = 2;
  image.voxels = std::make_shared<const std::vector<unsigned char>>(24);
  EXPECT_TRUE(Scene().Choose({image})->imageToWorld);
  const auto shown = Scene({0.5, 0.5, -0.5}).Choose({image});
  ASSERT_TRUE(shown);
  EXPECT_FALSE(shown->imageToWorld);
}

TEST(ShownImage, WithATimeItIsTheNearestToThat)
{
  const Scene scene;
  const std::vector<StreamedImage> images{ImageAt("a", 1.0), ImageAt("b", 2.0), ImageAt("without a time", NaN),
                                          ImageAt("c", 5.0)};
  EXPECT_EQ(scene.Choose(images, 1.2)->image.name, "a");
  const auto beyond = scene.Choose(images, 4.9);
  EXPECT_EQ(beyond->image.name, "c"); // though it has no place, and others have
  EXPECT_FALSE(beyond->imageToWorld);
}

TEST(ShownImage, WhatDisagreesWithItsBytesIsPassedOver)
{
  const Scene scene;
  StreamedImage cut = ImageAt("cut", 1.5), none = ImageAt("none", 1.5), pairs = ImageAt("pairs", 1.5),
                flat = ImageAt("flat", 1.5);
  cut.geometry.dimensions = {4, 4, 1};
  none.voxels.reset();
  pairs.components = 2;
  pairs.voxels = std::make_shared<const std::vector<unsigned char>>(24);
  flat.geometry.spacing[1] = 0.0;
  const auto shown = scene.Choose({ImageAt("good", 1.0), cut, none, pairs, flat});
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->image.name, "good");
}
