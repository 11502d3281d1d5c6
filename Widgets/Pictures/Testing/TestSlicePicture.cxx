// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include "Widgets/Pictures/SlicePicture.h"
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <limits>
#include <optional>

namespace {

using namespace echorama;
using Picture = std::vector<std::uint8_t>;

Picture Draw(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters = {})
{
  Picture picture(4 * static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height), 99);
  DrawSlice(layers, plane, parameters, picture.data());
  return picture;
}

// A volume that owns its voxels: a wave with a ragged valid region.
template <class T>
struct Posed {
  Volume<T> intensity;
  Volume<unsigned char> valid;
  ImageGeometry geometry;

  Posed(const std::array<int, 3>& dimensions, std::uint64_t seed, bool ragged = true)
    : intensity(dimensions), valid(dimensions, 1)
  {
    Random random(seed);
    geometry.dimensions = dimensions;
    geometry.spacing = Eigen::Vector3d(random.Uniform(0.4, 1.2), random.Uniform(0.4, 1.2), random.Uniform(0.4, 1.2));
    geometry.direction = ExpRotation(random.Direction() * random.Uniform(0.0, 3.0));
    geometry.origin.setZero();
    geometry.origin = -geometry.Centre() + random.Direction();
    std::ptrdiff_t index = 0;
    for (T& voxel : intensity.View()) {
      voxel = static_cast<T>(random.Uniform(1.0, 250.0));
      valid.View()[index++] = ragged && random.Uniform() < 0.05 ? 0 : 1;
    }
    if (std::is_floating_point_v<T> && ragged)
      for (int n = 0; n < 20; ++n)
        intensity.View()[static_cast<std::ptrdiff_t>(random.Below(static_cast<std::uint64_t>(intensity.View().Size())))] =
            n % 2 ? std::numeric_limits<T>::quiet_NaN() : std::numeric_limits<T>::infinity();
  }
  SliceLayer Layer() const
  {
    SliceLayer layer;
    layer.volume = PosedVolume<T>{intensity.View(), valid.View(), geometry};
    return layer;
  }
};

SlicePlane PlaneThrough(const Eigen::Vector3d& middle, const Eigen::Matrix3d& axes, double pixelMm, int width, int height)
{
  SlicePlane plane;
  plane.right = pixelMm * axes.col(0);
  plane.up = pixelMm * axes.col(1);
  plane.width = width;
  plane.height = height;
  plane.origin = middle - 0.5 * (width - 1) * plane.right - 0.5 * (height - 1) * plane.up;
  return plane;
}

// The grey level of one volume at one point through its window, by definition; nothing where it is not real.
std::optional<double> GreyAt(const SliceLayer& layer, const Eigen::Vector3d& world, bool linear)
{
  return std::visit(
      [&](const auto& volume) -> std::optional<double> {
        const Sampler sampler(volume.intensity, volume.valid);
        const Eigen::Vector3d at = volume.geometry.WorldToIndex() * world;
        double value = 0.0;
        if (!(linear ? sampler.Linear(at[0], at[1], at[2], value) : sampler.Nearest(at[0], at[1], at[2], value)))
          return {};
        return std::clamp((value - layer.black) / (layer.white - layer.black), 0.0, 1.0);
      },
      layer.volume);
}

// The mean of one side at one point: RGB in [0, 1] and opacity; opacity 0 where none is real.
std::array<double, 4> MeanAt(const std::vector<SliceLayer>& layers, int side, bool tinted, const Eigen::Vector3d& world,
                             bool linear)
{
  std::array<double, 4> mean{0, 0, 0, 0};
  double weights = 0.0;
  for (const SliceLayer& layer : layers) {
    if (layer.opacity == 0.0 || (side == 1 && !layer.selected) || (side == 2 && layer.selected))
      continue;
    if (const auto grey = GreyAt(layer, world, linear)) {
      for (std::size_t c = 0; c < 3; ++c)
        mean[c] += layer.opacity * *grey * (tinted ? layer.colour[c] : 1.0);
      weights += layer.opacity;
      mean[3] = std::max(mean[3], layer.opacity);
    }
  }
  for (std::size_t c = 0; c < 3 && weights > 0.0; ++c)
    mean[c] /= weights;
  return mean;
}

