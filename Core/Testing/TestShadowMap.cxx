// SPDX-License-Identifier: BSD-3-Clause
// Synthetic beams with known shadows, through scan conversion: what is found, what is spared, and what must not matter.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/ShadowMap.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;

// Mean brightness of a place: 0 black, 1 ordinary tissue.
using Scene = std::function<double(const BeamPoint&)>;

const ProbeGeometry convex = ProbeGeometry::Convex(1.1, 40.0, 0.9, 30.0, 5.0, 85.0);

Pose Oblique()
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(Eigen::Vector3d(0.5, -1.1, 0.3));
  pose.translation() = Eigen::Vector3d(120, -45, 8);
  return pose;
}

// Fully developed speckle, log-compressed over 60 dB, tissue at grey 110: one value per sample of the beams.
float Grey(double level, Random& random)
{
  const double db = 10.0 * std::log10(std::max(1e-12, -std::log1p(-random.Uniform()))) + 2.5;
  return static_cast<float>(std::min(255.0, std::max(0.0, 110.0 * level + (level > 0.0 ? 4.25 * db : 0.0))));
}

struct Image {
  ImageGeometry geometry;
  Volume<float> intensity;
  Volume<unsigned char> valid;
  PlacedProbe probe;

  PosedVolume<float> Posed() const { return {intensity.View(), valid.View(), geometry}; }
  Eigen::Vector3d PointAt(int i, int j, int k) const
  {
    return probe.probeToWorld.inverse() * (geometry.IndexToWorld() * Eigen::Vector3d(i, j, k));
  }
};

Image MakeImage(const Scene& scene, const ProbeGeometry& probe = convex, double spacing = 1.5)
{
  Image image;
  image.probe = {probe, Oblique()};
  Volume<float> beams({64, 44, probe.IsPlane() ? 1 : 36});
  const auto& n = beams.Dimensions();
  Random random(5);
  for (int s = 0; s < n[2]; ++s)
    for (int f = 0; f < n[1]; ++f)
      for (int d = 0; d < n[0]; ++d) {
        const BeamPoint at{probe.depthMin + (probe.depthMax - probe.depthMin) * d / (n[0] - 1), f / (n[1] - 1.0) - 0.5,
                           n[2] > 1 ? s / (n[2] - 1.0) - 0.5 : 0.0};
        beams.View()(d, f, s) = Grey(scene(at), random);
      }
  image.geometry = ScanConversionGrid(probe, image.probe.probeToWorld, spacing, 1u << 24);
  image.intensity = Volume<float>(image.geometry.dimensions);
  image.valid = Volume<unsigned char>(image.geometry.dimensions);
  ScanConvert<float>(beams.View(), probe, image.probe.probeToWorld, image.geometry, image.intensity.View(), image.valid.View());
  return image;
}

// The mean of a map over the real voxels whose place is inside.
double MeanOver(const Image& image, const Volume<float>& map, const std::function<bool(const BeamPoint&)>& inside)
{
  double sum = 0.0;
  int count = 0;
  const auto& n = image.geometry.dimensions;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (image.valid.View()(i, j, k))
          if (const auto at = BeamPointAt(image.probe.geometry, image.PointAt(i, j, k)); at && inside(*at)) {
            sum += static_cast<double>(map.View()(i, j, k));
            ++count;
          }
  EXPECT_GT(count, 10);
  return sum / count;
}

bool Everywhere(const BeamPoint&)
{
  return true;
}

// A shadow from depth 40 on, and its core and surroundings, half the edge apart.
bool InShadow(const BeamPoint& p)
{
  return p.depth > 40 && p.fan > 0.1 && p.fan < 0.35 && p.sweep > -0.2 && p.sweep < 0.15;
}
bool InShadowsCore(const BeamPoint& p)
{
  return p.depth > 45 && p.fan > 0.15 && p.fan < 0.3 && p.sweep > -0.14 && p.sweep < 0.09;
}
bool FarFromShadow(const BeamPoint& p)
{
  return p.depth < 36 || p.fan < 0.04 || p.fan > 0.41 || p.sweep < -0.28 || p.sweep > 0.23;
}
// A cyst of 20 mm, and a vessel across the whole fan.
bool InCyst(const BeamPoint& p)
{
  return p.depth > 45 && p.depth < 65 && p.fan > -0.3 && p.fan < -0.1 && p.sweep > -0.2 && p.sweep < 0.2;
}
bool InVessel(const BeamPoint& p)
{
  return p.depth > 25 && p.depth < 32;
}

