// SPDX-License-Identifier: BSD-3-Clause
// Noise that is known sample by sample, in fans of other sizes and side by side.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/BeamSampling.h"
#include "Filters/Embedding/FanFilling.h"
#include "Filters/Embedding/NoiseTiling.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <string>

using namespace echorama;

namespace {

constexpr double degree = RadiansPerDegree;
const ProbeGeometry convex = ProbeGeometry::Convex(60 * degree, 30.0, 40 * degree, 20.0, 2.0, 42.0);

PlacedProbe Placed(const ProbeGeometry& geometry)
{
  PlacedProbe placed{geometry, Pose::Identity()};
  placed.probeToWorld.linear() = ExpRotation(Eigen::Vector3d(0.3, -0.5, 0.9));
  placed.probeToWorld.translation() = Eigen::Vector3d(50, -20, 10);
  return placed;
}

struct Noise {
  PlacedProbe fan;
  ImageGeometry grid;
  Volume<float> intensity;
  Volume<unsigned char> valid;
  PosedVolume<float> Posed() const { return {intensity.View(), valid.View(), grid}; }
  NoiseInput Input(const std::string& name) const { return {Posed(), fan, name}; }
};

// A volume whose values are a function of the beam coordinates.
Noise NoiseOf(const ProbeGeometry& geometry, double spacing, const std::function<double(const BeamPoint&)>& value)
{
  Noise noise;
  noise.fan = Placed(geometry);
  noise.grid = ScanConversionGrid(geometry, noise.fan.probeToWorld, spacing, 1u << 24);
  noise.intensity = Volume<float>(noise.grid.dimensions);
  noise.valid = Volume<unsigned char>(noise.grid.dimensions);
  const Eigen::Affine3d toProbe = noise.fan.probeToWorld.inverse() * noise.grid.IndexToWorld();
  for (int k = 0; k < noise.grid.dimensions[2]; ++k)
    for (int j = 0; j < noise.grid.dimensions[1]; ++j)
      for (int i = 0; i < noise.grid.dimensions[0]; ++i)
        if (const auto beam = BeamPointAt(geometry, toProbe * Eigen::Vector3d(i, j, k), 1e-6)) {
          noise.intensity.View()(i, j, k) = static_cast<float>(value(*beam));
          noise.valid.View()(i, j, k) = 1;
        }
  return noise;
}

// Random values per beam sample, scan converted.
Noise SpeckleOf(const ProbeGeometry& geometry, double spacing, std::uint64_t seed, double offset = 0.0)
{
  auto dimensions = BeamDimensionsFor(geometry, 2.0);
  Volume<float> beams(dimensions);
  Random random(seed);
  for (float& sample : beams.View())
    sample = static_cast<float>(100.0 + offset + 20.0 * random.Normal());
  for (int k = 0; k < dimensions[2]; ++k)
    for (int j = 0; j < dimensions[1]; ++j)
      for (int i = 0; i < dimensions[0]; ++i)
        beams.View()(i, j, k) += static_cast<float>(2 * i); // gain with depth
  Noise noise;
  noise.fan = Placed(geometry);
  noise.grid = ScanConversionGrid(geometry, noise.fan.probeToWorld, spacing, 1u << 24);
  noise.intensity = Volume<float>(noise.grid.dimensions);
  noise.valid = Volume<unsigned char>(noise.grid.dimensions);
  ScanConvert<float>(beams.View(), geometry, noise.fan.probeToWorld, noise.grid, noise.intensity.View(), noise.valid.View());
  return noise;
}

struct Filled {
  ImageGeometry grid;
  Volume<float> intensity;
  Volume<unsigned char> valid;
  explicit Filled(const PlacedProbe& target, double spacing)
    : grid(ScanConversionGrid(target.geometry, target.probeToWorld, spacing, 1u << 24)), intensity(grid.dimensions, -1.0f),
      valid(grid.dimensions, 7)
  {
  }
};

// Calls body(beam of the target, value, valid) for every voxel inside the fan by more than \a inset mm.
void ForEachInside(const PlacedProbe& fan, const ImageGeometry& grid, VolumeView<const float> intensity,
                   VolumeView<const unsigned char> valid, double inset,
                   const std::function<void(const BeamPoint&, float, unsigned char)>& body)
{
  const Eigen::Affine3d toProbe = fan.probeToWorld.inverse() * grid.IndexToWorld();
  const ProbeGeometry& g = fan.geometry;
  int count = 0;
  for (int k = 0; k < grid.dimensions[2]; ++k)
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i) {
        const auto beam = BeamPointAt(g, toProbe * Eigen::Vector3d(i, j, k), 1e-9);
        if (!beam || beam->depth < g.depthMin + inset || beam->depth > g.depthMax - inset ||
            (0.5 - std::abs(beam->fan)) * g.Fan().Span(beam->depth) < inset)
          continue;
        if (!g.IsPlane() &&
            (0.5 - std::abs(beam->sweep)) * g.Sweep().Span(g.Fan().PointOf({beam->fan + g.fanOffset, beam->depth}).y()) < inset)
          continue;
        ++count;
        body(*beam, intensity(i, j, k), valid(i, j, k));
      }
  EXPECT_GT(count, 100);
}

