// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Live/BeamVolumes.h"
#include "Filters/Live/BorderDistance.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <optional>

namespace {

using namespace echorama;

constexpr int samples = 150, beams = 24; // more than one run of samples, and not a whole number of them

// What was read, and from where.
struct Reading {
  Volume<float> value{{samples, beams, 1}};
  Volume<unsigned char> content{{samples, beams, 1}};
};

Reading Read(const BeamVolumes& volumes, const PlacedProbe& probe, const BeamThickness& thickness, const VolumeMix& mix = {},
             const BeamBend* bend = nullptr)
{
  Reading reading;
  volumes.Read(probe, thickness, reading.value.View(), reading.content.View(), mix, bend);
  return reading;
}

// A grid of cubes whose middle lies at (0, 0, 40), obliquely.
ImageGeometry Oblique(const std::array<int, 3>& dimensions, double spacing)
{
  ImageGeometry g;
  g.dimensions = dimensions;
  g.spacing.setConstant(spacing);
  g.direction = ExpRotation({0.3, -0.2, 0.5});
  g.origin = Eigen::Vector3d(0, 0, 40) - (g.Centre() - g.origin);
  return g;
}

PlacedProbe Convex(const Pose& pose = Pose::Identity())
{
  return {ProbeGeometry::Convex(1.0, 30.0, 0.0, 0.0, 0.0, 80.0), pose};
}

template <class T>
Volume<T> Noise(const std::array<int, 3>& dimensions)
{
  Volume<T> volume(dimensions);
  Random random(3);
  for (T& voxel : volume.View())
    voxel = static_cast<T>(static_cast<int>(random.Below(256)));
  return volume;
}

// The same by the definitions, in double precision, one sample at a time.
struct Expected {
  double value = 0.0;
  double weight = 0.0;
};

template <class T>
std::optional<double> Trilinear(const PosedVolume<T>& volume, const Eigen::Vector3d& index)
{
  const auto& n = volume.intensity.Dimensions();
  const auto real = [&](int i, int j, int k) { return volume.valid.Empty() || volume.valid(i, j, k); };
  int nearest[3], below[3];
  for (int a = 0; a < 3; ++a) {
    const int count = n[static_cast<std::size_t>(a)];
    nearest[a] = static_cast<int>(std::floor(index[a] + 0.5));
    if (nearest[a] < 0 || nearest[a] >= count)
      return {};
    below[a] = std::min(std::max(static_cast<int>(std::floor(index[a])), 0), count - 2);
  }
  if (!real(nearest[0], nearest[1], nearest[2]))
    return {};
  double sum = 0.0, weights = 0.0;
  for (int c = 0; c < 8; ++c) {
    double w = 1.0;
    int at[3];
    for (int a = 0; a < 3; ++a) {
      const double t = std::min(std::max(index[a] - below[a], 0.0), 1.0);
      at[a] = below[a] + (c >> a & 1);
      w *= c >> a & 1 ? t : 1.0 - t;
    }
    if (real(at[0], at[1], at[2])) {
      sum += w * static_cast<double>(volume.intensity(at[0], at[1], at[2]));
      weights += w;
    }
  }
  return sum / weights;
}

template <class T>
Expected ExpectedAt(const PosedVolume<T>& volume, const PlacedProbe& probe, const BeamThickness& thickness, int sample, int beam)
{
  const ProbeGeometry& g = probe.geometry;
  const double depth = g.depthMin + (g.depthMax - g.depthMin) * sample / (samples - 1);
  const Eigen::Vector3d onAxis = PointOf(g, {depth, static_cast<double>(beam) / (beams - 1) - 0.5, 0.0});
  Expected expected;
  for (const ThicknessPlane& plane : PlanesOf(thickness)) {
    const Eigen::Vector3d point = onAxis + Eigen::Vector3d(0, plane.offset * thickness.SigmaMm(depth), 0);
    if (const auto value = Trilinear(volume, volume.geometry.WorldToIndex() * (probe.probeToWorld * point))) {
      expected.value += plane.weight * *value;
      expected.weight += plane.weight;
    }
  }
  if (expected.weight > 0.0)
    expected.value /= expected.weight;
  return expected;
}

template <class T>
void CompareWithDefinition(const Volume<T>& voxels, VolumeView<const unsigned char> valid)
{
  const PosedVolume<T> volume{voxels.View(), valid, Oblique(voxels.Dimensions(), 0.8)};
  const PlacedProbe probe = Convex(MotionAbout({0, 0, 40}, {0.2, 0.1, -0.4}, {3, -2, 1}));
  const BeamThickness thickness{3.0, 40.0, 0.1, 5};
  BeamVolumes volumes;
  volumes.Add<T>(volume);
  const Reading reading = Read(volumes, probe, thickness);
  int real = 0, unreal = 0, undecided = 0;
  for (int beam = 0; beam < beams; ++beam)
    for (int sample = 0; sample < samples; ++sample) {
      const Expected expected = ExpectedAt(volume, probe, thickness, sample, beam);
      const bool isReal = reading.content.View()(sample, beam, 0) != ContentNothing;
      // Whether a plane is real jumps halfway between voxels; single precision may see it on the other side.
      if (isReal != (expected.weight >= 0.4999)) {
        ++undecided;
        continue;
      }
      (isReal ? real : unreal)++;
      if (!isReal)
        EXPECT_EQ(reading.value.View()(sample, beam, 0), 0.0f);
      else if (std::abs(reading.value.View()(sample, beam, 0) - expected.value) > 0.02)
        ++undecided;
    }
  EXPECT_GT(real, 500);
  EXPECT_GT(unreal, 500);
  EXPECT_LE(undecided, 3);
}

TEST(BeamVolumes, FollowTheDefinition)
{
  const std::array<int, 3> dimensions{60, 50, 70};
  CompareWithDefinition<unsigned char>(Noise<unsigned char>(dimensions), {});
  CompareWithDefinition<short>(Noise<short>(dimensions), {});
  CompareWithDefinition<float>(Noise<float>(dimensions), {});
}

TEST(BeamVolumes, FollowTheDefinitionThroughAValidRegion)
{
  const std::array<int, 3> dimensions{60, 50, 70};
  Volume<unsigned char> valid(dimensions);
  Random random(8);
  for (int k = 0; k < dimensions[2]; ++k)
    for (int j = 0; j < dimensions[1]; ++j)
      for (int i = 0; i < dimensions[0]; ++i) // a half that is whole, with holes in the rest
        valid.View()(i, j, k) = i < 30 || random.Below(20) > 0;
  CompareWithDefinition<unsigned char>(Noise<unsigned char>(dimensions), valid.View());
  CompareWithDefinition<float>(Noise<float>(dimensions), valid.View());
}

template <class T>
void ExpectConstant()
{
  const std::array<int, 3> dimensions{50, 50, 50};
  const Volume<T> voxels(dimensions, static_cast<T>(119));
  Volume<unsigned char> valid(dimensions, 1);
  for (int k = 10; k < 20; ++k)
    valid.View()(25, 25, k) = 0;
  for (const bool masked : {false, true}) {
    BeamVolumes volumes;
    volumes.Add<T>({voxels.View(), masked ? valid.View() : VolumeView<const unsigned char>(), Oblique(dimensions, 1.0)});
    const Reading reading = Read(volumes, Convex(), {4.0, 30.0, 0.1, 5});
    int real = 0;
    for (std::ptrdiff_t i = 0; i < reading.value.View().Size(); ++i)
      if (reading.content.View()[i]) {
        ASSERT_NEAR(reading.value.View()[i], 119.0f, 1e-4f);
        ++real;
      }
    EXPECT_GT(real, 1000);
    EXPECT_LT(real, samples * beams);
  }
}

TEST(BeamVolumes, AConstantVolumeStaysConstantUpToItsEnd)
{
  ExpectConstant<unsigned char>();
  ExpectConstant<short>();
  ExpectConstant<unsigned short>();
  ExpectConstant<float>();
  ExpectConstant<double>();
}

// Volumes of slices across y, every 0.25 mm, whose value and label are functions of y.
template <class Value, class Label>
struct Slices {
  Slices(const Value& valueOf, const Label& labelOf) : value(dimensions), label(dimensions)
  {
    grid.dimensions = dimensions;
    grid.spacing = {8.0, 0.25, 8.0};
    grid.origin = {-40.0, -15.0, -4.0};
    for (int k = 0; k < dimensions[2]; ++k)
      for (int j = 0; j < dimensions[1]; ++j)
        for (int i = 0; i < dimensions[0]; ++i) {
          const double y = grid.origin.y() + j * 0.25;
          value.View()(i, j, k) = static_cast<float>(valueOf(y));
          label.View()(i, j, k) = static_cast<unsigned char>(labelOf(y));
        }
  }
  static constexpr std::array<int, 3> dimensions{11, 121, 13};
  Volume<float> value;
  Volume<unsigned char> label;
  ImageGeometry grid;
};

TEST(BeamVolumes, AThinSheetAcrossThePlaneShowsTheGaussianOfTheThickness)
{
  // Smooth enough for voxels and planes to follow it.
  constexpr double sheetSigma = 0.5;
  const Slices slices([](double y) { return 1000.0 * std::exp(-0.5 * y * y / (sheetSigma * sheetSigma)); },
                      [](double) { return 1; });
  BeamVolumes volumes;
  volumes.Add<float>({slices.value.View(), {}, slices.grid});
  const BeamThickness thickness{3.0, 40.0, 0.1, 65};
  const int middle = beams / 2;
  for (const int sample : {75, 140}) { // near the focus, and away from it
    const double depth = 80.0 * sample / (samples - 1), sigma = thickness.SigmaMm(depth);
    std::vector<double> seen;
    for (const double y : {0.0, 0.5, 1.0, 1.5, 2.0, 2.5}) {
      Pose pose = Pose::Identity();
      pose.translation().y() = y;
      seen.push_back(Read(volumes, Convex(pose), thickness).value.View()(sample, middle, 0));
    }
    // Two Gaussians make a third; 1.2% of the thickness' own are cut off.
    const double wide = std::hypot(sigma, sheetSigma), peak = 1000.0 * sheetSigma / wide / 0.98758;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const double y = 0.5 * static_cast<double>(i);
      EXPECT_NEAR(seen[i], peak * std::exp(-0.5 * y * y / (wide * wide)), 0.01 * peak) << "at " << y << " mm, depth " << depth;
    }
  }
}

