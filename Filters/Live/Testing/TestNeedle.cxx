// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Live/LiveProbe.h"
#include "Filters/Live/Needle.h"
#include "Filters/Live/NeedlePath.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double notANumber = std::numeric_limits<double>::quiet_NaN();

// A flat array of 60 mm, 80 mm deep: beam b looks along z at x = -30 + 60 b / 120, sample s lies at 0.1 s mm.
struct Bench {
  PlacedProbe probe{ProbeGeometry::Linear(60.0, 0.0, 0.0, 80.0), Pose::Identity()};
  BeamThickness thickness{2.0, 40.0, 0.0, 5};
  MachineControls controls;
  NeedleLook look;
  Volume<float> value{{801, 121, 1}, 0.0f};
  Volume<unsigned char> content;

  NeedleSight Draw(const Vector3d& tip, const Vector3d& direction)
  {
    return DrawNeedle(look, {tip, direction.normalized()}, probe, thickness, controls, value.View(), content.View());
  }
  float At(double x, double depth) const
  {
    return value.View()(static_cast<int>(std::lround(depth * 10)), static_cast<int>(std::lround((x + 30.0) * 2)), 0);
  }
  float Brightest(double x) const
  {
    float brightest = 0.0f;
    for (int s = 0; s < 801; ++s)
      brightest = std::max(brightest, At(x, 0.1 * s));
    return brightest;
  }
  // What a level of dB becomes.
  double Grey(double db) const { return 255.0 * std::min(1.0, std::max(0.0, 1.0 + db / controls.dynamicRangeDb)); }
};

} // namespace

TEST(Needle, IsBrightSquareToTheBeamWhereItLies)
{
  Bench bench;
  bench.look.echoDb = -10.0;
  const NeedleSight sight = bench.Draw({10, 0, 40}, {1, 0, 0});
  for (const double x : {-25.0, 0.0, 9.5})
    EXPECT_NEAR(bench.At(x, 40.0), bench.Grey(-10.0), 0.5) << x;
  EXPECT_NEAR(bench.At(0.0, 39.7), bench.Grey(-10.0 - 6.0206), 0.5); // half of the pulse's width off: half of its amplitude
  EXPECT_EQ(bench.At(0.0, 38.0), 0.0f);
  EXPECT_EQ(bench.At(13.0, 40.0), 0.0f); // before the tip
  EXPECT_TRUE(sight.tipInPlane);
  EXPECT_NEAR(sight.seenMm, 40.0, 0.2); // 30 mm and 10 mm of the fan; the rest of the shaft is beside it
  EXPECT_NEAR(sight.strongestDb, -10.0, 1e-9);
}

TEST(Needle, FadesWithTheThicknessOfThePlane)
{
  for (const double y : {0.0, 0.5, 1.0, -1.0, 2.0}) {
    Bench bench;
    bench.look.echoDb = -10.0;
    const NeedleSight sight = bench.Draw({10, y, 40}, {1, 0, 0});
    // 2 mm of full width at half of the amplitude.
    EXPECT_NEAR(bench.At(0.0, 40.0), bench.Grey(-10.0 - 6.0206 * y * y), 0.5) << y;
    EXPECT_EQ(sight.tipInPlane, std::abs(y) <= 1.0);
    EXPECT_DOUBLE_EQ(sight.tipOffPlaneMm, y);
  }
  Bench bench; // the plane is wider away from its focus
  bench.thickness = {2.0, 20.0, 0.1, 5};
  bench.look.echoDb = -10.0;
  bench.Draw({10, 1.5, 60}, {1, 0, 0});
  EXPECT_NEAR(bench.At(0.0, 60.0), bench.Grey(-10.0 - 6.0206 * 1.5 * 1.5 * 4.0 / 20.0), 0.5);
}