template <class Function>
Error::Kind RefusalOf(const Function& work, const std::string& words = {})
{
  try {
    work();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    return error.GetKind();
  }
  ADD_FAILURE() << "accepted";
  return Error::Kind::FileSystem;
}

// A triangle wave between two ends.
double Mirrored(double x, double low, double high)
{
  const double length = high - low, at = std::fmod(std::fmod(x - low, 2 * length) + 2 * length, 2 * length);
  return low + (at <= length ? at : 2 * length - at);
}

} // namespace

TEST(BeamSampling, IsScanConversionBackwards)
{
  const Noise noise =
      NoiseOf(convex, 0.8, [](const BeamPoint& beam) { return beam.depth + 30.0 * beam.fan - 10.0 * beam.sweep; });
  const auto dimensions = BeamDimensionsFor(convex, 0.8);
  EXPECT_EQ(dimensions[0], 51);
  EXPECT_EQ(dimensions[1], static_cast<int>(std::ceil(convex.Fan().Span(42.0) / 0.8)) + 1);
  const Volume<float> beams = SampleBeams(noise.Posed(), noise.fan, dimensions);
  const auto rim = RimOf(convex, dimensions, noise.grid);
  for (int k = rim[2]; k < dimensions[2] - rim[2]; ++k)
    for (int j = rim[1]; j < dimensions[1] - rim[1]; ++j)
      for (int i = rim[0]; i < dimensions[0] - rim[0]; ++i) {
        const double expected = convex.depthMin + 40.0 * i / (dimensions[0] - 1) +
                                30.0 * (static_cast<double>(j) / (dimensions[1] - 1) - 0.5) -
                                10.0 * (static_cast<double>(k) / (dimensions[2] - 1) - 0.5);
        ASSERT_NEAR(beams.View()(i, j, k), expected, 0.25) << i << " " << j << " " << k; // NaN fails
      }
  EXPECT_TRUE(std::isnan(
      SampleBeams(noise.Posed(), Placed(ProbeGeometry::Convex(60 * degree, 30.0, 40 * degree, 20.0, 60.0, 70.0)), {5, 5, 5})
          .View()[0]));
}

