// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "SpeckleTools.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

double RelativeDifference(const Row& row, const std::vector<std::complex<double>>& exact)
{
  double difference = 0.0, all = 0.0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    difference += std::norm(std::complex<double>(row[i]) - exact[i]);
    all += std::norm(exact[i]);
  }
  return std::sqrt(difference / all);
}

double RelativeDifference(const Row& row, const Row& other)
{
  return RelativeDifference(row, std::vector<std::complex<double>>(other.begin(), other.end()));
}

const DepthAxis axis{30.0, 0.1, 401}; // 30 to 70 mm

} // namespace

TEST(EchoSum, IsTheSumByItsDefinition)
{
  const Transducer transducer;
  SoundSegment segment = Beam({1.0, 2.0, 0.0}, {0.3, -0.2, 1.0}, 25.0, 50.0);
  segment.attenuation = 0.01;
  segment.amplitude = 0.7;
  segment.scanDepthPerMm = 0.95;
  const Scatterers scatterers = HeardBy({segment}, transducer, Tissue(2.0));
  for (const double reach : {2.0, 3.0})
    EXPECT_LT(RelativeDifference(RowOf(segment, scatterers, transducer, axis, reach),
                                 ExactRow(segment, ListOf(scatterers), transducer, axis, reach)),
              0.01)
        << reach;
}

TEST(EchoSum, NearTheFaceToo)
{
  const Transducer transducer;
  const SoundSegment segment = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 0.0, 30.0);
  const Scatterers scatterers = HeardBy({segment}, transducer, Tissue(4.0));
  const DepthAxis nearAxis{0.0, 0.1, 301};
  EXPECT_LT(RelativeDifference(RowOf(segment, scatterers, transducer, nearAxis),
                               ExactRow(segment, ListOf(scatterers), transducer, nearAxis, beamReach)),
            0.03);
}

TEST(EchoSum, PiecesOfAWayMakeTheWhole)
{
  const Transducer transducer;
  const SoundSegment whole = Beam(Vector3d::Zero(), {0.1, 0.2, 1.0}, 25.0, 50.0);
  const Scatterers scatterers = HeardBy({whole}, transducer, Tissue(4.0));
  Row sum(static_cast<std::size_t>(axis.count));
  double done = 0.0;
  for (const double length : {0.3, 7.7, 0.001, 21.0, 20.999}) {
    SoundSegment piece = whole;
    piece.from += done * whole.direction;
    piece.length = length;
    piece.way += done;
    piece.scanDepth += done;
    AddSegmentEchoes(piece, scatterers, transducer, axis, sum.data());
    done += length;
  }
  ASSERT_NEAR(done, 50.0, 1e-9);
  EXPECT_LT(RelativeDifference(sum, RowOf(whole, scatterers, transducer, axis)), 0.005);
}

TEST(EchoSum, RowsOfBeamsKnowNothingOfEachOther)
{
  const Transducer transducer;
  // Two pieces far apart, one beyond the axis, then another beam: what was moved out is gone.
  const SoundSegment first = Beam(Vector3d::Zero(), {0.1, 0.2, 1.0}, 31.0, 4.0),
                     second = Beam({3.0, 0.0, 0.0}, {0.1, 0.2, 1.0}, 60.0, 20.0),
                     other = Beam({1.0, -2.0, 0.0}, {-0.1, 0.1, 1.0}, 25.0, 30.0);
  const Scatterers scatterers = HeardBy({first, second, other}, transducer, Tissue(2.0));
  EchoSum sum(scatterers, transducer, axis);
  for (int round = 0; round < 2; ++round) {
    Row both(static_cast<std::size_t>(axis.count)), apart = both, one = both;
    sum.Add(first);
    sum.Add(second);
    sum.MoveTo(both.data());
    AddSegmentEchoes(first, scatterers, transducer, axis, apart.data());
    AddSegmentEchoes(second, scatterers, transducer, axis, apart.data());
    EXPECT_LT(RelativeDifference(both, apart), 1e-6);
    sum.Add(other);
    sum.MoveTo(one.data());
    EXPECT_EQ(one, RowOf(other, scatterers, transducer, axis));
    const Row before = one;
    sum.MoveTo(one.data());
    EXPECT_EQ(one, before);
  }
}

