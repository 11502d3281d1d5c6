// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "PulseEcho.h"
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;

TEST(Transducer, PointSpreadFollowsRayleighIntegral)
{
  const Transducer transducer;
  for (const double depth : {40.0, 70.0, 110.0}) {
    const BeamWidth scale = WidthAt(transducer, depth);
    const Widths exact = WidthsOf(RayleighPulseEcho(transducer, depth), scale),
                 ours = WidthsOf(OurPulseEcho(transducer, depth), scale);
    EXPECT_NEAR(ours.depth / exact.depth, 1.0, 0.1) << depth;
    EXPECT_NEAR(ours.lateral / exact.lateral, 1.0, 0.1) << depth;
    EXPECT_NEAR(ours.elevation / exact.elevation, 1.0, 0.1) << depth;
  }
}

TEST(Transducer, PulseHasItsBandwidth)
{
  Transducer transducer;
  transducer.frequencyMHz = 5.0;
  transducer.bandwidth = 0.4;
  // The spectrum of the sampled pulse, half a bandwidth away from the centre, is half of that at the centre.
  const double sigma = transducer.PulseSigmaMm(), step = 0.05 * sigma;
  double centre = 0.0, side = 0.0;
  for (int i = -200; i <= 200; ++i) {
    const double depth = i * step, microseconds = 2.0 * depth / (1e-3 * transducer.assumedSoundSpeed);
    const double pulse = std::exp(-0.5 * std::pow(depth / sigma, 2));
    centre += pulse;
    side += pulse * std::cos(2.0 * pi * 0.5 * 0.4 * 5.0 * microseconds);
  }
  EXPECT_NEAR(side / centre, 0.5, 1e-6);
}

TEST(Transducer, FocusIsNarrowestAndItsFrontIsCentredOnTheAperture)
{
  Transducer transducer;
  transducer.elevationFocusMm = 50.0;
  const double k = 2.0 * pi / transducer.WavelengthMm();
  const BeamWidth focus = WidthAt(transducer, transducer.lateralFocusMm);
  // Both ways are focused there: z / (k s), divided by the root of two.
  EXPECT_NEAR(focus.lateralSigma, 70.0 / (k * 14.0 / 5.0) / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(focus.lateralCurvature, 1.0 / 70.0, 1e-12);
  EXPECT_NEAR(WidthAt(transducer, 50.0).elevationSigma, 50.0 / (k * 10.0 / 5.0) / std::sqrt(2.0), 1e-9);
  EXPECT_GT(WidthAt(transducer, 140.0).elevationSigma, WidthAt(transducer, 50.0).elevationSigma);
  // Before the lens' focus the front converges.
  EXPECT_LT(WidthAt(transducer, 10.0).elevationCurvature, 0.0);
}

TEST(Transducer, FaceBoundsTheBeam)
{
  const Transducer transducer;
  for (const double way : {-5.0, 0.0, 0.5, 2.0}) {
    const BeamWidth width = WidthAt(transducer, way);
    EXPECT_LE(width.lateralSigma, transducer.lateralApertureMm / 5.0);
    EXPECT_LE(width.elevationSigma, transducer.elevationApertureMm / 5.0);
    EXPECT_GT(width.lateralSigma, 0.25 * transducer.WavelengthMm());
    EXPECT_LT(std::abs(width.lateralCurvature), 1.0 / transducer.WavelengthMm());
  }
}

TEST(Transducer, RefusesWhatIsOutOfRange)
{
  const auto refuses = [](const auto& change, const std::string& name) {
    Transducer transducer;
    change(transducer);
    try {
      CheckRanges(transducer);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("["), std::string::npos) << error.what();
    }
  };
  EXPECT_NO_THROW(CheckRanges(Transducer()));
  refuses([](Transducer& t) { t.frequencyMHz = 0.0; }, "FrequencyMHz");
  refuses([](Transducer& t) { t.bandwidth = 1.6; }, "Bandwidth");
  refuses([](Transducer& t) { t.lateralApertureMm = 0.0; }, "LateralApertureMm");
  refuses([](Transducer& t) { t.lateralFocusMm = std::nan(""); }, "LateralFocusMm");
  refuses([](Transducer& t) { t.smallestFNumber = 0.1; }, "SmallestFNumber");
  refuses([](Transducer& t) { t.elevationApertureMm = 1000.0; }, "ElevationApertureMm");
  refuses([](Transducer& t) { t.elevationFocusMm = -1.0; }, "ElevationFocusMm");
  refuses([](Transducer& t) { t.assumedSoundSpeed = 0.0; }, "AssumedSoundSpeed");
}