TEST(Needle, IsNotSeenOutOfThePlane)
{
  Bench bench;
  const NeedleSight sight = bench.Draw({10, 8, 40}, {1, 0, 0});
  for (const float grey : bench.value.View())
    ASSERT_EQ(grey, 0.0f);
  EXPECT_EQ(sight.seenMm, 0.0);
  EXPECT_FALSE(sight.tipInPlane);
  const NeedleSight behind = bench.Draw({0, 0, -5}, {0, 0, 1}); // above the face
  EXPECT_EQ(behind.seenMm, 0.0);
  EXPECT_FALSE(behind.tipInPlane);
}

TEST(Needle, AcrossThePlaneIsADotThatMayBeTakenForTheTip)
{
  Bench bench;
  bench.look.reverberationMm = 0.0;
  const NeedleSight sight = bench.Draw({0, 30, 40}, {0, 1, 0});
  EXPECT_GT(bench.At(0.0, 40.0), 250.0f);
  EXPECT_EQ(bench.At(4.0, 40.0), 0.0f);
  EXPECT_NEAR(sight.seenMm, 2.0, 0.11);
  EXPECT_FALSE(sight.tipInPlane);
  EXPECT_FALSE(sight.tip);
}

TEST(Needle, FadesByItsAngleToTheBeam)
{
  double before = 1e9;
  for (const double degrees : {0.0, 5.0, 10.0, 20.0, 30.0}) {
    Bench bench;
    bench.look.echoDb = -5.0;
    bench.look.roughDb = -50.0;
    bench.look.reverberationMm = 0.0;
    const double angle = degrees * RadiansPerDegree;
    const NeedleSight sight = bench.Draw({10, 0, 45}, {std::cos(angle), 0, std::sin(angle)});
    const double expected = std::max(-5.0 - 20.0 * std::log10(std::exp(0.5 * std::pow(degrees / 12.0, 2))), -50.0);
    EXPECT_NEAR(sight.strongestDb, expected, 1e-6);
    EXPECT_NEAR(bench.Brightest(0.0), bench.Grey(expected), 1.0) << degrees;
    EXPECT_LT(bench.Brightest(0.0), before);
    before = bench.Brightest(0.0);
  }
  Bench steep; // along a beam: hardly seen
  steep.look.roughDb = -40.0;
  EXPECT_NEAR(steep.Draw({0, 0, 60}, {0, 0, 1}).strongestDb, -40.0, 1e-9);
  EXPECT_NEAR(steep.At(0.0, 30.0), steep.Grey(-40.0), 1.0);
  EXPECT_EQ(steep.At(0.0, 62.0), 0.0f);
}

TEST(Needle, SquareMeansSquareToEachBeamOfAFan)
{
  // A horizontal needle under a convex probe is square to the middle beam alone.
  PlacedProbe probe{ProbeGeometry::Convex(1.2, 50.0, 0.0, 50.0, 0.0, 100.0), Pose::Identity()};
  Volume<float> value({501, 101, 1}, 0.0f);
  NeedleLook look;
  look.echoDb = -5.0;
  look.reverberationMm = 0.0;
  DrawNeedle(look, {{40, 0, 50}, {1, 0, 0}}, probe, {}, {}, value.View());
  const auto brightest = [&](int beam) { return *std::max_element(value.View().Row(beam, 0), value.View().Row(beam, 0) + 501); };
  // 15 of 100 beams are 0.18 radians aside; neighbours nearer to the middle lend a little.
  const double fading = 20.0 * std::log10(std::exp(0.5 * std::pow(0.18 * DegreesPerRadian / 12.0, 2)));
  EXPECT_NEAR(brightest(50) - brightest(65), 255.0 * fading / 60.0, 1.0);
  EXPECT_NEAR(brightest(40), brightest(60), 0.5);
}