double Body(const BeamPoint& p)
{
  return InShadow(p) || InCyst(p) || InVessel(p) ? 0.0 : 1.0;
}

const Image& BodyImage()
{
  static const Image image = MakeImage(Body);
  return image;
}

template <class T>
Volume<T> Converted(const Volume<float>& from, double scale, double shift)
{
  Volume<T> to(from.Dimensions());
  for (std::ptrdiff_t i = 0; i < to.View().Size(); ++i) {
    const double value = static_cast<double>(from.View()[i]) * scale + shift;
    to.View()[i] = static_cast<T>(std::is_integral_v<T> ? std::floor(value + 0.5) : value);
  }
  return to;
}

double LargestDifference(const Volume<float>& a, const Volume<float>& b)
{
  double largest = 0.0;
  for (std::ptrdiff_t i = 0; i < a.View().Size(); ++i)
    largest = std::max(largest, static_cast<double>(std::abs(a.View()[i] - b.View()[i])));
  return largest;
}

TEST(ShadowMap, FindsTheShadowAndSparesFluid)
{
  const Image& image = BodyImage();
  const Reliability found = MeasureReliability(image.Posed(), image.probe);
  EXPECT_LT(MeanOver(image, found.map, InShadowsCore), 0.02);
  EXPECT_GT(MeanOver(image, found.map, FarFromShadow), 0.995);
  EXPECT_GT(MeanOver(image, found.map, InCyst), 0.99);
  EXPECT_GT(MeanOver(image, found.map, [](const BeamPoint& p) { return InVessel(p); }), 0.99);
  EXPECT_NEAR(found.shadowShare, 1.0 - MeanOver(image, found.map, Everywhere), 0.01);
  EXPECT_EQ(found.saturatedShare, 0.0);
  EXPECT_TRUE(found.notes.empty());
  for (std::ptrdiff_t i = 0; i < found.map.View().Size(); ++i) {
    const float value = found.map.View()[i];
    ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
    ASSERT_TRUE(image.valid.View()[i] || value == 0.0f);
  }
}

TEST(ShadowMap, EveryShapeOfProbe)
{
  const double degree = RadiansPerDegree;
  for (const ProbeGeometry& probe :
       {ProbeGeometry::Linear(60, 50, 0, 80), ProbeGeometry::Phased(70 * degree, 60 * degree, 5, 85),
        ProbeGeometry{35 * degree, 30.0, 40 * degree, 25.0, 5.0, 85.0, 0.4}, ProbeGeometry::Convex(1.1, 40, 0, 0, 5, 85)}) {
    const Image image = MakeImage(Body, probe);
    const Volume<float> map = ReliabilityMap(image.Posed(), image.probe);
    EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.05) << probe.fanAngle << " " << probe.sweepAngle;
    EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.97) << probe.fanAngle << " " << probe.sweepAngle;
  }
}

