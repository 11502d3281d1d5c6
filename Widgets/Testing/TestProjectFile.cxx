// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
#include "SomeProject.h"
#include <csignal>
#include <sys/resource.h>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

class ProjectFile : public FolderTest {
protected:
  void ExpectRefused(const std::string& text, const std::string& words, Error::Kind kind = Error::Kind::BadFile) const
  {
    Put(Path("p.json"), text);
    try {
      ReadProject(Path("p.json"));
      ADD_FAILURE() << "accepted; wanted: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), kind) << error.what();
      EXPECT_NE(std::string(error.what()).find(Path("p.json")), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what() << " lacks " << words;
    }
  }
  /// A good project with \a from replaced.
  std::string With(const std::string& from, const std::string& to) const
  {
    WriteProject(Path("good.json"), SomeProject(5, Path()));
    std::string text = Text(Path("good.json"));
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
};

} // namespace

TEST_F(ProjectFile, EveryBitComesBack)
{
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Project project = SomeProject(seed, Path());
    WriteProject(Path("p.json"), project);
    const Project back = ReadProject(Path("p.json"));
    EXPECT_TRUE(back.state == project.state) << "seed " << seed;
    EXPECT_EQ(back.truth, project.truth);
    EXPECT_EQ(back.comment, project.comment);
  }
  EXPECT_EQ(Text(Path("p.json")).find("fixed"), std::string::npos) << "none was chosen";
  Project extreme = SomeProject(3, Path());
  extreme.state.volumes[0].volumeToWorld.translation() = Eigen::Vector3d(-0.0, 5e-324, 1.7976931348623157e308);
  extreme.state.volumes[1].name = "\u00e4\u6f22 \\ \n";
  extreme.state.volumes[1].landmarks = {{"apex \"", {1.0 / 3.0, -0.0, 5e-324}}, {"2", {1, 2, 3}}};
  extreme.fixed = extreme.state.volumes[1].name;
  WriteProject(Path("p.json"), extreme);
  EXPECT_TRUE(ReadProject(Path("p.json")) == extreme);
  EXPECT_TRUE(std::signbit(ReadProject(Path("p.json")).state.volumes[0].volumeToWorld.translation().x()));
  WriteProject(Path("p.json"), Project());
  EXPECT_TRUE(ReadProject(Path("p.json")).state.volumes.empty());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "no temporary file stays";
}

TEST_F(ProjectFile, IsAPoseFileAndAPoseFileIsAProject)
{
  const Project project = SomeProject(1, Path());
  WriteProject(Path("p.json"), project);
  const std::vector<VolumePose> poses = ReadPoses(Path("p.json"));
  ASSERT_EQ(poses.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const SessionVolume& volume = project.state.volumes[i];
    EXPECT_EQ(PoseFor(poses, volume.file, volume.geometry).volumeToWorld.matrix(), volume.volumeToWorld.matrix());
  }
  WritePoses(Path("poses.json"), poses);
  const Project back = ReadProject(Path("poses.json"));
  ASSERT_EQ(back.state.volumes.size(), 3u);
  EXPECT_EQ(back.state.volumes[2].name, "v2");
  EXPECT_EQ(back.state.volumes[2].file, project.state.volumes[2].file);
  EXPECT_EQ(back.state.volumes[2].volumeToWorld.matrix(), project.state.volumes[2].volumeToWorld.matrix());
}