TEST(Needle, RingsBelowTheLessTheMoreItIsTilted)
{
  Bench bench;
  bench.look.echoDb = -5.0;
  bench.look.reverberationMm = 3.0;
  bench.look.reverberationDb = -8.0;
  bench.Draw({10, 0, 40}, {1, 0, 0});
  for (const int ring : {1, 2, 3})
    EXPECT_NEAR(bench.At(0.0, 40.0 + 3.0 * ring), bench.Grey(-5.0 - 8.0 * ring), 0.5) << ring;
  EXPECT_EQ(bench.At(0.0, 41.5), 0.0f);

  Bench tilted;
  tilted.look = bench.look;
  const double angle = 10.0 * RadiansPerDegree;
  tilted.Draw({10, 0, 40 + 10 * std::tan(angle)}, {std::cos(angle), 0, std::sin(angle)});
  const double fading = 20.0 * std::log10(std::exp(0.5 * std::pow(10.0 / 12.0, 2)));
  EXPECT_NEAR(tilted.At(0.0, 40.0), tilted.Grey(-5.0 - fading), 1.5);
  EXPECT_NEAR(tilted.At(0.0, 46.0), tilted.Grey(-5.0 - 5.0 * fading - 16.0), 3.0); // two rings: 1 + 2^2 of the tilt
}

TEST(Needle, CastsAShadowAndAddsPowers)
{
  Bench bench;
  bench.look.reverberationMm = 0.0;
  bench.look.echoDb = -20.0;
  bench.look.shadowDb = 12.0;
  for (float& grey : bench.value.View())
    grey = static_cast<float>(bench.Grey(-20.0));
  bench.Draw({10, 0, 40}, {1, 0, 0});
  EXPECT_NEAR(bench.At(0.0, 30.0), bench.Grey(-20.0), 0.1);
  EXPECT_NEAR(bench.At(0.0, 40.0), bench.Grey(-20.0 + 3.0103), 0.1);
  EXPECT_NEAR(bench.At(0.0, 60.0), bench.Grey(-32.0), 0.1);
  EXPECT_NEAR(bench.At(15.0, 60.0), bench.Grey(-20.0), 0.1);
  Bench off; // half out of the plane: half of the shadow
  off.look = bench.look;
  for (float& grey : off.value.View())
    grey = static_cast<float>(off.Grey(-20.0));
  off.Draw({10, 1, 40}, {1, 0, 0});
  EXPECT_NEAR(off.At(0.0, 60.0), off.Grey(-26.0), 0.1);
}

TEST(Needle, FollowsTheMachinesGain)
{
  Bench bench;
  bench.look.echoDb = -30.0;
  bench.look.roughDb = -60.0;
  bench.controls.gainDb = 4.0;
  bench.controls.dynamicRangeDb = 50.0;
  bench.controls.tgcDb = {0, 0, 0, 0, 7, 7, 7, 7}; // linear between, all over the depths
  bench.Draw({10, 0, 40}, {1, 0, 0});
  EXPECT_NEAR(bench.At(0.0, 40.0), bench.Grey(-30.0 + 4.0 + 3.5), 0.5);
}

TEST(Needle, TipIsShownOnlyWhenAllowed)
{
  Bench hidden, shown;
  shown.look.showTip = true;
  const Vector3d tip{0, 0, 50}, steep = Vector3d(0.2, 0, 1).normalized();
  EXPECT_FALSE(hidden.Draw(tip, steep).tip);
  const NeedleSight sight = shown.Draw(tip, steep);
  ASSERT_TRUE(sight.tip);
  EXPECT_NEAR(sight.tip->depth, 50.0, 1e-9);
  EXPECT_NEAR(sight.tip->fan, 0.0, 1e-9);
  EXPECT_NEAR(shown.At(0.0, 50.0), shown.Grey(0.0), 1.0);
  EXPECT_NEAR(hidden.At(0.0, 50.0), hidden.Grey(-28.0), 1.0);
  EXPECT_FALSE(shown.Draw({0, 3, 50}, steep).tip); // out of the plane
}

