// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

class FileReplacementTest : public ::testing::Test {
protected:
  void SetUp() override
  {
    folder = fs::temp_directory_path() / ("echorama-replace-" + std::to_string(getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  std::string Path(const std::string& name) const { return (folder / name).string(); }
  static void Put(const std::string& path, const std::string& text) { std::ofstream(path) << text; }
  /// Every file in the folder, by name.
  std::map<std::string, std::string> Contents() const
  {
    std::map<std::string, std::string> contents;
    for (const auto& entry : fs::directory_iterator(folder)) {
      std::stringstream text;
      if (entry.is_regular_file())
        text << std::ifstream(entry.path()).rdbuf();
      contents[entry.path().filename().string()] = text.str();
    }
    return contents;
  }
  using Files = std::map<std::string, std::string>;
  fs::path folder;
};

} // namespace

TEST_F(FileReplacementTest, NothingHappensWithoutCommit)
{
  Put(Path("a.txt"), "old");
  {
    FileReplacement replacement;
    const std::string temporary = replacement.Stage(Path("a.txt"));
    EXPECT_EQ(fs::path(temporary).extension(), ".txt");
    EXPECT_EQ(fs::path(temporary).parent_path(), folder);
    Put(temporary, "new");
  }
  EXPECT_EQ(Contents(), (Files{{"a.txt", "old"}}));
}

TEST_F(FileReplacementTest, ASetIsReplacedAndStaleCompanionsGo)
{
  Put(Path("a"), "old");
  Put(Path("stale"), "old");
  FileReplacement replacement;
  Put(replacement.Stage(Path("b")), "companion");
  Put(replacement.Stage(Path("a")), "new");
  replacement.Remove(Path("stale"));
  replacement.Remove(Path("never there"));
  replacement.Commit();
  EXPECT_EQ(Contents(), (Files{{"a", "new"}, {"b", "companion"}}));
}

TEST_F(FileReplacementTest, WhatIsUnstagedLeavesNoTrace)
{
  Put(Path("a"), "old");
  Put(Path("b"), "old companion");
  FileReplacement replacement;
  const std::string companion = replacement.Stage(Path("b"));
  Put(companion, "companion");
  Put(replacement.Stage(Path("a")), "new");
  replacement.Unstage(companion);
  EXPECT_FALSE(fs::exists(companion));
  replacement.Commit();
  EXPECT_EQ(Contents(), (Files{{"a", "new"}, {"b", "old companion"}}));
}

TEST_F(FileReplacementTest, AFailureHalfwayRollsBack)
{
  Put(Path("a"), "old");
  Put(Path("b"), "old companion");
  Put(Path("stale"), "old");
  {
    FileReplacement replacement;
    Put(replacement.Stage(Path("b")), "companion");
    const std::string gone = replacement.Stage(Path("a"));
    fs::remove(gone); // so it cannot be put in place
    replacement.Remove(Path("stale"));
    EXPECT_THROW(replacement.Commit(), Error);
  }
  EXPECT_EQ(Contents(), (Files{{"a", "old"}, {"b", "old companion"}, {"stale", "old"}}));
}

TEST_F(FileReplacementTest, NothingIsReplacedByAFileThatWasNeverWritten)
{
  Put(Path("a"), "old");
  Put(Path("b"), "old companion");
  Put(Path("stale"), "old");
  {
    FileReplacement replacement;
    Put(replacement.Stage(Path("b")), "companion");
    replacement.Stage(Path("a"));
    replacement.Remove(Path("stale"));
    EXPECT_THROW(replacement.Commit(), Error);
  }
  EXPECT_EQ(Contents(), (Files{{"a", "old"}, {"b", "old companion"}, {"stale", "old"}}));
}

TEST_F(FileReplacementTest, ASymbolicLinkIsFollowed)
{
  Put(Path("real"), "old");
  fs::create_symlink("real", Path("link"));
  FileReplacement replacement;
  Put(replacement.Stage(Path("link")), "new");
  replacement.Commit();
  EXPECT_TRUE(fs::is_symlink(Path("link")));
  EXPECT_EQ(Contents(), (Files{{"real", "new"}, {"link", "new"}}));
}

TEST_F(FileReplacementTest, ALinkInTheTemporaryPlaceIsNotFollowed)
{
  Put(Path("victim"), "untouched");
  FileReplacement first, second;
  const std::string name = fs::path(first.Stage(Path("a"))).filename().string(); // .partPID-NUMBER@MACHINE@a
  const std::size_t dash = name.find('-'), at = name.find('@');
  const int number = std::stoi(name.substr(dash + 1));
  for (int next = number + 1; next < number + 4; ++next)
    fs::create_symlink("victim", Path(name.substr(0, dash + 1) + std::to_string(next) + name.substr(at)));
  Put(second.Stage(Path("a")), "new");
  second.Commit();
  EXPECT_EQ(Contents()["victim"], "untouched");
  EXPECT_EQ(Contents()["a"], "new");
}

TEST_F(FileReplacementTest, WhatKilledProcessesLeftIsRemoved)
{
  const pid_t child = fork();
  if (child == 0)
    _exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  const std::string dead = std::to_string(child), alive = std::to_string(getppid());
  char machine[65] = "";
  ASSERT_EQ(gethostname(machine, sizeof machine - 1), 0);
  const std::string here = "@" + std::string(machine) + "@", elsewhere = "@another" + here.substr(1);
  const auto name = [&](const char* purpose, const std::string& process, const std::string& rest) {
    return "." + (purpose + process) + rest;
  };
  Put(Path("a.txt"), "old");
  const std::string stays[] = {name("part", alive, "-0" + here + "a.txt"),
                               name("part", dead, "-0" + here + "b.txt"),
                               name("part", dead, "-0" + here + "b@a.txt"),
                               name("old", dead, "-1" + here + "b-a.txt"),
                               name("old", alive, "-1" + here + "a.txt"),
                               name("part", dead, "-5" + here + name("part", alive, "-4" + here + "a.txt")),
                               name("part", dead, "-5" + here + name("part", dead, "-4" + elsewhere + "a.txt")),
                               name("part", dead, "-5" + here + name("old", dead, "-4" + here + "a.txt")),
                               name("part", dead, "-5" + here + name("part", dead, "-4" + here + "b.txt")),
                               name("part", dead, "-0" + elsewhere + "a.txt"),
                               name("old", dead, "-1" + elsewhere + "a.txt"),
                               name("part", dead, "-0@@a.txt"),
                               name("part", dead, "-0-a.txt"),
                               ".partial-a.txt",
                               ".part" + dead + "-a.txt",
                               "part" + dead + "-0" + here + "a.txt"};
  for (const std::string& each : stays)
    Put(Path(each), "stays");
  Put(Path(name("part", dead, "-3" + here + "a.txt")), "half");
  Put(Path(name("part", dead, "-5" + here + name("part", dead, "-4" + here + "a.txt"))), "half, of a file that was staged twice");
  Put(Path(name("old", dead, "-4" + here + "a.txt")), "aside");
  {
    FileReplacement replacement;
    const std::string staged = replacement.Stage(Path("a.txt"));
    EXPECT_NE(staged.find(here + "a.txt"), std::string::npos) << staged;
    Put(staged, "new");
    EXPECT_FALSE(fs::exists(Path(name("part", dead, "-3" + here + "a.txt"))));
    EXPECT_TRUE(fs::exists(Path(name("old", dead, "-4" + here + "a.txt")))) << "it may be all that is left of the old file";
    replacement.Commit();
  }
  Files expected{{"a.txt", "new"}};
  for (const std::string& each : stays)
    expected[each] = "stays";
  EXPECT_EQ(Contents(), expected);
}

TEST_F(FileReplacementTest, ANameMayBeAsLongAsAFileSystemTakes)
{
  const std::string name = std::string(251, 'x') + ".txt";
  FileReplacement replacement;
  const std::string temporary = replacement.Stage(Path(name));
  EXPECT_EQ(fs::path(temporary).extension(), ".txt");
  Put(temporary, "new");
  replacement.Commit();
  EXPECT_EQ(Contents(), (Files{{name, "new"}}));
}

TEST_F(FileReplacementTest, RefusesPlacesWhereNoFileCanBe)
{
  FileReplacement replacement;
  EXPECT_THROW(replacement.Stage(""), Error);
  EXPECT_THROW(replacement.Stage(folder.string()), Error) << "a folder";
  EXPECT_THROW(replacement.Stage(Path("missing/a")), Error);
  EXPECT_THROW(replacement.Stage("/dev/full"), Error) << "a device";
  EXPECT_TRUE(Contents().empty());
}
