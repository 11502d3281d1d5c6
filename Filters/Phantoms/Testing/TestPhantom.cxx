// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Phantoms/Phantom.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double degree = 0.017453292519943295;
constexpr double pi = 3.141592653589793;

// A small probe with few beams, so that tests are quick: about 40 x 30 x 30 mm.
PhantomParameters Small()
{
  PhantomParameters p;
  p.probe = ProbeGeometry::Convex(30 * degree, 40.0, 24 * degree, 35.0, 20.0, 50.0);
  p.scene = UniformScene();
  return p;
}

struct Made {
  ImageGeometry geometry;
  Volume<unsigned char> intensity, valid;
};

Made Make(const PhantomParameters& p)
{
  Made made;
  made.geometry = PhantomGeometry(p);
  made.intensity = Volume<unsigned char>(made.geometry.dimensions);
  made.valid = Volume<unsigned char>(made.geometry.dimensions);
  MakePhantom(p, made.intensity.View(), made.valid.View());
  return made;
}

bool Same(const Volume<unsigned char>& a, const Volume<unsigned char>& b)
{
  return a.Dimensions() == b.Dimensions() && std::equal(a.View().begin(), a.View().end(), b.View().begin());
}

double Power(const BeamEchoes& echoes, const Vector3d& point)
{
  const auto value = echoes.At(point);
  return value ? std::norm(*value) : std::numeric_limits<double>::quiet_NaN();
}

// Mean and standard deviation of a list.
struct Moments {
  double mean = 0.0, deviation = 0.0;
};
Moments MomentsOf(const std::vector<double>& values)
{
  double sum = 0.0, squares = 0.0;
  for (const double v : values)
    sum += v;
  const double mean = sum / static_cast<double>(values.size());
  for (const double v : values)
    squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / static_cast<double>(values.size()))};
}

double Correlation(const std::vector<double>& a, const std::vector<double>& b)
{
  const Moments ma = MomentsOf(a), mb = MomentsOf(b);
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i] - ma.mean) * (b[i] - mb.mean);
  return sum / (static_cast<double>(a.size()) * ma.deviation * mb.deviation);
}

// Seen from two poses, the correlation of the speckle's power (of which the mean is known and equal) at points of the world.
double SpeckleCorrelation(const PhantomParameters& p, const Pose& first, const Pose& second, const std::vector<Vector3d>& points)
{
  PhantomParameters a = p, b = p;
  a.probeToWorld = first;
  b.probeToWorld = second;
  const BeamEchoes one = SimulateEchoes(a), two = SimulateEchoes(b);
  std::vector<double> x, y;
  for (const Vector3d& point : points) {
    const double u = Power(one, first.inverse() * point), v = Power(two, second.inverse() * point);
    if (std::isfinite(u) && std::isfinite(v)) {
      x.push_back(u);
      y.push_back(v);
    }
  }
  EXPECT_EQ(x.size(), points.size());
  return Correlation(x, y);
}