TEST(FillFan, AFunctionOfTheBeamsSurvivesMirroring)
{
  // Samples that are the depth, the beam or the step, in another probe: twice as deep, wider, bent otherwise, from behind.
  const std::array<int, 3> n{41, 31, 21}, rim{2, 3, 1};
  const ProbeGeometry targets[] = {
      ProbeGeometry::Convex(80 * degree, 50.0, 75 * degree, 25.0, -3.0, 95.0),
      ProbeGeometry::Convex(20 * degree, 60.0, 10 * degree, 100.0, 10.0, 30.0),
      ProbeGeometry::Linear(90.0, 70.0, 0.0, 60.0),
      ProbeGeometry::Phased(70 * degree, 30 * degree, 4.0, 50.0),
  };
  for (const ProbeGeometry& geometry : targets)
    for (int axis = 0; axis < 3; ++axis) {
      SCOPED_TRACE(std::to_string(geometry.fanWidth) + ", axis " + std::to_string(axis));
      Volume<float> beams(n);
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i)
            beams.View()(i, j, k) = static_cast<float>(axis == 0 ? i : axis == 1 ? j : k);
      const PlacedProbe target = Placed(geometry);
      Filled filled(target, 1.5);
      FillFanFromBeams(beams.View(), convex, rim, target, filled.grid, filled.intensity.View(), filled.valid.View());
      const double middle = 0.5 * (geometry.depthMin + geometry.depthMax);
      const auto sweepSpan = [](const ProbeGeometry& g, double depth) {
        return g.Sweep().Span(g.Fan().PointOf({0.0, depth}).y());
      };
      const double pitch[] = {1.0, convex.Fan().Span(22.0) / 30, sweepSpan(convex, 22.0) / 20}; // mm
      const double span[] = {1.0, geometry.Fan().Span(middle), sweepSpan(geometry, middle)};
      double worst = 0.0;
      ForEachInside(target, filled.grid, filled.intensity.View(), filled.valid.View(), 0.01,
                    [&](const BeamPoint& beam, float value, unsigned char valid) {
                      ASSERT_EQ(valid, 1);
                      const double places[] = {beam.depth - convex.depthMin, 15.0 + beam.fan * span[1] / pitch[1],
                                               10.0 + beam.sweep * span[2] / pitch[2]};
                      const double expected = Mirrored(places[axis], rim[axis], n[axis] - 1 - rim[axis]);
                      worst = std::max(worst, std::abs(expected - value));
                    });
      // Counts of samples are whole numbers: half a sample at the ends, and half of one where the parities differ.
      EXPECT_LT(worst, axis == 0 ? 0.52 : 1.02);
    }
}

TEST(FillFan, RealNoiseTakesThePlaceOfMadeNoiseWhereItIs)
{
  Volume<float> real({4, 1, 1}, 7.0f), noise({4, 1, 1}, 1.0f);
  Volume<unsigned char> there({4, 1, 1}), form({4, 1, 1});
  there.View()[0] = form.View()[0] = 1; // real in the form
  there.View()[1] = 1;                  // real outside of it
  form.View()[2] = 1;                   // missing
  EXPECT_EQ(PutRealNoise(real.View(), there.View(), form.View(), noise.View()), 1);
  EXPECT_EQ(std::vector<float>(noise.View().begin(), noise.View().end()), (std::vector<float>{7.0f, 7.0f, 1.0f, 1.0f}));
}

TEST(FillFan, OfItsOwnFanIsTheNoise)
{
  const Noise noise = NoiseOf(convex, 0.8, [](const BeamPoint& beam) {
    return 50.0 + 20.0 * std::sin(0.4 * beam.depth) + 20.0 * std::cos(12.0 * beam.fan) * std::sin(9.0 * beam.sweep);
  });
  Filled filled(noise.fan, 0.8);
  FillFan(noise.Posed(), noise.fan, noise.fan, filled.grid, filled.intensity.View(), filled.valid.View());
  double worst = 0.0;
  std::ptrdiff_t invalid = 0;
  const auto truth = noise.intensity.View();
  ForEachInside(noise.fan, filled.grid, filled.intensity.View(), filled.valid.View(), 0.01,
                [&](const BeamPoint&, float, unsigned char valid) { invalid += !valid; });
  EXPECT_EQ(invalid, 0);
  const Eigen::Affine3d toProbe = noise.fan.probeToWorld.inverse() * filled.grid.IndexToWorld();
  for (int k = 0; k < filled.grid.dimensions[2]; ++k)
    for (int j = 0; j < filled.grid.dimensions[1]; ++j)
      for (int i = 0; i < filled.grid.dimensions[0]; ++i) {
        const auto beam = BeamPointAt(convex, toProbe * Eigen::Vector3d(i, j, k));
        const bool inner =
            beam && beam->depth > 5.0 && beam->depth < 39.0 && std::abs(beam->fan) < 0.44 && std::abs(beam->sweep) < 0.4;
        if (inner)
          worst = std::max<double>(worst, std::abs(truth(i, j, k) - filled.intensity.View()(i, j, k)));
        if (!beam) {
          EXPECT_EQ(filled.valid.View()(i, j, k) ? filled.intensity.View()(i, j, k) : 0.0f, filled.intensity.View()(i, j, k));
        }
      }
  EXPECT_LT(worst, 1.2);
}

