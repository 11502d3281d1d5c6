// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Random.h"
#include "Filters/Live/SurfacePoseFilter.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

using namespace echorama;
using Eigen::Quaterniond, Eigen::Vector3d;

namespace {

constexpr double notANumber = std::numeric_limits<double>::quiet_NaN();

// A probe that a hand moves over a ball of 150 mm, and both of its streams. The world's z is up.
struct Simulation {
  double seconds = 120.0;
  double latitudeDegrees = 30.0; // of the place, about which it wanders by +-20 degrees: 90 is the top
  double surfaceHz = 90.0, imuHz = 100.0, surfaceDelay = 0.04, imuDelay = 0.015;
  double noiseMm = 0.3, normalDegrees = 2.0, imuDegrees = 0.3;
  double driftDegreesPerMinute = 10.0, driftChange = 5.0, headingNoise = 0.1;
  double heldDegrees = 12.0, heldSeconds = 3.0;
  double dropped = 0.0;
  std::uint64_t seed = 1;
  Eigen::Matrix3d sensorToProbe = ExpRotation({0.3, -0.2, 1.0});

  struct Moment {
    Pose probeToWorld;
    Vector3d normal;
    double drift; // of the heading, radians
  };
  std::vector<Moment> truth; // every millisecond

  Moment At(double time) const { return truth[static_cast<std::size_t>(std::lround(time * 1000.0))]; }