TEST(Needle, IsTheStrongestOfManyFinePoints)
{
  // A fan, and a needle whose angle to the beams goes from nearly square to nearly along them.
  const PlacedProbe probe{ProbeGeometry::Convex(1.2, 50.0, 0.0, 50.0, 0.0, 100.0), Pose::Identity()};
  constexpr int samples = 401, beams = 97;
  const double sigma = 0.42466090014400953, sampleMm = 100.0 / (samples - 1);
  NeedleLook look;
  look.echoDb = -4.0;
  look.roughDb = -20.0;
  look.reverberationMm = look.shadowDb = 0.0;
  look.lengthMm = 120.0;
  for (const double degrees : {3.0, 40.0, 80.0}) {
    const double angle = degrees * RadiansPerDegree;
    const Needle needle{{8, 0, 70}, {std::cos(angle), 0, std::sin(angle)}};
    Volume<float> value({samples, beams, 1}, 0.0f), reference({samples, beams, 1}, -60.0f);
    DrawNeedle(look, needle, probe, {}, {}, value.View());
    for (double passed = 0.0; passed <= look.lengthMm; passed += 0.02) {
      const auto at = BeamPointAt(probe.geometry, needle.tip - passed * needle.direction);
      if (!at)
        continue;
      const double off = std::asin(needle.direction.dot(DirectionOf(probe.geometry, *at))) * DegreesPerRadian / 12.0;
      const double level = std::max(-4.0 - 10.0 / std::log(10.0) * off * off, -20.0);
      const double beamMm = probe.geometry.Fan().Span(at->depth) / (beams - 1), width = std::max(1.2 * sigma, 0.5 * beamMm);
      for (int b = 0; b < beams; ++b) {
        const double aside = (b - (at->fan + 0.5) * (beams - 1)) * beamMm / width;
        for (int s = 0; s < samples && std::abs(aside) < 3.0; ++s) {
          const double below = (s * sampleMm - at->depth) / (0.6 * sigma);
          float& best = reference.View()(s, b, 0);
          if (std::abs(below) < 3.0)
            best = std::max(best, static_cast<float>(level - 10.0 / std::log(10.0) * (aside * aside + below * below)));
        }
      }
    }
    int bright = 0;
    for (std::ptrdiff_t n = 0; n < value.View().Size(); ++n) {
      const double expected = 255.0 * std::max(0.0, 1.0 + reference.View()[n] / 60.0);
      if (reference.View()[n] < -30.0) // 10 dB or more below the ridge, where half a dB is less than can be seen
        continue;
      // To half a dB.
      ASSERT_NEAR(value.View()[n], expected, 2.0) << degrees << " degrees, beam " << n / samples << ", sample " << n % samples;
      ++bright;
    }
    EXPECT_GT(bright, 200);
    for (std::ptrdiff_t n = 0; n < value.View().Size(); ++n)
      ASSERT_TRUE(value.View()[n] < 100.0f || reference.View()[n] > -42.0f) << "nothing is bright where no point is";
  }
}

