// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Base/Worker.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/LiveTransforms.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

Pose SomePose(std::uint64_t seed)
{
  Random random(seed);
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(2.0 * random.Direction());
  pose.translation() = 50.0 * random.Direction();
  return pose;
}

double Difference(const Eigen::Affine3d& a, const Eigen::Affine3d& b)
{
  double largest = 0.0;
  for (int i = 0; i < 16; ++i)
    largest = std::max(largest, std::abs(a.data()[i] - b.data()[i]));
  return largest;
}

Eigen::Affine3d Affine(const Pose& pose)
{
  return Eigen::Affine3d(pose.matrix());
}

NamedTransform Fixed(const std::string& from, const std::string& to, const Eigen::Affine3d& matrix, double errorMm)
{
  return {from, to, matrix, TransformStatus::Valid, errorMm, ""};
}

void Add(PoseStream& stream, const std::string& name, double time, const Pose& pose,
         TransformStatus status = TransformStatus::Valid)
{
  stream.Add({name, time, NaN, pose, status});
}

// Of a frame that moves from a (at time 0) to b (at time 1).
struct Mover {
  Pose a, b;
  Pose At(double time) const { return Interpolate(a, b, time); }
};

} // namespace

TEST(LiveTransforms, ComposesToolsAndCalibration)
{
  PoseStream stream;
  Eigen::Affine3d calibration(SomePose(1).matrix());
  calibration.linear() *= 0.08;
  const LiveTransforms live(stream, {Fixed("Image", "Probe", calibration, 0.5)});
  Add(stream, "ProbeToTracker", 10.0, SomePose(2));
  Add(stream, "ReferenceToTracker", 10.0, SomePose(3));
  const LiveTransform found = live.Find("ImageToReference");
  EXPECT_EQ(found.Status(), TransformStatus::Valid) << found.message;
  EXPECT_EQ(found.message, "");
  EXPECT_EQ(found.time, 10.0);
  const Eigen::Affine3d expected(SomePose(3).inverse() * SomePose(2) * calibration);
  EXPECT_LT(Difference(found.transform.matrix, expected), 1e-12);
  EXPECT_EQ(found.transform.PathText(), "ImageToProbe, ProbeToTracker, inverse of ReferenceToTracker");
  ASSERT_TRUE(found.transform.errorMm);
  EXPECT_EQ(*found.transform.errorMm, 0.5);
  EXPECT_FALSE(found.transform.errorIsComplete);
  EXPECT_LT(Difference(live.Find("ReferenceToImage").transform.matrix, expected.inverse()), 1e-12);
  EXPECT_LT(Difference(live.Graph().Find("Image", "Reference").matrix, expected), 1e-12);
  const LiveTransform still = live.Find("ImageToProbe"); // none of it moves
  EXPECT_EQ(still.Status(), TransformStatus::Valid);
  EXPECT_TRUE(std::isnan(still.time));
}

TEST(LiveTransforms, AtAMoment)
{
  PoseStream stream;
  stream.SetLive(false);
  const LiveTransforms live(stream);
  const Mover probe{SomePose(1), SomePose(2)}, reference{SomePose(3), SomePose(4)};
  for (int i = 0; i <= 10; ++i) // not at the same times
    Add(stream, "ProbeToTracker", 0.1 * i, probe.At(0.1 * i));
  for (int i = 0; i <= 3; ++i)
    Add(stream, "ReferenceToTracker", 0.3 * i, reference.At(0.3 * i));
  for (const double time : {0.0, 0.17, 0.77}) {
    const LiveTransform found = live.Find("ProbeToReference", time);
    EXPECT_EQ(found.Status(), TransformStatus::Valid);
    EXPECT_EQ(found.time, time);
    EXPECT_LT(Difference(found.transform.matrix, Affine(reference.At(time).inverse() * probe.At(time))), 1e-9);
  }
  EXPECT_EQ(live.Find("ProbeToReference", 0.95).Status(), TransformStatus::Missing);
  EXPECT_NE(live.Find("ProbeToReference", 0.95).message.find("ReferenceToTracker is missing"), std::string::npos);
  // The newest that both have reached is 0.9, though the probe is at 1.0.
  const LiveTransform newest = live.Find("ProbeToReference");
  EXPECT_EQ(newest.Status(), TransformStatus::Valid);
  EXPECT_NEAR(newest.time, 0.9, 1e-12);
  EXPECT_LT(Difference(newest.transform.matrix, Affine(reference.At(0.9).inverse() * probe.At(0.9))), 1e-9);
  EXPECT_NEAR(live.Find("ProbeToTracker").time, 1.0, 1e-12);
}

TEST(LiveTransforms, SendersWithoutACommonMoment)
{
  PoseStream stream;
  stream.SetLive(false);
  const LiveTransforms live(stream);
  Add(stream, "ProbeToTracker", 1000.0, SomePose(1));
  Add(stream, "ReferenceToTracker", 5.0, SomePose(2));
  const LiveTransform found = live.Find("ProbeToReference");
  EXPECT_EQ(found.Status(), TransformStatus::Valid);
  EXPECT_TRUE(std::isnan(found.time));
  EXPECT_EQ(found.message, "poses of different moments");
  EXPECT_LT(Difference(found.transform.matrix, Affine(SomePose(2).inverse() * SomePose(1))), 1e-9);
}