TEST(BeamVolumes, WhereLessThanHalfOfTheThicknessIsRealThereIsNothing)
{
  const Slices slices([](double) { return 50.0; }, [](double) { return 1; });
  BeamVolumes volumes;
  volumes.Add<float>({slices.value.View(), {}, slices.grid});
  const double end = 15.125; // half a voxel beyond the last slice
  for (const int planes : {1, 4, 5})
    for (const double beyond : {-8.0, planes % 2 ? -0.1 : -2.0, planes % 2 ? 0.1 : 2.0, 8.0}) {
      Pose pose = Pose::Identity();
      pose.translation().y() = end + beyond;
      const Reading reading = Read(volumes, Convex(pose), {3.0, 40.0, 0.0, planes});
      EXPECT_EQ(reading.content.View()(75, beams / 2, 0), beyond < 0.0 ? ContentData : ContentNothing) << planes << " " << beyond;
      EXPECT_NEAR(reading.value.View()(75, beams / 2, 0), beyond < 0.0 ? 50.0f : 0.0f, 1e-5f) << planes << " " << beyond;
    }
}

TEST(BeamVolumes, InventedBackgroundIsToldFromDataAndFromBoth)
{
  const Slices slices([](double) { return 50.0; }, [](double y) { return y < -6.0 ? 1 : y < 6.0 ? 2 : y < 12.0 ? 3 : 0; });
  BeamVolumes volumes;
  volumes.Add<float>({slices.value.View(), {}, slices.grid}, slices.label.View());
  const auto labelAt = [&volumes](double y, double thickness) {
    Pose pose = Pose::Identity();
    pose.translation().y() = y;
    return LabelOfContent(Read(volumes, Convex(pose), {thickness, 40.0, 0.0, 5}).content.View()(75, beams / 2, 0));
  };
  EXPECT_EQ(labelAt(-10.0, 2.0), 1);
  EXPECT_EQ(labelAt(0.0, 2.0), 2);
  EXPECT_EQ(labelAt(9.0, 2.0), 3);
  EXPECT_EQ(labelAt(14.5, 0.0), 0);
  EXPECT_EQ(labelAt(6.5, 0.0), 3); // as thin as a razor it is all invented
  EXPECT_EQ(labelAt(6.5, 3.0), 2); // but a thick plane reaches back
  EXPECT_EQ(labelAt(-6.5, 3.0), 2);
}