std::string MessageOf(const PhantomParameters& p)
{
  try {
    PhantomGeometry(p);
    SimulateEchoes(p);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// The correlation of the complex echoes of two volumes that are seen from one place.
double EchoCorrelation(const BeamEchoes& a, const BeamEchoes& b)
{
  std::complex<double> product = 0.0;
  double powerA = 0.0, powerB = 0.0;
  const auto x = a.baseband.View(), y = b.baseband.View();
  for (std::ptrdiff_t i = 0; i < x.end() - x.begin(); ++i) {
    product += std::complex<double>(x[i]) * std::conj(std::complex<double>(y[i]));
    powerA += std::norm(x[i]);
    powerB += std::norm(y[i]);
  }
  return product.real() / std::sqrt(powerA * powerB);
}

double MeanPower(const BeamEchoes& echoes)
{
  double sum = 0.0;
  for (const std::complex<float>& value : echoes.baseband.View())
    sum += std::norm(value);
  return sum / static_cast<double>(echoes.baseband.View().end() - echoes.baseband.View().begin());
}

} // namespace

TEST(Phantom, PlantedChangeDecorrelatesTheEchoesByAsMuchAsStated)
{
  ECHORAMA_SKIP_SANITIZED();
  PhantomParameters p = Small();
  const BeamEchoes own = SimulateEchoes(p);
  for (const double decorrelation : {0.2, 0.6, 1.0}) {
    p.decorrelation = decorrelation;
    p.changeSeed = 1;
    const BeamEchoes first = SimulateEchoes(p), again = SimulateEchoes(p);
    p.changeSeed = 2;
    const BeamEchoes second = SimulateEchoes(p);
    EXPECT_TRUE(std::equal(first.baseband.View().begin(), first.baseband.View().end(), again.baseband.View().begin()));
    // The volume holds some 5000 cells of resolution.
    EXPECT_NEAR(EchoCorrelation(first, second), 1.0 - decorrelation, 0.04);
    EXPECT_NEAR(EchoCorrelation(first, own), std::sqrt(1.0 - decorrelation), 0.04);
    EXPECT_NEAR(MeanPower(first), 1.0, 0.05);
  }
}

TEST(Phantom, BodiesStayWhenTheSpeckleChanges)
{
  PhantomParameters p = Small();
  p.scene.inclusions.push_back({"cyst", Ellipsoid{{0, 0, 35}, {7, 7, 7}, {0, 0, 0}}, Inclusion::anechoicDb, 0, 0, 0});
  p.decorrelation = 1.0;
  p.changeSeed = 9;
  const BeamEchoes echoes = SimulateEchoes(p);
  EXPECT_LT(Power(echoes, {0, 0, 35}), 1e-3);
  EXPECT_LT(Power(echoes, {3, 0, 36}), 1e-3);
}

TEST(Phantom, APressedProbeSeesTissueAndBodiesWhereThePressPutsThem)
{
  // Bright grains in fluid: the centroid of each one's power is where it is seen.
  PhantomParameters p = Small();
  p.press.mm = 4.0;
  p.probeToWorld.translation() << 30, -20, 10;
  p.probeToWorld.linear() = ExpRotation({0.2, -0.3, 0.1});
  p.scene.inclusions.push_back({"fluid", Ellipsoid{p.probeToWorld.translation(), {200, 200, 200}, {0, 0, 0}}, -80, 0, 0, 0});
  const std::vector<Vector3d> grains{{0, 0, 28}, {7, 4, 38}, {-6, -3, 42}};
  for (const Vector3d& grain : grains)
    p.scene.inclusions.push_back({"grain", Ellipsoid{p.probeToWorld * grain, {1.2, 1.2, 1.2}, {0, 0, 0}}, 30, 0, 0, 0});
  p.scatterersPerMm3 = 6.0;
  const BeamEchoes echoes = SimulateEchoes(p);
  for (const Vector3d& grain : grains) {
    const Vector3d seen = p.press.Seen(grain);
    EXPECT_GT((seen - grain).norm(), 1.8);
    Vector3d sum = Vector3d::Zero();
    double weight = 0.0;
    for (double z = -4.0; z <= 4.0; z += 0.25)
      for (double y = -4.0; y <= 4.0; y += 0.5)
        for (double x = -4.0; x <= 4.0; x += 0.5)
          if (const auto value = echoes.At(seen + Vector3d(x, y, z))) {
            sum += std::norm(*value) * Vector3d(x, y, z);
            weight += std::norm(*value);
          }
    // A grain holds some 40 scatterers of random strength, so its centroid is not exactly its middle.
    EXPECT_LT((sum / weight).norm(), 0.6) << grain.transpose();
  }
}

TEST(Phantom, AShadowFollowsTheBodyThatAPressedProbeMoves)
{
  ECHORAMA_SKIP_SANITIZED();
  PhantomParameters p = Small();
  p.scene.inclusions.push_back({"stone", Ellipsoid{{0, 0, 28}, {3, 3, 1}, {0, 0, 0}}, 0, 0, 0, 20});
  p.press.mm = 6.0;
  const double top = p.press.Seen({0, 0, 27}).z(), bottom = p.press.Seen({0, 0, 29}).z();
  ASSERT_GT(top, 30.0);
  PhantomParameters clear = p;
  clear.shadows = false;
  const BeamEchoes dark = SimulateEchoes(p), bright = SimulateEchoes(clear);
  const auto lossDb = [&](double z) { return 10.0 * std::log10(Power(bright, {0, 0, z}) / Power(dark, {0, 0, z})); };
  // The middle of beams lies between samples, where interpolation mixes beams with slightly different ways.
  EXPECT_NEAR(lossDb(top - 0.5), 0.0, 1.0);
  EXPECT_NEAR(lossDb(bottom + 2.0), 20.0 * (bottom - top), 2.5);
}

TEST(Phantom, NoiseHasItsPowerAndItsSeed)
{
  PhantomParameters p = Small();
  p.scene.inclusions.push_back({"fluid", Ellipsoid{{0, 0, 0}, {200, 200, 200}, {0, 0, 0}}, Inclusion::anechoicDb, 0, 0, 0});
  p.noiseDb = -10.0;
  const BeamEchoes first = SimulateEchoes(p);
  EXPECT_NEAR(10.0 * std::log10(MeanPower(first)), -10.0, 0.1);
  p.changeSeed = 2;
  EXPECT_NEAR(EchoCorrelation(first, SimulateEchoes(p)), 0.0, 0.02);
  p.noiseDb = -120.0;
  EXPECT_LT(MeanPower(SimulateEchoes(p)), 1e-9);
}

TEST(Phantom, ARibShadowsItsShareOfTheFan)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const ProbeGeometry& probe : {Small().probe, ProbeGeometry::Linear(30.0, 20.0, 5.0, 40.0)})
    for (const double share : {0.2, 0.5}) {
      PhantomParameters p = Small();
      p.probe = probe;
      p.probeToWorld.linear() = ExpRotation({0.1, 0.4, -0.2});
      p.ribShare = share;
      const BeamEchoes echoes = SimulateEchoes(p);
      const auto view = echoes.baseband.View();
      const auto& n = echoes.baseband.Dimensions();
      int dark = 0;
      for (int beam = 0; beam < n[1]; ++beam) { // the middle plane, well behind the rib
        double power = 0.0;
        for (int d = 2 * n[0] / 3; d < n[0]; ++d)
          power += std::norm(view.Row(beam, n[2] / 2)[d]);
        dark += power / (n[0] - 2 * n[0] / 3) < 0.01 ? 1 : 0;
      }
      EXPECT_NEAR(static_cast<double>(dark) / n[1], share, 0.06) << share;
    }
}