TEST(FillFan, AConstantFillsAnyFan)
{
  const auto constant = [](const BeamPoint&) { return 42.0; };
  const ProbeGeometry fans[] = {convex, ProbeGeometry::Linear(40.0, 30.0, 0.0, 50.0),
                                ProbeGeometry::Phased(70 * degree, 40 * degree, 10.0, 60.0),
                                ProbeGeometry::Convex(34 * degree, 24.67, 39.8 * degree, 18.0, 0, 43.1)};
  const ProbeGeometry targets[] = {ProbeGeometry::Convex(120 * degree, 50.0, 90 * degree, 40.0, 0.0, 90.0),
                                   ProbeGeometry::Convex(12 * degree, 50.0, 9 * degree, 40.0, 10.0, 20.0),
                                   ProbeGeometry::Linear(100.0, 20.0, 5.0, 70.0)};
  for (const ProbeGeometry& from : fans) {
    const Noise noise = NoiseOf(from, 1.0, constant);
    for (const ProbeGeometry& to : targets) {
      const PlacedProbe target = Placed(to);
      Filled filled(target, 2.0);
      FillFan(noise.Posed(), noise.fan, target, filled.grid, filled.intensity.View(), filled.valid.View());
      int wrong = 0, holes = 0;
      ForEachInside(target, filled.grid, filled.intensity.View(), filled.valid.View(), 0.01,
                    [&](const BeamPoint&, float value, unsigned char valid) {
                      holes += !valid;
                      wrong += valid && std::abs(value - 42.0f) > 1e-4f;
                    });
      EXPECT_EQ(holes, 0);
      EXPECT_EQ(wrong, 0);
    }
  }
}

TEST(FillFan, KeepsHolesAndPlanes)
{
  Noise noise = SpeckleOf(convex, 1.0, 3);
  const auto& n = noise.grid.dimensions;
  for (int k = n[2] / 2; k < n[2] / 2 + 6; ++k)
    for (int j = n[1] / 2; j < n[1] / 2 + 6; ++j)
      for (int i = n[0] / 2; i < n[0] / 2 + 6; ++i)
        (i % 2 ? noise.valid.View()(i, j, k) = 0 : 0, noise.intensity.View()(i, j, k) = std::numeric_limits<float>::quiet_NaN());
  const PlacedProbe target = Placed(ProbeGeometry::Convex(150 * degree, 30.0, 80 * degree, 20.0, 2.0, 80.0));
  Filled filled(target, 1.0);
  FillFan(noise.Posed(), noise.fan, target, filled.grid, filled.intensity.View(), filled.valid.View());
  double holes = 0.0, count = 0.0;
  ForEachInside(target, filled.grid, filled.intensity.View(), filled.valid.View(), 0.01,
                [&](const BeamPoint&, float value, unsigned char valid) {
                  holes += !valid;
                  count += 1.0;
                  ASSERT_TRUE(std::isfinite(value));
                });
  EXPECT_GT(holes, 2 * 216.0); // and mirror images of it
  EXPECT_LT(holes, 0.1 * count);

  // A plane from a volume: the middle of its sweep; a plane from a plane; no volume from a plane.
  const PlacedProbe plane = Placed(ProbeGeometry::Convex(90 * degree, 30.0, 0, 0, 2.0, 60.0));
  const Noise steps = NoiseOf(convex, 1.0, [](const BeamPoint& beam) { return beam.sweep; });
  Filled image(plane, 0.5);
  FillFan(steps.Posed(), steps.fan, plane, image.grid, image.intensity.View(), image.valid.View());
  ForEachInside(plane, image.grid, image.intensity.View(), image.valid.View(), 0.01,
                [&](const BeamPoint&, float value, unsigned char valid) {
                  ASSERT_EQ(valid, 1);
                  ASSERT_LT(std::abs(value), 0.03f);
                });
  const Noise flat = SpeckleOf(ProbeGeometry::Convex(50 * degree, 30.0, 0, 0, 2.0, 40.0), 0.5, 1);
  FillFan(flat.Posed(), flat.fan, plane, image.grid, image.intensity.View(), image.valid.View());
  ForEachInside(plane, image.grid, image.intensity.View(), image.valid.View(), 0.01,
                [&](const BeamPoint&, float, unsigned char valid) { ASSERT_EQ(valid, 1); });
  Filled volume(target, 4.0);
  EXPECT_EQ(RefusalOf([&] { FillFan(flat.Posed(), flat.fan, target, volume.grid, volume.intensity.View(), volume.valid.View()); },
                      "single plane"),
            Error::Kind::BadInput);
}