std::array<double, 4> PixelAt(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& p, int i,
                              int j)
{
  const Eigen::Vector3d world = plane.origin + i * plane.right + j * plane.up;
  if (p.mode == SliceMode::Blend)
    return MeanAt(layers, 0, true, world, p.linear);
  const bool tinted = p.mode == SliceMode::Checkerboard;
  const auto own = MeanAt(layers, 1, tinted, world, p.linear), other = MeanAt(layers, 2, tinted, world, p.linear);
  if (p.mode == SliceMode::Checkerboard) {
    const bool square = (i / p.squarePixels + j / p.squarePixels) % 2 == 1;
    return other[3] > 0.0 && (square || own[3] == 0.0) ? other : own;
  }
  const double level = own[3] > 0.0 && other[3] > 0.0 ? std::fabs(own[0] - other[0]) : 0.25 * std::max(own[0], other[0]);
  return {level, level, level, std::max(own[3], other[3])};
}

// How many pixels differ by more than one grey level from what they should be by definition.
int CountWrong(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters)
{
  const Picture picture = Draw(layers, plane, parameters);
  int wrong = 0;
  for (int j = 0; j < plane.height; ++j)
    for (int i = 0; i < plane.width; ++i) {
      const auto expected = PixelAt(layers, plane, parameters, i, j);
      for (std::size_t c = 0; c < 4; ++c)
        if (std::fabs(255.0 * expected[c] - picture[4 * static_cast<std::size_t>(j * plane.width + i) + c]) > 1.0) {
          ++wrong;
          break;
        }
    }
  return wrong;
}

template <class T>
class SlicePictureOf : public testing::Test {
};
using VoxelTypes = testing::Types<unsigned char, short, unsigned short, float, double>;
TYPED_TEST_SUITE(SlicePictureOf, VoxelTypes);

TYPED_TEST(SlicePictureOf, EqualsTheDefinitionOnObliquePlanes)
{
  const Posed<TypeParam> volume({23, 17, 19}, 5), plain({20, 20, 20}, 6, false);
  std::vector<SliceLayer> layers{volume.Layer(), plain.Layer()};
  layers[0].black = 20.0;
  layers[0].white = 200.0;
  layers[0].colour = {1.0, 0.5, 0.25};
  layers[1].opacity = 0.4;
  for (std::uint64_t n = 0; n < 12; ++n) {
    Random random(7, n);
    const Eigen::Matrix3d axes = ExpRotation(random.Direction() * random.Uniform(0.0, 3.0));
    const SlicePlane plane = PlaneThrough(random.Direction() * random.Uniform(0.0, 5.0), axes, 0.31, 90, 70);
    SliceParameters parameters;
    parameters.linear = n % 2 == 0;
    // A point within rounding of the face between two voxels may fall to either side.
    EXPECT_LE(CountWrong(layers, plane, parameters), 1) << n;
  }
}

TYPED_TEST(SlicePictureOf, PlanesAlongTheVoxelsAreExact)
{
  Posed<TypeParam> volume({12, 9, 7}, 8);
  volume.geometry.direction.setIdentity();
  volume.geometry.origin.setZero();
  volume.geometry.spacing.setConstant(0.5);
  for (int axis = 0; axis < 3; ++axis)
    for (const double depth : {-0.5, -0.25, 0.0, 0.75, 1.0, 2.5, 3.0}) { // on faces, on voxels and between
      SlicePlane plane;
      plane.right = 0.125 * Eigen::Vector3d::Unit((axis + 1) % 3);
      plane.up = 0.125 * Eigen::Vector3d::Unit((axis + 2) % 3);
      plane.origin = Eigen::Vector3d::Constant(-1.0);
      plane.origin[axis] = depth;
      plane.width = plane.height = 64;
      for (const bool linear : {true, false}) {
        SliceParameters parameters;
        parameters.linear = linear;
        EXPECT_EQ(CountWrong({volume.Layer()}, plane, parameters), 0) << axis << " " << depth << " " << linear;
      }
    }
}