TEST(Phantom, JetsAreThereInOneVolumeOnly)
{
  PhantomParameters p;
  EXPECT_EQ(p.WholeScene().inclusions.size(), DefaultScene().inclusions.size());
  p.jets = true;
  const PhantomScene with = p.WholeScene();
  EXPECT_NO_THROW(with.Check());
  const SceneLookup before(DefaultScene()), after(with);
  const Vector3d inVein(4, 20, 86), inTissue(12, -24, 58), elsewhere(-50, 10, 75);
  EXPECT_LT(before.EchogenicityAt(inVein), -100.0);
  EXPECT_GT(after.EchogenicityAt(inVein), 0.0);
  EXPECT_GT(after.EchogenicityAt(inTissue), before.EchogenicityAt(inTissue) + 5.0);
  EXPECT_EQ(after.EchogenicityAt(elsewhere), before.EchogenicityAt(elsewhere));
}

TEST(Phantom, TheSameSeedGivesTheSameBytes)
{
  ECHORAMA_SKIP_SANITIZED();
  PhantomParameters p = Small();
  p.scene = DefaultScene();
  const Made first = Make(p), second = Make(p);
  EXPECT_TRUE(Same(first.intensity, second.intensity));
  EXPECT_TRUE(Same(first.valid, second.valid));
  p.seed = 2;
  EXPECT_FALSE(Same(first.intensity, Make(p).intensity));
  p.seed = 1 + (std::uint64_t{1} << 40); // the upper half of the seed counts
  EXPECT_FALSE(Same(first.intensity, Make(p).intensity));
}

TEST(Phantom, IsTheSameForOneAndForTwoThreads)
{
  PhantomParameters p = Small();
  p.scene = DefaultScene();
  p.decorrelation = 0.3;
  p.press.mm = 2.0;
  p.noiseDb = -20.0;
  p.ribShare = 0.2;
  p.jets = true;
  Made one, two;
  {
    const ThreadLimit limit(1);
    one = Make(p);
  }
  {
    const ThreadLimit limit(2);
    two = Make(p);
  }
  EXPECT_TRUE(Same(one.intensity, two.intensity));
}