TEST_F(ProjectFile, FilesAreFoundWhereTheFolderWent)
{
  fs::create_directories(folder / "here" / "volumes");
  Project project = SomeProject(2, Path("here/volumes"));
  for (const SessionVolume& volume : project.state.volumes)
    Put(volume.file, "voxels");
  WriteProject(Path("here/p.json"), project);

  // The whole folder goes to another place.
  fs::rename(folder / "here", folder / "there");
  Project moved = ReadProject(Path("there/p.json"));
  EXPECT_EQ(moved.state.volumes[0].file, Path("there/volumes/v0.mha"));

  // The project alone goes: the absolute path still leads to the volumes.
  WriteProject(Path("there/p.json"), moved);
  fs::create_directories(folder / "else" / "where");
  fs::copy(folder / "there" / "p.json", folder / "else" / "where" / "p.json");
  moved = ReadProject(Path("else/where/p.json"));
  EXPECT_EQ(moved.state.volumes[0].file, Path("there/volumes/v0.mha"));

  // A volume is beside the project now; another in a folder that is searched; the third is gone.
  fs::rename(folder / "there" / "volumes" / "v0.mha", folder / "else" / "where" / "v0.mha");
  fs::create_directories(folder / "archive");
  fs::rename(folder / "there" / "volumes" / "v1.mha", folder / "archive" / "v1.mha");
  fs::remove(folder / "there" / "volumes" / "v2.mha");
  const std::string path = Path("else/where/p.json");
  moved = ReadProject(path);
  EXPECT_EQ(FindVolume(path, moved.state.volumes[0].file), Path("else/where/v0.mha"));
  EXPECT_EQ(FindVolume(path, moved.state.volumes[1].file), "");
  EXPECT_EQ(FindVolume(path, moved.state.volumes[1].file, {Path("nowhere"), Path("archive")}), Path("archive/v1.mha"));
  EXPECT_EQ(FindVolume(path, moved.state.volumes[2].file, {Path("archive")}), "");
  EXPECT_EQ(FindVolume(path, ""), "");
  EXPECT_EQ(FindVolume(Path("else/where/p.backups/backup.json"), "/gone/v0.mha"), Path("else/where/v0.mha"))
      << "of a backup: beside its project";
}

TEST_F(ProjectFile, RefusesWhatIsNotAProject)
{
  ExpectRefused("", "not JSON");
  ExpectRefused("{\"schema\": \"echorama-project-1\"", "not JSON");
  ExpectRefused("[]", "schema");
  ExpectRefused("{}", "schema");
  ExpectRefused(std::string(200, '['), "nested");
  ExpectRefused(With("echorama-project-1", "echorama-project-2"), "echorama-project-2");
  ExpectRefused(With("echorama-project-1", "echorama-transforms-1"), "schema");
  ExpectRefused(With("\"mm\"", "\"cm\""), "unit");
  ExpectRefused(With("\"LPS\"", "\"RAS\""), "frame");
  ExpectRefused(With("\"volumes\": [", "\"volumes\": 3, \"x\": ["), "volumes");
  ExpectRefused(With("\"VolumeToWorld\"", "\"x\""), "VolumeToWorld");
  ExpectRefused(With("\"dimensions\": [\n     30", "\"dimensions\": [\n     0"), "volume 1, geometry, dimensions");
  ExpectRefused(With("\"opacity\": 0.", "\"opacity\": 7."), "volume 1, opacity");
  ExpectRefused(With("\"opacity\": 0.", "\"opacity\": \"much\", \"x\": 0."), "volume 1, opacity");
  ExpectRefused(With("\"visible\": true", "\"visible\": 1"), "volume 1, visible");
  ExpectRefused(With("\"group\": 0", "\"group\": -1"), "volume 1, group");
  ExpectRefused(With("\"group\": 0", "\"group\": 1.5"), "volume 1, group");
  ExpectRefused(With("\"mode\": \"", "\"mode\": \"air"), "volume 2, stroke 1, mode");
  ExpectRefused(With("\"radiusMm\": ", "\"radiusMm\": -"), "volume 2, stroke 1");
  ExpectRefused(With("\"hardness\": 0.", "\"hardness\": 3."), "Hardness is 3.");
  ExpectRefused(With("\"pathMm\": [", "\"pathMm\": [], \"x\": ["), "no points");
  ExpectRefused(With("\"strokes\": []", "\"strokes\": {}"), "volume 1, strokes");
  const auto landmarks = [this](const char* list) { return With("\"landmarks\": []", std::string("\"landmarks\": ") + list); };
  ExpectRefused(landmarks("3"), "volume 1, landmarks: a list");
  ExpectRefused(landmarks("[{\"label\": \"a\", \"position\": [1, 2]}]"), "landmarks, landmark 1, position");
  ExpectRefused(landmarks("[{\"label\": \"\", \"position\": [1, 2, 3]}]"), "landmark 1, label");
  ExpectRefused(landmarks("[{\"label\": \"a\", \"position\": [1, 2, 3]}, {\"label\": \"a\", \"position\": [1, 2, 3]}]"),
                "landmark 2, label");
  std::string fixed = With("\"group\": 0", "\"group\": 0, \"fixed\": true");
  fixed.replace(fixed.find("\"group\": 4"), 10, "\"group\": 4, \"fixed\": true");
  ExpectRefused(fixed, "volume 2, fixed: volume \"0\" is");
  ExpectRefused(With("\"group\": 0", "\"group\": 0, \"fixed\": 1"), "volume 1, fixed");
  ExpectRefused(With("v1.mha", "v0.mha"), "v0.mha is named twice");
  ExpectRefused(With("volume \\\"1", "volume \\\"0"), "another volume");
  ExpectRefused(With("\"comment\": \"", "\"comment\": 3, \"x\": \""), "comment");
  EXPECT_THROW(ReadProject(Path("missing.json")), Error);
  EXPECT_THROW(ReadProject(Path()), Error) << "a folder";
}