TEST(BeamVolumes, WhatIsInventedIsHiddenOnRequest)
{
  const Slices slices([](double y) { return y < 0.0 ? 50.0 : 90.0; }, [](double y) { return y < 0.0 ? 1 : 3; });
  BeamVolumes volumes;
  volumes.Add<float>({slices.value.View(), {}, slices.grid}, slices.label.View());
  const BeamThickness thickness{4.0, 40.0, 0.0, 9};
  const auto at = [&](double y, bool shown) {
    Pose pose = Pose::Identity();
    pose.translation().y() = y;
    VolumeMix mix;
    mix.showInvented = shown;
    const Reading reading = Read(volumes, Convex(pose), thickness, mix);
    return std::make_pair(reading.value.View()(75, beams / 2, 0), reading.content.View()(75, beams / 2, 0));
  };
  const unsigned char both = ContentData | ContentInvented;
  EXPECT_EQ(at(-8.0, false), at(-8.0, true));
  EXPECT_EQ(at(8.0, true), std::make_pair(90.0f, static_cast<unsigned char>(ContentInvented)));
  EXPECT_EQ(at(8.0, false), std::make_pair(0.0f, static_cast<unsigned char>(ContentNothing)));
  // A thick plane that reaches into what is invented is made of the data alone, if half of it is data.
  EXPECT_EQ(at(-1.5, true).second, both);
  EXPECT_GT(at(-1.5, true).first, 51.0f);
  EXPECT_EQ(at(-1.5, false).second, ContentData);
  EXPECT_NEAR(at(-1.5, false).first, 50.0f, 1e-4f);
  EXPECT_EQ(at(1.5, false).second, ContentNothing);

  // Where the first volume is invented the next one is seen.
  const Slices other([](double) { return 20.0; }, [](double) { return 1; });
  volumes.Add<float>({other.value.View(), {}, other.grid}, other.label.View());
  EXPECT_NEAR(at(8.0, false).first, 20.0f, 1e-4f);
  EXPECT_NEAR(at(8.0, true).first, 90.0f, 1e-4f);
}