TEST(SlicePicture, ModesEqualTheirDefinitions)
{
  const Posed<unsigned char> a({23, 17, 19}, 1), b({20, 20, 20}, 2), c({30, 6, 21}, 3);
  std::vector<SliceLayer> layers{a.Layer(), b.Layer(), c.Layer()};
  layers[0].selected = true;
  layers[0].colour = {1.0, 0.2, 0.4};
  layers[2].opacity = 0.5;
  const SlicePlane plane = PlaneThrough({0.3, 0.2, 0.1}, ExpRotation({0.3, -0.4, 0.5}), 0.2, 130, 110);
  for (const SliceMode mode : {SliceMode::Blend, SliceMode::Difference, SliceMode::Checkerboard})
    for (const bool linear : {true, false}) {
      SliceParameters parameters;
      parameters.mode = mode;
      parameters.linear = linear;
      parameters.squarePixels = 13;
      EXPECT_LE(CountWrong(layers, plane, parameters), 1) << static_cast<int>(mode) << linear;
    }
}

TEST(SlicePicture, NothingBeforeAndBehindAndBesideAVolume)
{
  const Posed<float> volume({8, 8, 8}, 4, false);
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (const Eigen::Vector3d& middle : {Eigen::Vector3d(0, 0, 50), Eigen::Vector3d(0, 0, -50), Eigen::Vector3d(500, 0, 0),
                                        Eigen::Vector3d(0, -1e7, 0), Eigen::Vector3d(1e12, 1e12, 1e12)})
    for (const std::uint8_t byte : Draw({volume.Layer()}, PlaneThrough(middle, axes, 0.5, 30, 20)))
      ASSERT_EQ(byte, 0);
  EXPECT_EQ(Draw({}, PlaneThrough({0, 0, 0}, axes, 0.5, 3, 2)), Picture(24, 0)) << "no volumes";
}

TEST(SlicePicture, OneVoxelWideVolumes)
{
  for (const std::array<int, 3>& dimensions :
       {std::array<int, 3>{1, 1, 1}, std::array<int, 3>{1, 9, 8}, std::array<int, 3>{9, 1, 8}, std::array<int, 3>{9, 8, 1}}) {
    const Posed<short> volume(dimensions, 11, false);
    for (std::uint64_t n = 0; n < 6; ++n) {
      Random random(12, n);
      const SlicePlane plane = PlaneThrough(
          volume.geometry.Centre(), n == 0 ? volume.geometry.direction : ExpRotation(3.0 * random.Direction()), 0.05, 90, 90);
      EXPECT_LE(CountWrong({volume.Layer()}, plane, {}), 1);
      EXPECT_GT(Draw({volume.Layer()}, plane)[4 * (45 * 90 + 45) + 3], 0) << "the middle is there";
    }
  }
}

TEST(SlicePicture, VoxelsThatAreNotFiniteNeverBleed)
{
  Posed<double> volume({9, 9, 9}, 13, false);
  for (double& voxel : volume.intensity.View())
    voxel = 100.0;
  volume.intensity.View()(4, 4, 4) = std::numeric_limits<double>::quiet_NaN();
  volume.intensity.View()(2, 4, 4) = -std::numeric_limits<double>::infinity();
  SliceLayer layer = volume.Layer();
  std::get<PosedVolume<double>>(layer.volume).valid = {}; // no valid region: what is finite is real
  const SlicePlane plane = PlaneThrough(volume.geometry.Centre(), volume.geometry.direction, 0.05, 120, 120);
  const Picture picture = Draw({layer}, plane);
  int holes = 0;
  for (std::size_t p = 0; p < picture.size(); p += 4) {
    holes += picture[p + 3] == 0;
    EXPECT_TRUE(picture[p + 3] == 0 || picture[p] == 100);
  }
  EXPECT_GT(holes, 0);
  EXPECT_LE(CountWrong({layer}, plane, {}), 1);
}

TEST(SlicePicture, AVolumeOfOpacityZeroIsNotThere)
{
  const Posed<unsigned char> a({23, 17, 19}, 1), b({20, 20, 20}, 2);
  std::vector<SliceLayer> both{a.Layer(), b.Layer()};
  both[1].opacity = 0.0;
  const SlicePlane plane = PlaneThrough({0, 0, 0}, ExpRotation({0.3, -0.4, 0.5}), 0.2, 60, 60);
  EXPECT_EQ(Draw(both, plane), Draw({a.Layer()}, plane));
}