  void Run()
  {
    Random random(seed, 1);
    double rate = driftDegreesPerMinute * RadiansPerDegree / 60.0 * random.Normal(), drift = 0.0;
    const double held = heldDegrees * RadiansPerDegree, dt = 1e-3, kept = std::exp(-dt / heldSeconds);
    double a = held * random.Normal(), b = held * random.Normal();
    for (int n = 0; n <= static_cast<int>(seconds * 1000.0); ++n) {
      const double t = n * dt;
      const double latitude = (latitudeDegrees + 12.0 * std::sin(0.9 * t) + 8.0 * std::sin(0.37 * t + 1.0)) * RadiansPerDegree;
      const double longitude = 0.5 * std::sin(0.6 * t) + 0.3 * std::sin(0.23 * t + 2.0);
      Moment m;
      m.normal = {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
      const double turned = 0.8 * std::sin(0.5 * t + 0.4);
      const Vector3d east(-std::sin(longitude), std::cos(longitude), 0), z = -m.normal;
      Eigen::Matrix3d upright;
      const Vector3d x = Eigen::AngleAxisd(turned, z) * east;
      upright << x, z.cross(x), z;
      // The inner normal is (a, b, .) as the probe sees it.
      const Vector3d seen(a, b, std::sqrt(1.0 - a * a - b * b));
      m.probeToWorld.linear() = upright * Quaterniond::FromTwoVectors(seen, Vector3d::UnitZ()).toRotationMatrix();
      m.probeToWorld.translation() = 150.0 * m.normal;
      m.drift = drift;
      truth.push_back(m);
      drift += rate * dt + headingNoise * RadiansPerDegree * std::sqrt(dt) * random.Normal();
      rate += driftChange * RadiansPerDegree / 60.0 / std::sqrt(60.0) * std::sqrt(dt) * random.Normal();
      a = kept * a + held * std::sqrt(1 - kept * kept) * random.Normal();
      b = kept * b + held * std::sqrt(1 - kept * kept) * random.Normal();
      a = std::clamp(a, -0.6, 0.6);
      b = std::clamp(b, -0.6, 0.6);
    }
  }

  // What comes, in the order in which it comes; at(stamp, surface's or IMU's).
  template <class Surface, class Imu>
  void Send(Surface&& onSurface, Imu&& onImu) const
  {
    Random random(seed, 2);
    const auto vector = [&random](double sigma) -> Vector3d {
      const double x = random.Normal(), y = random.Normal(), z = random.Normal();
      return sigma * Vector3d(x, y, z);
    };
    double nextSurface = 0.0, nextImu = 0.0;
    while (std::max(nextSurface, nextImu) < seconds - 0.1) {
      const bool surface = nextSurface + surfaceDelay <= nextImu + imuDelay;
      const bool lost = random.Uniform() < dropped;
      if (surface) {
        const Moment m = At(nextSurface);
        const Vector3d normal = ExpRotation(vector(normalDegrees * RadiansPerDegree)) * m.normal;
        const Vector3d point = m.probeToWorld.translation() + vector(noiseMm);
        if (!lost)
          onSurface(nextSurface + surfaceDelay, point, normal);
        nextSurface = std::lround((nextSurface + 1.0 / surfaceHz) * 1000.0) / 1000.0;
      } else {
        const Moment m = At(nextImu);
        const Eigen::Matrix3d rotation = Eigen::AngleAxisd(m.drift, Vector3d::UnitZ()) * m.probeToWorld.linear() * sensorToProbe *
                                         ExpRotation(vector(imuDegrees * RadiansPerDegree));
        if (!lost)
          onImu(nextImu + imuDelay, Quaterniond(rotation));
        nextImu = std::lround((nextImu + 1.0 / imuHz) * 1000.0) / 1000.0;
      }
    }
  }

  SurfacePoseParameters Parameters() const
  {
    SurfacePoseParameters p;
    p.surfaceDelay = surfaceDelay;
    p.imuDelay = imuDelay;
    p.driftDegreesPerMinute = driftDegreesPerMinute;
    p.driftChange = driftChange;
    p.headingNoise = headingNoise;
    p.normalDegrees = normalDegrees;
    p.heldDegrees = heldDegrees;
    p.heldSeconds = heldSeconds;
    return p;
  }
};

struct Errors {
  double degrees = 0.0, mm = 0.0;           // RMS of the filter, at its newest moment
  double nowDegrees = 0.0, nowMm = 0.0;     // of its prediction for the moment of arrival
  double plainDegrees = 0.0, plainMm = 0.0; // of the newest of each stream, as it came
  double sigmas = 0.0;                      // RMS of the heading's error over its sigma
  double endSigmaDegrees = 0.0, endHeadingDegrees = 0.0, nis = 0.0;
  std::uint64_t count = 0;
};

Errors Compare(Simulation s)
{
  s.Run();
  SurfacePoseFilter filter(s.Parameters(), s.sensorToProbe);
  Errors e;
  Vector3d lastPoint = Vector3d::Zero();
  double alignedHeading = 0.0;
  bool aligned = false;
  Random random(s.seed, 3);
  const auto turnBetween = [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return LogRotation(a.transpose() * b).norm() * DegreesPerRadian;
  };
  s.Send(
      [&](double stamp, const Vector3d& point, const Vector3d& normal) {
        filter.AddSurface(stamp, point, normal);
        lastPoint = point;
      },
      [&](double stamp, const Quaterniond& q) {
        filter.AddImu(stamp, q);
        const auto newest = filter.Newest();
        if (!newest)
          return;
        if (!aligned && stamp > 0.5) { // somebody says which way it points, to 3 degrees
          const auto truth = s.At(newest->time);
          aligned = filter.Align(newest->time,
                                 Eigen::AngleAxisd(3.0 * RadiansPerDegree * random.Normal(), Vector3d::UnitZ()) *
                                     truth.probeToWorld.linear().col(0),
                                 3.0);
          ASSERT_TRUE(aligned);
          alignedHeading = filter.Heading();
          return;
        }
        if (stamp < 5.0)
          return;
        const auto truth = s.At(newest->time), now = s.At(stamp);
        const auto predicted = filter.At(stamp);
        if (!predicted)
          return;
        ++e.count;
        e.degrees += std::pow(turnBetween(newest->probeToWorld.linear(), truth.probeToWorld.linear()), 2);
        e.mm += (newest->probeToWorld.translation() - truth.probeToWorld.translation()).squaredNorm();
        e.nowDegrees += std::pow(turnBetween(predicted->probeToWorld.linear(), now.probeToWorld.linear()), 2);
        e.nowMm += (predicted->probeToWorld.translation() - now.probeToWorld.translation()).squaredNorm();
        const Eigen::Matrix3d plain =
            Eigen::AngleAxisd(alignedHeading, Vector3d::UnitZ()) * q.toRotationMatrix() * s.sensorToProbe.transpose();
        e.plainDegrees += std::pow(turnBetween(plain, now.probeToWorld.linear()), 2);
        e.plainMm += (lastPoint - now.probeToWorld.translation()).squaredNorm();
        const double wrong = std::remainder(filter.Heading() + truth.drift, 2.0 * Pi);
        e.sigmas += std::pow(wrong / filter.HeadingSigma(), 2);
        e.endSigmaDegrees = filter.HeadingSigma() * DegreesPerRadian;
        e.endHeadingDegrees = wrong * DegreesPerRadian;
      });
  for (double* sum : {&e.degrees, &e.mm, &e.nowDegrees, &e.nowMm, &e.plainDegrees, &e.plainMm, &e.sigmas})
    *sum = std::sqrt(*sum / static_cast<double>(e.count));
  e.nis = filter.Counted().meanNis;
  return e;
}

// Of several seeds.
Errors Mean(Simulation s, int trials)
{
  Errors mean;
  for (int t = 1; t <= trials; ++t) {
    s.seed = static_cast<std::uint64_t>(t);
    const Errors e = Compare(s);
    const auto add = [trials](double& sum, double value) { sum += value * value / trials; };
    add(mean.degrees, e.degrees);
    add(mean.mm, e.mm);
    add(mean.nowDegrees, e.nowDegrees);
    add(mean.nowMm, e.nowMm);
    add(mean.plainDegrees, e.plainDegrees);
    add(mean.plainMm, e.plainMm);
    add(mean.sigmas, e.sigmas);
    add(mean.endSigmaDegrees, e.endSigmaDegrees);
    add(mean.endHeadingDegrees, e.endHeadingDegrees);
    mean.nis += e.nis / trials;
  }
  for (double* sum : {&mean.degrees, &mean.mm, &mean.nowDegrees, &mean.nowMm, &mean.plainDegrees, &mean.plainMm, &mean.sigmas,
                      &mean.endSigmaDegrees, &mean.endHeadingDegrees})
    *sum = std::sqrt(*sum);
  return mean;
}

void Record(const std::string& name, const Errors& e)
{
  const std::string text = Format(
      "at its newest moment %.2f degrees %.2f mm; at arrival %.2f degrees %.2f mm; as it came %.2f degrees %.2f mm; "
      "sigmas %.2f; in the end heading off %.2f degrees, says %.2f; NIS %.3f",
      e.degrees, e.mm, e.nowDegrees, e.nowMm, e.plainDegrees, e.plainMm, e.sigmas, e.endHeadingDegrees, e.endSigmaDegrees, e.nis);
  testing::Test::RecordProperty(name, text);
}

} // namespace

TEST(SurfacePoseFilter, OnAFlankItHoldsTheHeading)
{
  for (const double latitude : {0.0, 30.0}) {
    Simulation flank;
    flank.latitudeDegrees = latitude;
    const Errors e = Mean(flank, 8);
    Record(latitude == 0.0 ? "side" : "flank", e);
    EXPECT_LT(e.degrees, 0.5 * e.plainDegrees);
    EXPECT_LT(e.nowDegrees, 0.5 * e.plainDegrees);
    EXPECT_LT(e.nowMm, 0.75 * e.plainMm);          // the delay
    EXPECT_NEAR(e.mm, 0.3 * std::sqrt(3.0), 0.03); // the tracker's own noise
    // It knows how good it is, and does not say better; nor much worse.
    EXPECT_LT(e.sigmas, 1.3);
    EXPECT_GT(e.sigmas, 0.5);
    EXPECT_GT(e.nis, 0.6);
    EXPECT_LT(e.nis, 1.1);
    EXPECT_LT(e.endSigmaDegrees, 10.0);
  }
}

TEST(SurfacePoseFilter, OnTopItSaysThatItDoesNot)
{
  Simulation top;
  top.latitudeDegrees = 90.0;
  const Errors e = Mean(top, 8);
  Record("top", e);
  EXPECT_EQ(e.nis, 0.0); // not one update
  EXPECT_GT(e.endSigmaDegrees, 15.0);
  EXPECT_LT(e.sigmas, 1.5);
  EXPECT_GT(e.degrees, 0.8 * e.plainDegrees); // no better than the IMU alone
}

TEST(SurfacePoseFilter, TheDriftIsFound)
{
  double largest = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Simulation s;
    s.seed = seed;
    s.latitudeDegrees = 0.0;
    s.driftDegreesPerMinute = 30.0;
    s.driftChange = 0.0;
    s.heldDegrees = 4.0;
    s.Run();
    SurfacePoseFilter filter(s.Parameters(), s.sensorToProbe);
    bool aligned = false;
    s.Send([&](double stamp, const Vector3d& p, const Vector3d& n) { filter.AddSurface(stamp, p, n); },
           [&](double stamp, const Quaterniond& q) {
             filter.AddImu(stamp, q);
             if (!aligned && stamp > 0.5)
               aligned = filter.Align(filter.Newest()->time, s.At(filter.Newest()->time).probeToWorld.linear().col(0));
           });
    const double truth = (s.truth.front().drift - s.truth.back().drift) * DegreesPerRadian / 2.0; // in two minutes
    largest = std::max(largest, std::abs(truth));
    EXPECT_NEAR(filter.DriftDegreesPerMinute(), truth, 4.0) << seed;
  }
  EXPECT_GT(largest, 20.0);
}

