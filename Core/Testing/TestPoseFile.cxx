// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/CoarseGrid.h"
#include "Core/Geometry/PoseFile.h"
#include <csignal>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <sys/resource.h>
#include <unistd.h>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

class PoseFile : public ::testing::Test {
protected:
  void SetUp() override
  {
    folder = fs::temp_directory_path() / ("echorama-poses-" + std::to_string(getpid()));
    fs::create_directories(folder / "sub");
  }
  void TearDown() override { fs::remove_all(folder); }

  std::string Path(const std::string& name) const { return (folder / name).string(); }
  std::string Write(const std::string& text) const
  {
    std::ofstream(Path("p.json")) << text;
    return Path("p.json");
  }
  int FileCount() const
  {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder))
      count += entry.is_regular_file();
    return count;
  }
  static std::string Text(const std::string& path)
  {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  /// Expects that reading \a text fails with \a kind and a message that holds the path and \a words.
  void ExpectRefused(const std::string& text, const std::string& words, Error::Kind kind = Error::Kind::BadFile) const
  {
    const std::string path = Write(text);
    try {
      ReadPoses(path);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), kind) << error.what();
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what() << " lacks " << words;
    }
  }

  fs::path folder;
};

ImageGeometry SomeGeometry(std::uint64_t seed)
{
  Random random(seed);
  ImageGeometry g;
  g.dimensions = {10, 20, 30};
  g.origin = 100.0 * random.Direction();
  g.spacing = {0.1 + random.Uniform(), 0.1 + random.Uniform(), 0.1 + random.Uniform()};
  g.direction = ExpRotation(2.0 * random.Direction());
  return g;
}

std::string Document(const std::string& volume,
                     const std::string& head = R"("schema":"echorama-poses-1","unit":"mm","frame":"LPS")")
{
  return "{" + head + R"(,"volumes":[)" + volume + "]}";
}
const std::string Identity = R"([[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]])";

} // namespace

TEST_F(PoseFile, EveryBitComesBackAndPathsFollowTheFile)
{
  std::vector<VolumePose> poses(3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Random random(7, i);
    poses[i].file = Path(i == 2 ? "sub/c.mha" : std::string(1, static_cast<char>('a' + i)) + ".mha");
    poses[i].geometry = SomeGeometry(i);
    poses[i].volumeToWorld = MotionAbout(random.Direction(), random.Direction(), 50.0 * random.Direction());
  }
  poses[1].displacement = Path("sub/b.vti");
  WritePoses(Path("poses.json"), poses);
  EXPECT_NE(Text(Path("poses.json")).find("\"sub/b.vti\""), std::string::npos) << "so are those of displacements";
  EXPECT_NE(Text(Path("poses.json")).find("\"sub/c.mha\""), std::string::npos) << "paths are relative to the JSON";
  EXPECT_EQ(FileCount(), 1) << "no temporary file stays";

  const auto back = ReadPoses(Path("poses.json"));
  ASSERT_EQ(back.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(fs::path(back[i].file), fs::path(poses[i].file));
    EXPECT_EQ(fs::path(back[i].displacement), fs::path(poses[i].displacement));
    EXPECT_EQ(back[i].volumeToWorld.matrix(), poses[i].volumeToWorld.matrix());
    ASSERT_TRUE(back[i].geometry);
    EXPECT_EQ(back[i].geometry->origin, poses[i].geometry->origin);
    EXPECT_EQ(back[i].geometry->spacing, poses[i].geometry->spacing);
    EXPECT_EQ(back[i].geometry->direction, poses[i].geometry->direction);
    EXPECT_EQ(back[i].geometry->dimensions, poses[i].geometry->dimensions);
  }

  // The folder moves with everything in it: the paths still lead to the volumes.
  fs::create_directories(folder / "moved");
  fs::rename(folder / "poses.json", folder / "moved" / "poses.json");
  EXPECT_EQ(fs::path(ReadPoses(Path("moved/poses.json"))[0].file), folder / "moved" / "a.mha");
  EXPECT_EQ(fs::path(ReadPoses(Path("moved/poses.json"))[1].displacement), folder / "moved" / "sub" / "b.vti");
}