// Two volumes that overlap from z = 30 to 60: what each weighs at a depth follows from where it ends.
TEST(BeamVolumes, TheMeanOfSeveralHasNoSeam)
{
  const auto box = [](double fromZ, int slices) {
    ImageGeometry g;
    g.dimensions = {161, 161, slices};
    g.origin = {-80, -80, fromZ};
    return g;
  };
  const ImageGeometry upper = box(-40, 101), lower = box(30, 101); // from -40 to 60, and from 30 to 130
  const Volume<unsigned char> dark(upper.dimensions, 100), bright(lower.dimensions, 140);
  BeamVolumes volumes;
  volumes.Add<unsigned char>({dark.View(), {}, upper});
  volumes.Add<unsigned char>({bright.View(), {}, lower});
  VolumeMix unprepared;
  unprepared.overlap = VolumeMix::Overlap::Mean;
  EXPECT_THROW(Read(volumes, Convex(), {}, unprepared), Error);
  volumes.PrepareMean();
  const BeamThickness razor{0.0, 0.0, 0.0, 1};
  const auto along = [&](VolumeMix::Overlap overlap, int i) {
    VolumeMix mix;
    mix.overlap = overlap;
    static std::map<VolumeMix::Overlap, Reading> kept;
    if (!kept.count(overlap))
      kept[overlap] = Read(volumes, Convex(), razor, mix);
    return kept[overlap].value.View()(i, beams / 2, 0);
  };
  float largest = 0.0f, largestOfFirst = 0.0f;
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector3d point = PointOf(Convex().geometry, {80.0 * i / (samples - 1), (beams / 2) / (beams - 1.0) - 0.5, 0.0});
    const double z = point.z();
    const float mean = along(VolumeMix::Overlap::Mean, i);
    if (z < 30.0 || z > 60.0) {
      EXPECT_EQ(mean, z < 40.0 ? 100.0f : 140.0f);
    } else {
      EXPECT_NEAR(mean, 100.0 + 40.0 * (z - 30.0) / 30.0, 0.1) << z;
    }
    if (i > 0) {
      largest = std::max(largest, std::abs(mean - along(VolumeMix::Overlap::Mean, i - 1)));
      largestOfFirst =
          std::max(largestOfFirst, std::abs(along(VolumeMix::Overlap::First, i) - along(VolumeMix::Overlap::First, i - 1)));
    }
  }
  const double step = 80.0 / (samples - 1);
  EXPECT_LT(largest, 1.3 * 40.0 * step / 30.0); // as even as a ramp over the overlap
  EXPECT_EQ(largestOfFirst, 40.0f);
}

