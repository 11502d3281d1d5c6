// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "SomeProject.h"
#include "Widgets/Session/AlignmentSession.h"
#include <cmath>
#include <functional>
#include <limits>

using namespace echorama;

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

Pose Shift(double x, double y = 0.0, double z = 0.0)
{
  return Pose(Eigen::Translation3d(x, y, z));
}

AlignmentSession Three()
{
  AlignmentSession session;
  Random random(1);
  for (const char* name : {"a", "b", "c"})
    session.Add(SomeVolume(random, name));
  return session;
}

void ExpectRefused(AlignmentSession& session, const std::function<void()>& edit, const std::string& words,
                   Error::Kind kind = Error::Kind::InvalidParameter)
{
  const SessionState before = session.State();
  const int entries = session.UndoCount();
  try {
    edit();
    ADD_FAILURE() << "accepted; wanted: " << words;
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what() << " lacks " << words;
  }
  EXPECT_TRUE(session.State() == before) << words;
  EXPECT_EQ(session.UndoCount(), entries) << words;
  EXPECT_FALSE(session.Editing()) << words;
}

int AnyId(const AlignmentSession& session, Random& random)
{
  return session.State().volumes[random.Below(session.State().volumes.size())].id;
}

// One operation of any kind, now and then inside an edit, now and then one that changes nothing or is refused.
void DoSomething(AlignmentSession& session, Random& random)
{
  if (session.State().volumes.empty() || (random.Below(12) == 0 && session.State().volumes.size() < 9)) {
    // Compilers differ in which argument comes first, so numbers are drawn one by one.
    const char* name = random.Below(2) ? "same name" : "";
    session.Add(SomeVolume(random, name));
    return;
  }
  const int id = AnyId(session, random);
  switch (random.Below(18)) {
  case 0:
    session.SetPose(id, SomePose(random));
    break;
  case 1:
    session.SetPose(id, Pose(session.State().Find(id)->volumeToWorld));
    break;
  case 2:
    session.SetName(id, "name " + std::to_string(random.Bits()));
    break;
  case 3:
    session.SetColour(id, {random.Uniform(), random.Uniform(), random.Uniform()});
    break;
  case 4:
    session.SetOpacity(id, 0.25 * static_cast<double>(random.Below(5)));
    break;
  case 5:
    session.SetVisible(id, random.Below(2) == 0);
    break;
  case 6:
  case 7:
    session.AddStroke(id, SomeStroke(random));
    break;
  case 8: {
    const bool alone = random.Below(2) == 0, on = random.Below(3) > 0;
    session.Select(id, on, alone);
    break;
  }
  case 9:
    session.InvertSelection();
    break;
  case 10:
    session.SelectAll();
    break;
  case 11:
    session.MoveSelection(SomePose(random));
    break;
  case 12: // a drag
    session.Begin("Drag");
    for (int step = 0; step < 5; ++step) {
      const Eigen::Vector3d way = random.Direction(), turn = 0.1 * random.Direction();
      session.MoveSelection(MotionAbout(session.CentreOfRotation(), turn, way));
    }
    if (random.Below(4) == 0)
      session.Cancel();
    else
      session.End();
    break;
  case 13:
    if (session.Selection().size() > 1)
      session.GroupSelection();
    break;
  case 14:
    session.UngroupSelection();
    break;
  case 15:
    if (random.Below(3) == 0)
      session.Remove(id);
    break;
  case 16: // a backup that is restored
    session.Replace(session.State(), "Nothing");
    break;
  default:
    EXPECT_THROW(session.SetOpacity(id, 2.0), Error);
    EXPECT_THROW(session.SetPose(9999, Pose::Identity()), Error);
  }
}

} // namespace

TEST(AlignmentSession, FiveHundredOperationsUndoneAndDoneAgain)
{
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, 500);
    AlignmentSession session;
    std::vector<SessionState> states{session.State()};
    for (int operation = 0; operation < 500; ++operation) {
      // Now and then some steps back, and from there another way.
      if (random.Below(15) == 0)
        for (std::uint64_t steps = random.Below(5); steps > 0 && session.Undo(); --steps)
          states.pop_back();
      const int entries = session.UndoCount();
      const SessionState before = session.State();
      DoSomething(session, random);
      ASSERT_EQ(session.UndoCount() - entries, before == session.State() ? 0 : 1) << "operation " << operation;
      if (session.UndoCount() > entries)
        states.push_back(session.State());
      ASSERT_EQ(session.UndoCount(), static_cast<int>(states.size()) - 1);
    }
    ASSERT_GT(states.size(), 150u);
    for (std::size_t i = states.size() - 1; i > 0; --i) {
      ASSERT_TRUE(session.State() == states[i]) << "back at " << i;
      ASSERT_FALSE(session.UndoLabel().empty());
      ASSERT_TRUE(session.Undo());
    }
    EXPECT_TRUE(session.State().volumes.empty());
    EXPECT_FALSE(session.Undo());
    EXPECT_TRUE(session.Selection().empty()) << "what is not there is not selected";
    for (std::size_t i = 1; i < states.size(); ++i) {
      ASSERT_TRUE(session.Redo());
      ASSERT_TRUE(session.State() == states[i]) << "forth at " << i;
    }
    EXPECT_FALSE(session.Redo());
  }
}