TEST(ShadowMap, WithoutAProbeAlongAnAxis)
{
  // The beams of a flat array are the lines of voxels of its grid: the answer is that of the probe.
  const ProbeGeometry flat = ProbeGeometry::Linear(60, 50, 0, 80);
  const Image image = MakeImage(Body, flat);
  const Volume<float> along = ReliabilityMap(image.Posed(), {});
  EXPECT_LT(MeanOver(image, along, InShadowsCore), 0.05);
  EXPECT_GT(MeanOver(image, along, FarFromShadow), 0.97);

  // Turned to the other axes, and about: the same numbers in other places.
  const auto& n = image.geometry.dimensions;
  for (const int axis : {0, 1, 2})
    for (const bool reversed : {false, true}) {
      ReliabilityParameters parameters;
      parameters.depthAxis = axis;
      parameters.depthReversed = reversed;
      const auto turned = [&](int i, int j, int k) {
        std::array<int, 3> at{};
        at[axis] = reversed ? n[2] - 1 - k : k;
        at[(axis + 1) % 3] = i;
        at[(axis + 2) % 3] = j;
        return at;
      };
      ImageGeometry geometry;
      geometry.spacing.setConstant(1.5);
      geometry.dimensions = turned(n[0], n[1], n[2]);
      geometry.dimensions[axis] = n[2];
      Volume<float> intensity(geometry.dimensions);
      Volume<unsigned char> valid(geometry.dimensions);
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const auto at = turned(i, j, k);
            intensity.View()(at[0], at[1], at[2]) = image.intensity.View()(i, j, k);
            valid.View()(at[0], at[1], at[2]) = image.valid.View()(i, j, k);
          }
      const Volume<float> map = ReliabilityMap(PosedVolume<float>{intensity.View(), valid.View(), geometry}, {}, parameters);
      Volume<float> back(n);
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const auto at = turned(i, j, k);
            back.View()(i, j, k) = map.View()(at[0], at[1], at[2]);
          }
      EXPECT_LT(MeanOver(image, back, InShadowsCore), 0.05) << axis << reversed;
      EXPECT_GT(MeanOver(image, back, FarFromShadow), 0.97) << axis << reversed;
    }
}

TEST(ShadowMap, APlaneIsAnImage)
{
  const ProbeGeometry plane = ProbeGeometry::Convex(1.1, 40.0, 0.0, 0.0, 5.0, 85.0);
  ASSERT_TRUE(plane.IsPlane());
  const Image image = MakeImage(Body, plane, 0.8);
  ASSERT_EQ(image.geometry.dimensions[2], 1);
  for (const bool known : {true, false}) {
    const Volume<float> map = ReliabilityMap(image.Posed(), known ? std::optional(image.probe) : std::nullopt);
    EXPECT_LT(MeanOver(image, map, InShadowsCore), known ? 0.05 : 0.3) << known;
    EXPECT_GT(MeanOver(image, map, FarFromShadow), known ? 0.97 : 0.9) << known;
  }
}

TEST(ShadowMap, UnitsDoNotMatter)
{
  const Image& image = BodyImage();
  const Volume<float> map = ReliabilityMap(image.Posed(), image.probe);
  const auto with = [&](const auto& intensity) {
    using T = std::remove_const_t<std::remove_reference_t<decltype(intensity.View()[0])>>;
    return ReliabilityMap(PosedVolume<T>{intensity.View(), image.valid.View(), image.geometry}, image.probe);
  };
  EXPECT_LT(LargestDifference(map, with(Converted<float>(image.intensity, 0.001, -3.0))), 1e-3);
  EXPECT_LT(LargestDifference(map, with(Converted<double>(image.intensity, 100.0, 1e4))), 1e-3);
  EXPECT_LT(LargestDifference(map, with(Converted<unsigned char>(image.intensity, 1.0, 0.0))), 0.02);
  EXPECT_LT(LargestDifference(map, with(Converted<unsigned short>(image.intensity, 257.0, 0.0))), 1e-3);
  EXPECT_LT(LargestDifference(map, with(Converted<short>(image.intensity, 16.0, -2000.0))), 2e-3);
}

TEST(ShadowMap, GainHardlyMatters)
{
  const Image& image = BodyImage();
  for (const double db : {-8.0, 8.0}) {
    Image louder = image;
    for (float& value : louder.intensity.View())
      value = std::clamp(value > 0.0f ? value + static_cast<float>(4.25 * db) : 0.0f, 0.0f, 255.0f);
    const Volume<float> map = ReliabilityMap(louder.Posed(), image.probe);
    EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.05) << db;
    EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.98) << db;
    EXPECT_GT(MeanOver(image, map, InCyst), 0.95) << db;
  }
}