TEST(Phantom, SpeckleIsFullyDeveloped)
{
  PhantomParameters p = Small();
  p.scatterersPerMm3 = 6.0; // some 30 to 60 per resolution cell: a Rayleigh envelope
  const BeamEchoes echoes = SimulateEchoes(p);
  const auto baseband = echoes.baseband.View();
  const auto& n = baseband.Dimensions();
  // Samples four steps apart: beyond three standard deviations of the point spread, where its autocorrelation
  // exp(-d^2 / (4 sigma^2)) of amplitudes is below 0.1, so nearly independent.
  std::vector<double> envelope, power;
  for (int k = 2; k < n[2] - 2; k += 4)
    for (int j = 2; j < n[1] - 2; j += 4)
      for (int i = 4; i < n[0] - 4; i += 4) {
        envelope.push_back(std::abs(baseband(i, j, k)));
        power.push_back(std::norm(baseband(i, j, k)));
      }
  const double count = static_cast<double>(envelope.size());
  ASSERT_GT(count, 800.0);
  const Moments m = MomentsOf(envelope);
  // The standard error of the signal-to-noise ratio of n independent Rayleigh values is 1.06 * 1.91 / sqrt(2 n), rounded up.
  const double error = 1.6 / std::sqrt(count);
  EXPECT_NEAR(m.mean / m.deviation, 1.9131, 4.0 * error);
  // The mean power of the background is 1 at every depth.
  EXPECT_NEAR(MomentsOf(power).mean, 1.0, 4.0 / std::sqrt(count));
  for (const int half : {0, 1}) {
    std::vector<double> part;
    for (int k = 2; k < n[2] - 2; k += 4)
      for (int j = 2; j < n[1] - 2; j += 4)
        for (int i = half ? n[0] / 2 : 4; i < (half ? n[0] - 4 : n[0] / 2); i += 4)
          part.push_back(std::norm(baseband(i, j, k)));
    EXPECT_NEAR(MomentsOf(part).mean, 1.0, 4.0 / std::sqrt(static_cast<double>(part.size())));
  }
}

TEST(Phantom, SpeckleDecorrelatesAlongABeamLikeThePointSpread)
{
  // Intensities correlate as the square of the amplitudes: exp(-d^2 / (2 sigma^2)).
  PhantomParameters p = Small();
  p.scatterersPerMm3 = 4.0;
  const BeamEchoes echoes = SimulateEchoes(p);
  const auto baseband = echoes.baseband.View();
  const auto& n = baseband.Dimensions();
  const double step = (p.probe.depthMax - p.probe.depthMin) / (n[0] - 1);
  for (const int lag : {1, 2, 4}) {
    std::vector<double> a, b;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i + lag < n[0]; ++i) {
          a.push_back(std::norm(baseband(i, j, k)));
          b.push_back(std::norm(baseband(i + lag, j, k)));
        }
    const double d = lag * step / p.pulseSigmaMm;
    EXPECT_NEAR(Correlation(a, b), std::exp(-0.5 * d * d), 0.05) << lag;
  }
}

TEST(Phantom, AFixedBeamSeesTissueSlideThroughItsPointSpread)
{
  PhantomParameters p = Small();
  p.probe = ProbeGeometry::Linear(24.0, 24.0, 20.0, 40.0);
  p.lateralSigmaMm = 1.0;
  p.lateralGrowth = 0.0;
  p.scatterersPerMm3 = 4.0;
  const BeamEchoes still = SimulateEchoes(p);
  for (const double move : {0.5, 1.0, 2.0}) {
    PhantomParameters moved = p;
    moved.probeToWorld.translation().x() = move;
    const BeamEchoes slid = SimulateEchoes(moved);
    std::vector<double> a, b;
    for (const auto& value : still.baseband.View())
      a.push_back(std::norm(value));
    for (const auto& value : slid.baseband.View())
      b.push_back(std::norm(value));
    EXPECT_NEAR(Correlation(a, b), std::exp(-0.5 * move * move), 0.06) << move;
  }
}

TEST(Phantom, SlidingAFlatProbeKeepsTheSpeckleOfAPoint)
{
  PhantomParameters p = Small();
  p.probe = ProbeGeometry::Linear(30.0, 20.0, 20.0, 40.0);
  p.scatterersPerMm3 = 4.0;
  std::vector<Vector3d> points;
  Random random(7);
  for (int i = 0; i < 1500; ++i)
    points.emplace_back(random.Uniform(-9, 13), random.Uniform(-9, 9), random.Uniform(21, 39));
  Pose moved = Pose::Identity();
  moved.translation() = Vector3d(3.3, 0.4, 0.0);
  // What is lost is lost between the samples, which lie elsewhere.
  EXPECT_GT(SpeckleCorrelation(p, Pose::Identity(), moved, points), 0.97);
}

