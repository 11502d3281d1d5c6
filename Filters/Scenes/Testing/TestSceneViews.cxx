// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Scenes/SceneViews.h"
#include "Testing/TemporaryFolder.h"
#include <gtest/gtest.h>
#include <sstream>

using namespace echorama;
using Eigen::Vector3d;

namespace {

SynthesisScene Parse(const std::string& members)
{
  return SceneFromJson(
      R"({"schema": "echorama-scene-1", "background": "air", "probe": {"elements": 8, "sweepSteps": 6, "samples": 30}, )" +
          members + "}",
      "scene.json");
}

// Down to the skin in a second, then 30 mm along it in three.
const std::string keys = R"("views": {"keys": [
  {"seconds": 0, "pose": {"face": [0, 0, -20], "target": [0, 0, 50]}},
  {"seconds": 1, "pose": {"face": [0, 0, 4], "target": [0, 0, 50]}},
  {"seconds": 4, "pose": {"face": [30, 0, 4], "target": [30, 0, 50]}}], )";

std::string MessageOf(const SynthesisScene& scene)
{
  try {
    ViewsOf(scene);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

using SceneRecordings = echorama::testing::TemporaryFolder;

} // namespace

TEST(SceneViews, OfKeysLieOnThePath)
{
  const auto views = ViewsOf(Parse(keys + R"("times": [1, 2.5, 4]})"));
  ASSERT_EQ(views.size(), 3u);
  const Vector3d faces[] = {{0, 0, 4}, {15, 0, 4}, {30, 0, 4}};
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_TRUE(views[n].probeToWorld.translation().isApprox(faces[n], 1e-12)) << n;
    EXPECT_TRUE(views[n].way.empty()) << "nothing is moved";
    ASSERT_EQ(views[n].states.size(), 1u);
    EXPECT_EQ(views[n].states[0].firstStep, 0);
    EXPECT_EQ(views[n].states[0].lastStep, 5);
  }
  const auto even = ViewsOf(Parse(keys + R"("count": 5})"));
  ASSERT_EQ(even.size(), 5u);
  EXPECT_TRUE(even[3].probeToWorld.translation().isApprox(Vector3d(20, 0, 4), 1e-12)); // at 3 s
}

TEST(SceneViews, TheWayIsFollowedInSmallSteps)
{
  const auto views = ViewsOf(Parse(R"("gel": {}, )" + keys + R"("times": [1, 4], "stepMm": 5})"));
  ASSERT_EQ(views.size(), 2u);
  TimedPose last = views[0].way.front();
  EXPECT_EQ(last.time, 0.0);
  EXPECT_EQ(last.pose.translation().z(), -20.0);
  double way = 0.0;
  std::size_t moments = 0;
  for (const SceneView& view : views)
    for (const TimedPose& next : view.way) {
      const double step = (next.pose.translation() - last.pose.translation()).norm();
      EXPECT_LE(step, 5.0);
      EXPECT_GE(next.time, last.time);
      way += step;
      last = next;
      ++moments;
    }
  EXPECT_NEAR(way, 24.0 + 30.0, 1e-9);
  EXPECT_LT(moments, 30u); // 11 pieces of 5 mm would do; halves are at least half as long
  EXPECT_EQ(views[0].way.back().time, 1.0);
  EXPECT_EQ(views[1].way.back().time, 4.0);
  EXPECT_GT(views[1].way.front().time, 1.0);
}

TEST(SceneViews, AMoveThereAndBackIsNotMissed)
{
  const auto views = ViewsOf(Parse(R"("gel": {}, "views": {"keys": [
    {"seconds": 0, "pose": {"face": [0, 0, 0], "target": [0, 0, 50]}},
    {"seconds": 1, "pose": {"face": [20, 0, 0], "target": [20, 0, 50]}},
    {"seconds": 2, "pose": {"face": [0, 0, 0], "target": [0, 0, 50]}}], "times": [2]})"));
  double farthest = 0.0;
  for (const TimedPose& moment : views.at(0).way)
    farthest = std::max(farthest, moment.pose.translation().x());
  EXPECT_EQ(farthest, 20.0);
}

TEST_F(SceneRecordings, TimesSoLargeThatNothingLiesBetweenThemEnd)
{
  std::ostringstream frames;
  frames << "ObjectType = Image\nNDims = 3\nDimSize = 1 1 10\nElementType = MET_UCHAR\n" << std::fixed;
  for (int i = 0; i < 10; ++i) // neighbouring numbers are 2 s apart there
    frames << "Seq_Frame000" << i << "_Timestamp = " << 1e16 + 2.0 * i << "\nSeq_Frame000" << i
           << "_ProbeToTrackerTransform = 1 0 0 " << 10 * i << " 0 1 0 0 0 0 1 0 0 0 0 1\n";
  Put("path.igs.mha", frames.str() + "ElementDataFile = LOCAL\n0123456789");
  SynthesisScene scene = Parse(R"("gel": {}, "views": {"recording":
    {"file": "path.igs.mha", "smoothSeconds": 0, "longestGapSeconds": 600, "count": 2, "stepMm": 1}})");
  scene.folder = folder.string();
  const auto views = ViewsOf(scene);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[1].way.back().pose.translation().x(), 90.0);
}