TEST(ShadowMap, AttenuationAndNoiseGrowWithDepth)
{
  // Tissue fades to half at the end; the receiver's noise rises to a fifth. Both are no shadow, and hide none.
  const Image image = MakeImage([](const BeamPoint& p) {
    const double deep = (p.depth - 5.0) / 80.0;
    return std::max(Body(p) * (1.0 - 0.5 * deep), 0.12 * deep);
  });
  const Volume<float> map = ReliabilityMap(image.Posed(), image.probe);
  EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.1);
  EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.98);
}

TEST(ShadowMap, BeyondPenetrationNothingIsReliable)
{
  const Image image = MakeImage([](const BeamPoint& p) { return p.depth < 50 ? 1.0 : 0.08; });
  const Volume<float> map = ReliabilityMap(image.Posed(), image.probe);
  EXPECT_LT(MeanOver(image, map, [](const BeamPoint& p) { return p.depth > 55; }), 0.02);
  EXPECT_GT(MeanOver(image, map, [](const BeamPoint& p) { return p.depth < 46; }), 0.98);
}

TEST(ShadowMap, SpecksAreNoEchoesAndALoneDarkBeamIsNoShadow)
{
  // A few samples of noise deep in the shadow do not light it. One beam in one plane of the sweep is dark.
  const Image image = MakeImage([](const BeamPoint& p) {
    if (InShadow(p) && std::abs(p.depth - 75.0) < 0.5 && std::abs(p.fan - 0.22) < 0.015)
      return 2.0;
    const bool lone = std::abs(p.fan + 0.4) < 0.012 && std::abs(p.sweep - 0.4) < 0.015 && p.depth > 30;
    return lone ? 0.0 : Body(p);
  });
  const Volume<float> map = ReliabilityMap(image.Posed(), image.probe);
  EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.05);
  EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.995);
}

// Beams along z without speckle, a cell a voxel: tissue of grey 100, the first samples black. The beams of one half show
// something else from a depth on.
class FlatBeams {
public:
  explicit FlatBeams(const std::function<float(int depth)>& tail)
  {
    geometry_.dimensions = {24, 20, samples};
    intensity_ = Volume<float>(geometry_.dimensions, 100.0f);
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 24; ++i) {
        intensity_.View()(i, j, 0) = 0.0f;
        for (int d = 1; i < 12 && d < samples; ++d)
          if (const float grey = tail(d); grey >= 0.0f)
            intensity_.View()(i, j, d) = grey;
      }
    intensity_.View()(20, 10, 40) = 150.0f; // the top value, that nothing else is saturated
  }
  /// Of the middle of the half, at a depth.
  double At(int depth, const ReliabilityParameters& p) const
  {
    const Volume<float> map = ReliabilityMap(PosedVolume<float>{intensity_.View(), {}, geometry_}, {}, p);
    EXPECT_EQ(map.View()(18, 10, depth), 1.0f) << "of the other half";
    return static_cast<double>(map.View()(5, 10, depth));
  }
  static constexpr int samples = 60;

private:
  ImageGeometry geometry_;
  Volume<float> intensity_;
};