TEST(BeamVolumes, WhatIsInventedDoesNotOutweighDataInAMean)
{
  const Slices invented([](double) { return 200.0; }, [](double) { return 3; });
  const Slices data([](double) { return 100.0; }, [](double y) { return y < 0.0 ? 1 : 3; });
  BeamVolumes volumes;
  volumes.Add<float>({invented.value.View(), {}, invented.grid}, invented.label.View());
  volumes.Add<float>({data.value.View(), {}, data.grid}, data.label.View());
  volumes.PrepareMean();
  VolumeMix mix;
  mix.overlap = VolumeMix::Overlap::Mean;
  const auto at = [&](double y) {
    Pose pose = Pose::Identity();
    pose.translation().y() = y;
    const Reading reading = Read(volumes, Convex(pose), {0.0, 0.0, 0.0, 1}, mix);
    return std::make_pair(reading.value.View()(75, beams / 2, 0), reading.content.View()(75, beams / 2, 0));
  };
  EXPECT_EQ(at(-9.0), std::make_pair(100.0f, static_cast<unsigned char>(ContentData)));
  EXPECT_EQ(at(9.0).second, ContentInvented); // nobody has data there
}

TEST(BeamVolumes, PressedTissueIsReadWhereItLay)
{
  const std::array<int, 3> dimensions{60, 50, 70};
  const Volume<float> voxels = Noise<float>(dimensions);
  const Volume<unsigned char> valid(dimensions, 1);
  for (const bool masked : {false, true}) { // bricks or none
    BeamVolumes volumes;
    volumes.Add<float>({voxels.View(), masked ? valid.View() : VolumeView<const unsigned char>(), Oblique(dimensions, 0.8)});
    const PlacedProbe probe = Convex(MotionAbout({0, 0, 40}, {0.2, 0.1, -0.4}, {3, -2, 1}));
    const BeamThickness thickness{3.0, 40.0, 0.1, 5};
    // All that has moved alike is seen as by a probe that has moved on.
    const Eigen::Vector3d move(1.3, -0.7, 2.1);
    BeamBend bend(probe.geometry, 5, 3, 10.0);
    for (std::size_t node = 0; node < bend.Count(); ++node)
      bend.SetMove(node, move);
    PlacedProbe moved = probe;
    moved.probeToWorld.translation() += probe.probeToWorld.linear() * move;
    const Reading pressed = Read(volumes, probe, thickness, {}, &bend), expected = Read(volumes, moved, thickness);
    int different = 0, real = 0;
    for (std::ptrdiff_t i = 0; i < pressed.value.View().Size(); ++i) {
      real += expected.content.View()[i] != ContentNothing;
      different += pressed.content.View()[i] != expected.content.View()[i] ||
                   std::abs(pressed.value.View()[i] - expected.value.View()[i]) > 0.02f;
    }
    EXPECT_GT(real, 500);
    EXPECT_LE(different, 3) << masked; // rounding where something ends
  }
}

