// SPDX-License-Identifier: BSD-3-Clause
// Results and their sources: what counts as a change of a source, and what happens to the link and to the result.
#include "SomeProject.h"
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/ProjectVolumes.h"

using namespace echorama;

namespace {

class MadeOfTest : public FolderTest {
protected:
  void SetUp() override
  {
    FolderTest::SetUp();
    for (const char* name : {"A", "B", "C"})
      ids.push_back(session.Add(SomeVolume(random, name, Path(std::string(name) + ".mha"))));
    for (const int id : ids)
      session.SetPose(id, SomePose(random));
    session.AddStroke(ids[1], SomeStroke(random));
    SessionVolume made = SomeVolume(random, "result");
    made.madeOf = std::make_shared<const MadeOf>(Record({ids[0], ids[1]}));
    result = session.Add(made);
  }
  MadeOf Record(const std::vector<int>& of) const { return RecordSources(session.State(), of, {{"Method", "membrane"}}); }
  const SessionVolume& Result() const { return *session.State().Find(result); }
  std::string Changes() const { return ChangesSince(session.State(), Result()); }

  Random random{7};
  AlignmentSession session;
  std::vector<int> ids;
  int result = 0;
};

TEST_F(MadeOfTest, EveryChangeOfASourceIsToldAndUndoTakesItBack)
{
  ASSERT_EQ(Changes(), "");
  const auto tells = [&](const std::string& wanted, const std::function<void()>& change) {
    const int entries = session.UndoCount();
    change();
    EXPECT_EQ(Changes(), wanted);
    while (session.UndoCount() > entries)
      session.Undo();
    EXPECT_EQ(Changes(), "") << "after undoing: " << wanted;
  };
  tells("A was moved", [&] { session.SetPose(ids[0], SomePose(random)); });
  tells("B was painted or carved", [&] { session.AddStroke(ids[1], SomeStroke(random)); });
  tells("A was painted or carved", [&] { session.AddStroke(ids[0], SomeStroke(random)); });
  tells("A is gone", [&] { session.Remove(ids[0]); });
  tells("A was moved; B was moved, was painted or carved", [&] {
    session.SelectAll();
    session.Select(result, false);
    session.MoveSelection(SomePose(random));
    session.AddStroke(ids[1], SomeStroke(random));
  });
  tells("A is another volume", [&] { // of the same name
    session.Remove(ids[0]);
    session.Add(SomeVolume(random, "A", Path("A.mha")));
  });
  tells("A was moved; B was moved", [&] { session.SetPose(result, SomePose(random)); }); // it lies elsewhere than they do
  // A thousandth of a millimetre is a change, what is left of rounding is none.
  tells("A was moved", [&] {
    session.SetPose(ids[0], Pose(Eigen::Translation3d(1e-3, 0.0, 0.0)) * session.State().Find(ids[0])->volumeToWorld);
  });
}

TEST_F(MadeOfTest, WhatDoesNotChangeTheVoxelsIsNoChange)
{
  session.SetVisible(ids[0], false);
  session.SetOpacity(ids[0], 0.3);
  session.SetLandmark(ids[0], "apex", {1.0, 2.0, 3.0});
  session.SetPose(ids[2], SomePose(random)); // which is no source
  session.AddStroke(result, SomeStroke(random));
  EXPECT_EQ(Changes(), "");
  session.SetName(ids[0], "liver");
  EXPECT_EQ(Changes(), "") << "the link follows the name";
  EXPECT_EQ(SourcesOf(session.State(), *Result().madeOf), (std::vector<int>{ids[0], ids[1]}));
  session.Remove(ids[1]);
  EXPECT_EQ(SourcesOf(session.State(), *Result().madeOf), (std::vector<int>{ids[0], 0}));
  session.Undo();
  // Everything moved together: they lie to each other as they did.
  session.SelectAll();
  for (int i = 0; i < 50; ++i)
    session.MoveSelection(SomePose(random));
  EXPECT_EQ(Changes(), "");
}

TEST_F(MadeOfTest, AResultOfAResultKnowsThatItWasMadeAgain)
{
  SessionVolume whole = SomeVolume(random, "whole");
  whole.madeOf = std::make_shared<const MadeOf>(Record({result, ids[2]}));
  const int id = session.Add(whole);
  const auto changes = [&] { return ChangesSince(session.State(), *session.State().Find(id)); };
  ASSERT_EQ(changes(), "");
  session.SetPose(ids[0], SomePose(random));
  EXPECT_EQ(changes(), "") << "its own source is as it was";
  session.Remake(result, Result().geometry, Record({ids[0], ids[1]}));
  EXPECT_EQ(changes(), "result was made again");
  EXPECT_THROW(session.Remake(result, Result().geometry, Record({result})), Error) << "of itself";
}

TEST_F(MadeOfTest, MadeAgainItKeepsItsLooksAndWhatWasPaintedStaysInItsPlace)
{
  session.SetColour(result, {0.1, 0.2, 0.3});
  session.SetPose(result, SomePose(random));
  session.AddStroke(result, SomeStroke(random));
  session.SetLandmark(result, "apex", {1.0, 2.0, 3.0});
  const Eigen::Vector3d painted = Result().volumeToWorld * Result().strokes->stroke.pathMm.front();
  const SessionState before = session.State();
  const ImageGeometry other = SomeVolume(random, "").geometry;
  const int edition = Result().edition;
  session.SetFile(result, Path("result.mha"));
  EXPECT_EQ(Result().file, Path("result.mha"));
  int held = 0;
  session.Remake(result, other, Record({ids[0]}), [&](const SessionVolume& volume) { held = volume.edition; });
  EXPECT_EQ(Result().colour, (std::array<double, 3>{0.1, 0.2, 0.3}));
  EXPECT_TRUE(SameGeometry(Result().geometry, other));
  EXPECT_EQ(Result().volumeToWorld.matrix(), Eigen::Matrix4d::Identity());
  EXPECT_TRUE((Result().volumeToWorld * Result().strokes->stroke.pathMm.front()).isApprox(painted, 1e-12));
  EXPECT_TRUE(session.PlaceOfLandmark(result, "apex")->isApprox(Eigen::Vector3d(1.0, 2.0, 3.0), 1e-12));
  EXPECT_EQ(Result().file, "") << "the file holds what it was before";
  EXPECT_EQ(held, Result().edition);
  EXPECT_NE(held, edition);
  EXPECT_EQ(Changes(), "");
  session.Undo();
  EXPECT_EQ(Result().file, Path("result.mha")) << "that is a fact, and no edit";
  EXPECT_EQ(Result().edition, edition);
  EXPECT_TRUE(session.Remembers(result, held)) << "it can be done again";
  session.Redo();
  EXPECT_EQ(Result().edition, held);
  session.Remake(result, other, Record({ids[0]}));
  EXPECT_GT(Result().edition, held) << "never given twice";
  // What cannot be held changes nothing.
  const SessionState now = session.State();
  const int entries = session.UndoCount();
  EXPECT_THROW(session.Remake(result, other, Record({ids[1]}), [](const SessionVolume&) { throw std::bad_alloc(); }),
               std::bad_alloc);
  EXPECT_TRUE(session.State() == now);
  EXPECT_EQ(session.UndoCount(), entries);
  EXPECT_THROW(session.Remake(ids[0], other, Record({ids[1]})), Error) << "which is no result";
}

TEST_F(MadeOfTest, RecordsRefuseWhatIsNoSource)
{
  EXPECT_THROW(Record({}), Error);
  EXPECT_THROW(Record({ids[0], 99}), Error);
  EXPECT_THROW(Record({ids[0], ids[0]}), Error);
  EXPECT_THROW(session.SetFile(result, Path("A.mha")), Error) << "A is that file";
  EXPECT_EQ(Result().file, "");
}

TEST_F(MadeOfTest, AProjectBringsTheLinkBackToTheLastBit)
{
  session.SetFile(result, Path("result.mha"));
  session.SetCentreOfRotation(Eigen::Vector3d(0.1, -0.2, 1e-7));
  Project project{session.State(), {}, {}, {{"B", SomePose(random)}}};
  WriteProject(Path("p.json"), project);
  const Project back = ReadProject(Path("p.json"));
  EXPECT_TRUE(SameTruths(back.truths, project.truths));
  EXPECT_FALSE(SameTruths(back.truths, {}));
  EXPECT_EQ(back.state.centre, project.state.centre);
  ASSERT_TRUE(back.state.volumes[3].madeOf);
  EXPECT_TRUE(*back.state.volumes[3].madeOf == *Result().madeOf);
  EXPECT_EQ(ChangesSince(back.state, back.state.volumes[3]), "");
  AlignmentSession again;
  again.Reset(back.state);
  again.SetPose(again.State().IdAt(0), SomePose(random));
  EXPECT_EQ(ChangesSince(again.State(), again.State().volumes[3]), "A was moved");
  EXPECT_TRUE(MadeOfText(TextOf(*Result().madeOf), "") == *Result().madeOf);
}

TEST_F(MadeOfTest, ABrokenLinkIsNamed)
{
  session.SetFile(result, Path("result.mha"));
  WriteProject(Path("p.json"), {session.State(), {}, {}});
  const std::string good = Text(Path("p.json"));
  const auto refuses = [&](const std::string& from, const std::string& to, const std::string& words) {
    std::string bad = good;
    ASSERT_NE(bad.rfind(from), std::string::npos) << from;
    bad.replace(bad.rfind(from), from.size(), to);
    Put(Path("bad.json"), bad);
    try {
      ReadProject(Path("bad.json"));
      ADD_FAILURE() << to;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refuses("\"options\": {", "\"options\": [], \"other\": {", "madeOf, options");
  refuses("\"Method\": \"membrane\"", "\"Method\": 3", "options, Method");
  refuses("\"sources\": [", "\"sources\": [], \"other\": [", "madeOf, sources");
  refuses("\"name\": \"B\",\n      \"file\"", "\"name\": \"A\",\n      \"file\"", "source 2, name");
  refuses("\"VolumeToResult\"", "\"VolumeTo\"", "VolumeToResult");
}

TEST_F(MadeOfTest, PoseFilesLeaveResultsOut)
{
  WritePosesOf(session.State(), Path("poses.json")); // the result is in no file, and that is no reason to refuse
  EXPECT_EQ(ReadPoses(Path("poses.json")).size(), 3u);
  session.SetFile(result, Path("result.mha"));
  WritePosesOf(session.State(), Path("poses.json"));
  EXPECT_EQ(ReadPoses(Path("poses.json")).size(), 3u);
}

// A backup of a result that was in no file: its voxels are those of the same making, or they are not there.
TEST_F(MadeOfTest, ABackupFindsTheVoxelsThatWereMadeInTheSameWay)
{
  const SessionVolume first = Result();
  session.SetPose(ids[0], SomePose(random));
  session.Remake(result, first.geometry, Record({ids[0], ids[1]}));
  const SessionVolume second = Result();
  for (const SessionVolume& wanted : {first, second}) {
    std::vector<SessionVolume> volumes{wanted};
    volumes[0].id = 0;
    volumes[0].edition = 0;
    Recognize(volumes, {first, second}, [](int) { return true; });
    EXPECT_EQ(volumes[0].id, result);
    EXPECT_EQ(volumes[0].edition, wanted.edition);
  }
}

TEST(SessionCentre, IsPartOfWhatUndoBringsBack)
{
  Random random(3);
  AlignmentSession session;
  const int id = session.Add(SomeVolume(random, "A"));
  session.SetCentreOfRotation(Eigen::Vector3d(1.0, 2.0, 3.0));
  session.Select(id, true);
  session.Begin("Drag");
  const auto grip = session.TakeHold();
  session.MoveHeld(grip, Pose(Eigen::Translation3d(5.0, 0.0, 0.0)));
  session.End();
  EXPECT_EQ(session.CentreOfRotation(), Eigen::Vector3d(6.0, 2.0, 3.0)) << "it goes along";
  session.Undo();
  EXPECT_EQ(session.CentreOfRotation(), Eigen::Vector3d(1.0, 2.0, 3.0));
  session.Undo();
  EXPECT_FALSE(session.ChosenCentre()) << "as it was before it was chosen";
  session.Redo();
  session.Redo();
  EXPECT_EQ(session.CentreOfRotation(), Eigen::Vector3d(6.0, 2.0, 3.0));
}

} // namespace