TEST(Needle, CrossesTheSeamOfAFanThatLooksAllRound)
{
  LiveProbeSettings settings;
  settings.kind = LiveProbe::Radial;
  constexpr int samples = 200, beams = 64;
  const PlacedProbe probe{GeometryOf(settings, beams), Pose::Identity()};
  const double radius = probe.geometry.fanWidth / probe.geometry.fanAngle;
  // The seam lies straight behind the middle of the catheter, which is at z = -radius; in front of it is the middle of the fan.
  Volume<float> behind({samples, beams, 1}, 40.0f), before = behind;
  const NeedleSight seen = DrawNeedle({}, {{7, 0, -radius - 12}, {1, 0, 0}}, probe, {}, {}, behind.View());
  const NeedleSight same = DrawNeedle({}, {{-7, 0, -radius + 12}, {-1, 0, 0}}, probe, {}, {}, before.View());
  EXPECT_NEAR(seen.seenMm, same.seenMm, 1e-9);
  double brightest = 0.0;
  for (int b = 0; b < beams; ++b)
    for (int s = 0; s < samples; ++s) {
      ASSERT_NEAR(behind.View()(s, b, 0), before.View()(s, (b + beams / 2) % beams, 0), 0.01) << b << " " << s;
      if (b == 0 || b == beams - 1)
        brightest = std::max<double>(brightest, behind.View()(s, b, 0));
    }
  EXPECT_GT(brightest, 200.0);
  // A tip between the last beam and the first is in the plane, too.
  NeedleLook shown;
  shown.showTip = true;
  EXPECT_TRUE(DrawNeedle(shown, {{0, 0, -radius - 12}, {1, 0, 0}}, probe, {}, {}, behind.View()).tip);
  // A fan that does not close has an end there.
  PlacedProbe open = probe;
  open.geometry.fanAngle *= 0.9;
  open.geometry.fanWidth *= 0.9;
  EXPECT_FALSE(DrawNeedle(shown, {{0, 0, -radius - 12}, {1, 0, 0}}, open, {}, {}, behind.View()).tip);
}

TEST(Needle, IsTheSameOnAnyNumberOfThreads)
{
  Bench one, many;
  {
    const ThreadLimit limit(1);
    one.Draw({10, 0.2, 40}, {1, 0.01, 0.1});
  }
  many.Draw({10, 0.2, 40}, {1, 0.01, 0.1});
  EXPECT_TRUE(std::equal(one.value.View().begin(), one.value.View().end(), many.value.View().begin()));
}

TEST(Needle, IsNotDrawnWhereThereIsNoImage)
{
  Bench bench;
  bench.content = Volume<unsigned char>({801, 121, 1}, 1);
  for (int s = 0; s < 801; ++s)
    bench.content.View()(s, 60, 0) = 0;
  bench.Draw({10, 0, 40}, {1, 0, 0});
  EXPECT_EQ(bench.At(0.0, 40.0), 0.0f);
  EXPECT_GT(bench.At(0.5, 40.0), 200.0f);
}

TEST(Needle, MovesWithTheWorld)
{
  Bench here, there;
  const Pose moved = MotionAbout({1, 2, 3}, {0.4, -0.3, 1.0}, {100, -50, 20});
  here.Draw({10, 0.3, 40}, {1, 0.01, 0.1});
  there.probe.probeToWorld = moved;
  there.Draw(moved * Vector3d(10, 0.3, 40), moved.linear() * Vector3d(1, 0.01, 0.1));
  for (std::ptrdiff_t n = 0; n < here.value.View().Size(); ++n)
    ASSERT_NEAR(here.value.View()[n], there.value.View()[n], 1e-2);
}

TEST(Needle, RefusesWhatIsNone)
{
  Bench bench;
  EXPECT_THROW(bench.Draw({notANumber, 0, 0}, {1, 0, 0}), Error);
  EXPECT_THROW(bench.Draw({0, 0, 0}, {0, 0, 0}), Error);
  Pose sheared = Pose::Identity();
  sheared.matrix()(0, 1) = 0.5;
  EXPECT_THROW(Needle::Of(sheared), Error);
  EXPECT_EQ(Needle::Of(MotionAbout({0, 0, 0}, {Pi / 2, 0, 0}, {1, 2, 3})).tip, Vector3d(1, 2, 3));
  EXPECT_LT((Needle::Of(MotionAbout({0, 0, 0}, {Pi / 2, 0, 0}, {1, 2, 3})).direction - Vector3d(0, -1, 0)).norm(), 1e-12);
  bench.probe.probeToWorld = sheared;
  EXPECT_THROW(bench.Draw({0, 0, 10}, {1, 0, 0}), Error);
  bench.probe = {ProbeGeometry::Linear(60.0, 20.0, 0.0, 80.0), Pose::Identity()};
  EXPECT_THROW(bench.Draw({0, 0, 10}, {1, 0, 0}), Error);
  bench = Bench();
  bench.content = Volume<unsigned char>({801, 120, 1}, 1);
  EXPECT_THROW(bench.Draw({0, 0, 10}, {1, 0, 0}), Error);
  bench = Bench();
  bench.look.widthMm = 0.0;
  EXPECT_THROW(bench.Draw({0, 0, 10}, {1, 0, 0}), Error);
}