TEST(BorderDistance, FallsToNothingWhereOthersGoOn)
{
  ImageGeometry g;
  g.dimensions = {101, 81, 63}; // 25 and 20 blocks, and 15 and a half
  g.spacing = {0.5, 1.0, 1.5};
  const int hole[3] = {12, 10, 8};
  // Others have the hole, and all that is beyond the volume but for x < 0.
  const BorderDistance depth(g, [&](int i, int j, int k) {
    return (i == hole[0] && j == hole[1] && k == hole[2]) || i > 24 || j < 0 || j > 19 || k < 0 || k > 14;
  });
  Random random(5);
  for (int n = 0; n < 3000; ++n) {
    const Eigen::Vector3d at(random.Uniform(-0.5, 100.5), random.Uniform(-0.5, 80.5), random.Uniform(-0.5, 62.5));
    double toRim = g.spacing[0] * (100.0 - at[0]), toHole = 0.0;
    toRim = std::min({toRim, g.spacing[1] * std::min(at[1], 80.0 - at[1]), g.spacing[2] * std::min(at[2], 60.0 - at[2])});
    for (int axis = 0; axis < 3; ++axis)
      toHole += std::pow(g.spacing[axis] * std::max({0.0, 4.0 * hole[axis] - at[axis], at[axis] - 4.0 * hole[axis] - 4.0}), 2);
    const double expected = std::max(0.0, std::min(toRim, std::sqrt(toHole)));
    const double made = depth.At(static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2]));
    if (expected == 0.0) {
      EXPECT_EQ(made, 0.0) << at.transpose();
    } else {
      EXPECT_NEAR(made, expected, 3.0) << at.transpose(); // half a cell: linear where the distance has a ridge
    }
  }
  g.dimensions = {50, 40, 1};
  EXPECT_EQ(BorderDistance(g, [](int, int, int) { return false; }).At(10.0f, 10.0f, 0.0f), BorderDistance::farthestMm);
}

TEST(BeamVolumes, TheFirstOfSeveralVolumesCounts)
{
  const std::array<int, 3> dimensions{50, 50, 50};
  const Volume<unsigned char> first(dimensions, 10), second({80, 80, 80}, 200);
  const ImageGeometry inner = Oblique(dimensions, 0.5), outer = Oblique({80, 80, 80}, 0.8);
  BeamVolumes alone, both, reversed;
  alone.Add<unsigned char>({first.View(), {}, inner});
  both.Add<unsigned char>({first.View(), {}, inner});
  both.Add<unsigned char>({second.View(), {}, outer});
  reversed.Add<unsigned char>({second.View(), {}, outer});
  reversed.Add<unsigned char>({first.View(), {}, inner});
  const BeamThickness razor{0.0, 0.0, 0.0, 1};
  const Reading one = Read(alone, Convex(), razor), two = Read(both, Convex(), razor), other = Read(reversed, Convex(), razor);
  int inFirst = 0, inSecond = 0;
  for (std::ptrdiff_t i = 0; i < one.value.View().Size(); ++i) {
    if (one.content.View()[i]) {
      EXPECT_EQ(two.value.View()[i], 10.0f);
      ++inFirst;
    } else if (two.content.View()[i]) {
      EXPECT_EQ(two.value.View()[i], 200.0f);
      ++inSecond;
    }
    EXPECT_EQ(other.value.View()[i], other.content.View()[i] ? 200.0f : 0.0f); // the outer one holds the inner one
  }
  EXPECT_GT(inFirst, 200);
  EXPECT_GT(inSecond, 200);
}