TEST(AlignmentSession, ADragIsOneEntryAndNothingIsNone)
{
  AlignmentSession session = Three();
  const int entries = session.UndoCount();
  session.Select(1, true);
  session.Begin("Move a");
  for (int i = 0; i < 100; ++i)
    session.MoveSelection(Shift(0.5));
  EXPECT_THROW(session.Undo(), Error) << "not in the middle of a drag";
  EXPECT_TRUE(session.End());
  EXPECT_EQ(session.UndoCount(), entries + 1);
  EXPECT_EQ(session.UndoLabel(), "Move a");

  session.Begin("There and back");
  session.MoveSelection(Shift(0.5));
  session.MoveSelection(Shift(-0.5));
  EXPECT_FALSE(session.End());
  session.Begin("Cancelled");
  session.MoveSelection(Shift(7.0));
  session.Begin("Inner");
  session.SetOpacity(2, 0.5);
  session.End();
  session.Cancel();
  EXPECT_FALSE(session.Editing());
  EXPECT_EQ(session.State().Find(2)->opacity, 1.0);
  session.SelectNone();
  session.MoveSelection(Shift(1.0));
  session.UngroupSelection();
  session.SetVisible(1, true);
  EXPECT_EQ(session.UndoCount(), entries + 1);

  EXPECT_TRUE(session.Undo());
  EXPECT_EQ(session.RedoLabel(), "Move a");
  EXPECT_EQ(session.State().Find(1)->volumeToWorld.matrix(), Pose::Identity().matrix());
  session.SetOpacity(3, 0.5);
  EXPECT_EQ(session.RedoCount(), 0) << "from here another way";
}

TEST(AlignmentSession, LandmarksGoWithTheirVolumes)
{
  AlignmentSession session = Three();
  const int entries = session.UndoCount();
  EXPECT_EQ(session.NextLandmarkLabel(1), "1");
  session.SetLandmark(1, "1", {1, 2, 3});
  session.SetLandmark(1, "apex", {4, 5, 6});
  EXPECT_EQ(session.UndoLabel(), "Mark apex in a");
  EXPECT_EQ(session.NextLandmarkLabel(1), "2") << "a new one";
  EXPECT_EQ(session.NextLandmarkLabel(2), "1") << "the first that it has not";
  session.SetPose(2, Shift(10.0));
  session.SetLandmark(2, "1", {11, 2, 3});
  EXPECT_EQ(session.NextLandmarkLabel(2), "apex");
  const auto positionIn = [&](int id, std::size_t i) { return session.State().Find(id)->landmarks.at(i).position; };
  EXPECT_EQ(positionIn(2, 0), session.State().Find(2)->volumeToWorld.inverse() * Eigen::Vector3d(11, 2, 3));
  session.SetPose(2, Shift(20.0));
  session.SetLandmark(1, "1", {0, 0, 0});
  EXPECT_EQ(session.State().Find(1)->landmarks.size(), 2u) << "it moved, and is no other";
  EXPECT_EQ(positionIn(1, 0), Eigen::Vector3d::Zero());
  EXPECT_EQ(session.UndoCount(), entries + 6);
  session.RemoveLandmark("1");
  EXPECT_EQ(session.State().Find(1)->landmarks.size(), 1u);
  EXPECT_TRUE(session.State().Find(2)->landmarks.empty());
  session.RemoveLandmark("nobody's");
  EXPECT_EQ(session.UndoCount(), entries + 7);
  session.Undo();
  session.Undo();
  EXPECT_EQ(positionIn(1, 0), Eigen::Vector3d(1, 2, 3));
  session.ClearLandmarks();
  for (const SessionVolume& volume : session.State().volumes)
    EXPECT_TRUE(volume.landmarks.empty());
  for (const char* label : {"", "x"})
    EXPECT_THROW(session.SetLandmark(1, label, {0, 0, *label ? std::nan("") : 0.0}), Error);
  EXPECT_THROW(session.SetLandmark(99, "x", {0, 0, 0}), Error);
}

