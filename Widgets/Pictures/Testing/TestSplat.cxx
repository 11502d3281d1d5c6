// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Widgets/Pictures/Splat.h"
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

namespace echorama {
namespace {

constexpr int Width = 75, Height = 50; // no whole tiles

Particles Cloud(int count, std::uint64_t seed, double side)
{
  Random random(seed);
  Particles particles;
  for (int i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis)
      particles.positions.push_back(static_cast<float>(60.0 * (random.Uniform() - 0.5)));
    particles.values.push_back(static_cast<std::uint8_t>(random.Below(256)));
    particles.alphas.push_back(static_cast<std::uint8_t>(1 + random.Below(200)));
  }
  particles.sizeMm = static_cast<float>(side);
  return particles;
}

// A camera at z = 100 that looks at the origin, as gluPerspective and gluLookAt have it; its picture is 60 mm high there.
SplatView View(bool perspective)
{
  const double near = 20.0, far = 200.0, distance = 100.0, half = 30.0, aspect = static_cast<double>(Width) / Height;
  SplatView view;
  view.width = Width;
  view.height = Height;
  Eigen::Matrix4d projection = Eigen::Matrix4d::Zero();
  if (perspective) {
    const double f = distance / half;
    projection << f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), 2.0 * far * near / (near - far), 0, 0, -1,
        0;
    view.pixels = 0.5 * Height * f;
  } else {
    projection.diagonal() << 1.0 / (half * aspect), 1.0 / half, -2.0 / (far - near), 1.0;
    projection(2, 3) = -(far + near) / (far - near);
    view.pixels = 0.5 * Height / half;
  }
  Eigen::Affine3d camera(Eigen::Translation3d(0.0, 0.0, -distance));
  view.worldToClip = projection * camera.matrix();
  return view;
}

struct Seen {
  double x, y, half, depth;
  std::array<double, 4> colour;
};

// By the definition: all particles are sorted, and each pixel is blended from back to front.
std::vector<double> ByForce(const std::vector<SplatSet>& sets, const SplatView& view, const float* depth = nullptr)
{
  std::vector<Seen> all;
  for (const SplatSet& set : sets)
    for (std::size_t p = 0; p < set.particles->Count(); ++p) {
      const Eigen::Vector3d position = Eigen::Map<const Eigen::Vector3f>(set.particles->positions.data() + 3 * p).cast<double>();
      const Eigen::Vector4d clip = view.worldToClip * (set.volumeToWorld * position).homogeneous();
      if (clip[3] <= 0.0 || (clip.head<3>().array().abs() > clip[3]).any())
        continue;
      const double value = set.particles->values[p];
      all.push_back({0.5 * view.width * (clip[0] / clip[3] + 1.0),
                     0.5 * view.height * (clip[1] / clip[3] + 1.0),
                     0.5 * std::max(1.0, view.sides * set.particles->sizeMm * view.pixels / clip[3]),
                     0.5 * (clip[2] / clip[3] + 1.0),
                     {std::round(set.colour[0] * value), std::round(set.colour[1] * value), std::round(set.colour[2] * value),
                      std::round(set.opacity * set.particles->alphas[p])}});
    }
  std::stable_sort(all.begin(), all.end(), [](const Seen& a, const Seen& b) { return a.depth > b.depth; });
  std::vector<double> picture(4 * static_cast<std::size_t>(view.width * view.height), 0.0);
  for (const Seen& seen : all)
    for (int j = 0; j < view.height; ++j)
      for (int i = 0; i < view.width; ++i) {
        const auto at = static_cast<std::size_t>(j * view.width + i);
        if (i + 0.5 < seen.x - seen.half || i + 0.5 >= seen.x + seen.half || j + 0.5 < seen.y - seen.half ||
            j + 0.5 >= seen.y + seen.half || (depth && seen.depth >= depth[at]))
          continue;
        const double alpha = seen.colour[3] / 255.0;
        for (std::size_t c = 0; c < 4; ++c)
          picture[4 * at + c] = (1.0 - alpha) * picture[4 * at + c] + alpha * (c < 3 ? seen.colour[c] : 255.0);
      }
  return picture;
}

// How many bytes are off by more than rounding; those at the borders of particles may be, as floats have 24 bits.
int Wrong(const std::vector<std::uint8_t>& picture, const std::vector<double>& wanted, double tolerance)
{
  EXPECT_EQ(picture.size(), wanted.size());
  int wrong = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wrong += std::fabs(picture[i] - wanted[i]) > tolerance;
  return wrong;
}