double SmoothStep(double from, double to, double x)
{
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

TEST(ShadowMap, LevelsOfShadowAndTissue)
{
  for (const double level : {0.05, 0.2, 0.35, 0.45, 0.65, 0.8, 1.0}) {
    const FlatBeams beams([level](int d) { return d >= 30 ? static_cast<float>(100.0 * level) : -1.0f; });
    for (const auto& [shadow, tissue] : {std::pair(0.3, 0.7), {0.1, 0.7}, {0.3, 0.9}, {0.0, 1.0}, {0.6, 0.62}}) {
      ReliabilityParameters p;
      p.shadowLevel = shadow;
      p.tissueLevel = tissue;
      const double reliability = SmoothStep(shadow, tissue, level);
      EXPECT_NEAR(beams.At(45, p), reliability < 0.5 ? reliability : 1.0, 1e-4) // from one half on it is no tail
          << level << " " << shadow << " " << tissue;
      EXPECT_EQ(beams.At(15, p), 1.0) << "above the tail";
    }
  }
}

TEST(ShadowMap, HowLongAShadowIsAtLeast)
{
  for (const int length : {3, 6, 9, 12, 15}) { // of 60 samples
    const FlatBeams beams([length](int d) { return d >= FlatBeams::samples - length ? 0.0f : -1.0f; });
    for (const double least : {0.0, 0.1, 0.2, 0.4}) {
      ReliabilityParameters p;
      p.leastEcho = 0.0;
      p.leastShadow = least;
      const double counts = least > 0.0 ? SmoothStep(0.5 * least, least, length / 60.0) : 1.0;
      EXPECT_NEAR(beams.At(59, p), 1.0 - counts, 1e-4) << length << " " << least;
      EXPECT_EQ(beams.At(59 - length, p), 1.0) << length << " " << least;
    }
  }
}

// A stretch as long as the least echo proves sound, all the way down to it; one sample less proves nothing.
TEST(ShadowMap, HowLongAnEchoIsAtLeast)
{
  for (const int length : {2, 5, 6, 9}) {
    const FlatBeams beams([length](int d) { return d < 20 || (d >= 40 && d < 40 + length) ? -1.0f : 0.0f; });
    for (const double least : {0.0, 0.05, 0.1, 0.15}) { // 1, 3, 6 and 9 samples
      ReliabilityParameters p;
      p.leastEcho = least;
      p.leastShadow = 0.1;
      const bool proves = length >= std::max(1, static_cast<int>(std::lround(60.0 * least)));
      EXPECT_EQ(beams.At(30, p), proves ? 1.0 : 0.0) << length << " " << least;
      EXPECT_EQ(beams.At(55, p), 0.0) << length << " " << least;
    }
  }
}

// Of three columns of voxels two at the top value: two thirds of every neighbourhood of a saturated voxel.
TEST(ShadowMap, HowMuchIsSaturated)
{
  ImageGeometry geometry;
  geometry.dimensions = {24, 20, 30};
  Volume<float> intensity(geometry.dimensions, 100.0f);
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 24; ++i)
        if (k == 0 || i % 3)
          intensity.View()(i, j, k) = k == 0 ? 0.0f : 110.0f;
  for (const double share : {0.0, 0.3, 0.5, 0.66, 0.7}) {
    ReliabilityParameters p;
    p.saturatedShare = share;
    const Volume<float> map = ReliabilityMap(PosedVolume<float>{intensity.View(), {}, geometry}, {}, p);
    EXPECT_NEAR(map.View()(10, 10, 15), 1.0 - SmoothStep(share, 1.0, 2.0 / 3.0), 1e-4) << share;
    EXPECT_EQ(map.View()(12, 10, 15), 1.0f) << share;
  }
}

TEST(ShadowMap, FluidThatRunsOutOfTheImageForAShortWayIsExcused)
{
  const auto darkFrom = [](double depth) {
    const Image image = MakeImage([depth](const BeamPoint& p) { return p.depth > depth && p.fan > 0.2 ? 0.0 : 1.0; });
    return MeanOver(image, ReliabilityMap(image.Posed(), image.probe),
                    [depth](const BeamPoint& p) { return p.depth > depth + 2 && p.fan > 0.3; });
  };
  EXPECT_GT(darkFrom(79.0), 0.95); // 6 of 80 mm
  EXPECT_LT(darkFrom(65.0), 0.05); // 20 of 80 mm
}

