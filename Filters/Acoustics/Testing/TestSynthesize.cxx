// SPDX-License-Identifier: BSD-3-Clause
// The composition: what the parts promise (their own tests) must survive being put together.
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Acoustics/Synthesize.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

using echorama::AcousticScene;
using echorama::BeamEchoes;
using echorama::Error;
using echorama::Material;
using echorama::Pose;
using echorama::ProbeGeometry;
using echorama::StandardMaterial;
using echorama::SynthesisParameters;
using echorama::TissueSurface;
using echorama::testing::AddBox;
using echorama::testing::Background;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

Material Clear(double soundSpeed = 1540.0, double density = 1000.0)
{
  Material material;
  material.name = "clear";
  material.soundSpeed = soundSpeed;
  material.density = density;
  material.attenuation = 0.0;
  material.scattererDensity = 0.0;
  material.backscatterDb = Material::clearDb;
  return material;
}

Material Speckled(double density = 4.0)
{
  Material material;
  material.name = "speckled";
  material.attenuation = 0.0;
  material.scattererDensity = density;
  return material;
}

// A small flat probe.
SynthesisParameters Small()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Linear(16.0, 8.0, 0.0, 40.0);
  p.elements = 17;
  p.steps = 5;
  p.samples = 160;
  p.transducer.lateralFocusMm = p.transducer.elevationFocusMm = 25.0;
  p.receiver.noiseDb = echorama::Receiver::noNoiseDb;
  p.receiver.tgcDbPerCm = 0.0;
  return p;
}

double LargestDifference(const BeamEchoes& a, const BeamEchoes& b)
{
  double largest = 0.0;
  const auto x = a.baseband.View(), y = b.baseband.View();
  for (std::ptrdiff_t i = 0; i < x.Size(); ++i)
    largest = std::max<double>(largest, std::abs(x[i] - y[i]));
  return largest;
}

double Power(const BeamEchoes& echoes)
{
  double sum = 0.0;
  for (const auto& sample : echoes.baseband.View())
    sum += std::norm(sample);
  return sum / static_cast<double>(echoes.baseband.View().Size());
}

TEST(Synthesize, UniformTissueHasPowerOne)
{
  SynthesisParameters p = Small();
  p.probe = ProbeGeometry::Linear(30.0, 30.0, 5.0, 40.0);
  p.elements = p.steps = 16;
  const BeamEchoes echoes = SynthesizeEchoes(AcousticScene(Background(Speckled())), p);
  EXPECT_NEAR(Power(echoes), 1.0, 0.12);
}

TEST(Synthesize, NothingComesOfNothing)
{
  SynthesisParameters p = Small();
  echorama::SynthesisCost cost;
  const auto beams = SynthesizeBeams(AcousticScene(Background(Clear())), p, {}, &cost);
  for (const unsigned char grey : beams.View())
    ASSERT_EQ(grey, 0);
  EXPECT_EQ(cost.scatterers, 0);
  EXPECT_EQ(cost.surfaceEchoes, 0);
}

TEST(Synthesize, APlaneIsSeenWhereTheScannerThinksItIs)
{
  for (const double soundSpeed : {1540.0, 1450.0, 1620.0}) {
    TissueSurface surface = Background(Clear(soundSpeed));
    const double depth = 23.37;
    AddBox(surface, Clear(1540.0, 1600.0), Vector3f(-50, -50, depth), Vector3f(50, 50, 60));
    SynthesisParameters p = Small();
    p.transport.faceReflection = 0.0;
    const BeamEchoes echoes = SynthesizeEchoes(AcousticScene(surface), p);
    const auto rows = echoes.baseband.View();
    const double step = 40.0 / (rows.Dimensions()[0] - 1), sample = 40.0 / (p.samples - 1);
    for (int beam = 0; beam < p.elements; ++beam) {
      const auto* row = rows.Row(beam, 2);
      const auto* peak = std::max_element(row, row + rows.Dimensions()[0],
                                          [](const auto& a, const auto& b) { return std::norm(a) < std::norm(b); });
      EXPECT_NEAR(static_cast<double>(peak - row) * step, depth * 1540.0 / soundSpeed, 0.5 * sample) << soundSpeed;
    }
  }
}