TEST(SurfacePoseFilter, LivesWithLostSamples)
{
  Simulation s;
  s.latitudeDegrees = 0.0;
  s.dropped = 0.3;
  const Errors e = Mean(s, 4);
  Record("dropped", e);
  EXPECT_LT(e.degrees, 0.6 * e.plainDegrees);
  EXPECT_LT(e.sigmas, 1.4);
}

TEST(SurfacePoseFilter, DelaysAreTakenOut)
{
  // Without noise, at the same moment on both clocks.
  Simulation s;
  s.seconds = 5.0;
  s.noiseMm = s.imuDegrees = s.driftDegreesPerMinute = s.driftChange = s.headingNoise = 0.0;
  s.surfaceDelay = 0.13;
  s.imuDelay = 0.02;
  s.Run();
  for (const bool known : {true, false}) {
    SurfacePoseParameters p = s.Parameters();
    if (!known)
      p.surfaceDelay = p.imuDelay = 0.0;
    SurfacePoseFilter filter(p, s.sensorToProbe);
    double mm = 0.0, degrees = 0.0;
    bool aligned = false;
    s.Send([&](double stamp, const Vector3d& point, const Vector3d& n) { filter.AddSurface(stamp, point, n); },
           [&](double stamp, const Quaterniond& q) {
             filter.AddImu(stamp, q);
             const auto newest = filter.Newest();
             if (!newest)
               return;
             const Pose truth = s.At(newest->time).probeToWorld;
             if (!aligned)
               aligned = filter.Align(newest->time, truth.linear().col(0), 0.01);
             EXPECT_FALSE(newest->isPredicted);
             mm = std::max(mm, (newest->probeToWorld.translation() - truth.translation()).norm());
             const Vector3d is = newest->probeToWorld.linear().col(2), wanted = truth.linear().col(2);
             degrees = std::max(degrees, std::acos(std::min(1.0, is.dot(wanted))) * DegreesPerRadian);
           });
    if (known) {
      EXPECT_LT(mm, 0.05);
    } else
      EXPECT_GT(mm, 3.0);
  }
}