TEST_F(ProjectFile, AChangedBackupIsFoundOut)
{
  const BackupStamp stamp{7, 1700000000, "Move a"};
  WriteBackup(Path("good.json"), SomeProject(5, Path()), stamp);
  BackupStamp back;
  EXPECT_TRUE(ReadProject(Path("good.json"), &back).state == SomeProject(5, Path()).state);
  EXPECT_EQ(back.number, 7);
  EXPECT_EQ(back.time, 1700000000);
  EXPECT_EQ(back.label, "Move a");

  // Any digit of it.
  const std::string text = Text(Path("good.json"));
  Random random(4);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    std::string damaged = text;
    char& letter = damaged[random.Below(text.size() - 1)]; // but the last line break
    const char other = static_cast<char>('0' + random.Below(10));
    if (letter == other || letter == ' ')
      continue;
    letter = other;
    Put(Path("bad.json"), damaged);
    try {
      // The last digit of seventeen may stand for the same number.
      EXPECT_TRUE(ReadProject(Path("bad.json")).state == SomeProject(5, Path()).state) << damaged;
    } catch (const Error&) {
      ++found;
    }
  }
  EXPECT_GT(found, 200);
  for (std::size_t length = 0; length + 1 < text.size(); length += 1 + text.size() / 50) {
    Put(Path("bad.json"), text.substr(0, length));
    EXPECT_THROW(ReadProject(Path("bad.json")), Error);
  }
}

TEST_F(ProjectFile, AFullDiskLeavesWhatWasThere)
{
  const Project before = SomeProject(6, Path());
  WriteProject(Path("p.json"), before);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{3000, limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  try {
    WriteProject(Path("p.json"), SomeProject(7, Path()));
    ADD_FAILURE() << "written";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
    EXPECT_NE(std::string(error.what()).find(Path("p.json")), std::string::npos) << error.what();
  }
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(ReadProject(Path("p.json")).state == before.state);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
  EXPECT_THROW(WriteProject(Path("missing/p.json"), before), Error);
  EXPECT_THROW(WriteProject("/dev/full", before), Error);
  EXPECT_THROW(WriteProject("", before), Error);
  Project odd = before;
  odd.state.volumes[0].name = "\xff";
  EXPECT_THROW(WriteProject(Path("p.json"), odd), Error);
  EXPECT_TRUE(ReadProject(Path("p.json")).state == before.state);
}
