// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Acoustics/BeamLobes.h"
#include "Filters/Acoustics/Synthesize.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.14159265358979;

double Db(double amplitude)
{
  return 20.0 * std::log10(amplitude);
}

// The echo of a point at the focus, beside the axis by an angle: every pair of elements, one that sends and one that listens,
// adds a pulse at its own time. \returns the peak of the envelope beside that of a point on the axis.
double PeakOfAllPairs(const BeamLobes& lobes, const Transducer& t, double sine)
{
  const int count = static_cast<int>(std::lround(t.lateralApertureMm / lobes.pitchMm));
  const double k = 2.0 * pi / t.WavelengthMm(), focus = 1e4; // so far that nothing is near
  const double u = lobes.elementWidth * lobes.pitchMm * sine / t.WavelengthMm();
  const double element = (u == 0.0 ? 1.0 : std::sin(pi * u) / (pi * u)) * std::sqrt(1.0 - sine * sine);
  std::vector<double> late, weights;
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const double x = (i - 0.5 * (count - 1)) * lobes.pitchMm, part = (i + 0.5) / count - 0.5;
    weights.push_back(lobes.apodisation == Apodisation::Rectangular ? 1.0
                      : lobes.apodisation == Apodisation::Hann      ? 0.5 + 0.5 * std::cos(2.0 * pi * part)
                                                                    : std::exp(-12.5 * part * part));
    sum += weights.back();
    const double px = focus * sine, pz = focus * std::sqrt(1.0 - sine * sine);
    late.push_back(std::hypot(px - x, pz) - std::hypot(x, focus)); // delayed to meet on the axis
  }
  double peak = 0.0;
  for (double depth = -0.1; depth <= 0.1; depth += 0.02) {
    std::complex<double> echo = 0.0;
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < count; ++j) {
        const double from = 0.5 * (late[static_cast<std::size_t>(i)] + late[static_cast<std::size_t>(j)]);
        const double away = (depth - from) / t.PulseSigmaMm();
        echo += weights[static_cast<std::size_t>(i)] * weights[static_cast<std::size_t>(j)] * std::exp(-0.5 * away * away) *
                std::exp(std::complex<double>(0.0, 2.0 * k * (depth - from)));
      }
    peak = std::max(peak, std::abs(echo));
  }
  return peak / (sum * sum) * element * element;
}

} // namespace

TEST(BeamLobes, NoneUnlessTheyAreAskedFor)
{
  EXPECT_TRUE(LobesOf(BeamLobes(), Transducer()).empty());
}

// Of long pulses, the figures of every table of windows; both ways, so twice the dB.
TEST(BeamLobes, SideLobesOfWindowsAreWhereAndAsLoudAsTablesSay)
{
  Transducer t;
  t.bandwidth = 0.05;
  BeamLobes lobes;
  lobes.sideLobes = 2;
  struct Expected {
    Apodisation apodisation;
    double first, firstDb, second, secondDb; // wavelengths / aperture
  };
  for (const Expected& e : {Expected{Apodisation::Rectangular, 1.430, -13.26, 2.459, -17.83},
                            Expected{Apodisation::Hann, 2.362, -31.47, 3.388, -41.6}}) {
    lobes.apodisation = e.apodisation;
    const std::vector<BeamLobe> all = LobesOf(lobes, t);
    ASSERT_EQ(all.size(), 4u);
    const double unit = t.WavelengthMm() / t.lateralApertureMm;
    EXPECT_NEAR(all[0].sine / unit, e.first, 0.02);
    EXPECT_NEAR(Db(all[0].amplitude), 2.0 * e.firstDb, 0.4);
    EXPECT_EQ(all[1].sine, -all[0].sine);
    EXPECT_EQ(all[1].amplitude, all[0].amplitude);
    EXPECT_NEAR(all[2].sine / unit, e.second, 0.03);
    EXPECT_NEAR(Db(all[2].amplitude), 2.0 * e.secondDb, 0.8);
    // A lobe of a window without its own axis is narrower than the main one: half as wide as from zero to zero.
    const double half = WidthAt(all[0].transducer, t.lateralFocusMm).lateralSigma * 2.3548 / t.lateralFocusMm / unit;
    EXPECT_NEAR(half, 0.5, 0.05);
  }
}