TEST(FillFan, ThreadsCancellingAndBadInput)
{
  const Noise noise = SpeckleOf(convex, 1.5, 3);
  const PlacedProbe target = Placed(ProbeGeometry::Convex(90 * degree, 30.0, 60 * degree, 20.0, 2.0, 60.0));
  Filled one(target, 2.0), many(target, 2.0);
  {
    const ThreadLimit limit(1);
    FillFan(noise.Posed(), noise.fan, target, one.grid, one.intensity.View(), one.valid.View());
  }
  {
    const ThreadLimit limit(3);
    FillFan(noise.Posed(), noise.fan, target, many.grid, many.intensity.View(), many.valid.View());
  }
  EXPECT_TRUE(std::equal(one.intensity.View().begin(), one.intensity.View().end(), many.intensity.View().begin()));
  const auto fill = [&](const PlacedProbe& from, const PlacedProbe& to, const Progress& progress = {}) {
    FillFan(noise.Posed(), from, to, one.grid, one.intensity.View(), one.valid.View(), progress);
  };
  for (const double stop : {0.0, 0.2, 0.5, 0.8})
    EXPECT_EQ(RefusalOf([&] { fill(noise.fan, target, Progress([stop](double done) { return done < stop; })); }),
              Error::Kind::Cancelled);
  PlacedProbe bad = target;
  bad.geometry.fanAngle = -1.0;
  EXPECT_EQ(RefusalOf([&] { fill(noise.fan, bad); }), Error::Kind::InvalidParameter);
  EXPECT_EQ(RefusalOf([&] { fill(bad, target); }), Error::Kind::InvalidParameter);
  bad = target;
  bad.probeToWorld.linear() *= 2.0;
  EXPECT_EQ(RefusalOf([&] { fill(bad, target); }), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf([&] { fill(noise.fan, bad); }), Error::Kind::BadInput);
  bad = target;
  bad.geometry.fanWidth = 1e9;
  EXPECT_EQ(RefusalOf([&] { fill(noise.fan, bad); }), Error::Kind::TooLarge);
  Volume<float> small({3, 3, 3});
  EXPECT_EQ(RefusalOf([&] { FillFan(noise.Posed(), noise.fan, target, one.grid, small.View(), one.valid.View()); }),
            Error::Kind::BadInput);
  const Volume<float> beams({5, 5, 5});
  EXPECT_EQ(RefusalOf([&] {
              FillFanFromBeams(beams.View(), convex, {0, 3, 0}, target, one.grid, one.intensity.View(), one.valid.View());
            }),
            Error::Kind::InvalidParameter);
}

TEST(NoiseTiling, VolumesLieSideBySide)
{
  // A function of depth is the same in all, so it is that of the whole; a constant stays one.
  const Noise noise = NoiseOf(convex, 1.0, [](const BeamPoint& beam) { return 10.0 + beam.depth; });
  NoiseTilingParameters parameters;
  for (const auto& [columns, rows] : {std::pair{1, 1}, {2, 1}, {3, 1}, {1, 2}, {2, 2}}) {
    SCOPED_TRACE(std::to_string(columns) + " columns, " + std::to_string(rows) + " rows");
    parameters.columns = columns;
    parameters.rows = rows;
    const TiledNoise tiled = TileNoise(parameters, {noise.Input("one")});
    const NoiseTiling plan = PlanNoiseTiling(parameters, {noise.Input("one")});
    EXPECT_TRUE(plan.geometry.AgreesWith(tiled.geometry, 1e-9));
    EXPECT_EQ(plan.fan.geometry.fanAngle, tiled.fan.geometry.fanAngle);
    EXPECT_NO_THROW(tiled.fan.geometry.Check());
    EXPECT_EQ(tiled.fan.probeToWorld.matrix(), noise.fan.probeToWorld.matrix());
    // A voxel at either side is not used, at the first depth: 1.6 degrees of the fan, 2 of the sweep (a twentieth).
    EXPECT_NEAR(tiled.fan.geometry.fanAngle / degree, 60.0 * columns - 10.0 * (columns - 1) - 4.0 * columns, 2.6 * columns);
    EXPECT_NEAR(tiled.fan.geometry.sweepAngle / degree, 40.0 * rows - 10.0 * (rows - 1) - 4.0 * rows, 2.6 * rows);
    EXPECT_NEAR(tiled.fan.geometry.fanWidth / tiled.fan.geometry.fanAngle, 30.0, 1e-9);
    EXPECT_NEAR(tiled.fan.geometry.sweepWidth / tiled.fan.geometry.sweepAngle, 20.0, 1e-9);
    EXPECT_NEAR(tiled.geometry.spacing.x(), 1.0, 1e-9);
    ForEachInside(tiled.fan, tiled.geometry, tiled.intensity.View(), tiled.valid.View(), 0.01,
                  [&](const BeamPoint& beam, float value, unsigned char valid) {
                    ASSERT_EQ(valid, 1);
                    ASSERT_NEAR(value, 10.0 + beam.depth, 0.15);
                  });
  }
}