TEST(AlignmentSession, GroupsAreChosenAsAWhole)
{
  AlignmentSession session = Three();
  session.Select(1, true);
  EXPECT_THROW(session.GroupSelection(), Error);
  session.Select(3, true);
  const int group = session.GroupSelection();
  EXPECT_EQ(session.GroupSelection(), group) << "they are one already";
  session.Select(3, false);
  EXPECT_TRUE(session.Selection().empty());
  session.Select(1, true, true);
  EXPECT_EQ(session.Selection(), (std::set<int>{1, 3}));
  session.InvertSelection();
  EXPECT_EQ(session.Selection(), (std::set<int>{2}));
  session.Select(1, true, true);
  session.UngroupSelection();
  session.Select(3, false);
  EXPECT_EQ(session.Selection(), (std::set<int>{1}));
  session.Undo();
  EXPECT_EQ(session.Selection(), (std::set<int>{1, 3})) << "a group that came back is selected as a whole";
}

TEST(AlignmentSession, VolumesTurnAboutTheirMiddleOrAChosenPoint)
{
  AlignmentSession session = Three();
  session.Select(2, true);
  session.SetPose(2, Shift(3.0, 4.0, 5.0));
  const SessionVolume& volume = *session.State().Find(2);
  const Eigen::Vector3d middle = volume.geometry.Centre() + Eigen::Vector3d(3.0, 4.0, 5.0);
  EXPECT_TRUE(session.CentreOfRotation().isApprox(middle, 1e-14));
  for (int i = 0; i < 10000; ++i)
    session.MoveSelection(MotionAbout(session.CentreOfRotation(), Eigen::Vector3d(0.1, 0.02, -0.3), Eigen::Vector3d::Zero()));
  EXPECT_TRUE(session.CentreOfRotation().isApprox(middle, 1e-9)) << "it stays where it is";
  EXPECT_TRUE(IsRotation(session.State().Find(2)->volumeToWorld.linear(), 1e-11)) << "ten thousand steps do not shear";

  session.SetCentreOfRotation(Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(session.CentreOfRotation(), Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_THROW(session.SetCentreOfRotation(Eigen::Vector3d(NaN, 0.0, 0.0)), Error);
  session.SetCentreOfRotation(std::nullopt);
  session.SelectAll();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const SessionVolume& each : session.State().volumes)
    mean += each.volumeToWorld * each.geometry.Centre() / 3.0;
  EXPECT_TRUE(session.CentreOfRotation().isApprox(mean, 1e-12));
}

TEST(AlignmentSession, NamesAndTintsTellVolumesApart)
{
  AlignmentSession session;
  Random random(3);
  for (int i = 0; i < 3; ++i)
    session.Add(SomeVolume(random, "liver"));
  const auto& volumes = session.State().volumes;
  EXPECT_EQ(volumes[0].name, "liver");
  EXPECT_EQ(volumes[1].name, "liver (2)");
  EXPECT_EQ(volumes[2].name, "liver (3)");
  EXPECT_EQ(volumes[0].colour, (std::array<double, 3>{1.0, 1.0, 1.0}));
  EXPECT_NE(volumes[1].colour, volumes[0].colour);
  EXPECT_NE(volumes[2].colour, volumes[1].colour);
  session.Remove(3);
  EXPECT_EQ(session.Add(SomeVolume(random, "x")), 4) << "ids are never given twice";
  EXPECT_TRUE(session.Remembers(3));
  session.Reset(session.State());
  EXPECT_FALSE(session.Remembers(3));
  EXPECT_FALSE(session.Remembers(1)) << "what was opened has new ids";
  EXPECT_TRUE(session.Remembers(5));
}

TEST(AlignmentSession, RefusesWithTheReasonAndChangesNothing)
{
  AlignmentSession session = Three();
  Random random(5);
  session.SelectAll();
  session.SetCentreOfRotation(std::nullopt);
  Pose sheared = Pose::Identity();
  sheared.linear()(0, 1) = 0.01;
  Pose mirror = Pose::Identity();
  mirror.linear()(0, 0) = -1.0;
  Pose projective = Pose::Identity();
  projective.matrix()(3, 0) = 0.5;
  for (const Pose& pose : {sheared, mirror, projective, Shift(NaN), Shift(std::numeric_limits<double>::infinity())}) {
    ExpectRefused(
        session, [&] { session.SetPose(1, pose); }, "not rigid");
    ExpectRefused(
        session, [&] { session.MoveSelection(pose); }, "not rigid");
    SessionVolume volume = SomeVolume(random, "d");
    volume.volumeToWorld = pose;
    ExpectRefused(
        session, [&] { session.Add(volume); }, "not rigid");
    SessionState state = session.State();
    state.volumes[1].volumeToWorld = pose;
    ExpectRefused(
        session, [&] { session.Replace(state, "x"); }, "not rigid");
    ExpectRefused(
        session, [&] { session.Reset(state); }, "not rigid");
  }
  session.SetPose(1, Shift(1e308));
  ExpectRefused(
      session, [&] { session.MoveSelection(Shift(1.5e308)); }, "not rigid");
  session.Undo();
  for (const int id : {0, -1, 4, 1000}) {
    ExpectRefused(
        session, [&] { session.SetPose(id, Pose::Identity()); }, "no volume");
    ExpectRefused(
        session, [&] { session.Remove(id); }, "no volume");
    ExpectRefused(
        session, [&] { session.Select(id, true); }, "no volume");
    ExpectRefused(
        session, [&] { session.AddStroke(id, SomeStroke(random)); }, "no volume");
  }
  ExpectRefused(
      session, [&] { session.SetName(1, "b"); }, "another volume");
  ExpectRefused(
      session, [&] { session.SetName(1, ""); }, "name");
  ExpectRefused(
      session, [&] { session.SetOpacity(1, NaN); }, "opacity");
  ExpectRefused(
      session,
      [&] {
        session.SetColour(1, {0.0, 1.1, 0.0});
      },
      "colour");
  ExpectRefused(
      session, [&] { session.AddStroke(1, Stroke()); }, "no points");
  SessionVolume file = SomeVolume(random, "d", "/data/d.mha");
  session.Add(file);
  ExpectRefused(
      session, [&] { session.Add(file); }, "open already");
  file.file = "/data/e.mha";
  file.geometry.spacing.x() = 0.0;
  ExpectRefused(
      session, [&] { session.Add(file); }, "spacing", Error::Kind::BadInput);
}

TEST(AlignmentSession, LongHistoriesEndWithoutOverflow)
{
  AlignmentSession session = Three();
  Random random(9);
  Stroke stroke = SomeStroke(random);
  StrokeChain chain;
  for (int i = 0; i < 100000; ++i)
    chain = Append(chain, stroke);
  EXPECT_EQ(chain->count, 100000);
  StrokeChain branch = Append(chain->before, stroke);
  chain.reset();
  EXPECT_EQ(StrokesOf(branch).size(), 100000u) << "what two chains share stays";
}

TEST(AlignmentSession, NumbersPlaceAVolumeAndLeaveItAloneWhenTheyAreItsOwn)
{
  AlignmentSession session = Three();
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    session.SetPose(1, SomePose(random));
    const Pose before = session.State().Find(1)->volumeToWorld;
    Placement placement = PlacementOf(*session.State().Find(1));
    const int entries = session.UndoCount();
    session.SetPlacement(1, placement);
    EXPECT_EQ(session.State().Find(1)->volumeToWorld.matrix(), before.matrix()) << "to the last bit";
    EXPECT_EQ(session.UndoCount(), entries);
    placement.middle.x() += 1.0;
    placement.degrees = {10.0, -20.0, 170.0};
    session.SetPlacement(1, placement);
    const Placement now = PlacementOf(*session.State().Find(1));
    EXPECT_LT((now.middle - placement.middle).norm(), 1e-9);
    EXPECT_LT((now.degrees - placement.degrees).norm(), 1e-9);
  }
  ExpectRefused(
      session,
      [&session] {
        session.SetPlacement(1, {{NaN, 0, 0}, {0, 0, 0}});
      },
      "rigid");
}