TEST(Synthesize, DoesNotDependOnThreads)
{
  TissueSurface surface = Background(Speckled());
  AddBox(surface, StandardMaterial("bone"), Vector3f(-5, -5, 15), Vector3f(5, 5, 25));
  const AcousticScene scene(surface);
  for (const int subRays : {1, 7, -1, -7}) {
    SynthesisParameters p = Small();
    p.subRays = std::abs(subRays);
    p.wideBeams = subRays < 0;
    p.lobes.sideLobes = subRays == -1 ? 1 : 0;
    std::vector<BeamEchoes> made;
    for (const int threads : {1, 2, 5}) {
      const echorama::ThreadLimit limit(threads);
      made.push_back(SynthesizeEchoes(scene, p));
    }
    EXPECT_EQ(LargestDifference(made[0], made[1]), 0.0);
    EXPECT_EQ(LargestDifference(made[0], made[2]), 0.0);
    EXPECT_GT(Power(made[0]), 0.0);
  }
}

TEST(Synthesize, ViewsOfOneSeedSeeTheSameSpeckle)
{
  const AcousticScene scene(Background(Speckled()));
  SynthesisParameters p = Small();
  const BeamEchoes first = SynthesizeEchoes(scene, p);
  p.probeToWorld.translation().x() = 4.0; // four beams on
  const BeamEchoes moved = SynthesizeEchoes(scene, p);
  const auto a = first.baseband.View(), b = moved.baseband.View();
  double largest = 0.0;
  for (int step = 0; step < p.steps; ++step)
    for (int beam = 4; beam < p.elements; ++beam)
      for (int i = 0; i < a.Dimensions()[0]; ++i)
        largest = std::max<double>(largest, std::abs(a.Row(beam, step)[i] - b.Row(beam - 4, step)[i]));
  EXPECT_LT(largest, 1e-3);
  p.seed = 2;
  EXPECT_GT(LargestDifference(moved, SynthesizeEchoes(scene, p)), 0.5);
}

TEST(Synthesize, ChangedTissueCorrelatesByWhatItKeeps)
{
  const AcousticScene scene(Background(Speckled()));
  SynthesisParameters p = Small();
  p.probe = ProbeGeometry::Linear(30.0, 30.0, 5.0, 40.0);
  p.elements = p.steps = 16;
  const auto correlation = [](const BeamEchoes& one, const BeamEchoes& other) {
    std::complex<double> product = 0.0;
    for (std::ptrdiff_t i = 0; i < one.baseband.View().Size(); ++i)
      product += std::complex<double>(one.baseband.View()[i]) * std::conj(std::complex<double>(other.baseband.View()[i]));
    return std::abs(product) / std::sqrt(Power(one) * Power(other)) / static_cast<double>(one.baseband.View().Size());
  };
  const BeamEchoes before = SynthesizeEchoes(scene, p);
  for (const double decorrelation : {0.1, 0.4, 1.0}) {
    p.decorrelation = decorrelation;
    p.changeSeed = 1;
    const BeamEchoes one = SynthesizeEchoes(scene, p);
    EXPECT_EQ(LargestDifference(one, SynthesizeEchoes(scene, p)), 0.0);
    p.changeSeed = 2;
    const BeamEchoes two = SynthesizeEchoes(scene, p);
    EXPECT_NEAR(correlation(one, two), 1.0 - decorrelation, 0.06) << decorrelation;
    EXPECT_NEAR(correlation(before, one), std::sqrt(1.0 - decorrelation), 0.06) << decorrelation;
    EXPECT_NEAR(Power(one), Power(before), 0.12);
  }
}

TEST(Synthesize, APartOfTheSweepIsThatPartOfTheWhole)
{
  TissueSurface surface = Background(Speckled());
  AddBox(surface, StandardMaterial("cyst"), Vector3f(-5, -5, 15), Vector3f(5, 5, 25));
  const AcousticScene scene(surface);
  SynthesisParameters p = Small();
  p.wideBeams = true;
  const BeamEchoes whole = SynthesizeEchoes(scene, p);
  p.firstStep = 1;
  p.lastStep = 2;
  ASSERT_GT(p.steps, 3);
  const BeamEchoes part = SynthesizeEchoes(scene, p);
  for (int step = 0; step < p.steps; ++step)
    for (int beam = 0; beam < p.elements; ++beam)
      for (int i = 0; i < whole.baseband.View().Dimensions()[0]; ++i)
        ASSERT_NEAR(std::abs(part.baseband.View().Row(beam, step)[i] -
                             (step == 1 || step == 2 ? whole.baseband.View().Row(beam, step)[i] : std::complex<float>(0.0f))),
                    0.0, 1e-5); // scatterers are added up in another order
  p.lastStep = p.steps;
  EXPECT_THROW(p.Check(), Error);
}

