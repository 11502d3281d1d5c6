// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Widgets/Session/PoseComparison.h"
#include "Widgets/Testing/SomeProject.h"

namespace echorama {
namespace {

SessionState SomeState(int count)
{
  Random random(11);
  SessionState state;
  for (int id = 1; id <= count; ++id) {
    state.volumes.push_back(SomeVolume(random, "v" + std::to_string(id)));
    state.volumes.back().id = id;
    state.volumes.back().volumeToWorld = SomePose(random);
  }
  return state;
}

std::map<int, Pose> PosesOf(const SessionState& state)
{
  std::map<int, Pose> poses;
  for (const SessionVolume& volume : state.volumes)
    poses[volume.id] = volume.volumeToWorld;
  return poses;
}

TEST(PoseComparison, MeasuresAMotionThatIsKnown)
{
  const SessionState state = SomeState(3);
  std::map<int, Pose> other = PosesOf(state);
  const SessionVolume& second = state.volumes[1];
  const Eigen::Vector3d centre = second.volumeToWorld * second.geometry.Centre();
  // 3, 4, 0 mm and 10 degrees about the middle: the middle moves by 5 mm, no corner by less than nothing or more than the turn
  // adds.
  other[2] = MotionAbout(centre, Eigen::Vector3d(0, 0, 10.0 / DegreesPerRadian), Eigen::Vector3d(3, 4, 0)) * other[2];
  other.erase(3);
  const auto differences = ComparePoses(state, other, false);
  ASSERT_EQ(differences.size(), 3u);
  EXPECT_TRUE(differences[0].isKnown);
  EXPECT_NEAR(differences[0].mostMm, 0.0, 1e-9);
  EXPECT_NEAR(differences[0].degrees, 0.0, 1e-5);
  EXPECT_NEAR(differences[1].middleMm, 5.0, 1e-9);
  EXPECT_NEAR(differences[1].degrees, 10.0, 1e-9);
  double most = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d index(corner & 1 ? 29 : 0, corner & 2 ? 24 : 0, corner & 4 ? 19 : 0);
    const Eigen::Vector3d point = second.geometry.IndexToWorld() * index;
    most = std::max(most, (second.volumeToWorld * point - other[2] * point).norm());
  }
  EXPECT_NEAR(differences[1].mostMm, most, 1e-9);
  EXPECT_GT(most, 5.0);
  EXPECT_EQ(differences[2].id, 3);
  EXPECT_FALSE(differences[2].isKnown);
}

TEST(PoseComparison, AMotionOfAllIsNoDifferenceBesideTheFirst)
{
  const SessionState state = SomeState(3);
  Random random(5);
  const Pose together = SomePose(random, 70.0);
  std::map<int, Pose> other = PosesOf(state);
  for (auto& [id, pose] : other)
    pose = together * pose;
  for (const PoseDifference& difference : ComparePoses(state, other, true)) {
    EXPECT_NEAR(difference.mostMm, 0.0, 1e-9);
    EXPECT_NEAR(difference.degrees, 0.0, 1e-5);
  }
  for (const PoseDifference& difference : ComparePoses(state, other, false))
    EXPECT_GT(difference.middleMm, 1.0);
  other.erase(1); // then the second is the first that both know
  const auto differences = ComparePoses(state, other, true);
  EXPECT_FALSE(differences[0].isKnown);
  EXPECT_NEAR(differences[2].mostMm, 0.0, 1e-9);
}

} // namespace
} // namespace echorama