TEST_F(PoseFile, GeometryAndFurtherKeysAreOptional)
{
  const auto poses = ReadPoses(
      Write(Document(R"({"file":"/data/x.mha","score":3,"VolumeToWorld":[[0,-1,0,5],[1,0,0,6],[0,0,1,7],[0,0,0,1]]})")));
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(poses[0].file, "/data/x.mha");
  EXPECT_FALSE(poses[0].geometry);
  EXPECT_EQ(poses[0].volumeToWorld * Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(5, 7, 7));
}

TEST_F(PoseFile, AProjectIsAPoseFile)
{
  const auto poses =
      ReadPoses(Write(Document(R"({"name":"liver","file":"a.mha","VolumeToWorld":)" + Identity + R"(,"opacity":0.5})",
                               R"("schema":"echorama-project-1","unit":"mm","frame":"LPS","truth":"")")));
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(fs::path(poses[0].file), folder / "a.mha");
}

TEST_F(PoseFile, FindsByPathThenByName)
{
  std::vector<VolumePose> poses(3);
  poses[0].file = Path("a.mha");
  poses[1].file = Path("sub/a.mha");
  poses[2].file = "/elsewhere/b.mha";
  for (auto& pose : poses)
    pose.geometry = SomeGeometry(1);
  EXPECT_EQ(&PoseFor(poses, Path("sub/../a.mha"), SomeGeometry(1)), &poses[0]);
  EXPECT_EQ(&PoseFor(poses, Path("sub/a.mha"), SomeGeometry(1)), &poses[1]);
  EXPECT_EQ(&PoseFor(poses, Path("b.mha"), SomeGeometry(1)), &poses[2]);
  EXPECT_THROW(PoseFor(poses, "/other/a.mha", SomeGeometry(1)), Error) << "two of that name";
  EXPECT_THROW(PoseFor(poses, Path("c.mha"), SomeGeometry(1)), Error);
  try {
    PoseFor(poses, Path("b.mha"), SomeGeometry(1).Moved(MotionAbout({0, 0, 0}, {0, 0, 0}, {0.1, 0, 0})));
    ADD_FAILURE() << "a moved volume must not be moved again";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    EXPECT_NE(std::string(error.what()).find("b.mha"), std::string::npos);
  }
}

TEST_F(PoseFile, APoseFoundAtAStrideIsThatOfTheWholeVolume)
{
  ImageGeometry whole = SomeGeometry(1);
  whole.dimensions = {10, 12, 13}; // one of three: 0, 3, 6, 9
  const ImageGeometry coarse = CoarseGrid(whole, 3);
  EXPECT_EQ(coarse.dimensions, (std::array<int, 3>{4, 4, 5}));
  EXPECT_TRUE(
      (coarse.IndexToWorld() * Eigen::Vector3d(1, 2, 3)).isApprox(whole.IndexToWorld() * Eigen::Vector3d(3, 6, 9), 1e-14));
  EXPECT_TRUE(AreGridsOfOneVolume(whole, coarse) && AreGridsOfOneVolume(coarse, whole) && AreGridsOfOneVolume(whole, whole));
  std::vector<VolumePose> poses{{Path("a.mha"), coarse}};
  EXPECT_EQ(&PoseFor(poses, Path("a.mha"), whole), &poses[0]);
  ImageGeometry averaged = coarse; // blocks of voxels: their middle lies elsewhere
  averaged.origin = whole.IndexToWorld() * Eigen::Vector3d(1, 1, 1);
  ImageGeometry longer = coarse, between = coarse;
  longer.dimensions[2] = 6;
  between.spacing = 2.5 * whole.spacing;
  for (const ImageGeometry& other : {averaged, longer, between}) {
    EXPECT_FALSE(AreGridsOfOneVolume(whole, other));
    poses[0].geometry = other;
    EXPECT_THROW(PoseFor(poses, Path("a.mha"), whole), Error);
  }
}