TEST(Phantom, SpeckleOfAPointDecorrelatesWithTheViewingAngle)
{
  ECHORAMA_SKIP_SANITIZED();
  PhantomParameters p;
  p.scene = UniformScene();
  p.probe = ProbeGeometry::Convex(26 * degree, 40.0, 18 * degree, 35.0, 36.0, 64.0);
  p.scatterersPerMm3 = 3.0;
  // Points near the middle of the volume; the probe turns about that middle, in the plane of the fan.
  const Vector3d middle(0, 0, 50);
  std::vector<Vector3d> points;
  Random random(11);
  for (int i = 0; i < 3000; ++i)
    points.push_back(middle + Vector3d(random.Uniform(-6, 6), random.Uniform(-8, 8), random.Uniform(-7, 7)));
  const auto at = [&](double degrees) {
    return SpeckleCorrelation(p, Pose::Identity(), MotionAbout(middle, {0, degrees * degree, 0}, Vector3d::Zero()), points);
  };
  EXPECT_DOUBLE_EQ(at(0.0), 1.0);
  const double sigma = p.lateralSigmaMm + 50.0 * p.lateralGrowth;
  double before = 1.0;
  for (const double angle : {1.0, 2.0, 4.0, 8.0}) {
    const double x = 2.0 * pi * sigma * std::sin(angle * degree) / p.wavelengthMm;
    const double found = at(angle);
    // About 1000 independent speckles: a standard error of 0.03; the points near the rim of the box see a slightly other
    // angle and width.
    EXPECT_NEAR(found, std::exp(-2.0 * x * x), 0.1) << angle;
    EXPECT_LT(found, before + 0.05);
    before = found;
  }
  EXPECT_GT(at(1.0), 0.85);
  EXPECT_GT(at(2.0), 0.55);
  EXPECT_LT(std::abs(at(20.0)), 0.1);
}

TEST(Phantom, FluidIsDarkAndBodiesLieWhereTheyAre)
{
  PhantomParameters p = Small();
  Inclusion cyst;
  cyst.shape = Ellipsoid{{0, 0, 36}, {5, 5, 5}, {0, 0, 0}};
  cyst.echogenicityDb = Inclusion::anechoicDb;
  p.scene.inclusions.push_back(cyst);
  p.probeToWorld = MotionAbout({0, 0, 36}, {0.1, -0.2, 0.7}, {0, 0, 0}); // the middle stays where it is
  const BeamEchoes echoes = SimulateEchoes(p);
  const auto meanPower = [&](double distance) {
    Random random(3, static_cast<std::uint64_t>(distance * 1000));
    double sum = 0.0;
    for (int i = 0; i < 4000; ++i)
      sum += Power(echoes, p.probeToWorld.inverse() * (Vector3d(0, 0, 36) + distance * random.Direction()));
    return sum / 4000;
  };
  EXPECT_LT(meanPower(1.0), 1e-3);
  EXPECT_GT(meanPower(9.0), 0.6);
  // Half of the power at the surface, within the blur of the point spread.
  EXPECT_LT(meanPower(4.0), 0.35);
  EXPECT_GT(meanPower(6.0), 0.65);

  const Made made = Make(p);
  const Vector3d index = made.geometry.WorldToIndex() * Vector3d(0, 0, 36);
  EXPECT_LT(made.intensity.View()(static_cast<int>(std::lround(index.x())), static_cast<int>(std::lround(index.y())),
                                  static_cast<int>(std::lround(index.z()))),
            10);
}