TEST(SceneViews, ASweepThatMovesHasSeveralStates)
{
  const std::string sweep =
      R"("sweep": {"seconds": 0.6, "velocityMmPerSecond": [10, 0, 0], "states": 3}, "views": {"count": 1}, )";
  const auto views = ViewsOf(Parse(sweep + R"("press": {})"));
  ASSERT_EQ(views.at(0).states.size(), 3u);
  ASSERT_EQ(views[0].steps.size(), 6u);
  int next = 0;
  for (const SceneState& state : views[0].states) {
    EXPECT_EQ(state.firstStep, next);
    EXPECT_EQ(state.lastStep, next + 1);
    // Its tissue is that of the moment between its two planes.
    const Vector3d middle = 0.5 * (views[0].steps[static_cast<std::size_t>(next)].translation() +
                                   views[0].steps[static_cast<std::size_t>(next) + 1].translation());
    EXPECT_TRUE(state.probe.pose.translation().isApprox(middle, 1e-9)) << next;
    next += 2;
  }
  EXPECT_EQ(ViewsOf(Parse(sweep + R"("name": "no press")")).at(0).states.size(), 1u) << "nothing gives way";
  EXPECT_EQ(ViewsOf(Parse(R"("press": {}, "sweep": {"seconds": 0.6}, "views": {"count": 1})")).at(0).states.size(), 1u)
      << "the probe rests";
}

TEST(SceneViews, ASweepBesideThePathStaysWithinItsTimesWhereTheWayMatters)
{
  const std::string sweep = R"("sweep": {"seconds": 0.6, "velocityMmPerSecond": [10, 0, 0]}, )";
  const auto free = ViewsOf(Parse(R"("press": {}, )" + sweep + keys + R"("count": 3})"));
  ASSERT_EQ(free.size(), 3u);
  for (const SceneView& view : free) {
    EXPECT_TRUE(view.way.empty()) << "tissue forgets it";
    ASSERT_EQ(view.states.size(), 3u);
  }
  EXPECT_EQ(free.front().states[1].probe.time, 0.0);
  EXPECT_EQ(free.back().states[1].probe.time, 4.0);

  for (const std::string goesOn : {R"("press": {"friction": 0.3}, )", R"("gel": {}, )"}) {
    const auto views = ViewsOf(Parse(goesOn + sweep + keys + R"("count": 3})"));
    ASSERT_EQ(views.size(), 3u);
    EXPECT_NEAR(views.front().states[1].probe.time, 0.3, 1e-12);
    EXPECT_NEAR(views.back().states[1].probe.time, 3.7, 1e-12);
    EXPECT_EQ(views.front().way.front().time, 0.0);
    EXPECT_LE(views.back().way.back().time, 4.0);
    EXPECT_NE(MessageOf(Parse(goesOn + sweep + keys + R"("times": [0.2]})"))
                  .find("the sweep around 0.2 s is not within the path, from 0 to 4 s"),
              std::string::npos);
  }
}

TEST(SceneViews, TheFirstSweepMayBeginWithThePath)
{
  // 0.1 + 0.25 - 0.25 is a little less than 0.1.
  const auto views =
      ViewsOf(Parse(R"("gel": {}, "sweep": {"seconds": 0.5, "alongRecording": true, "states": 6}, "views": {"keys": [
    {"seconds": 0.1, "pose": {"face": [0, 0, 0], "target": [0, 0, 50]}},
    {"seconds": 2, "pose": {"face": [20, 0, 0], "target": [20, 0, 50]}}], "count": 2})"));
  EXPECT_EQ(views.at(0).way.front().time, views.at(0).states.front().probe.time);
  EXPECT_NEAR(views.at(0).way.front().time, 0.1, 1e-12);
}

TEST(SceneViews, RefusesWhatATimeCannotBe)
{
  EXPECT_NE(MessageOf(Parse(R"("gel": {}, "sweep": {"seconds": 1, "alongRecording": true}, )" + keys + R"("times": [1, 1.5]})"))
                .find("view 2 begins before the one before it has ended"),
            std::string::npos);
  EXPECT_NE(MessageOf(Parse(R"("sweep": {"seconds": 1, "alongRecording": true}, )" + keys + R"("times": [0.2]})"))
                .find("the sweep around 0.2 s is not within the path, from 0 to 4 s"),
            std::string::npos);
}