TEST(Synthesize, SpeckleGoesAlongWithDisplacedTissue)
{
  const AcousticScene scene(Background(Speckled()));
  SynthesisParameters p = Small();
  const BeamEchoes rest = SynthesizeEchoes(scene, p);
  const Vector3d shift(1.5, -2.0, 3.0);
  echorama::ImageGeometry lattice;
  lattice.dimensions = {12, 12, 12};
  lattice.spacing = Vector3d::Constant(20.0);
  lattice.origin = Vector3d(-110, -110, -110);
  p.displacement = echorama::DisplacementField(lattice, std::vector<Vector3d>(12 * 12 * 12, shift));
  p.probeToWorld.translation() = shift;
  EXPECT_LT(LargestDifference(rest, SynthesizeEchoes(scene, p)), 2e-3);
  p.probeToWorld.translation().setZero();
  EXPECT_GT(LargestDifference(rest, SynthesizeEchoes(scene, p)), 0.5);
}

TEST(Synthesize, ASliceIsAPlaneOfTheVolume)
{
  TissueSurface surface = Background(Speckled());
  AddBox(surface, StandardMaterial("cyst"), Vector3f(-5, -5, 15), Vector3f(5, 5, 25));
  const AcousticScene scene(surface);
  SynthesisParameters p = Small();
  for (const bool swept : {false, true}) {
    p.wideBeams = swept; // planes know nothing of each other
    if (swept)
      p.probe = ProbeGeometry::Convex(0.6, 30.0, 0.5, 25.0, 2.0, 40.0);
    p.probeToWorld = Pose(Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()));
    const BeamEchoes whole = SynthesizeEchoes(scene, p);
    for (int step = 0; step < p.steps; ++step) {
      const BeamEchoes slice = SynthesizeEchoes(scene, SliceOf(p, static_cast<double>(step) / (p.steps - 1) - 0.5));
      ASSERT_EQ(slice.baseband.Dimensions()[2], 1);
      double largest = 0.0;
      for (int beam = 0; beam < p.elements; ++beam)
        for (int i = 0; i < whole.baseband.Dimensions()[0]; ++i)
          largest = std::max<double>(largest,
                                     std::abs(whole.baseband.View().Row(beam, step)[i] - slice.baseband.View().Row(beam, 0)[i]));
      EXPECT_LT(largest, 5e-3) << swept << " " << step;
    }
  }
  EXPECT_THROW(SliceOf(p, 0.6), Error);
}

TEST(Synthesize, AMovingProbeImagesEachPlaneWhereItWas)
{
  const AcousticScene scene(Background(Speckled()));
  SynthesisParameters p = Small();
  const BeamEchoes rest = SynthesizeEchoes(scene, p);
  p.stepPoses.assign(static_cast<std::size_t>(p.steps), Pose::Identity());
  EXPECT_EQ(LargestDifference(rest, SynthesizeEchoes(scene, p)), 0.0);
  // Sweeping back over its own sweep: every plane lies where the middle one does.
  for (int step = 0; step < p.steps; ++step)
    p.stepPoses[static_cast<std::size_t>(step)].translation().y() = 4.0 - 2.0 * step;
  const BeamEchoes still = SynthesizeEchoes(scene, p);
  const auto a = rest.baseband.View(), b = still.baseband.View();
  for (int step = 0; step < p.steps; ++step)
    for (int i = 0; i < a.Dimensions()[0]; i += 7)
      EXPECT_LT(std::abs(a.Row(8, 2)[i] - b.Row(8, step)[i]), 1e-3);
  p.stepPoses.pop_back();
  EXPECT_THROW(p.Check(), Error);
}