TEST(BeamVolumes, VoxelsThatAreNotFiniteAreNotReal)
{
  const std::array<int, 3> dimensions{50, 50, 50};
  Volume<float> voxels(dimensions, 7.0f);
  for (int k = 0; k < 50; ++k)
    voxels.View()(25, 25, k) = k % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
  for (int k = 30; k < 50; ++k) // whole bricks of it
    for (int j = 0; j < 50; ++j)
      for (int i = 0; i < 50; ++i)
        voxels.View()(i, j, k) = std::numeric_limits<float>::quiet_NaN();
  BeamVolumes volumes;
  volumes.Add<float>({voxels.View(), {}, Oblique(dimensions, 1.0)});
  const Reading reading = Read(volumes, Convex(), {2.0, 40.0, 0.1, 5});
  int real = 0;
  for (std::ptrdiff_t i = 0; i < reading.value.View().Size(); ++i) {
    ASSERT_TRUE(std::isfinite(reading.value.View()[i]));
    if (reading.content.View()[i]) {
      ++real;
      ASSERT_NEAR(reading.value.View()[i], 7.0f, 1e-5f);
    }
  }
  EXPECT_GT(real, 200);
}

TEST(BeamVolumes, ASingleSliceIsReadWithinHalfItsThickness)
{
  const Volume<unsigned char> voxels({80, 1, 100}, 33);
  ImageGeometry grid;
  grid.dimensions = voxels.Dimensions();
  grid.origin = {-40, 0.2, -5};
  BeamVolumes volumes;
  volumes.Add<unsigned char>({voxels.View(), {}, grid});
  const BeamThickness razor{0.0, 0.0, 0.0, 1};
  EXPECT_EQ(Read(volumes, Convex(), razor).value.View()(75, beams / 2, 0), 33.0f);
  Pose beside = Pose::Identity();
  beside.translation().y() = 0.8;
  EXPECT_EQ(Read(volumes, Convex(beside), razor).content.View()(75, beams / 2, 0), ContentNothing);
}

TEST(BeamVolumes, ThreadsChangeNothing)
{
  const std::array<int, 3> dimensions{60, 50, 70};
  const Volume<unsigned char> voxels = Noise<unsigned char>(dimensions);
  BeamVolumes volumes;
  volumes.Add<unsigned char>({voxels.View(), {}, Oblique(dimensions, 0.8)});
  const Reading many = Read(volumes, Convex(), {});
  const ThreadLimit limit(1);
  const Reading one = Read(volumes, Convex(), {});
  EXPECT_TRUE(std::equal(one.value.View().begin(), one.value.View().end(), many.value.View().begin()));
  EXPECT_TRUE(std::equal(one.content.View().begin(), one.content.View().end(), many.content.View().begin()));
}

TEST(BeamVolumes, RefuseWhatTheyCannotRead)
{
  const Volume<unsigned char> voxels({20, 20, 20}, 1), few({20, 20, 19}, 1);
  BeamVolumes volumes;
  EXPECT_THROW(volumes.Add<unsigned char>({few.View(), {}, Oblique({20, 20, 20}, 1.0)}), Error);
  EXPECT_THROW(volumes.Add<unsigned char>({voxels.View(), few.View(), Oblique({20, 20, 20}, 1.0)}), Error);
  EXPECT_THROW(volumes.Add<unsigned char>({voxels.View(), {}, Oblique({20, 20, 20}, 1.0)}, few.View()), Error);
  EXPECT_TRUE(volumes.Empty());
  volumes.Add<unsigned char>({voxels.View(), {}, Oblique({20, 20, 20}, 1.0)});
  PlacedProbe nowhere = Convex();
  nowhere.probeToWorld.translation().x() = std::numeric_limits<double>::quiet_NaN();
  PlacedProbe mirrored = Convex();
  mirrored.probeToWorld.linear()(0, 0) = -1.0;
  PlacedProbe swept = Convex();
  swept.geometry.sweepAngle = 0.5;
  for (const PlacedProbe& probe : {nowhere, mirrored, swept})
    EXPECT_THROW(Read(volumes, probe, {}), Error);
}

} // namespace