TEST_F(PoseFile, RefusesWhatIsNotAPoseFile)
{
  EXPECT_THROW(ReadPoses(Path("missing.json")), Error);
  EXPECT_THROW(ReadPoses(folder.string()), Error) << "a folder";
  const std::string good = R"({"file":"a.mha","VolumeToWorld":)" + Identity + "}";
  ASSERT_EQ(ReadPoses(Write(Document(good))).size(), 1u);
  ExpectRefused("", "JSON");
  ExpectRefused(Document(good).substr(0, 60), "JSON");
  ExpectRefused(std::string(1000000, '['), "nested");
  ExpectRefused(Document(std::string(100, '[') + std::string(100, ']')), "nested");
  ExpectRefused("[1,2]", "schema");
  ExpectRefused(Document(good, R"("schema":"echorama-poses-1","unit":"mm","unit":"mm","frame":"LPS")"),
                "\"unit\" is there twice");
  std::string many = R"({"file":"a.mha")";
  for (int i = 0; i < 5000; ++i)
    many += ",\"" + std::to_string(i) + "\":0";
  ExpectRefused(Document(many + "}"), "more than 4096 keys");
  ExpectRefused(Document(good, R"("schema":"echorama-poses-2","unit":"mm","frame":"LPS")"), "schema");
  ExpectRefused(Document(good, R"("schema":"echorama-poses-1","unit":"cm","frame":"LPS")"), "unit");
  ExpectRefused(Document(good, R"("schema":"echorama-poses-1","unit":"mm","frame":"RAS")"), "frame");
  ExpectRefused(Document(good, R"("schema":"echorama-poses-1","unit":"mm")"), "frame");
  ExpectRefused(Document(good + "," + R"({"file":"a.mha"})"), "named twice");
  ExpectRefused(Document(R"({"file":"a.mha"})"), "volume 1: \"VolumeToWorld\" is missing");
  ExpectRefused(Document(R"({"file":3,"VolumeToWorld":)" + Identity + "}"), "file");
  for (const char* matrix : {"[[1,0,0,0],[0,1,0,0],[0,0,1,0]]", "[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
                             "[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]",
                             "[[1,0,0,null],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", "[[1,0,0,1e999],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
                             "[[1,0.1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", "7"})
    ExpectRefused(Document(std::string(R"({"file":"a.mha","VolumeToWorld":)") + matrix + "}"), "");
  const auto withGeometry = [&](const std::string& geometry) {
    return Document(R"({"file":"a.mha","geometry":)" + geometry + R"(,"VolumeToWorld":)" + Identity + "}");
  };
  const std::string direction = R"("direction":[[1,0,0],[0,1,0],[0,0,1]])";
  EXPECT_NO_THROW(
      ReadPoses(Write(withGeometry(R"({"origin":[0,0,0],"spacing":[1,1,1],"dimensions":[2,2,2],)" + direction + "}"))));
  ExpectRefused(withGeometry(R"({"origin":[0,0,0],"spacing":[1,0,1],"dimensions":[2,2,2],)" + direction + "}"), "spacing");
  ExpectRefused(withGeometry(R"({"origin":[0,0],"spacing":[1,1,1],"dimensions":[2,2,2],)" + direction + "}"), "origin");
  ExpectRefused(withGeometry(R"({"origin":[0,0,0],"spacing":[1,1,1],"dimensions":[2,2.5,2],)" + direction + "}"), "dimensions");
  ExpectRefused(withGeometry(R"({"origin":[0,0,0],"spacing":[1,1,1],"dimensions":[2,2,2]})"), "direction");
}

TEST_F(PoseFile, AFailedWriteLeavesWhatWasThere)
{
  std::vector<VolumePose> poses(1);
  poses[0].file = Path("a.mha");
  EXPECT_THROW(WritePoses(Path("p.json"), poses), Error) << "no geometry";
  poses[0].geometry = SomeGeometry(3);
  EXPECT_THROW(WritePoses(Path("missing/p.json"), poses), Error);
  EXPECT_THROW(WritePoses(Path("sub"), poses), Error) << "a folder";
  EXPECT_EQ(FileCount(), 0);

  WritePoses(Path("p.json"), poses);
  const std::string before = Text(Path("p.json"));
  poses.resize(200, poses[0]);
  // A full disk: no file may grow beyond 1000 bytes.
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit small{1000, limit.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(WritePoses(Path("p.json"), poses), Error);
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(Text(Path("p.json")), before);
  EXPECT_EQ(FileCount(), 1);
}
