// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "SomeProject.h"
#include "Widgets/Session/SessionTruth.h"
#include <cmath>

using namespace echorama;

namespace {

class TruthFolder : public FolderTest {
protected:
  void SetUp() override
  {
    FolderTest::SetUp();
    Random random(2);
    for (const char* name : {"a.mha", "b.mha", "c.mha"}) {
      state.volumes.push_back(SomeVolume(random, name, Path(name)));
      state.volumes.back().id = 3 + static_cast<int>(state.volumes.size());
    }
  }
  std::string Write(std::size_t count) const
  {
    std::vector<VolumePose> poses;
    for (std::size_t i = 0; i < count; ++i)
      poses.push_back({state.volumes[i].file, state.volumes[i].geometry, Pose::Identity()});
    WritePoses(Path("truth.json"), poses);
    return Path("truth.json");
  }
  SessionTruth::PointsOf pointsOf = [this](int id) {
    asked.push_back(id);
    return std::vector<Eigen::Vector3d>{{1, 2, 3}, {4, 5, 6}};
  };
  SessionState state; // ids 4, 5, 6
  std::vector<int> asked;
};

} // namespace

TEST_F(TruthFolder, TheScoreFollowsPosesWhenItIsTold)
{
  SessionTruth truth;
  EXPECT_TRUE(std::isnan(truth.Mean(state)));
  truth.Read(Write(2), state, pointsOf);
  EXPECT_EQ(asked, (std::vector<int>{4, 5})) << "once for each that is named";
  EXPECT_EQ(truth.Fixed(state), 4);
  EXPECT_NEAR(truth.Mean(state), 0.0, 1e-12);
  state.volumes[1].volumeToWorld.translation() = Eigen::Vector3d(3, 0, 4);
  EXPECT_NEAR(truth.Mean(state), 0.0, 1e-12) << "not yet told";
  truth.Outdate();
  EXPECT_NEAR(truth.Mean(state), 5.0, 1e-12);
  EXPECT_NEAR(truth.MeanOf(5, state), 5.0, 1e-12);
  EXPECT_NEAR(truth.DegreesOf(5, state), 0.0, 1e-6);
  EXPECT_TRUE(std::isnan(truth.MeanOf(6, state)));
  truth.SetFixed(5);
  EXPECT_NEAR(truth.MeanOf(4, state), 5.0, 1e-12);
  EXPECT_THROW(truth.SetFixed(6), Error);
  EXPECT_EQ(truth.Fixed(state), 5);
  EXPECT_EQ(truth.FixedName(state), "b.mha");
  truth.SetFixedName("c.mha", state);
  EXPECT_EQ(truth.Fixed(state), 4) << "its truth may come later";
  EXPECT_EQ(truth.FixedName(state), "c.mha");
  truth.SetFixedName("", state);
  EXPECT_EQ(truth.FixedName(state), "");
}

TEST_F(TruthFolder, AVolumeThatComesLaterHasItsTruth)
{
  const std::string path = Write(3);
  SessionState few = state;
  few.volumes.pop_back();
  SessionTruth truth;
  truth.Read(path, few, pointsOf);
  EXPECT_EQ(truth.Find(6), nullptr);
  truth.Match(state.volumes[2], pointsOf);
  EXPECT_NE(truth.Find(6), nullptr);
}

TEST_F(TruthFolder, WhatIsWrongChangesNothing)
{
  SessionTruth truth;
  truth.Read(Write(2), state, pointsOf);
  SessionState others = state;
  for (SessionVolume& volume : others.volumes)
    volume.file += ".other";
  EXPECT_THROW(truth.Read(Path("truth.json"), others, pointsOf), Error) << "it names none";
  EXPECT_THROW(truth.Read(Path("none.json"), state, pointsOf), Error);
  Pose sheared = Pose::Identity();
  sheared.linear()(0, 1) = 0.5;
  EXPECT_THROW(truth.Set(state.volumes[2], sheared, pointsOf), Error);
  EXPECT_EQ(truth.File(), Path("truth.json"));
  EXPECT_NEAR(truth.Mean(state), 0.0, 1e-12);
  EXPECT_EQ(truth.Find(6), nullptr);
  truth.Clear();
  EXPECT_TRUE(truth.Empty());
  EXPECT_EQ(truth.File(), "");
  EXPECT_EQ(truth.Fixed(state), -1);
}