TEST(ShadowMap, SaturatedAreas)
{
  Image image = MakeImage([](const BeamPoint&) { return 1.0; });
  const auto inBlock = [](const BeamPoint& p) {
    return std::abs(p.depth - 40) < 8 && std::abs(p.fan) < 0.2 && std::abs(p.sweep) < 0.2;
  };
  const auto inMiddle = [](const BeamPoint& p) {
    return std::abs(p.depth - 40) < 3 && std::abs(p.fan) < 0.08 && std::abs(p.sweep) < 0.08;
  };
  const auto& n = image.geometry.dimensions;
  for (float& value : image.intensity.View())
    value = std::min(value, 200.0f);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (const auto at = BeamPointAt(convex, image.PointAt(i, j, k))) {
          const bool sheet = std::abs(at->depth - 70) < 0.8; // about a voxel thick
          const bool single = i % 5 == 0 && j % 5 == 0 && k % 5 == 0;
          if (inBlock(*at) || sheet || single)
            image.intensity.View()(i, j, k) = 255.0f;
        }
  const Reliability found = MeasureReliability(image.Posed(), image.probe);
  EXPECT_LT(MeanOver(image, found.map, inMiddle), 0.02);
  EXPECT_GT(MeanOver(image, found.map, [&](const BeamPoint& p) { return p.depth > 60; }), 0.99);
  EXPECT_GT(MeanOver(image, found.map, [&](const BeamPoint& p) { return p.depth < 28; }), 0.99);
  EXPECT_GT(found.saturatedShare, 0.0);
  EXPECT_LT(found.saturatedShare, 0.1);
  EXPECT_LT(found.shadowShare, 0.001);
}

TEST(ShadowMap, VoxelsThatAreNotNumbers)
{
  const Image& image = BodyImage();
  Image broken = image;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  Random random(9);
  for (float& value : broken.intensity.View())
    if (random.Uniform() < 0.05)
      value = random.Uniform() < 0.5 ? nan : random.Uniform() < 0.5 ? inf : -inf;
  const Volume<float> map = ReliabilityMap(broken.Posed(), image.probe);
  for (std::ptrdiff_t i = 0; i < map.View().Size(); ++i) {
    ASSERT_TRUE(std::isfinite(map.View()[i]));
    if (!std::isfinite(broken.intensity.View()[i])) {
      ASSERT_EQ(map.View()[i], 0.0f);
    }
  }
  EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.05);
  EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.93); // of what is left 0.95
}

TEST(ShadowMap, DarkAndConstantVolumes)
{
  const Image& image = BodyImage();
  const auto noted = [&](auto make, const char* word) {
    auto intensity = make();
    using T = std::remove_const_t<std::remove_reference_t<decltype(intensity.View()[0])>>;
    const Reliability found =
        MeasureReliability(PosedVolume<T>{intensity.View(), image.valid.View(), image.geometry}, image.probe);
    double largest = 0.0;
    for (const float value : found.map.View())
      largest = std::max(largest, static_cast<double>(value));
    EXPECT_EQ(largest, 0.0) << word;
    ASSERT_EQ(found.notes.size(), 1u);
    EXPECT_NE(found.notes[0].find(word), std::string::npos) << found.notes[0];
  };
  noted([&] { return Volume<float>(image.geometry.dimensions, 42.0f); }, "one value");
  noted(
      [&] {
        Volume<unsigned char> dark(image.geometry.dimensions);
        Random random(1);
        for (unsigned char& value : dark.View())
          value = random.Uniform() < 0.3 ? 1 : 0;
        return dark;
      },
      "dark");
}

TEST(ShadowMap, OneThreadOrTwo)
{
  const Image& image = BodyImage();
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return ReliabilityMap(image.Posed(), image.probe);
  };
  EXPECT_EQ(LargestDifference(with(1), with(2)), 0.0);
}

