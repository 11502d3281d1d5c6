// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
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
  EXPECT_EQ(storage.LaterBackup(Step(1), {}), "");
  storage.BackUp(Step(2), "later", true);
  EXPECT_EQ(ReadProject(storage.LaterBackup(Step(1), {})).state.volumes[0].volumeToWorld.translation().x(), 2.0);
  EXPECT_EQ(storage.LaterBackup(Step(2), {}), "");
  Project noted = Step(2);
  noted.comment = "for people";
  storage.BackUp(noted, "another comment", true);
  EXPECT_EQ(ReadProject(storage.LaterBackup(Step(2), {})).comment, "for people");
  EXPECT_EQ(storage.LaterBackup(noted, {}), "");
  noted.truths[noted.state.volumes[0].name] = Pose::Identity();
  EXPECT_NE(storage.LaterBackup(noted, {}), "") << "another truth";
}

TEST_F(SessionOnDisk, WhatIsLaterDoesNotDependOnTheClock)
{
  const std::string path = Path("p.json"), other = Path("q.json");
  const auto later = [this](const std::string& project, int open) { // for who opens it now; 0: nothing
    SessionStorage storage;
    storage.Opened(project, ReadProject(project), SessionStorage::FingerprintOf(project));
    const std::string found = storage.LaterBackup(Step(open), {});
    return found.empty() ? 0 : static_cast<int>(ReadProject(found).state.volumes[0].volumeToWorld.translation().x());
  };
  // The clock was a day ahead when that was written.
  const auto putOff = [](const std::string& file) {
    std::filesystem::last_write_time(file, std::filesystem::last_write_time(file) + std::chrono::hours(24));
  };
  const auto putOffBackups = [&] {
    for (const Backup& backup : Backups::ListFor(path)) {
      const std::string place = Path("p.backups/" + Backups::FileName(backup.number, backup.time + 86400));
      std::filesystem::rename(backup.path, place);
      putOff(place);
    }
  };
  SessionStorage storage;
  storage.BackUp(Step(1), "before the first save", true);
  storage.Save(path, Step(2));
  EXPECT_EQ(later(path, 2), 0);
  putOff(path);
  storage.BackUp(Step(3), "after the clock was set back", true);
  EXPECT_EQ(later(path, 2), 3);
  storage.BackUp(Step(4), "going on", true);
  EXPECT_EQ(later(path, 2), 4);

  putOffBackups();
  storage.Save(path, Step(5));
  EXPECT_EQ(later(path, 5), 0) << "that was earlier";
  storage.BackUp(Step(6), "later", true);
  EXPECT_EQ(later(path, 5), 6);
  EXPECT_EQ(Labels(storage).front(), "later") << "the newest first";

  // What waits for its turn is earlier than the file, too.
  storage.Post(Step(7), "a drag", false);
  storage.Save(path, Step(8));
  EXPECT_EQ(later(path, 8), 0);

  // Numbers go on where backups were removed, and when another session goes on.
  std::filesystem::remove_all(Path("p.backups"));
  SessionStorage next;
  next.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
  next.BackUp(Step(9), "of the next session", true);
  putOff(path);
  EXPECT_EQ(later(path, 8), 9);

  // Numbers of another lineage tell nothing: a copy in the place of a project that has more backups.
  SessionStorage copy;
  copy.Save(other, Step(10));
  for (int step = 11; step < 31; ++step)
    copy.BackUp(Step(step), "of the other " + std::to_string(step), true);
  EXPECT_EQ(later(other, 10), 30);
  std::filesystem::copy_file(path, other, std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(later(other, 8), 0);
  next.Save(other, Step(40)); // and another name is another lineage
  EXPECT_EQ(later(other, 40), 0);
  EXPECT_NE(ReadProject(other).lastBackup.lineage, ReadProject(path).lastBackup.lineage);
  next.BackUp(Step(41), "later", true);
  EXPECT_EQ(later(other, 40), 41);
  EXPECT_EQ(later(path, 8), 9);
}

TEST_F(SessionOnDisk, WhatAnotherWindowHasNotSavedIsLaterWhateverThisOneSaves)
{
  const std::string path = Path("p.json");
  const auto later = [&](int open) {
    SessionStorage storage;
    storage.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
    const std::string found = storage.LaterBackup(Step(open), {});
    return found.empty() ? 0 : static_cast<int>(ReadProject(found).state.volumes[0].volumeToWorld.translation().x());
  };
  SessionStorage first;
  first.BackUp(Step(1), "before the first save", true);
  first.Save(path, Step(1));
  first.BackUp(Step(2), "two", true);
  SessionStorage other; // opened beside it, when there is a backup that is offered
  other.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
  other.BackUp(Step(10), "ten", true);
  other.Save(path, Step(10));
  EXPECT_EQ(later(10), 0) << "it was offered";
  first.BackUp(Step(3), "three", true);
  first.BackUp(Step(4), "four", true);
  other.BackUp(Step(11), "eleven", true);
  other.Save(path, Step(11));
  EXPECT_EQ(ReadProject(path).lastBackup.number, 6);
  EXPECT_EQ(ReadProject(path).lastBackup.others, (std::set<int>{4, 5}));
  EXPECT_EQ(later(11), 4);
  // It was offered, and whoever saved did without.
  SessionStorage next;
  next.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
  next.Save(path, Step(12));
  EXPECT_EQ(later(12), 0);
  // A file without a lineage, such as poses: each window has begun its own.
  const std::string poses = Path("poses.json");
  WriteProject(poses, Step(1));
  SessionStorage one, two;
  for (SessionStorage* each : {&one, &two})
    each->Opened(poses, ReadProject(poses), SessionStorage::FingerprintOf(poses));
  one.BackUp(Step(30), "of one", true);
  two.BackUp(Step(31), "of two", true);
  one.Save(poses, Step(32));
  SessionStorage again;
  again.Opened(poses, ReadProject(poses), SessionStorage::FingerprintOf(poses));
  EXPECT_EQ(ReadProject(again.LaterBackup(Step(32), {})).state.volumes[0].volumeToWorld.translation().x(), 31.0);
  // What was taken along to another name is of the same window.
  const std::string moved = Path("q.json");
  SessionStorage unsaved;
  unsaved.BackUp(Step(20), "edit", true);
  unsaved.Save(moved, Step(21));
  unsaved.Save(moved, Step(22));
  EXPECT_TRUE(ReadProject(moved).lastBackup.others.empty());
}

TEST_F(SessionOnDisk, ALargeNumberOfTheLastBackupLeavesRoomForMore)
{
  const std::string path = Path("p.json");
  Project project = Step(1);
  project.lastBackup = {"lineage", LargestNumber};
  WriteProject(path, project);
  SessionStorage storage;
  storage.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
  storage.BackUp(Step(2), "later", true);
  EXPECT_EQ(Labels(storage), (std::vector<std::string>{"later"}));
  EXPECT_NE(storage.LaterBackup(Step(1), {}), "");
  storage.Save(path, Step(3));
  EXPECT_EQ(ReadProject(path).lastBackup.number, LargestNumber) << "it can be read again";
  project.lastBackup.number = LargestNumber + 1;
  WriteProject(path, project);
  EXPECT_THROW(ReadProject(path), Error);
}

TEST_F(SessionOnDisk, TheTruthAndPosesWithDisplacementsAreNotReplaced)
{
  SessionStorage storage;
  Project project = Step(1);
  project.truth = Path("truth.json");
  Put(project.truth, "true");
  EXPECT_THROW(storage.Save(project.truth, project), Error);
  EXPECT_EQ(Text(project.truth), "true");
  const SessionVolume& volume = project.state.volumes[0];
  WritePoses(Path("bent.json"), {{volume.file, volume.geometry, volume.volumeToWorld, Path("bent.displacement-1.vti")}});
  const std::string before = Text(Path("bent.json"));
  EXPECT_THROW(storage.Save(Path("bent.json"), project), Error);
  EXPECT_EQ(Text(Path("bent.json")), before);
  Put(Path("bent.json"), before + before);
  EXPECT_THROW(storage.Save(Path("bent.json"), project), Error) << "it cannot be read";
  WritePoses(Path("bent.json"), {{volume.file, volume.geometry, volume.volumeToWorld}});
  storage.Save(Path("bent.json"), project);
  EXPECT_TRUE(ReadProject(Path("bent.json")).state == project.state);
}

TEST_F(SessionOnDisk, TimesTellWhatIsLaterThanAFileThatKnowsNoBackup)
{
  const std::string path = Path("p.json");
  WriteProject(path, Step(1)); // as a script does
  const auto open = [&] {
    SessionStorage storage;
    storage.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
    return storage.LaterBackup(Step(1), {});
  };
  SessionStorage storage;
  storage.Opened(path, ReadProject(path), SessionStorage::FingerprintOf(path));
  storage.BackUp(Step(2), "later", true);
  EXPECT_NE(open(), "");
  std::filesystem::last_write_time(path, std::filesystem::last_write_time(path) + std::chrono::hours(1));
  EXPECT_EQ(open(), "");
  storage.Save(path, Step(1));
  EXPECT_NE(ReadProject(path).lastBackup.lineage, "");
  EXPECT_EQ(ReadProject(path).lastBackup.number, 1);
}

TEST_F(SessionOnDisk, ABackupOfTheSecondInWhichTheProjectWasSavedIsLaterOnlyWhenItIs)
{
  SessionStorage storage;
  storage.Save(Path("p.json"), Step(1));
  for (int step = 2; step < 8; step += 2) { // a second may end between the two, but not each time
    storage.BackUp(Step(step), "earlier", true);
    std::this_thread::sleep_for(std::chrono::milliseconds(20)); // file systems tell times by ticks
    storage.Save(Path("p.json"), Step(step + 1));
    EXPECT_EQ(storage.LaterBackup(Step(step + 1), {}), "");
  }
}

TEST_F(SessionOnDisk, TroubleIsToldOnce)
{
  Put(Path("data"), "a file where the folder should be");
  SessionStorage storage;
  EXPECT_NE(storage.Post(Step(1), "one", true), "");
  EXPECT_EQ(storage.Post(Step(2), "two", true), "");
}