TEST(SurfacePoseFilter, AlignsByASlide)
{
  // Slid along x for 40 mm on a level table, with the IMU's heading wrong by 70 degrees.
  SurfacePoseFilter filter({});
  const Eigen::Matrix3d truth = (Eigen::Matrix3d() << 1, 0, 0, 0, -1, 0, 0, 0, -1).finished(); // z down
  for (int n = 0; n <= 100; ++n) {
    filter.AddImu(0.01 * n, Quaterniond(Eigen::Matrix3d(Eigen::AngleAxisd(70.0 * RadiansPerDegree, Vector3d::UnitZ()) * truth)));
    filter.AddSurface(0.01 * n, {0.4 * n, 0, 0}, {0, 0, 1});
  }
  EXPECT_FALSE(filter.IsAligned());
  EXPECT_NEAR(filter.HeadingSigma(), Pi, 1e-9);
  EXPECT_FALSE(filter.AlignBySlide(0.0, 0.2)); // 8 mm are too few
  EXPECT_FALSE(filter.AlignBySlide(0.0, 3.0)); // nobody knows where it was then
  EXPECT_TRUE(filter.AlignBySlide(0.0, 1.0, 4.0));
  EXPECT_NEAR(filter.Heading(), -70.0 * RadiansPerDegree, 1e-9);
  EXPECT_NEAR(filter.HeadingSigma(), 4.0 * RadiansPerDegree, 1e-9);
  EXPECT_LT((filter.Newest()->probeToWorld.linear() - truth).norm(), 1e-9);
  // A second opinion of the same weight counts half.
  EXPECT_TRUE(filter.Align(1.0, Eigen::AngleAxisd(0.02, Vector3d::UnitZ()) * Vector3d::UnitX(), 4.0));
  EXPECT_NEAR(filter.Heading(), -70.0 * RadiansPerDegree + 0.01, 1e-9);
  EXPECT_FALSE(filter.Align(1.0, {0, 0, 1})); // up is no heading
  EXPECT_THROW(filter.Align(1.0, {notANumber, 0, 1}), Error);
}