TEST(LiveTransforms, ADropOutIsNotBridgedByALaterPose)
{
  const auto along = [](double x) {
    Pose pose = Pose::Identity();
    pose.translation().x() = x;
    return pose;
  };
  for (const bool isMarked : {true, false}) { // the sender says that it was not seen, or sends nothing
    PoseStream stream;
    stream.SetLive(false);
    const LiveTransforms live(stream);
    Add(stream, "ProbeToTracker", 9.0, along(0.0));
    Add(stream, "ReferenceToTracker", 10.0, along(0.0));
    if (isMarked)
      Add(stream, "ProbeToTracker", 10.0, along(0.0), TransformStatus::Missing);
    Add(stream, "ProbeToTracker", 10.8, along(400.0));
    const LiveTransform lost = live.Find("ProbeToReference");
    EXPECT_EQ(lost.Status(), TransformStatus::Missing);
    EXPECT_EQ(lost.message, "ProbeToTracker is missing");
    Add(stream, "ReferenceToTracker", 10.8, along(0.0));
    const LiveTransform back = live.Find("ProbeToReference");
    EXPECT_EQ(back.Status(), TransformStatus::Valid);
    EXPECT_EQ(back.time, 10.8);
    EXPECT_EQ(back.transform.matrix.translation().x(), 400.0);
  }
}

TEST(LiveTransforms, StatusesAndReasons)
{
  PoseStream stream;
  const LiveTransforms live(stream, {Fixed("Tip", "Probe", Eigen::Affine3d::Identity(), 0.1)});
  EXPECT_EQ(live.Find("TipToTracker").Status(), TransformStatus::Missing);
  EXPECT_NE(live.Find("TipToTracker").message.find("Tracker"), std::string::npos);
  EXPECT_EQ(live.Find("Nonsense").Status(), TransformStatus::Missing);
  EXPECT_NE(live.Find("Nonsense").message.find("does not name two frames"), std::string::npos);
  Add(stream, "ProbeToTracker", 1.0, SomePose(1), TransformStatus::OutOfRange);
  EXPECT_EQ(live.Find("TipToTracker").Status(), TransformStatus::OutOfRange);
  EXPECT_EQ(live.Find("TipToTracker").message, "ProbeToTracker is out of range");
  Add(stream, "ProbeToTracker", 1.1, SomePose(1), TransformStatus::Missing);
  EXPECT_EQ(live.Find("TipToTracker").Status(), TransformStatus::Missing);
  EXPECT_EQ(live.Find("TipToTracker").message, "ProbeToTracker is missing");
  // Names that are no transforms, and from a frame to itself, lead nowhere, and do no harm.
  for (const char* name : {"Nonsense", "AToBToC", "ProbeToProbe", "To", "PROBE"})
    Add(stream, name, 2.0, SomePose(1));
  Add(stream, "ProbeToTracker", 2.0, SomePose(1));
  EXPECT_EQ(live.Find("TipToTracker").Status(), TransformStatus::Valid);
  EXPECT_EQ(live.Find("Tip", "Tip").Status(), TransformStatus::Valid);
}

TEST(LiveTransforms, AStalePictureIsNotShownAsLive)
{
  PoseStream stream;
  const LiveTransforms live(stream, {}, 0.5);
  const double now = ClockNow();
  stream.Add({"ProbeToTracker", 1.0, now - 20.0, SomePose(1), TransformStatus::Valid});
  const LiveTransform found = live.Find("ProbeToTracker");
  EXPECT_EQ(found.Status(), TransformStatus::Missing);
  EXPECT_NE(found.message.find("s ago"), std::string::npos) << found.message;
  EXPECT_EQ(live.Find("ProbeToTracker", 1.0).Status(), TransformStatus::Valid); // it was there then
  stream.SetLive(false);
  EXPECT_EQ(live.Find("ProbeToTracker").Status(), TransformStatus::Valid); // the end of a recording stays
  EXPECT_THROW(LiveTransforms(stream, {}, 0.0), Error);
  EXPECT_THROW(LiveTransforms(stream, {}, NaN), Error);
}

TEST(LiveTransforms, TheStreamComesBeforeWhatIsFixed)
{
  PoseStream stream;
  const LiveTransforms live(stream, {Fixed("Reference", "Tracker", Eigen::Affine3d::Identity(), 0.1)});
  Add(stream, "ReferenceToTracker", 1.0, SomePose(1));
  EXPECT_LT(Difference(live.Find("ReferenceToTracker").transform.matrix, Affine(SomePose(1))), 1e-12);
  NamedTransform none;
  EXPECT_THROW(LiveTransforms(stream, {none}), Error);
}

TEST(LiveTransforms, ManyThreads)
{
  PoseStream stream;
  stream.SetLive(false);
  const LiveTransforms live(stream, {Fixed("Image", "Probe", Eigen::Affine3d::Identity(), 0.5)});
  Add(stream, "ProbeToTracker", 0.0, Pose::Identity());
  Add(stream, "ReferenceToTracker", 0.0, Pose::Identity());
  Worker readers[3];
  for (Worker& reader : readers)
    reader.Start([&live](const Worker::Signal& signal) {
      while (!signal.Stopped()) {
        const LiveTransform found = live.Find("ImageToReference");
        ASSERT_EQ(found.Status(), TransformStatus::Valid) << found.message;
        // Both go along x by the same, so that nothing but one common moment gives nothing.
        ASSERT_NEAR(found.transform.matrix.translation().norm(), 0.0, 1e-9);
      }
    });
  for (int i = 1; i < 2000; ++i) {
    Pose pose = Pose::Identity();
    pose.translation().x() = i;
    Add(stream, "ProbeToTracker", 0.01 * i, pose);
    Add(stream, "ReferenceToTracker", 0.01 * i, pose);
  }
}