TEST(Phantom, ABrightGrainIsFoundWhereItLies)
{
  for (const Vector3d& place : {Vector3d(-4, 3, 34), Vector3d(3, -3, 40)}) {
    PhantomParameters p = Small();
    p.spacingMm = 0.5;
    Inclusion grain;
    grain.shape = Ellipsoid{place, {1.2, 1.2, 1.2}, {0, 0, 0}};
    grain.echogenicityDb = 40.0;
    p.scene.inclusions.push_back(grain);
    p.probeToWorld = MotionAbout(place, {0.2, 0.05, -0.1}, {0, 0, 0});
    const BeamEchoes echoes = SimulateEchoes(p);
    // The centre of the power around the place. Speckle of the few scatterers within moves it by less than a millimetre.
    Vector3d sum = Vector3d::Zero();
    double weights = 0.0;
    for (double z = -5; z <= 5; z += 0.4)
      for (double y = -5; y <= 5; y += 0.4)
        for (double x = -5; x <= 5; x += 0.4) {
          const double power = Power(echoes, p.probeToWorld.inverse() * (place + Vector3d(x, y, z)));
          sum += power * Vector3d(x, y, z);
          weights += power;
        }
    EXPECT_LT((sum / weights).norm(), 1.0);
  }
}

TEST(Phantom, GainMovesTheGreysByItsShareOfTheDynamicRange)
{
  PhantomParameters p = Small();
  p.dynamicRangeDb = 120.0; // wide enough that neither nulls nor peaks are clamped
  p.backgroundGrey = 160.0;
  const Made quiet = Make(p);
  p.gainDb = 6.0;
  const Made loud = Make(p);
  const double shift = 6.0 * 255.0 / 120.0;
  double sum = 0.0;
  long count = 0;
  for (std::ptrdiff_t i = 0; i < quiet.valid.View().Size(); ++i)
    if (quiet.valid.View()[i]) {
      const int difference = loud.intensity.View()[i] - quiet.intensity.View()[i];
      ASSERT_NEAR(difference, shift, 2.0); // greys are rounded on the beams and again in the voxels
      sum += difference;
      ++count;
    }
  ASSERT_GT(count, 10000);
  EXPECT_NEAR(sum / static_cast<double>(count), shift, 0.05);
}

TEST(Phantom, TheBackgroundHasTheStatedGrey)
{
  PhantomParameters p = Small();
  p.scatterersPerMm3 = 4.0;
  const Made made = Make(p);
  double sum = 0.0;
  long count = 0;
  for (std::ptrdiff_t i = 0; i < made.valid.View().Size(); ++i)
    if (made.valid.View()[i]) {
      sum += made.intensity.View()[i];
      ++count;
    } else
      ASSERT_EQ(made.intensity.View()[i], 0);
  EXPECT_NEAR(sum / static_cast<double>(count), p.backgroundGrey, 2.0);
}

TEST(Phantom, AStoneCastsAShadowAlongTheBeamsBehindIt)
{
  PhantomParameters p = Small();
  Inclusion stone;
  stone.shape = Ellipsoid{{0, 0, 30}, {3, 3, 3}, {0, 0, 0}};
  stone.attenuationDbPerMm = 5.0;
  p.scene.inclusions.push_back(stone);
  const auto ratio = [](const BeamEchoes& dark, const BeamEchoes& bright, const BeamPoint& at) {
    const Vector3d point = PointOf(dark.probe, at);
    return 10.0 * std::log10(Power(dark, point) / Power(bright, point));
  };
  const BeamEchoes dark = SimulateEchoes(p);
  p.shadows = false;
  const BeamEchoes bright = SimulateEchoes(p);
  const auto& n = dark.baseband.Dimensions();
  // On a beam through the middle: 6 mm of way at 5 dB. The beam nearest to the middle may pass it by half a step.
  const double beam = std::round(0.5 * (n[1] - 1)) / (n[1] - 1) - 0.5, plane = std::round(0.5 * (n[2] - 1)) / (n[2] - 1) - 0.5;
  for (const double depth : {36.0, 42.0, 48.0})
    EXPECT_NEAR(ratio(dark, bright, {depth, beam, plane}), -30.0, 1.0);
  EXPECT_NEAR(ratio(dark, bright, {30.0, beam, plane}), -15.0, 1.0);
  EXPECT_NEAR(ratio(dark, bright, {25.0, beam, plane}), 0.0, 1e-6);
  EXPECT_NEAR(ratio(dark, bright, {45.0, 0.4, 0.0}), 0.0, 1e-6);
}