TEST(Synthesize, ShadowsAreAsSoftAsTheApertureIsWide)
{
  TissueSurface surface = Background(Speckled());
  AddBox(surface, StandardMaterial("bone"), Vector3f(0.5, -50, 8), Vector3f(50, 50, 10));
  const AcousticScene scene(surface);
  SynthesisParameters p = Small();
  p.subRays = 1;
  p.transport.maxBounces = 0;
  p.transport.refraction = false;
  // Mean power of every beam behind the edge, beside that without a bone.
  const AcousticScene bare(Background(Speckled()));
  const auto behind = [&](const BeamEchoes& echoes) {
    std::vector<double> power(static_cast<std::size_t>(p.elements), 0.0);
    for (int step = 0; step < p.steps; ++step)
      for (int beam = 0; beam < p.elements; ++beam)
        for (int i = echoes.baseband.Dimensions()[0] / 2; i < echoes.baseband.Dimensions()[0] * 9 / 10; ++i)
          power[static_cast<std::size_t>(beam)] += std::norm(echoes.baseband.View().Row(beam, step)[i]);
    return power;
  };
  const auto lit = behind(SynthesizeEchoes(bare, p));
  const auto sharp = behind(SynthesizeEchoes(scene, p));
  EXPECT_NEAR(sharp[7] / lit[7], 1.0, 0.25);
  EXPECT_LT(sharp[10] / lit[10], 0.05);
  p.subRays = 64;
  p.sampling = echorama::Sampling::Sobol;
  const auto soft = behind(SynthesizeEchoes(scene, p));
  EXPECT_GT(soft[0] / lit[0], 0.9);
  EXPECT_LT(soft[7] / lit[7], 0.8);
  EXPECT_GT(soft[9] / lit[9], 0.02);
  EXPECT_LT(soft[16] / lit[16], 0.05);
  for (std::size_t beam = 1; beam < soft.size(); ++beam)
    EXPECT_LT(soft[beam] / lit[beam], soft[beam - 1] / lit[beam - 1] + 0.25);
}

// Behind the edge of an absorber the amplitude is the share of the aperture, by its apodisation, that looks past it. Along the
// fan and along the sweep that is another aperture.
TEST(Synthesize, EachDirectionHasItsOwnAperture)
{
  Material absorber = Clear();
  absorber.attenuation = 200.0;
  const double edge = 0.5, depth = 9.0, thickness = 0.4, focus = 25.0;
  for (const double lateral : {14.0, 4.0}) {
    SynthesisParameters p = Small();
    p.probe = ProbeGeometry::Linear(16.0, 16.0, 0.0, 40.0);
    p.elements = p.steps = 9; // 2 mm apart
    p.subRays = 256;
    p.sampling = echorama::Sampling::Sobol;
    p.transport.maxBounces = 0;
    p.transport.refraction = false;
    p.transducer.lateralApertureMm = lateral;
    p.transducer.elevationApertureMm = 18.0 - lateral;
    const BeamEchoes open = SynthesizeEchoes(AcousticScene(Background(Speckled())), p);
    for (const int axis : {0, 1}) {
      TissueSurface surface = Background(Speckled());
      Vector3f from(-50.0, -50.0, depth - 0.5 * thickness);
      from[axis] = static_cast<float>(edge);
      AddBox(surface, absorber, from, Vector3f(50.0, 50.0, depth + 0.5 * thickness));
      const BeamEchoes shaded = SynthesizeEchoes(AcousticScene(surface), p);
      const double sigma =
          (axis == 0 ? lateral : 18.0 - lateral) / echorama::Transducer::sigmasPerAperture * (1.0 - depth / focus);
      const auto below = [](double sigmas) { return 0.5 * std::erfc(-std::clamp(sigmas, -2.5, 2.5) / std::sqrt(2.0)); };
      for (int place = 0; place < 9; ++place) {
        double with = 0.0, without = 0.0;
        for (int other = 0; other < 9; ++other)
          for (int i = open.baseband.Dimensions()[0] / 2; i < open.baseband.Dimensions()[0] * 9 / 10; ++i) {
            const int beam = axis == 0 ? place : other, step = axis == 0 ? other : place;
            with += std::norm(shaded.baseband.View().Row(beam, step)[i]);
            without += std::norm(open.baseband.View().Row(beam, step)[i]);
          }
        const double share = (below((edge - (2.0 * place - 8.0)) / sigma) - below(-2.5)) / (below(2.5) - below(-2.5));
        EXPECT_NEAR(std::sqrt(with / without), share, 0.03) << lateral << " " << axis << " " << place;
      }
    }
  }
}