TEST(SurfacePoseFilter, TakesAnyDirectionForUp)
{
  SurfacePoseParameters p;
  p.up = {0, -2, 0}; // a patient on the back, LPS
  SurfacePoseFilter filter(p);
  const Eigen::Matrix3d truth = (Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished(); // z of the probe is +y: down
  const Quaterniond level = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(0, -1, 0));
  const Quaterniond imu = level.inverse() * Quaterniond(Eigen::Matrix3d(Eigen::AngleAxisd(1.0, Vector3d(0, -1, 0)) * truth));
  for (int n = 0; n < 3; ++n) {
    filter.AddImu(0.1 * n, imu);
    filter.AddSurface(0.1 * n, {1, 2, 3}, {0, -1, 0});
  }
  EXPECT_TRUE(filter.Align(0.2, {1, 0, 0}));
  EXPECT_LT((filter.Newest()->probeToWorld.linear() - truth).norm(), 1e-9);
  EXPECT_LT((filter.Newest()->probeToWorld.translation() - Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST(SurfacePoseFilter, PredictsAndBridgesNoFurtherThanItMay)
{
  SurfacePoseFilter filter({});
  const auto turned = [](double t) { return Quaterniond(Eigen::AngleAxisd(0.5 * t, Vector3d::UnitX())); };
  EXPECT_FALSE(filter.Newest());
  for (int n = 0; n <= 20; ++n) {
    const double t = 0.02 * n + (n > 10 ? 1.0 : 0.0); // silent from 0.2 to 1.22
    filter.AddImu(t, turned(t));
    filter.AddSurface(t, {100 * t, 0, 0}, {0, 0, 1});
  }
  EXPECT_FALSE(filter.At(-0.01));
  EXPECT_TRUE(filter.At(0.15));
  EXPECT_FALSE(filter.At(0.7));
  EXPECT_FALSE(filter.At(1.4)->isPredicted);
  const auto soon = filter.At(1.47);
  ASSERT_TRUE(soon);
  EXPECT_TRUE(soon->isPredicted);
  EXPECT_NEAR(soon->probeToWorld.translation()[0], 147.0, 1e-9);
  EXPECT_LT((soon->probeToWorld.linear() - turned(1.47).toRotationMatrix()).norm(), 1e-9);
  EXPECT_FALSE(filter.At(1.6));
  EXPECT_FALSE(filter.At(notANumber));
}

TEST(SurfacePoseFilter, RefusesWhatCannotBe)
{
  const auto reason = [](auto&& f) {
    try {
      f();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  SurfacePoseFilter filter({});
  filter.AddImu(1.0, Quaterniond::Identity());
  filter.AddSurface(1.0, {0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(reason([&] { filter.AddImu(1.0, Quaterniond::Identity()); }), "the IMU: the time stamp is not later than the last");
  EXPECT_EQ(reason([&] {
              filter.AddSurface(0.9, {0, 0, 0}, {0, 0, 1});
            }),
            "the surface tracker: the time stamp is not later than the last");
  EXPECT_EQ(reason([&] {
              filter.AddSurface(notANumber, {0, 0, 0}, {0, 0, 1});
            }),
            "the surface tracker: the time stamp is not finite");
  for (const Vector3d& normal : {Vector3d(0, 0, 0), Vector3d(notANumber, 0, 1)})
    EXPECT_EQ(reason([&] {
                filter.AddSurface(2.0, {0, 0, 0}, normal);
              }),
              "the surface tracker: the place or the normal is not finite, or the normal has no length");
  EXPECT_EQ(reason([&] { filter.AddImu(2.0, Quaterniond(2, 0, 0, 0)); }),
            "the IMU: the quaternion is not finite, or not of length 1");
  EXPECT_EQ(filter.Counted().imu, 1u);
  EXPECT_EQ(filter.Counted().surface, 1u);
  EXPECT_EQ(filter.Newest()->time, 1.0);
  SurfacePoseParameters p;
  p.up.setZero();
  EXPECT_EQ(reason([&] { SurfacePoseFilter bad(p); }), "Up has no length");
  EXPECT_EQ(reason([&] { SurfacePoseFilter bad({}, Eigen::Matrix3d::Zero()); }), "how the IMU is mounted is no rotation");
}