TEST(NeedlePath, StopsAtBone)
{
  const NeedleObstacle bone = [](const Vector3d& p) { return p[2] > 30.0 && p[2] < 34.0; };
  const NeedleAdvance advance = AdvanceTip({0, 0, 10}, {0, 0, 60}, bone);
  EXPECT_TRUE(advance.stopped);
  EXPECT_NEAR(advance.freeMm, 20.0, 0.01);
  EXPECT_LE(advance.freeMm, 20.0);
  const NeedleAdvance oblique = AdvanceTip({0, 0, 10}, {40, 0, 50}, bone);
  EXPECT_NEAR(oblique.freeMm, 20.0 * std::sqrt(2.0), 0.01);
  EXPECT_FALSE(AdvanceTip({0, 0, 10}, {0, 0, 29.9}, bone).stopped);
  EXPECT_DOUBLE_EQ(AdvanceTip({0, 0, 10}, {0, 0, 29.9}, bone).freeMm, 19.9);
  EXPECT_FALSE(AdvanceTip({0, 0, 10}, {0, 0, 60}, {}).stopped);
  // In bone already: no further in, but back out.
  EXPECT_TRUE(AdvanceTip({0, 0, 32}, {0, 0, 33}, bone).stopped);
  EXPECT_EQ(AdvanceTip({0, 0, 32}, {0, 0, 33}, bone).freeMm, 0.0);
  EXPECT_FALSE(AdvanceTip({0, 0, 32}, {0, 0, 20}, bone).stopped);
  EXPECT_THROW(AdvanceTip({0, 0, notANumber}, {0, 0, 20}, bone), Error);
  EXPECT_THROW(AdvanceTip({0, 0, 0}, {0, 0, 2000}, bone), Error);
  EXPECT_THROW(AdvanceTip({0, 0, 0}, {0, 0, 20}, bone, 0.0), Error);
}

TEST(NeedlePath, StopsWhereAVolumeIsBrightButNotAtItsGrain)
{
  // 1 mm voxels: tissue of 90 with single white voxels, and bone of 240 from z = 30 on.
  Volume<unsigned char> voxels({40, 40, 60}, 90);
  for (int k = 0; k < 60; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i)
        if (k >= 30 || (i % 4 == 0 && j % 4 == 0 && k % 4 == 0))
          voxels.View()(i, j, k) = k >= 30 ? 240 : 255;
  ImageGeometry grid;
  grid.dimensions = voxels.Dimensions();
  BeamVolumes volumes;
  volumes.Add<unsigned char>({voxels.View(), {}, grid});
  const NeedleObstacle bone = BrighterThan(volumes, 200.0);
  const NeedleAdvance advance = AdvanceTip({20, 20, -10}, {20, 20, 50}, bone); // through the white voxels, from outside
  EXPECT_TRUE(advance.stopped);
  EXPECT_NEAR(advance.freeMm, 39.7, 0.5); // linear from 90 at 29 mm to 240 at 30 mm: 200 at 29.7 mm
  EXPECT_FALSE(AdvanceTip({20, 20, -10}, {20, 20, 28}, bone).stopped);
  EXPECT_FALSE(AdvanceTip({100, 20, -10}, {100, 20, 50}, bone).stopped); // beside it
  EXPECT_THROW(BrighterThan(volumes, 200.0, {}, 0.0), Error);

  // What is not seen stops nothing: bone that embedding invented.
  Volume<unsigned char> labels(voxels.Dimensions(), 1);
  for (int k = 29; k < 60; ++k)
    for (int j = 0; j < 40; ++j)
      std::fill_n(labels.View().Row(j, k), 40, static_cast<unsigned char>(3));
  BeamVolumes embedded;
  embedded.Add<unsigned char>({voxels.View(), {}, grid}, labels.View());
  VolumeMix hidden;
  hidden.showInvented = false;
  EXPECT_TRUE(AdvanceTip({20, 20, -10}, {20, 20, 50}, BrighterThan(embedded, 200.0)).stopped);
  EXPECT_FALSE(AdvanceTip({20, 20, -10}, {20, 20, 50}, BrighterThan(embedded, 200.0, hidden)).stopped);
}