// At the focus neighbouring beams share speckle as far as their profiles, of two Gaussian widths and curved fronts, overlap.
TEST(Synthesize, SpeckleIsAsWideAsTheBeamInEachDirection)
{
  const AcousticScene scene(Background(Speckled(8.0)));
  for (const double lateral : {14.0, 6.0}) {
    SynthesisParameters p = Small();
    p.probe = ProbeGeometry::Linear(12.0, 12.0, 23.0, 27.0);
    p.elements = p.steps = 13; // 1 mm apart
    p.samples = 33;
    p.subRays = 1;
    p.transducer.lateralApertureMm = lateral;
    p.transducer.elevationApertureMm = 20.0 - lateral;
    const BeamEchoes echoes = SynthesizeEchoes(scene, p);
    const auto rows = echoes.baseband.View();
    const echorama::BeamWidth width = WidthAt(p.transducer, 25.0);
    for (const int axis : {0, 1}) {
      std::complex<double> both = 0.0;
      double power = 0.0;
      for (int step = 0; step + axis < p.steps; ++step)
        for (int beam = 0; beam + 1 - axis < p.elements; ++beam)
          for (int i = 0; i < rows.Dimensions()[0]; ++i) {
            const std::complex<double> a = rows.Row(beam, step)[i], b = rows.Row(beam + 1 - axis, step + axis)[i];
            both += a * std::conj(b);
            power += 0.5 * (std::norm(a) + std::norm(b));
          }
      const double sigma = axis == 0 ? width.lateralSigma : width.elevationSigma;
      const double phase = p.transducer.PhasePerMm() * (axis == 0 ? width.lateralCurvature : width.elevationCurvature) * sigma;
      EXPECT_NEAR(std::abs(both) / power, std::exp(-0.25 / (sigma * sigma) - 0.25 * phase * phase), 0.1)
          << lateral << " " << axis;
    }
  }
}

TEST(Synthesize, WhatStaysBlackIsNotSummed)
{
  TissueSurface surface = Background(Speckled());
  AddBox(surface, StandardMaterial("bone"), Vector3f(-50, -50, 8), Vector3f(50, 50, 18));
  const AcousticScene scene(surface);
  SynthesisParameters p = Small();
  echorama::SynthesisCost cost, full;
  const auto part = SynthesizeBeams(scene, p, {}, &cost);
  p.invisibleDb = 300.0;
  const auto all = SynthesizeBeams(scene, p, {}, &full);
  EXPECT_LT(cost.segments, full.segments / 2);
  for (std::ptrdiff_t i = 0; i < all.View().Size(); ++i)
    ASSERT_NEAR(part.View()[i], all.View()[i], 8) << i; // peaks of speckle, and ways that add up
}

TEST(Synthesize, ManyRaysOfAnOpenBeamAreAsGoodAsOne)
{
  const AcousticScene scene(Background(Speckled()));
  SynthesisParameters p = Small();
  const BeamEchoes one = SynthesizeEchoes(scene, p);
  p.subRays = 16;
  const BeamEchoes many = SynthesizeEchoes(scene, p);
  EXPECT_NEAR(Power(many) / Power(one), 1.0, 0.05);
  p.wideBeams = true; // nothing bends it
  EXPECT_LT(LargestDifference(many, SynthesizeEchoes(scene, p)), 1e-3);
}

TEST(Synthesize, LooksAwayFromTheTissue)
{
  TissueSurface surface = Background(Clear());
  AddBox(surface, Speckled(), Vector3f(-50, -50, 5), Vector3f(50, 50, 60));
  SynthesisParameters p = Small();
  p.probeToWorld = Pose(Eigen::AngleAxisd(3.14159265358979, Vector3d::UnitX()));
  echorama::SynthesisCost cost;
  EXPECT_EQ(Power(SynthesizeEchoes(AcousticScene(surface), p, {}, &cost)), 0.0);
  EXPECT_EQ(cost.scatterers, 0);
}

TEST(Synthesize, OnlyScatterersInTheBeamAreMade)
{
  SynthesisParameters p = Small();
  echorama::SynthesisCost cost;
  SynthesizeEchoes(AcousticScene(Background(Speckled(1.0))), p, {}, &cost);
  const double beam = 16.0 * 8.0 * 40.0;
  EXPECT_GT(static_cast<double>(cost.scatterers), beam);
  EXPECT_LT(static_cast<double>(cost.scatterers), 12.0 * beam); // with the width of the beams and whole cells
  EXPECT_EQ(cost.rays, 0);                                      // there is nothing to meet
  EXPECT_EQ(cost.segments, 17 * 5);
  EXPECT_GT(cost.bytes, 0u);
}

TEST(Synthesize, FarFromTheOriginNothingChanges)
{
  SynthesisParameters p = Small();
  const BeamEchoes near = SynthesizeEchoes(AcousticScene(Background(Speckled())), p);
  TissueSurface surface = Background(Speckled());
  p.probeToWorld.translation() = Vector3d(9e5, -8e5, 7e5);
  const BeamEchoes far = SynthesizeEchoes(AcousticScene(surface), p);
  EXPECT_NEAR(Power(far) / Power(near), 1.0, 0.3);
}