TEST(AlignmentSession, WhatIsHeldGoesFromWhereItWasTaken)
{
  AlignmentSession session = Three();
  session.Select(1, true);
  session.Select(2, true);
  session.SetCentreOfRotation(Eigen::Vector3d(1, 2, 3));
  const AlignmentSession::Grip grip = session.TakeHold();
  session.Begin(session.LabelOf("Turn"));
  session.MoveHeld(grip, Shift(50.0));
  session.MoveHeld(grip, Shift(2.0)); // not on top of the first
  session.Remove(2);
  session.MoveHeld(grip, Shift(3.0)); // what is gone is left out
  EXPECT_TRUE(session.End());
  EXPECT_EQ(session.UndoLabel(), "Turn 2 volumes");
  EXPECT_EQ(session.State().Find(1)->volumeToWorld.translation(), Eigen::Vector3d(3.0, 0.0, 0.0));
  EXPECT_EQ(session.State().Find(3)->volumeToWorld.translation(), Eigen::Vector3d(0.0, 0.0, 0.0));
  EXPECT_EQ(session.CentreOfRotation(), Eigen::Vector3d(4, 2, 3)) << "the one that was chosen goes along";
  ExpectRefused(
      session, [&] { session.MoveHeld(grip, Shift(NaN)); }, "rigid");
}