TEST(NoiseTiling, BeamsFillAFanWithoutADetourThroughVoxels)
{
  const Noise a = SpeckleOf(convex, 1.0, 1), b = SpeckleOf(convex, 1.0, 2);
  const std::vector<NoiseInput> inputs{a.Input("a"), b.Input("b")};
  const TiledBeams beams = TileNoiseBeams({}, inputs);
  const TiledNoise tiled = TileNoise({}, inputs);
  EXPECT_EQ(beams.fan.geometry.fanAngle, tiled.fan.geometry.fanAngle);
  Filled filled(tiled.fan, 1.0);
  FillFanFromBeams(beams.samples.View(), beams.fan.geometry, {0, 0, 0}, tiled.fan, filled.grid, filled.intensity.View(),
                   filled.valid.View());
  EXPECT_TRUE(std::equal(tiled.intensity.View().begin(), tiled.intensity.View().end(), filled.intensity.View().begin()));
  EXPECT_TRUE(std::equal(tiled.valid.View().begin(), tiled.valid.View().end(), filled.valid.View().begin()));
}

TEST(NoiseTiling, EachVolumeIsWhereItWasLaid)
{
  // Three constants, not equalized: outside of the overlaps each is itself.
  std::vector<Noise> noise;
  for (const double value : {10.0, 20.0, 40.0})
    noise.push_back(NoiseOf(convex, 1.0, [value](const BeamPoint&) { return value; }));
  NoiseTilingParameters parameters;
  parameters.stitch.equalizeGain = false;
  const TiledNoise tiled = TileNoise(parameters, {noise[0].Input("a"), noise[1].Input("b"), noise[2].Input("c")});
  const double whole = tiled.fan.geometry.fanAngle / degree, each = (whole + 20.0) / 3.0;
  ForEachInside(tiled.fan, tiled.geometry, tiled.intensity.View(), tiled.valid.View(), 0.01,
                [&](const BeamPoint& beam, float value, unsigned char) {
                  const double at = (beam.fan + 0.5) * whole;
                  if (at < each - 11.0) {
                    ASSERT_NEAR(value, 10.0, 1e-4);
                  } else if (at > each + 1.0 && at < 2.0 * each - 21.0) {
                    ASSERT_NEAR(value, 20.0, 1e-4);
                  } else if (at > 2.0 * each - 9.0) {
                    ASSERT_NEAR(value, 40.0, 1e-4);
                  } else {
                    ASSERT_GE(value, 10.0f - 1e-4f);
                    ASSERT_LE(value, 40.0f + 1e-4f);
                  }
                });
}

TEST(NoiseTiling, GainsAreEqualized)
{
  const Noise dark = SpeckleOf(convex, 1.0, 1), bright = SpeckleOf(convex, 1.0, 2, 30.0);
  NoiseTilingParameters parameters;
  parameters.overlapDegrees = 20.0;
  const auto step = [&](const TiledNoise& tiled) {
    double sums[2] = {}, counts[2] = {};
    ForEachInside(tiled.fan, tiled.geometry, tiled.intensity.View(), tiled.valid.View(), 1.0,
                  [&](const BeamPoint& beam, float value, unsigned char) {
                    sums[beam.fan > 0.0] += value;
                    counts[beam.fan > 0.0] += 1.0;
                  });
    return sums[1] / counts[1] - sums[0] / counts[0];
  };
  EXPECT_LT(std::abs(step(TileNoise(parameters, {dark.Input("dark"), bright.Input("bright")}))), 3.0);
  parameters.stitch.equalizeGain = false;
  EXPECT_GT(step(TileNoise(parameters, {dark.Input("dark"), bright.Input("bright")})), 20.0);
}