TEST(Phantom, TheGridFollowsThePoseAndCoversTheFan)
{
  PhantomParameters p = Small();
  const ImageGeometry still = PhantomGeometry(p);
  p.probeToWorld = MotionAbout({1, 2, 3}, {0.3, -0.4, 0.2}, {50, -20, 7});
  const ImageGeometry moved = PhantomGeometry(p);
  EXPECT_TRUE(moved.AgreesWith(still.Moved(p.probeToWorld), 1e-9));
  EXPECT_TRUE(moved.direction.isApprox(p.probeToWorld.linear(), 1e-12));
  for (const double depth : {20.0, 50.0})
    for (const double fan : {-0.5, 0.0, 0.5})
      for (const double sweep : {-0.5, 0.0, 0.5}) {
        const Vector3d index = still.WorldToIndex() * PointOf(p.probe, {depth, fan, sweep});
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_GE(index[axis], -0.01);
          EXPECT_LE(index[axis], still.dimensions[static_cast<std::size_t>(axis)] - 0.99);
        }
      }
}

TEST(Phantom, PhasedAndLinearProbesWorkToo)
{
  for (const ProbeGeometry& probe :
       {ProbeGeometry::Phased(50 * degree, 40 * degree, 3.0, 30.0), ProbeGeometry::Linear(20, 15, 0, 20)}) {
    PhantomParameters p = Small();
    p.probe = probe;
    const Made made = Make(p);
    double sum = 0.0;
    long count = 0;
    for (std::ptrdiff_t i = 0; i < made.valid.View().Size(); ++i)
      if (made.valid.View()[i]) {
        sum += made.intensity.View()[i];
        ++count;
      }
    ASSERT_GT(count, 1000);
    EXPECT_NEAR(sum / static_cast<double>(count), p.backgroundGrey, 6.0);
  }
}

TEST(Phantom, RefusesWhatItCannotMake)
{
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const auto with = [](auto change) {
    PhantomParameters p = Small();
    change(p);
    return MessageOf(p);
  };
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_NE(with([](auto& p) { p.spacingMm = 0.0; }).find("SpacingMm is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.spacingMm = -1.0; }).find("SpacingMm is "), std::string::npos);
  EXPECT_NE(with([&](auto& p) { p.spacingMm = nan; }).find("SpacingMm is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.spacingMm = 1e-3; }).find("larger spacing"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.spacingMm = 1e-300; }).find("larger spacing"), std::string::npos);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NE(with([&](auto& p) { p.probeToWorld.translation()[axis] = nan; }).find("ProbeToWorld"), std::string::npos) << axis;
  EXPECT_NE(with([](auto& p) { p.probeToWorld.translation().x() = 1e7; }).find("ProbeToWorld"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.probeToWorld.linear() *= 2.0; }).find("ProbeToWorld"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.probe.depthMax = p.probe.depthMin; }).find("probe geometry"), std::string::npos);
  EXPECT_NE(with([&](auto& p) { p.probe.fanAngle = infinity; }).find("probe geometry"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.probe.sweepAngle = p.probe.sweepWidth = 0.0; }).find("plane"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.probe = ProbeGeometry::Convex(3.0, 40, 1.0, 5, 0, 50); }).find("axis"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.probe.depthMax = 1e9; }).find("larger spacing"), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.scatterersPerMm3 = 0.0; }).find("ScatterersPerMm3 is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.wavelengthMm = 0.0; }).find("WavelengthMm is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.pulseSigmaMm = -1.0; }).find("PulseSigmaMm is "), std::string::npos);
  EXPECT_NE(with([&](auto& p) { p.gainDb = nan; }).find("GainDb is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.decorrelation = 1.1; }).find("Decorrelation is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.press.mm = 11.0; }).find("DeformationMm is "), std::string::npos);
  EXPECT_NE(with([&](auto& p) { p.noiseDb = nan; }).find("NoiseDb is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.ribShare = -0.1; }).find("RibShare is "), std::string::npos);
  EXPECT_NE(with([](auto& p) { p.dynamicRangeDb = 0.0; }).find("DynamicRangeDb is "), std::string::npos);

  PhantomParameters p = Small();
  Volume<unsigned char> wrong({3, 3, 3});
  EXPECT_THROW(MakePhantom(p, wrong.View(), wrong.View()), Error);
}

TEST(Phantom, StopsWhenAsked)
{
  int calls = 0;
  const Progress stop([&calls](double) { return ++calls < 3; });
  const PhantomParameters p = Small();
  const ImageGeometry geometry = PhantomGeometry(p);
  Volume<unsigned char> intensity(geometry.dimensions), valid(geometry.dimensions);
  try {
    MakePhantom(p, intensity.View(), valid.View(), stop);
    FAIL() << "was not stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}