TEST(EchoSum, KeepsItsPhaseFarFromTheOrigin)
{
  Transducer transducer;
  transducer.frequencyMHz = 15.0;
  const SoundSegment here = Beam(Vector3d::Zero(), {0.1, 0.2, 1.0}, 25.0, 50.0);
  SoundSegment there = here;
  const Vector3d far(1e6, -1e6, 1e6);
  there.from += far;
  Random random(3);
  std::vector<Vector3d> points, farPoints;
  std::vector<float> amplitudes;
  for (int i = 0; i < 3000; ++i) {
    points.push_back(here.from + random.Uniform(0.0, 50.0) * here.direction +
                     Vector3d(random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0)));
    farPoints.push_back(points.back() + far);
    amplitudes.push_back(static_cast<float>(random.Normal()));
  }
  EXPECT_LT(RelativeDifference(RowOf(there, Scatterers::At(farPoints, amplitudes), transducer, axis),
                               RowOf(here, Scatterers::At(points, amplitudes), transducer, axis)),
            0.004);
}

TEST(EchoSum, RigidMotionOfTheMaterialIsMotionOfTheImage)
{
  ImageGeometry lattice;
  lattice.dimensions = {16, 16, 20};
  lattice.origin = {-75.0, -75.0, -40.0};
  lattice.spacing = {10.0, 10.0, 10.0};
  const Vector3d by(4.0, -3.0, 6.0);
  const DisplacementField shift(lattice, std::vector<Vector3d>(16 * 16 * 20, by));
  const Transducer transducer;
  const SoundSegment rest = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 30.0, 40.0);
  SoundSegment moved = rest;
  moved.from += by;
  ScattererParameters parameters;
  parameters.displacement = &shift;
  const Row a = RowOf(rest, HeardBy({rest}, transducer, Tissue(6.0)), transducer, axis);
  const Row b = RowOf(moved, HeardBy({moved}, transducer, Tissue(6.0), parameters), transducer, axis);
  EXPECT_LT(RelativeDifference(b, a), 1e-3);
  // Unmoved beams see other speckle.
  EXPECT_GT(RelativeDifference(RowOf(rest, HeardBy({rest}, transducer, Tissue(6.0), parameters), transducer, axis), a), 0.9);
}

TEST(EchoSum, SpeckleOfTheReferenceHasPowerOneAtEveryDepth)
{
  const Transducer transducer;
  const Material tissue = Tissue(4.0);
  for (const double perMm : {1.0, 0.8}) {
    std::vector<SoundSegment> beams;
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) {
        beams.push_back(Beam({5.0 * i, 7.0 * j, 0.0}, Vector3d::UnitZ(), 20.0, 100.0));
        beams.back().scanDepthPerMm = perMm;
      }
    const Scatterers scatterers = HeardBy(beams, transducer, tissue);
    const DepthAxis deep{20.0, 0.137, 600};
    double power[3] = {}, count[3] = {};
    for (const SoundSegment& beam : beams) {
      const Row row = RowOf(beam, scatterers, transducer, deep);
      for (std::size_t i = 20; i < 560; ++i) {
        power[(i - 20) / 180] += static_cast<double>(std::norm(row[i]));
        count[(i - 20) / 180] += 1.0;
      }
    }
    for (int part = 0; part < 3; ++part)
      EXPECT_NEAR(power[part] / count[part], 1.0, 0.07) << part; // 64 x 60 or so independent samples
  }
}

TEST(EchoSum, AttenuationHasItsSlope)
{
  const Transducer transducer;
  Material tissue = Tissue(4.0);
  tissue.attenuation = 0.7;
  tissue.attenuationPower = 1.0;
  SoundSegment clear = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 30.0, 40.0), lossy = clear;
  lossy.attenuation = 2.0 * tissue.AttenuationDbPerMm(transducer.frequencyMHz) * std::log(10.0) / 20.0;
  const Scatterers scatterers = HeardBy({clear}, transducer, tissue);
  const Row a = RowOf(clear, scatterers, transducer, axis), b = RowOf(lossy, scatterers, transducer, axis);
  double xx = 0.0, xy = 0.0;
  for (int i = 10; i < 391; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const double cm = 0.1 * (axis.first + i * axis.step - 30.0), weight = static_cast<double>(std::norm(a[n]));
    const double db = 10.0 * std::log10(static_cast<double>(std::norm(b[n])) / weight);
    xx += weight * cm * cm;
    xy += weight * cm * db;
  }
  // dB per cm of tissue (one way) and MHz.
  EXPECT_NEAR(-xy / xx / (2.0 * transducer.frequencyMHz), 0.7, 0.01);
}