TEST(Synthesize, CountedEventsMakeAPictureToo)
{
  TissueSurface surface = Background(StandardMaterial("liver"));
  AddBox(surface, StandardMaterial("cyst"), Vector3f(-4, -50, 15), Vector3f(4, 50, 25));
  const AcousticScene scene(surface);
  SynthesisParameters p = Small();
  p.mode = SynthesisParameters::Mode::Counting;
  p.counting.raysPerElement = 64;
  const auto beams = SynthesizeBeams(scene, p);
  const auto mean = [&](int beam, double from, double to) {
    double sum = 0.0;
    int count = 0;
    for (auto i = static_cast<int>(from / 40.0 * 159.0); i < static_cast<int>(to / 40.0 * 159.0); ++i, ++count)
      sum += beams.View().Row(beam, 2)[i];
    return sum / count;
  };
  EXPECT_GT(mean(0, 17.0, 23.0), mean(8, 17.0, 23.0) + 20.0);
  EXPECT_NEAR(mean(0, 3.0, 10.0), p.receiver.referenceGrey, 60.0); // few events a sample: their logarithm is low
  for (const double clarity : {0.0, 200.0}) {
    p.counting.clarity = clarity;
    EXPECT_NO_THROW(SynthesizeBeams(scene, p)) << clarity;
  }
}

TEST(Synthesize, OnePlaneCanBeAskedAnywhere)
{
  SynthesisParameters p = SliceOf(Small(), 0.0);
  const BeamEchoes echoes = SynthesizeEchoes(AcousticScene(Background(Speckled())), p);
  const auto at = echoes.At(Vector3d(0.0, 0.0, 20.0));
  ASSERT_TRUE(at);
  const auto row = echoes.baseband.View().Row(p.elements / 2, 0);
  const double sample = 20.0 / 40.0 * (echoes.baseband.Dimensions()[0] - 1);
  const auto i = static_cast<std::ptrdiff_t>(sample);
  const std::complex<double> a(row[i]), b(row[i + 1]);
  EXPECT_LT(std::abs(*at - (a + (sample - static_cast<double>(i)) * (b - a))), 1e-5);
}

TEST(Synthesize, TheDescriptionIsJson)
{
  SynthesisParameters p = Small();
  const auto text = nlohmann::json::parse(DescribeSynthesis(p));
  EXPECT_EQ(text.at("elements"), 17);
  EXPECT_EQ(text.at("mode"), "coherent");
  EXPECT_EQ(text.at("transducer").at("frequencyMHz"), 3.5);
  p.mode = SynthesisParameters::Mode::Counting;
  EXPECT_EQ(nlohmann::json::parse(DescribeSynthesis(p)).at("counting").at("clarity"), 20.0);
}

TEST(Synthesize, RefusesWhatIsOutOfRange)
{
  const AcousticScene scene(Background(Clear()));
  const auto refuses = [&](const auto& change, const std::string& word) {
    SynthesisParameters p = Small();
    change(p);
    try {
      SynthesizeEchoes(scene, p);
      ADD_FAILURE() << word << " was taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refuses([](auto& p) { p.elements = 1; }, "Elements");
  refuses([](auto& p) { p.steps = 5000; }, "Steps");
  refuses([](auto& p) { p.samples = 0; }, "Samples");
  refuses([](auto& p) { p.mode = static_cast<SynthesisParameters::Mode>(7); }, "Mode");
  refuses(
      [](auto& p) {
        p.mode = SynthesisParameters::Mode::Counting;
        p.stepPoses.assign(5, Pose::Identity());
      },
      "stepPoses");
  refuses([](auto& p) { p.subRays = 0; }, "SubRays");
  refuses([](auto& p) { p.mirrorDb = std::nan(""); }, "MirrorDb");
  refuses([](auto& p) { p.transducer.frequencyMHz = -1.0; }, "requency");
  refuses([](auto& p) { p.transport.maxBounces = -1; }, "ounces");
  refuses([](auto& p) { p.probeToWorld.linear() *= 2.0; }, "probeToWorld");
  refuses([](auto& p) { p.elements = p.steps = 4096, p.samples = 16384; }, "2^29");
}

TEST(Synthesize, StopsOnRequest)
{
  const AcousticScene scene(Background(Speckled()));
  for (const double when : {0.0, 0.25, 0.6})
    EXPECT_THROW(SynthesizeBeams(scene, Small(), echorama::Progress([when](double done) { return done <= when; })), Error);
}

} // namespace