TEST(NeedleTrack, CountsTurnsWithinTheBodyOnly)
{
  NeedleTrack track({0, 0, 50});
  double seconds = 0.0;
  const auto add = [&](double degrees, bool inside) {
    const double angle = degrees * RadiansPerDegree;
    track.Add({seconds, {{0, 0, 45}, {std::sin(angle), 0, std::cos(angle)}}, inside, true, false});
    seconds += 0.05;
  };
  const auto hold = [&](double degrees, bool inside) {
    for (int n = 0; n < 20; ++n)
      add(degrees, inside);
  };
  hold(0.0, false);
  hold(40.0, false); // aiming is free
  hold(40.0, true);
  hold(44.0, true); // less than 5 degrees
  EXPECT_EQ(track.Score().redirections, 0);
  for (int n = 0; n <= 20; ++n)
    add(44.0 - n, true); // one slow turn of 20 degrees
  hold(24.0, true);
  EXPECT_EQ(track.Score().redirections, 1);
  hold(34.0, true);
  EXPECT_EQ(track.Score().redirections, 2);
  for (int n = 0; n < 40; ++n)
    add(34.0 + (n % 2 ? 1.0 : -1.0), true); // a tremor
  EXPECT_EQ(track.Score().redirections, 2);
  hold(34.0, false);
  hold(60.0, true); // out, and in again
  EXPECT_EQ(track.Score().redirections, 2);
  EXPECT_EQ(track.Score().passes, 2);
}

TEST(NeedleTrack, TimesAndDistances)
{
  NeedleTrack track({3, 4, 50});
  const auto moment = [](double seconds, double z, bool inside, bool inPlane, bool stopped = false) {
    return NeedleTrack::Moment{seconds, {{3, 0, z}, {0, 0, 1}}, inside, inPlane, stopped};
  };
  track.Add(moment(0.0, 0, false, false));
  track.Add(moment(0.25, 10, true, false));
  track.Add(moment(0.5, 50, true, true));
  track.Add(moment(0.75, 53, true, true, true));
  track.Add(moment(1.0, 53, true, false, true)); // still there: one stop
  track.Add(moment(9.0, 53, true, true));        // a pause
  track.Add(moment(9.25, 53, false, true));
  track.Add(moment(9.5, 0, false, false));
  EXPECT_DOUBLE_EQ(track.Score().insideSeconds, 1.0);
  EXPECT_DOUBLE_EQ(track.Score().offPlaneSeconds, 0.25);
  EXPECT_DOUBLE_EQ(track.Score().nearestMm, 4.0);
  EXPECT_DOUBLE_EQ(track.Score().targetMm, std::hypot(4.0, 50.0));
  EXPECT_EQ(track.Score().stops, 1);
  EXPECT_THROW(track.Add(moment(9.4, 0, false, false)), Error);
  EXPECT_THROW(track.Add(moment(notANumber, 0, false, false)), Error);
  EXPECT_THROW(track.Add(moment(10.0, notANumber, false, false)), Error);
  EXPECT_EQ(track.Score().stops, 1);
  EXPECT_THROW(NeedleTrack({notANumber, 0, 0}), Error);
  EXPECT_THROW(NeedleTrack({0, 0, 0}, {0.0, 0.3, 0.5}), Error);
}