TEST(SlicePicture, OneAndManyThreadsDrawTheSame)
{
  const Posed<unsigned char> a({40, 40, 40}, 1);
  const Posed<float> b({40, 40, 40}, 2);
  const SlicePlane plane = PlaneThrough({0, 0, 0}, ExpRotation({0.3, -0.4, 0.5}), 0.1, 301, 203);
  for (const int step : {1, 3}) {
    SliceParameters parameters;
    parameters.step = step;
    const Picture many = Draw({a.Layer(), b.Layer()}, plane, parameters);
    const ThreadLimit one(1);
    EXPECT_EQ(Draw({a.Layer(), b.Layer()}, plane, parameters), many);
  }
}

TEST(SlicePicture, StepsKeepTheSamplesAndFillBetween)
{
  // A ramp: what is interpolated is right everywhere but in the last columns, beyond the last sample.
  Posed<float> volume({64, 64, 3}, 1, false);
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i)
        volume.intensity.View()(i, j, k) = static_cast<float>(2 * i + j);
  const SlicePlane plane = PlaneThrough(volume.geometry.Centre(), volume.geometry.direction, 0.1, 201, 161);
  const Picture full = Draw({volume.Layer()}, plane);
  for (const int step : {2, 4, 16}) {
    SliceParameters parameters;
    parameters.step = step;
    const Picture coarse = Draw({volume.Layer()}, plane, parameters);
    for (int j = 0; j < plane.height; ++j)
      for (int i = 0; i < plane.width; ++i) {
        const std::size_t p = 4 * static_cast<std::size_t>(j * plane.width + i);
        ASSERT_EQ(full[p + 3], 255); // the plane lies inside the volume
        ASSERT_EQ(coarse[p + 3], 255) << step << " " << i << " " << j;
        if (i % step == 0 && j % step == 0) {
          ASSERT_EQ(coarse[p], full[p]);
        } else if (i < plane.width / step * step && j < plane.height / step * step) {
          ASSERT_NEAR(coarse[p], full[p], 2);
        }
      }
  }
}

TEST(SlicePicture, RefusesWhatMakesNoSense)
{
  const Posed<unsigned char> volume({5, 5, 5}, 1);
  const SlicePlane plane = PlaneThrough({0, 0, 0}, Eigen::Matrix3d::Identity(), 0.5, 8, 8);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](const auto& change, const std::string& word) {
    std::vector<SliceLayer> layers{volume.Layer()};
    SlicePlane p = plane;
    SliceParameters parameters;
    change(layers[0], p, parameters);
    try {
      Draw(layers, p, parameters);
      ADD_FAILURE() << word << " was not refused";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refuses([](SliceLayer& l, SlicePlane&, SliceParameters&) { l.white = l.black; }, "grey window");
  refuses([&](SliceLayer& l, SlicePlane&, SliceParameters&) { l.white = nan; }, "grey window");
  refuses([&](SliceLayer& l, SlicePlane&, SliceParameters&) { l.opacity = nan; }, "opacity");
  refuses([](SliceLayer& l, SlicePlane&, SliceParameters&) { l.colour[1] = 1.5; }, "colour");
  refuses([](SliceLayer&, SlicePlane& p, SliceParameters&) { p.up = p.right; }, "plane");
  refuses([&](SliceLayer&, SlicePlane& p, SliceParameters&) { p.origin[1] = nan; }, "plane");
  refuses([](SliceLayer&, SlicePlane&, SliceParameters& s) { s.step = 0; }, "step");
  refuses([](SliceLayer&, SlicePlane&, SliceParameters& s) { s.squarePixels = 1; }, "squarePixels");
  refuses([](SliceLayer& l, SlicePlane&, SliceParameters&) { std::get<0>(l.volume).geometry.spacing[0] = 0.0; }, "spacing");
  SlicePlane empty = plane;
  empty.width = 0;
  EXPECT_TRUE(Draw({volume.Layer()}, empty).empty()) << "a window without pixels is no error";
}

} // namespace
