// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "SomeProject.h"
#include "Widgets/Session/SessionStorage.h"
#include <chrono>
#include <cstdlib>
#include <thread>

using namespace echorama;

namespace {

class SessionOnDisk : public FolderTest {
protected:
  void SetUp() override
  {
    FolderTest::SetUp();
    setenv("XDG_DATA_HOME", Path("data").c_str(), 1);
  }
  Project Step(int step) const
  {
    Project project = SomeProject(5, Path());
    project.state.volumes[0].volumeToWorld.translation().x() = step;
    return project;
  }
  static std::vector<std::string> Labels(const SessionStorage& storage)
  {
    std::string trouble;
    std::vector<std::string> labels;
    for (const Backup& backup : storage.List(trouble))
      labels.push_back(backup.label);
    EXPECT_EQ(trouble, "");
    return labels;
  }
};

} // namespace

TEST_F(SessionOnDisk, TheFirstSaveTakesBackupsAlong)
{
  SessionStorage storage;
  storage.BackUp(Step(1), "one", true);
  const std::string before = storage.BackupFolder();
  EXPECT_EQ(before.rfind(Path("data"), 0), 0u);
  EXPECT_EQ(storage.Save(Path("p.json"), Step(1)), "");
  EXPECT_EQ(storage.BackupFolder(), Path("p.backups"));
  EXPECT_FALSE(std::filesystem::exists(before));
  EXPECT_EQ(Labels(storage), (std::vector<std::string>{"one"}));
  EXPECT_TRUE(storage.Saved() == Step(1));
}

TEST_F(SessionOnDisk, WhatSomebodyElseWroteIsReplacedOnlyWhenAskedTwice)
{
  SessionStorage storage;
  storage.Save(Path("p.json"), Step(1));
  Put(Path("p.json"), "{}");
  EXPECT_THROW(storage.Save(Path("p.json"), Step(2)), Error);
  EXPECT_EQ(Text(Path("p.json")), "{}");
  storage.Save(Path("p.json"), Step(2));
  EXPECT_TRUE(ReadProject(Path("p.json")).state == Step(2).state);
  EXPECT_THROW(storage.Save(Step(2).state.volumes[0].file, Step(2)), Error) << "a volume's file stays";
}

TEST_F(SessionOnDisk, BackupsGoOnlyWithoutWantedWork)
{
  const Project opened = Step(1);
  for (const bool worked : {false, true})
    for (const bool forgotten : {false, true}) {
      SessionStorage storage;
      storage.SetUnworked(opened.state);
      storage.BackUp(worked ? Step(2) : opened, "edit", true);
      const std::string folder = storage.BackupFolder();
      storage.SetForgotten(forgotten);
      storage.Leave(worked ? Step(2).state : opened.state, "");
      EXPECT_EQ(std::filesystem::exists(folder), worked && !forgotten) << worked << forgotten;
      EXPECT_EQ(SessionStorage::Abandoned().size(), worked && !forgotten ? 1u : 0u);
      if (worked && !forgotten)
        Backups::Discard(folder);
    }
}

TEST_F(SessionOnDisk, AnAbandonedSessionGoesOn)
{
  {
    SessionStorage lost;
    lost.BackUp(Step(1), "lost", true);
    lost.Leave(Step(1).state, "");
  }
  const std::vector<std::string> folders = SessionStorage::Abandoned();
  ASSERT_EQ(folders.size(), 1u);
  SessionStorage storage;
  storage.Recovered(Backups::List(folders[0]).front().path);
  EXPECT_EQ(storage.ProjectPath(), "");
  storage.BackUp(Step(2), "found", true);
  EXPECT_EQ(Labels(storage), (std::vector<std::string>{"found", "lost"}));
  EXPECT_TRUE(SessionStorage::Abandoned().empty()) << "it is offered no more";
}

TEST_F(SessionOnDisk, ALaterBackupIsOfOtherWork)
{
  SessionStorage storage;
  storage.Save(Path("p.json"), Step(1));
  storage.BackUp(Step(1), "the same", true);
  EXPECT_EQ(storage.LaterBackup(Step(1).state, {}), "");
  storage.BackUp(Step(2), "later", true);
  EXPECT_EQ(ReadProject(storage.LaterBackup(Step(1).state, {})).state.volumes[0].volumeToWorld.translation().x(), 2.0);
  EXPECT_EQ(storage.LaterBackup(Step(2).state, {}), "");
}

TEST_F(SessionOnDisk, ABackupOfTheSecondInWhichTheProjectWasSavedIsLaterOnlyWhenItIs)
{
  SessionStorage storage;
  storage.Save(Path("p.json"), Step(1));
  for (int step = 2; step < 8; step += 2) { // a second may end between the two, but not each time
    storage.BackUp(Step(step), "earlier", true);
    std::this_thread::sleep_for(std::chrono::milliseconds(20)); // file systems tell times by ticks
    storage.Save(Path("p.json"), Step(step + 1));
    EXPECT_EQ(storage.LaterBackup(Step(step + 1).state, {}), "");
  }
}

TEST_F(SessionOnDisk, TroubleIsToldOnce)
{
  Put(Path("data"), "a file where the folder should be");
  SessionStorage storage;
  EXPECT_NE(storage.Post(Step(1), "one", true), "");
  EXPECT_EQ(storage.Post(Step(2), "two", true), "");
}