std::vector<SplatSet> TwoClouds(const Particles& one, const Particles& other)
{
  return {{&one, {1.0, 0.8, 0.2}, 1.0, MotionAbout({0, 0, 0}, {0.2, 0.5, -0.3}, {4.0, 1.0, 2.0})},
          {&other, {0.3, 0.6, 1.0}, 0.7, MotionAbout({0, 0, 0}, {-0.4, 0.1, 0.6}, {-3.0, 2.0, 0.0})}};
}

TEST(Splat, IsTheBlendOfAllParticlesFromBackToFront)
{
  for (const bool perspective : {true, false})
    for (const double side : {0.3, 2.0, 40.0}) { // less than a pixel, some pixels, more than a tile
      const int count = side > 10.0 ? 300 : 4000;
      const Particles one = Cloud(count, 1, side), other = Cloud(count, 2, 1.3 * side);
      const std::vector<SplatSet> sets = TwoClouds(one, other);
      const SplatView view = View(perspective);
      const std::vector<double> wanted = ByForce(sets, view);
      EXPECT_LE(Wrong(DrawParticles(sets, view), wanted, 1.01), 8) << perspective << " " << side;
      EXPECT_GT(std::accumulate(wanted.begin(), wanted.end(), 0.0), 100.0 * Width * Height);
    }
}

TEST(Splat, WhatIsBehindSomethingOpaqueIsNotSeen)
{
  const Particles one = Cloud(3000, 1, 2.0), other = Cloud(3000, 2, 3.0);
  const std::vector<SplatSet> sets = TwoClouds(one, other);
  const SplatView view = View(true);
  std::vector<float> depth(Width * Height, 1.0f);
  for (int j = 10; j < 40; ++j) // something that leans through the cloud
    for (int i = 20; i < 70; ++i)
      depth[static_cast<std::size_t>(j * Width + i)] = 0.85f + 0.001f * static_cast<float>(i);
  const std::vector<double> wanted = ByForce(sets, view, depth.data());
  EXPECT_LE(Wrong(DrawParticles(sets, view, depth.data()), wanted, 1.01), 8);
  EXPECT_GT(Wrong(DrawParticles(sets, view), wanted, 1.01), 1000); // it hides much
}

// The last of several that lie at one place is on top, as OpenGL draws them.
TEST(Splat, AtOneDepthTheLastIsOnTop)
{
  Particles one;
  one.positions = {0.0f, 0.0f, 0.0f};
  one.values = {255};
  one.alphas = {255};
  one.sizeMm = 30.0f;
  const std::vector<SplatSet> sets{{&one, {1.0, 0.0, 0.0}, 1.0, Pose::Identity()},
                                   {&one, {0.0, 1.0, 0.0}, 1.0, Pose::Identity()}};
  const std::vector<std::uint8_t> picture = DrawParticles(sets, View(true));
  const std::size_t middle = 4 * static_cast<std::size_t>(Height / 2 * Width + Width / 2);
  EXPECT_EQ(picture[middle], 0);
  EXPECT_EQ(picture[middle + 1], 255);
  EXPECT_EQ(picture[0] + picture[1] + picture[2] + picture[3], 0); // and the corner is empty
}

TEST(Splat, StopsWhereAllIsOpaqueWithoutADifference)
{
  const Particles dense = Cloud(20000, 3, 6.0);
  const std::vector<SplatSet> sets{{&dense, {1.0, 1.0, 1.0}, 1.0, Pose::Identity()}};
  EXPECT_LE(Wrong(DrawParticles(sets, View(true)), ByForce(sets, View(true)), 1.01), 20);
}

TEST(Splat, DoesNotDependOnThreads)
{
  const Particles one = Cloud(90000, 1, 1.0), other = Cloud(40000, 2, 1.5); // several chunks
  const std::vector<std::uint8_t> many = DrawParticles(TwoClouds(one, other), View(true));
  const ThreadLimit limit(1);
  EXPECT_EQ(DrawParticles(TwoClouds(one, other), View(true)), many);
}

TEST(Splat, LeavesOutWhatTheCameraDoesNotSee)
{
  Particles particles;
  particles.positions = {0.0f, 0.0f, 150.0f, 0.0f, 0.0f, 90.0f, 0.0f, 0.0f, -150.0f, 500.0f, 0.0f, 0.0f, NAN, 0.0f, 0.0f};
  particles.values.assign(5, 255); // behind the camera, too near, too far, beside, nowhere
  particles.alphas.assign(5, 255);
  particles.sizeMm = 5.0f;
  const std::vector<std::uint8_t> picture = DrawParticles({{&particles, {1.0, 1.0, 1.0}, 1.0, Pose::Identity()}}, View(true));
  EXPECT_EQ(std::accumulate(picture.begin(), picture.end(), 0), 0);
  EXPECT_EQ(DrawParticles({}, View(true)), picture);
}

} // namespace
} // namespace echorama