TEST(ShadowMap, FindsTheProbeItself)
{
  ECHORAMA_SKIP_SANITIZED();
  const Image& image = BodyImage();
  std::string note;
  const auto probe = FindProbe(image.Posed(), {}, &note);
  ASSERT_TRUE(probe);
  EXPECT_TRUE(note.empty());
  const Volume<float> map = ReliabilityMap(image.Posed(), probe);
  EXPECT_LT(MeanOver(image, map, InShadowsCore), 0.03);
  EXPECT_GT(MeanOver(image, map, FarFromShadow), 0.99);

  // A region that no fan fills.
  Image shell = image;
  const auto& n = shell.geometry.dimensions;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double x = i - 0.5 * n[0], y = j - 0.5 * n[1], z = k - 0.5 * n[2], r = std::sqrt(x * x + y * y + z * z);
        shell.valid.View()(i, j, k) = (r < 14 && z > -3) || (r > 20 && r < 26 && x > 0 && y > 0) ? 1 : 0;
      }
  EXPECT_FALSE(FindProbe(shell.Posed(), {}, &note));
  EXPECT_FALSE(note.empty());
}

TEST(ShadowMap, Refusals)
{
  const Image& image = BodyImage();
  const auto refused = [](Error::Kind kind, const char* word, const auto& call) {
    try {
      call();
      ADD_FAILURE() << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), kind) << word;
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  const auto with = [&](auto set, const char* word) {
    ReliabilityParameters parameters;
    set(parameters);
    refused(Error::Kind::InvalidParameter, word, [&] { ReliabilityMap(image.Posed(), image.probe, parameters); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  with([](auto& p) { p.resolution = 8; }, "Resolution is 8");
  with([](auto& p) { p.shadowLevel = 1.0; }, "above ShadowLevel, which is 1");
  with([](auto& p) { p.tissueLevel = p.shadowLevel; }, "TissueLevel is 0.3");
  with([nan](auto& p) { p.leastEcho = nan; }, "LeastEcho is nan");
  with([](auto& p) { p.leastShadow = -0.1; }, "LeastShadow is -0.1");
  with([](auto& p) { p.saturatedShare = 1.0; }, "SaturatedShare is 1");
  with([](auto& p) { p.depthAxis = 3; }, "DepthAxis is 3");

  PlacedProbe skewed = image.probe;
  skewed.probeToWorld.linear()(0, 0) += 0.2;
  refused(Error::Kind::BadInput, "rigid", [&] { ReliabilityMap(image.Posed(), skewed); });
  PlacedProbe bad = image.probe;
  bad.geometry.depthMax = bad.geometry.depthMin;
  refused(Error::Kind::InvalidParameter, "depths", [&] { ReliabilityMap(image.Posed(), bad); });
  PosedVolume<float> odd = image.Posed();
  ++odd.geometry.dimensions[1];
  refused(Error::Kind::BadInput, "dimensions", [&] { ReliabilityMap(odd, image.probe); });
  const Volume<unsigned char> nothing(image.geometry.dimensions, 0);
  refused(Error::Kind::BadInput, "no voxel", [&] {
    ReliabilityMap(PosedVolume<float>{image.intensity.View(), nothing.View(), image.geometry}, image.probe);
  });
  refused(Error::Kind::Cancelled, "stopped",
          [&] { ReliabilityMap(image.Posed(), image.probe, {}, Progress([](double done) { return done < 0.5; })); });
}

TEST(ShadowMap, SmallAndOddVolumes)
{
  // A single voxel beside another, a line, a probe that looks elsewhere: numbers in [0, 1], no crash.
  for (const std::array<int, 3>& n : {std::array<int, 3>{2, 1, 1}, {1, 1, 50}, {3, 2, 2}, {40, 1, 30}}) {
    Volume<short> intensity(n);
    short next = 0;
    for (short& value : intensity.View())
      value = static_cast<short>(37 * ++next % 101);
    ImageGeometry geometry;
    geometry.dimensions = n;
    const PosedVolume<short> posed{intensity.View(), {}, geometry};
    PlacedProbe elsewhere = BodyImage().probe;
    elsewhere.probeToWorld.translation().setConstant(1e4);
    for (const auto& probe : {std::optional<PlacedProbe>(), std::optional(BodyImage().probe), std::optional(elsewhere)}) {
      const Volume<float> map = ReliabilityMap(posed, probe);
      for (const float value : map.View())
        ASSERT_TRUE(value >= 0.0f && value <= 1.0f) << n[0] << " " << value;
    }
  }
}

} // namespace