TEST(BeamLobes, GratingLobesOfALongPulseAreAsLoudAsTheElementLets)
{
  Transducer t;
  t.bandwidth = 0.05;
  t.lateralApertureMm = 6.0;
  BeamLobes lobes;
  lobes.apodisation = Apodisation::Gaussian;
  lobes.pitchMm = 2.4 * t.WavelengthMm();
  lobes.elementWidth = 0.6;
  const std::vector<BeamLobe> all = LobesOf(lobes, t);
  ASSERT_EQ(all.size(), 4u); // of the first two orders
  for (const int m : {1, 2}) {
    const BeamLobe& lobe = all[static_cast<std::size_t>(2 * (m - 1))];
    EXPECT_NEAR(lobe.sine, m / 2.4, 1e-12);
    const double element = std::sin(pi * 0.6 * m) / (pi * 0.6 * m);
    EXPECT_NEAR(Db(lobe.amplitude), Db(element * element * (1.0 - lobe.sine * lobe.sine)), 1.0) << m;
  }
  lobes.pitchMm = 0.9 * t.WavelengthMm();
  EXPECT_TRUE(LobesOf(lobes, t).empty());
}

// Short pulses: elements are heard one after the other.
TEST(BeamLobes, LevelsAreThoseOfAllPairsOfElements)
{
  for (const double bandwidth : {0.1, 0.6})
    for (const Apodisation apodisation : {Apodisation::Rectangular, Apodisation::Hann, Apodisation::Gaussian}) {
      Transducer t;
      t.bandwidth = bandwidth;
      BeamLobes lobes;
      lobes.apodisation = apodisation;
      lobes.pitchMm = 0.65;
      lobes.elementWidth = 0.1; // as loud at all frequencies
      lobes.sideLobes = apodisation == Apodisation::Rectangular ? 2 : 0;
      t.lateralApertureMm = 20 * lobes.pitchMm;
      const std::vector<BeamLobe> all = LobesOf(lobes, t);
      ASSERT_GE(all.size(), 2u);
      for (const BeamLobe& lobe : all)
        EXPECT_NEAR(Db(lobe.amplitude), Db(PeakOfAllPairs(lobes, t, lobe.sine)), 0.5) << bandwidth << " " << lobe.sine;
    }
}

// A ball in clear water, and beams that turn past it: beside the beam that looks at it those whose lobe does show it, at its
// depth, as loud as the lobe is.
TEST(BeamLobes, AStrongPointBesideTheBeamAppearsInTheBeam)
{
  TissueSurface surface = Background(Clear("water", 1540.0, 1000));
  AddSphere(surface, AddBody(surface, Clear("ball", 1540.0, 4000)), Vector3d(0, 0, 61), 1.0, 5);
  const AcousticScene scene(surface);
  SynthesisParameters p;
  p.probe = ProbeGeometry::Convex(1.2, 1.0, 0.0, 0.0, 40.0, 70.0);
  p.elements = 241;
  p.samples = 3000; // so that a sample lies at the peak of each pulse
  p.subRays = 1;
  p.transport.faceReflection = 0.0;
  p.transport.maxBounces = 0;
  p.transport.acceptanceDegrees = 20.0;
  p.receiver.noiseDb = Receiver::noNoiseDb;
  const auto peaks = [&] {
    const BeamEchoes echoes = SynthesizeEchoes(scene, p);
    std::vector<double> loudest;
    for (int beam = 0; beam < p.elements; ++beam) {
      double peak = 0.0;
      for (int i = 0; i < echoes.baseband.Dimensions()[0]; ++i)
        peak = std::max(peak, static_cast<double>(std::abs(echoes.baseband.View().Row(beam, 0)[i])));
      loudest.push_back(peak);
    }
    return loudest;
  };
  const std::vector<double> bare = peaks();
  p.lobes.pitchMm = 1.1;
  p.lobes.elementWidth = 0.5;
  const std::vector<double> heard = peaks();
  const double sine = p.transducer.WavelengthMm() / 1.1;
  const double level = TwoWayPattern(p.lobes, p.transducer, sine);
  EXPECT_NEAR(heard[120], bare[120], 1e-3 * bare[120]);
  for (const int side : {-1, 1}) {
    int loudest = 120 + 20 * side;
    for (int beam = loudest; beam >= 0 && beam < p.elements; beam += side)
      if (heard[static_cast<std::size_t>(beam)] > heard[static_cast<std::size_t>(loudest)])
        loudest = beam;
    EXPECT_EQ(bare[static_cast<std::size_t>(loudest)], 0.0);
    EXPECT_NEAR((loudest - 120) * 1.2 / 240, side * std::asin(sine), 0.01);
    EXPECT_NEAR(heard[static_cast<std::size_t>(loudest)] / heard[120], level, 0.03 * level);
  }
}

TEST(BeamLobes, WhatIsOutOfRangeIsRefused)
{
  SynthesisParameters p;
  p.lobes.sideLobes = -1;
  EXPECT_THROW(p.Check(), Error);
  p.lobes.sideLobes = 0;
  p.lobes.elementWidth = 0.0;
  EXPECT_THROW(p.Check(), Error);
}
