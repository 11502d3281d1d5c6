// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/CoarseGrid.h"
#include "SomeProject.h"
#include "Widgets/Session/ProjectVolumes.h"

using namespace echorama;

namespace {

class ProjectFolder : public FolderTest {
protected:
  SessionVolume Volume(int id, const std::string& name, const std::string& file) const
  {
    Random random(7); // all of one geometry
    SessionVolume volume = SomeVolume(random, name, file.empty() ? file : Path(file));
    volume.id = id;
    return volume;
  }
  static std::vector<int> Ids(const std::vector<SessionVolume>& volumes)
  {
    std::vector<int> ids;
    for (const SessionVolume& volume : volumes)
      ids.push_back(volume.id);
    return ids;
  }
  void MakeFolder(const std::string& name) const { std::filesystem::create_directories(folder / name); }
};

bool Shown(int id)
{
  return id >= 5;
}

} // namespace

TEST_F(ProjectFolder, RecognizesAVolumeByItsPathAndByAnUnmistakableName)
{
  const std::vector<SessionVolume> known{Volume(3, "a", "a.mha"), Volume(4, "b", "old/b.mha"), Volume(5, "c", "one/c.mha"),
                                         Volume(6, "c (2)", "two/c.mha"), Volume(7, "drawn", "")};
  std::vector<SessionVolume> volumes{Volume(1, "other name", "a.mha"), Volume(2, "b", "new/b.mha"), Volume(3, "c", "three/c.mha"),
                                     Volume(4, "drawn", ""), Volume(5, "else", "")};
  Recognize(volumes, known, Shown);
  // c: two have the name; "else": in no file, and of another name.
  EXPECT_EQ(Ids(volumes), (std::vector<int>{3, 4, 0, 7, 0}));
  EXPECT_EQ(volumes[1].file, known[1].file) << "where it is now";
  EXPECT_EQ(LeaveOutFileless("backup", volumes), "backup: it opens without what was in no file: else");
  EXPECT_EQ(Ids(volumes), (std::vector<int>{3, 4, 0, 7}));
}

TEST_F(ProjectFolder, AFileThatIsThereIsNoOther)
{
  MakeFolder("new");
  Put(Path("new/b.mha"), "another");
  std::vector<SessionVolume> volumes{Volume(1, "b", "new/b.mha")};
  Recognize(volumes, {Volume(4, "b", "old/b.mha")}, Shown);
  EXPECT_EQ(volumes[0].id, 0) << "the name counts only when there is nothing at the path";
}

TEST_F(ProjectFolder, PrefersWhatIsShown)
{
  std::vector<SessionVolume> volumes{Volume(1, "a", "a.mha"), Volume(2, "a", "a.mha")};
  Recognize(volumes, {Volume(3, "removed", "a.mha"), Volume(6, "shown", "a.mha")}, Shown);
  EXPECT_EQ(Ids(volumes), (std::vector<int>{6, 3})) << "each once";
  SessionVolume moved = Volume(6, "shown", "a.mha");
  moved.geometry.spacing.x() *= 2.0;
  volumes = {Volume(1, "a", "a.mha")};
  Recognize(volumes, {moved}, Shown);
  EXPECT_EQ(volumes[0].id, 0) << "another geometry is another volume";
}

TEST_F(ProjectFolder, NamesAllThatAreNowhere)
{
  Put(Path("a.mha"), "");
  MakeFolder("else");
  Put(Path("else/b.mha"), "");
  std::vector<SessionVolume> volumes{Volume(0, "a", "a.mha"), Volume(0, "b", "gone/b.mha"), Volume(9, "here", "gone/c.mha")};
  FindVolumes(Path("project.json"), volumes, {Path("else")});
  EXPECT_EQ(volumes[1].file, Path("else/b.mha"));
  EXPECT_EQ(volumes[2].file, Path("gone/c.mha")) << "it is in the session";
  volumes = {Volume(0, "x", "gone/x.mha"), Volume(0, "y", "")};
  try {
    FindVolumes(Path("project.json"), volumes, {});
    ADD_FAILURE() << "found";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("2 of its volumes are not there: " + Path("gone/x.mha") + ", y"), std::string::npos)
        << error.what();
  }
  volumes = {Volume(0, "a", "a.mha"), Volume(0, "a too", "gone/a.mha")};
  EXPECT_THROW(FindVolumes(Path("project.json"), volumes, {}), Error) << "both would be one file";
}

TEST_F(ProjectFolder, NothingIsMovedTwice)
{
  SessionVolume volume = Volume(1, "a", "a.mha");
  ImageGeometry other = volume.geometry;
  other.origin.x() += 1.0;
  EXPECT_THROW(TakeGeometry(volume, other), Error);
  const ImageGeometry coarse = CoarseGrid(volume.geometry, 2); // it was read whole, and now is too large for that
  TakeGeometry(volume, coarse);
  EXPECT_EQ(volume.geometry.dimensions, coarse.dimensions);
  volume.geometry.dimensions = {0, 0, 0}; // the project does not say
  TakeGeometry(volume, other);
  EXPECT_EQ(volume.geometry.origin, other.origin);
}

TEST_F(ProjectFolder, PosesGoThroughAFile)
{
  SessionState state{{Volume(4, "a", "a.mha"), Volume(6, "b", "b.mha")}};
  Random random(3);
  state.volumes[1].volumeToWorld = SomePose(random);
  WritePosesOf(state, Path("poses.json"));
  const std::map<int, Pose> poses = ReadPosesOf(state, Path("poses.json"));
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses.at(6).matrix(), state.volumes[1].volumeToWorld.matrix());
  EXPECT_THROW(ReadPosesOf({{Volume(4, "c", "c.mha")}}, Path("poses.json")), Error) << "it names none";
  EXPECT_THROW(WritePosesOf(state, Path("b.mha")), Error) << "a volume's file stays";
  EXPECT_THROW(WritePosesOf(state, Path("poses.json"), Path("poses.json")), Error) << "so does that of the truth";
  EXPECT_EQ(DisplacementNote(Path("poses.json")), "");
  WritePoses(Path("bent.json"), {{Path("b.mha"), state.volumes[1].geometry, Pose::Identity(), Path("b.vti")}});
  EXPECT_EQ(DisplacementNote(Path("bent.json")),
            Path("bent.json") + ": its displacements (of b.mha) are neither shown here nor kept");
  EXPECT_EQ(DisplacementNote(Path("absent.json")), "");
  state.volumes[0].file.clear();
  EXPECT_THROW(WritePosesOf(state, Path("poses.json")), Error);
}

TEST_F(ProjectFolder, TheSameWorkWhateverTheIds)
{
  const SessionState state{{Volume(1, "a", "a.mha")}};
  SessionState other{{Volume(8, "a", "a.mha")}};
  EXPECT_TRUE(SameWork(state, other));
  other.measurements.push_back({1, {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()}});
  EXPECT_FALSE(SameWork(state, other));
  other.measurements.clear();
  other.volumes[0].volumeToWorld.translation().x() += 1e-9;
  EXPECT_FALSE(SameWork(state, other));
}