TEST(NoiseTiling, FlatFacesPlanesAndOtherFans)
{
  const auto grows = [](const BeamPoint& beam) { return 10.0 + beam.depth; };
  const auto expect = [](const TiledNoise& tiled, double leastValid) {
    double valids = 0.0, count = 0.0;
    ForEachInside(tiled.fan, tiled.geometry, tiled.intensity.View(), tiled.valid.View(), 0.01,
                  [&](const BeamPoint& beam, float value, unsigned char valid) {
                    valids += valid;
                    count += 1.0;
                    if (valid) {
                      ASSERT_NEAR(value, 10.0 + beam.depth, 0.3);
                    }
                  });
    EXPECT_GE(valids, leastValid * count);
  };
  NoiseTilingParameters parameters;
  parameters.overlapMm = 6.0;
  const Noise flat = NoiseOf(ProbeGeometry::Linear(40.0, 30.0, 0.0, 40.0), 1.0, grows);
  parameters.rows = 2;
  const TiledNoise box = TileNoise(parameters, {flat.Input("a"), flat.Input("b"), flat.Input("c")});
  EXPECT_EQ(box.fan.geometry.fanAngle, 0.0);
  EXPECT_NEAR(box.fan.geometry.fanWidth, 2 * 38.0 - 6.0, 1.01);
  EXPECT_NEAR(box.fan.geometry.sweepWidth, 2 * 28.0 - 6.0, 1.01);
  expect(box, 1.0);

  parameters.rows = 1;
  const Noise sector = NoiseOf(ProbeGeometry::Convex(50 * degree, 30.0, 0, 0, 2.0, 40.0), 0.5, grows);
  const TiledNoise plane = TileNoise(parameters, {sector.Input("a"), sector.Input("b")});
  EXPECT_TRUE(plane.fan.geometry.IsPlane());
  EXPECT_GT(plane.fan.geometry.fanAngle, 85 * degree);
  expect(plane, 1.0);

  // Narrower, of another radius, less deep: laid by its angle; what it lacks is a hole.
  const Noise wide = NoiseOf(convex, 1.0, grows);
  const Noise narrow = NoiseOf(ProbeGeometry::Convex(30 * degree, 45.0, 40 * degree, 30.0, 2.0, 34.0), 1.0, grows);
  const TiledNoise both = TileNoise(parameters, {wide.Input("wide"), narrow.Input("narrow")});
  EXPECT_NEAR(both.fan.geometry.fanAngle / degree, 60 + 30 - 10 - 6, 3.0);
  EXPECT_NEAR(both.fan.geometry.fanWidth / both.fan.geometry.fanAngle, 30.0, 1e-9);
  expect(both, 0.85);

  // No overlap: they only touch.
  parameters.overlapDegrees = 0.0;
  expect(TileNoise(parameters, {wide.Input("a"), wide.Input("b")}), 1.0);

  const auto tile = [&parameters](const Noise& a, const Noise& b) {
    return [&a, &b, &parameters] { TileNoise(parameters, {a.Input("this"), b.Input("that")}); };
  };
  EXPECT_EQ(RefusalOf(tile(wide, flat), "straight"), Error::Kind::BadInput);
  EXPECT_EQ(RefusalOf(tile(wide, sector), "single plane"), Error::Kind::BadInput);
  parameters.overlapDegrees = 57.0;
  EXPECT_EQ(RefusalOf(tile(wide, wide), "the fan of this is 60 degrees"), Error::Kind::InvalidParameter);
  parameters.overlapDegrees = 10.0;
  parameters.rows = 2;
  EXPECT_EQ(RefusalOf(tile(sector, sector), "do not sweep"), Error::Kind::InvalidParameter);
  parameters.rows = 1;
  parameters.columns = 8;
  EXPECT_EQ(RefusalOf(tile(wide, wide), "no probe has that"), Error::Kind::NotPossible);
}

