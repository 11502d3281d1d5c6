// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
#include "Widgets/Session/ProjectFolder.h"
#include "Widgets/Testing/SomeProject.h"
#include <algorithm>

namespace fs = std::filesystem;

namespace echorama {
namespace {

class CopiedProject : public ::testing::Test {
protected:
  void SetUp() override
  {
    char name[] = "/tmp/echorama-folder-XXXXXX";
    root = ::mkdtemp(name);
    fs::create_directories(root / "data/one");
    fs::create_directories(root / "data/two/series");
  }
  void TearDown() override { fs::remove_all(root); }

  std::string Write(const std::string& name, const std::string& text)
  {
    std::ofstream(root / name) << text;
    return (root / name).string();
  }
  static std::string Read(const fs::path& path)
  {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // Two volumes of one name, one with a header of its own and a valid region, and a folder of slices.
  Project Some()
  {
    const std::string header = "ObjectType = Image\nNDims = 3\nDimSize = 30 25 20\nElementType = MET_UCHAR\nElementDataFile = ";
    Project project;
    Random random(3);
    const auto add = [&](const std::string& name, const std::string& file) {
      project.state.volumes.push_back(SomeVolume(random, name, file));
      project.state.volumes.back().id = static_cast<int>(project.state.volumes.size());
      project.state.volumes.back().volumeToWorld = SomePose(random);
    };
    add("a", Write("data/one/liver.mhd", header + "liver.raw\n"));
    Write("data/one/liver.raw", std::string(15000, 'a'));
    Write("data/one/liver.ValidRegion.mhd", header + "liver.ValidRegion.raw\n");
    Write("data/one/liver.ValidRegion.raw", std::string(15000, '\1'));
    add("b", Write("data/two/liver.mhd", header + "liver.raw\n"));
    Write("data/two/liver.raw", std::string(15000, 'b'));
    Write("data/two/series/1.png", "first");
    Write("data/two/series/2.png", "second");
    add("c", (root / "data/two/series").string());
    Write("data/one/other.mha", "not of the project");
    return project;
  }
  std::vector<std::string> FilesIn(const fs::path& folder)
  {
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        files.push_back(entry.path().lexically_relative(folder).string());
    std::sort(files.begin(), files.end());
    return files;
  }

  fs::path root;
};

TEST_F(CopiedProject, HoldsAllThatTheProjectNeedsAndOpensElsewhere)
{
  Project project = Some();
  std::vector<VolumePose> truth;
  for (const SessionVolume& volume : project.state.volumes)
    truth.push_back({volume.file, volume.geometry, volume.volumeToWorld.inverse()});
  project.truth = (root / "data/truth.json").string();
  WritePoses(project.truth, truth);
  project.comment = "for people";
  const std::string path = CopyProject(project, (root / "copy").string());
  EXPECT_EQ(path, (root / "copy/copy.json").string());
  EXPECT_EQ(FilesIn(root / "copy"),
            (std::vector<std::string>{"copy.json", "truth.json", "volumes/2/liver.mhd", "volumes/2/liver.raw",
                                      "volumes/liver.ValidRegion.mhd", "volumes/liver.ValidRegion.raw", "volumes/liver.mhd",
                                      "volumes/liver.raw", "volumes/series/1.png", "volumes/series/2.png"}));
  EXPECT_EQ(Read(root / "copy/volumes/liver.raw"), std::string(15000, 'a'));
  EXPECT_EQ(Read(root / "copy/volumes/2/liver.raw"), std::string(15000, 'b'));

  // Another machine: another place, and nothing of what it was copied from.
  fs::create_directories(root / "machine");
  fs::rename(root / "copy", root / "machine/here");
  fs::remove_all(root / "data");
  const Project there = ReadProject((root / "machine/here/copy.json").string());
  ASSERT_EQ(there.state.volumes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const SessionVolume& volume = there.state.volumes[i];
    const std::string found = FindVolume((root / "machine/here/copy.json").string(), volume.file);
    EXPECT_EQ(found.rfind((root / "machine/here/volumes").string(), 0), 0u) << found;
    EXPECT_TRUE(fs::exists(found));
    EXPECT_EQ(volume.volumeToWorld.matrix(), project.state.volumes[i].volumeToWorld.matrix());
    EXPECT_EQ(volume.name, project.state.volumes[i].name);
  }
  EXPECT_EQ(there.comment, "for people");
  const std::vector<VolumePose> known = ReadPoses((root / "machine/here/truth.json").string());
  ASSERT_EQ(known.size(), 3u);
  EXPECT_EQ(known[1].volumeToWorld.matrix(), truth[1].volumeToWorld.matrix());
  EXPECT_TRUE(fs::exists(known[1].file)) << known[1].file;
}

// Under its own name, in the folder alone; two that want one name are told apart, and files keep theirs.
TEST_F(CopiedProject, HoldsVolumesThatAreInNoFileWrittenIntoIt)
{
  Project project = Some();
  for (const char* name : {"both/livers", "other"}) {
    project.state.volumes.push_back(project.state.volumes[0]);
    project.state.volumes.back().name = name;
    project.state.volumes.back().file.clear();
  }
  project.state.volumes[1].file = (root / "data/one/other.mha").string();
  const auto write = [](const SessionVolume& volume, const std::string& file, const Progress& progress) {
    progress(0.5);
    std::ofstream(file) << "voxels of " << volume.name;
    std::ofstream(file.substr(0, file.size() - 4) + ".ValidRegion.mha") << "valid";
  };
  double told = 0.0;
  bool goesOn = true;
  const Progress progress([&](double fraction) { return goesOn = goesOn && fraction >= told, told = fraction, true; });
  const std::string path = CopyProject(project, (root / "copy").string(), progress, write);
  EXPECT_TRUE(goesOn && told <= 1.0 && told > 0.5);
  const auto files = FilesIn(root / "copy");
  EXPECT_EQ(std::count(files.begin(), files.end(), "volumes/other.mha"), 1); // the one that was a file
  EXPECT_EQ(Read(root / "copy/volumes/other.mha"), "not of the project");
  EXPECT_EQ(Read(root / "copy/volumes/both_livers.mha"), "voxels of both/livers");
  EXPECT_EQ(Read(root / "copy/volumes/2/other.mha"), "voxels of other");
  const Project there = ReadProject(path);
  ASSERT_EQ(there.state.volumes.size(), 5u);
  EXPECT_EQ(FindVolume(path, there.state.volumes[3].file), (root / "copy/volumes/both_livers.mha").string());
  EXPECT_EQ(FindVolume(path, there.state.volumes[4].file), (root / "copy/volumes/2/other.mha").string());

  // One that cannot be written leaves nothing.
  const auto fails = [](const SessionVolume&, const std::string& file, const Progress&) {
    throw Error(Error::Kind::FileSystem, file + ": the disk is full");
  };
  EXPECT_THROW(CopyProject(project, (root / "second").string(), {}, fails), Error);
  for (const auto& entry : fs::directory_iterator(root))
    EXPECT_TRUE(entry.path().filename() == "data" || entry.path().filename() == "copy") << entry.path();
}

TEST_F(CopiedProject, OfTwoAtOnceNoneIsMissingFiles)
{
  const Project project = Some();
  const std::string place = (root / "copy").string();
  int told = 0;
  const Progress progress([&](double) { // a second one begins, and is stopped
    if (++told == 3) {
      EXPECT_THROW(CopyProject(project, place, Progress([](double) { return false; })), Error);
    }
    return true;
  });
  CopyProject(project, place, progress);
  EXPECT_GE(told, 3);
  const std::string other = CopyProject(project, (root / "other").string());
  std::vector<std::string> expected = FilesIn(root / "other"), files = FilesIn(root / "copy");
  const auto isProject = [](const std::string& file) { return file.find('/') == std::string::npos; };
  expected.erase(std::remove_if(expected.begin(), expected.end(), isProject), expected.end());
  files.erase(std::remove_if(files.begin(), files.end(), isProject), files.end());
  EXPECT_EQ(files, expected);
  EXPECT_GT(files.size(), 5u);
}

TEST_F(CopiedProject, IsRefusedWithTheReasonAndNothingIsLeft)
{
  const Project project = Some();
  const auto reason = [&](const Project& which, const fs::path& place) {
    try {
      CopyProject(which, place.string());
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(reason(project, root / "data").find("not empty"), std::string::npos);
  EXPECT_NE(reason(project, root / "data/two/series/copy").find("among the files of a volume"), std::string::npos);
  Project fileless = project;
  fileless.state.volumes[0].file.clear();
  EXPECT_NE(reason(fileless, root / "copy").find("a: it is in no file; export it first"), std::string::npos);
  Project gone = project;
  gone.state.volumes[0].file = (root / "data/gone.mha").string();
  EXPECT_NE(reason(gone, root / "copy").find("gone.mha"), std::string::npos);
  Project apart = project;
  apart.state.volumes[0].file =
      Write("data/apart.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 30 25 20\nElementType = MET_UCHAR\nElementDataFile = "
                              "../elsewhere.raw\n");
  Write("elsewhere.raw", std::string(15000, 'e'));
  EXPECT_NE(reason(apart, root / "copy").find("convert it"), std::string::npos) << reason(apart, root / "copy");
  fs::remove(root / "data/apart.mhd");
  EXPECT_THROW(CopyProject(project, (root / "copy").string(), Progress([](double fraction) { return fraction < 0.5; })), Error);
  for (const auto& entry : fs::directory_iterator(root))
    EXPECT_TRUE(entry.path().filename() == "data" || entry.path().filename() == "elsewhere.raw") << entry.path();
  // An empty folder that is there, as a dialog makes one, is taken.
  fs::create_directories(root / "empty");
  EXPECT_EQ(CopyProject(project, (root / "empty/").string()), (root / "empty/empty.json").string());
}

} // namespace
} // namespace echorama
