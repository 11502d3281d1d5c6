// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Tracking/Testing/SurfaceSimulation.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Quaterniond, Eigen::Vector3d;

namespace {

constexpr double notANumber = std::numeric_limits<double>::quiet_NaN();

struct Errors {
  double degrees = 0.0, mm = 0.0;           // RMS of the filter, at its newest moment
  double nowDegrees = 0.0, nowMm = 0.0;     // of its prediction for the moment of arrival
  double plainDegrees = 0.0, plainMm = 0.0; // of the newest of each stream, as it came
  double sigmas = 0.0;                      // RMS of the heading's error over its sigma
  double endSigmaDegrees = 0.0, endHeadingDegrees = 0.0, nis = 0.0;
  std::uint64_t count = 0;
};

Errors Compare(SurfaceSimulation s)
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
Errors Mean(SurfaceSimulation s, int trials)
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
    SurfaceSimulation flank;
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
  SurfaceSimulation top;
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
    SurfaceSimulation s;
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
  SurfaceSimulation s;
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
  SurfaceSimulation s;
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
    filter.AddSurface(0.01 * n, {0.4 * n, 0, 0}, Vector3d(0, 0, 1));
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
    filter.AddSurface(0.1 * n, {1, 2, 3}, Vector3d(0, -1, 0));
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
    filter.AddSurface(t, {100 * t, 0, 0}, Vector3d(0, 0, 1));
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
  filter.AddSurface(1.0, {0, 0, 0}, Vector3d(0, 0, 1));
  EXPECT_EQ(reason([&] { filter.AddImu(1.0, Quaterniond::Identity()); }), "the IMU: the time stamp is not later than the last");
  EXPECT_EQ(reason([&] {
              filter.AddSurface(0.9, {0, 0, 0}, Vector3d(0, 0, 1));
            }),
            "the surface tracker: the time stamp is not later than the last");
  EXPECT_EQ(reason([&] {
              filter.AddSurface(notANumber, {0, 0, 0}, Vector3d(0, 0, 1));
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

namespace {

// Both streams of a probe that moves at 100 mm/s along x, at times from \a from on.
void Feed(SurfacePoseFilter& filter, double from, int count)
{
  for (int n = 0; n < count; ++n) {
    filter.AddImu(from + 0.02 * n, Quaterniond::Identity());
    filter.AddSurface(from + 0.02 * n, {2.0 * n, 0, 0}, Vector3d(0, 0, 1));
  }
}

} // namespace

TEST(SurfacePoseFilter, OneOddStampDoesNotStopIt)
{
  SurfacePoseFilter filter({});
  Feed(filter, 100.0, 20);
  for (const double odd : {1e9, 102.0, -7.0}) {
    filter.AddImu(odd, Quaterniond::Identity());
    filter.AddSurface(odd, {5e3, 0, 0}, Vector3d(0, 0, 1));
  }
  EXPECT_EQ(filter.Newest()->time, 100.38);
  filter.AddImu(100.40, Quaterniond::Identity());
  filter.AddSurface(100.40, {40, 0, 0}, Vector3d(0, 0, 1));
  EXPECT_EQ(filter.Newest()->time, 100.40);
  EXPECT_EQ(filter.Newest()->probeToWorld.translation(), Vector3d(40, 0, 0));
  EXPECT_EQ(filter.Counted().odd, 6u);
  EXPECT_EQ(filter.Counted().surface, 21u);
  EXPECT_EQ(filter.Counted().jumps, 0u);
  // Nor does one that comes first of all.
  SurfacePoseFilter other({});
  other.AddImu(1e9, Quaterniond::Identity());
  Feed(other, 0.0, 5);
  ASSERT_TRUE(other.Newest());
  EXPECT_NEAR(other.Newest()->time, 0.08, 1e-12);
  EXPECT_EQ(other.Counted().jumps, 1u);
}

TEST(SurfacePoseFilter, GoesOnAfterASilenceAndAfterAClockThatJumped)
{
  SurfacePoseFilter filter({});
  Feed(filter, 100.0, 20);
  EXPECT_TRUE(filter.Align(100.2, {1, 0, 0}, 3.0));
  const double before = filter.HeadingSigma();
  Feed(filter, 160.0, 10); // silent for a minute
  EXPECT_NEAR(filter.Newest()->time, 160.18, 1e-9);
  EXPECT_EQ(filter.Counted().imu, 30u);
  // Nothing is known of what the heading did meanwhile but by how much it may have drifted: 10 degrees.
  EXPECT_NEAR(filter.HeadingSigma(), std::hypot(before, 10.0 * RadiansPerDegree), 1.5 * RadiansPerDegree);
  const double heading = filter.Heading();
  Feed(filter, 5.0, 10); // back
  EXPECT_EQ(filter.Counted().jumps, 2u);
  EXPECT_NEAR(filter.Newest()->time, 5.18, 1e-9);
  EXPECT_FALSE(filter.At(160.1));
  EXPECT_NEAR(filter.Heading(), heading, 1e-6); // what was aligned stays
  EXPECT_TRUE(filter.IsAligned());
}

TEST(SurfacePoseFilter, AnAlignmentThatIsRefusedChangesNothing)
{
  // Beside a twin that was not asked. The refused one is of a later moment than the last update.
  SurfacePoseFilter filter({}), twin({});
  for (SurfacePoseFilter* one : {&filter, &twin}) {
    Feed(*one, 0.0, 20);
    EXPECT_TRUE(one->Align(0.1, {1, 0, 0}, 3.0));
    one->AddImu(0.55, Quaterniond::Identity());
  }
  const double sigma = filter.HeadingSigma();
  EXPECT_FALSE(filter.Align(0.55, {0, 0, 1}));
  EXPECT_EQ(filter.HeadingSigma(), sigma);
  for (SurfacePoseFilter* one : {&filter, &twin}) {
    one->AddImu(0.7, Quaterniond::Identity());
    one->AddSurface(0.6, {1, 0, 0}, Vector3d(0, 0, 1));
  }
  EXPECT_EQ(filter.HeadingSigma(), twin.HeadingSigma());
}

TEST(SurfacePoseFilter, WithoutNormalsThePlaceIsTakenAndTheHeadingLeftAlone)
{
  SurfacePoseParameters p;
  SurfacePoseFilter with(p), without(p);
  const Quaterniond flank(Eigen::AngleAxisd(0.5 * Pi, Vector3d::UnitX())); // z lies level
  for (int n = 0; n < 100; ++n)
    for (SurfacePoseFilter* one : {&with, &without}) {
      one->AddImu(0.02 * n, flank);
      const Vector3d normal = Eigen::AngleAxisd(0.3, Vector3d::UnitZ()) * -(flank * Vector3d::UnitZ());
      one->AddSurface(0.02 * n, {1.0 * n, 0, 0}, one == &with ? std::optional<Vector3d>(normal) : std::nullopt);
      if (n == 1) {
        EXPECT_TRUE(one->Align(0.02, {1, 0, 0}, 10.0));
      }
    }
  EXPECT_GT(with.Heading(), 0.05);
  EXPECT_EQ(without.Heading(), 0.0);
  EXPECT_EQ(without.Counted().updates, 0u);
  EXPECT_EQ(without.Newest()->probeToWorld.translation(), Vector3d(99, 0, 0));
}