TEST(NoiseTiling, RepeatsAreNotSeenAsSuch)
{
  // One volume twice: the second is turned by half, so the same speckle is at the mirrored place.
  const Noise noise = SpeckleOf(convex, 1.0, 5);
  NoiseTilingParameters parameters;
  parameters.columns = 2;
  parameters.overlapDegrees = 0.0;
  parameters.stitch.equalizeGain = false;
  const TiledNoise tiled = TileNoise(parameters, {noise.Input("one")});
  const auto dimensions = BeamDimensionsFor(tiled.fan.geometry, 1.0);
  const Volume<float> beams =
      SampleBeams(PosedVolume<float>{tiled.intensity.View(), tiled.valid.View(), tiled.geometry}, tiled.fan, dimensions);
  const auto view = beams.View();
  const auto correlation = [&](const std::function<float(int, int, int)>& other) {
    double xx = 0, yy = 0, xy = 0;
    for (int k = 4; k < dimensions[2] - 4; ++k)
      for (int j = 4; j < dimensions[1] / 2 - 4; ++j)
        for (int i = 4; i < dimensions[0] - 4; ++i) {
          const double ramp = 100.0 + 2.0 * i * 40.0 / (dimensions[0] - 1) / 2.0;
          const double x = view(i, j, k) - ramp, y = other(i, j, k) - ramp;
          if (!std::isfinite(x + y))
            continue;
          xx += x * x;
          yy += y * y;
          xy += x * y;
        }
    return xy / std::sqrt(xx * yy);
  };
  const auto n = dimensions;
  EXPECT_GT(correlation([&](int i, int j, int k) { return view(i, n[1] - 1 - j, n[2] - 1 - k); }), 0.9);
  EXPECT_LT(correlation([&](int i, int j, int k) { return view(i, n[1] - 1 - j, k); }), 0.3);
  EXPECT_LT(correlation([&](int i, int j, int k) { return view(i, n[1] / 2 + j, k); }), 0.3);
}

TEST(NoiseTiling, ThreadsCancellingAndBadInput)
{
  const Noise a = SpeckleOf(convex, 1.5, 1), b = SpeckleOf(convex, 1.5, 2);
  NoiseTilingParameters parameters;
  TiledNoise tiled[2];
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    tiled[threads / 2] = TileNoise(parameters, {a.Input("a"), b.Input("b")});
  }
  EXPECT_TRUE(std::equal(tiled[0].intensity.View().begin(), tiled[0].intensity.View().end(), tiled[1].intensity.View().begin()));
  for (const double stop : {0.0, 0.2, 0.5, 0.9})
    EXPECT_EQ(RefusalOf([&] {
                TileNoise(parameters, {a.Input("a"), b.Input("b")}, Progress([stop](double done) { return done < stop; }));
              }),
              Error::Kind::Cancelled);
  EXPECT_EQ(RefusalOf([&] { TileNoise(parameters, {}); }), Error::Kind::BadInput);
  const auto refuse = [&](const char* words, Error::Kind kind, const std::function<void(NoiseTilingParameters&)>& spoil) {
    NoiseTilingParameters wrong;
    spoil(wrong);
    EXPECT_EQ(RefusalOf([&] { TileNoise(wrong, {a.Input("a"), b.Input("b")}); }, words), kind) << words;
  };
  refuse("Columns", Error::Kind::InvalidParameter, [](auto& p) { p.columns = -1; });
  refuse("Rows", Error::Kind::InvalidParameter, [](auto& p) { p.rows = 0; });
  refuse("OverlapDegrees", Error::Kind::InvalidParameter, [](auto& p) { p.overlapDegrees = -1.0; });
  refuse("OverlapMm", Error::Kind::InvalidParameter, [](auto& p) { p.overlapMm = std::numeric_limits<double>::quiet_NaN(); });
  refuse("SpacingMm", Error::Kind::InvalidParameter, [](auto& p) { p.spacingMm = -1.0; });
  refuse("million voxels", Error::Kind::TooLarge, [](auto& p) { p.spacingMm = 0.01; });
  NoiseInput bad = a.Input("a");
  bad.fan.geometry.depthMax = -5.0;
  EXPECT_EQ(RefusalOf([&] { TileNoise(parameters, {bad}); }), Error::Kind::InvalidParameter);
}