TEST(EchoSum, NegativeAmplitudesTurnThePhase)
{
  const Transducer transducer;
  SoundSegment segment = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 30.0, 40.0);
  const Scatterers scatterers = HeardBy({segment}, transducer, Tissue(2.0));
  const Row plus = RowOf(segment, scatterers, transducer, axis);
  segment.amplitude = -1.0;
  Row sum = RowOf(segment, scatterers, transducer, axis);
  for (std::size_t i = 0; i < sum.size(); ++i)
    EXPECT_LT(std::abs(sum[i] + plus[i]), 1e-3f);
}

TEST(EchoSum, SurfaceEchoIsAPulseWithItsPhase)
{
  const Transducer transducer;
  SurfaceEcho echo;
  echo.scanDepth = 43.21;
  echo.amplitude = -0.25;
  Row row(static_cast<std::size_t>(axis.count));
  AddSurfaceEcho(echo, transducer, axis, row.data(), 2.0);
  for (int i = 0; i < axis.count; ++i) {
    const double depth = axis.first + i * axis.step;
    const std::complex<double> expected = -0.5 * std::exp(-0.5 * std::pow((depth - 43.21) / transducer.PulseSigmaMm(), 2)) *
                                          std::exp(std::complex<double>(0.0, -transducer.PhasePerMm() * 43.21));
    EXPECT_LT(std::abs(std::complex<double>(row[static_cast<std::size_t>(i)]) - expected), 3e-4);
  }
  // Outside of the axis: nothing.
  for (const double depth : {-1e9, 0.0, 29.0, 71.0, 1e9}) {
    echo.scanDepth = depth;
    Row none(static_cast<std::size_t>(axis.count));
    AddSurfaceEcho(echo, transducer, axis, none.data());
    EXPECT_EQ(std::count(none.begin(), none.end(), std::complex<float>()), axis.count);
  }
}

TEST(EchoSum, SegmentsOutsideOfTheAxisAddNothing)
{
  const Transducer transducer;
  const SoundSegment inside = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 30.0, 40.0);
  const Scatterers scatterers = HeardBy({inside}, transducer, Tissue(2.0));
  for (const double depth : {-1e8, -200.0, 500.0, 1e8}) {
    SoundSegment outside = inside;
    outside.scanDepth = depth;
    const Row row = RowOf(outside, scatterers, transducer, axis);
    EXPECT_EQ(std::count(row.begin(), row.end(), std::complex<float>()), axis.count) << depth;
  }
}

TEST(EchoSum, RefusesWhatIsWrong)
{
  const Transducer transducer;
  const SoundSegment segment = Beam(Vector3d::Zero(), Vector3d::UnitZ(), 30.0, 40.0);
  const Scatterers scatterers = Scatterers::At({{0.0, 0.0, 50.0}}, {1.0f});
  Row row(10);
  const auto kindOf = [&](const SoundSegment& s, const DepthAxis& a, double reach) {
    try {
      AddSegmentEchoes(s, scatterers, transducer, a, row.data(), reach);
    } catch (const Error& error) {
      return error.GetKind();
    }
    return Error::Kind::Cancelled;
  };
  EXPECT_EQ(kindOf(segment, {0.0, 0.0, 10}, 3.0), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf(segment, {0.0, std::nan(""), 10}, 3.0), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf(segment, {0.0, 0.1, 10}, 0.0), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf(segment, {0.0, 0.1, 10}, 7.0), Error::Kind::InvalidParameter);
  SoundSegment bad = segment;
  bad.from.x() = std::nan("");
  EXPECT_EQ(kindOf(bad, {0.0, 0.1, 10}, 3.0), Error::Kind::BadInput);
  bad = segment;
  bad.length = std::numeric_limits<double>::infinity();
  EXPECT_EQ(kindOf(bad, {0.0, 0.1, 10}, 3.0), Error::Kind::BadInput);
  EXPECT_EQ(std::count(row.begin(), row.end(), std::complex<float>()), 10);
}

TEST(EchoSum, HearsNothingBeyondItsTube)
{
  const Transducer transducer;
  const SoundSegment segment = Beam({1.0, 2.0, 3.0}, {0.3, -0.2, 1.0}, 5.0, 100.0);
  // Scatterers of the bricks around the tube alone give the row of those of the whole box.
  const VisitedSpace space = SpaceOf({segment}, transducer);
  const Scatterers all = Scatterers::Make({}, {Tissue(0.5)}, AllFirst, space.Box()),
                   some = HeardBy({segment}, transducer, Tissue(0.5));
  const DepthAxis deep{0.0, 0.1, 1001};
  EXPECT_LT(some.Count(), all.Count() / 2);
  EXPECT_LT(RelativeDifference(RowOf(segment, some, transducer, deep), RowOf(segment, all, transducer, deep)), 1e-5);
}
