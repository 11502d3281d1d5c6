// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "SomeProject.h"
#include "Widgets/Session/Backups.h"
#include "Widgets/Session/BackupWriter.h"
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <set>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

class BackupFolder : public FolderTest {
protected:
  /// The project after \a step edits: its state tells the number.
  Project Step(int step) const
  {
    Project project = SomeProject(11, Path());
    project.state.volumes[0].volumeToWorld.translation().x() = step;
    return project;
  }
  static int StepOf(const Project& project)
  {
    return static_cast<int>(project.state.volumes.at(0).volumeToWorld.translation().x());
  }
  void PutOld(int number, std::int64_t time) const
  {
    const BackupStamp stamp{number, time, "old"};
    WriteBackup(Path(Backups::FileName(number, time)), Step(number), stamp);
  }
  std::set<int> Numbers() const
  {
    std::set<int> numbers;
    for (const Backup& backup : Backups::List(Path()))
      numbers.insert(backup.number);
    return numbers;
  }
};

/// While this lives, this process waits for the disk until GoOn(), or fails.
class HangingDisk {
public:
  HangingDisk() { Set(Hangs); }
  ~HangingDisk() { Set(Works); }
  void GoOn() const { Set(Works); }
  void Fail() const { Set(Fails); }
  bool IsWaitedFor() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return waiting_ > 0;
  }
  int Synced() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return synced_;
  }
  /// What fsync does here.
  static int Sync(int file)
  {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      ++waiting_;
      changed_.wait(lock, [] { return state_ != Hangs; });
      --waiting_;
      if (state_ == Fails) {
        errno = EIO;
        return -1;
      }
      ++synced_;
    }
    return static_cast<int>(syscall(SYS_fsync, file));
  }

private:
  enum State { Works, Hangs, Fails };
  static void Set(State state)
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      state_ = state;
      if (state == Hangs)
        synced_ = 0;
    }
    changed_.notify_all();
  }
  static inline std::mutex mutex_;
  static inline std::condition_variable changed_;
  static inline State state_ = Works;
  static inline int waiting_ = 0, synced_ = 0;
};

/// The writing of this process fails as on a full disk while this lives.
class FullDisk {
public:
  FullDisk()
  {
    getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{2000, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk()
  {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

} // namespace

// Takes the place of the system's, for all libraries of this program.
extern "C" __attribute__((visibility("default"))) int fsync(int file)
{
  return HangingDisk::Sync(file);
}

TEST_F(BackupFolder, NumberedTheNewestFirst)
{
  Backups backups(Path());
  EXPECT_TRUE(backups.List().empty());
  EXPECT_TRUE(backups.Write(Step(1), "one"));
  EXPECT_FALSE(backups.Write(Step(1), "nothing new"));
  EXPECT_TRUE(backups.Write(Step(2), "two"));
  EXPECT_TRUE(backups.Write(Step(3), "three"));
  backups.Sync();
  EXPECT_TRUE(backups.Write(Step(4), "three, going on", true));
  const auto files = [this] { return std::distance(fs::directory_iterator(folder), {}); };
  EXPECT_EQ(files(), 5) << "the lock, too: what is on the disk stays until the one in its place is";
  EXPECT_TRUE(backups.Write(Step(5), "three, going on", true));
  EXPECT_EQ(files(), 5) << "what is not goes at once";
  ASSERT_EQ(backups.List().size(), 3u) << "what will go is not told of";
  EXPECT_EQ(backups.List()[1].label, "two");
  EXPECT_TRUE(backups.Write(Step(4), "three, going on", true));
  backups.Sync();
  EXPECT_EQ(files(), 4);
  const std::vector<Backup> list = backups.List();
  ASSERT_EQ(list.size(), 3u);
  EXPECT_EQ(list[0].label, "three, going on");
  EXPECT_EQ(list[0].number, 6);
  EXPECT_EQ(list[2].label, "one");
  EXPECT_EQ(StepOf(ReadProject(list[0].path)), 4);
  EXPECT_EQ(StepOf(ReadProject(list[1].path)), 2);
  EXPECT_LE(std::abs(static_cast<double>(list[0].time - std::time(nullptr))), 30.0);
  Backups later(Path());
  later.Write(Step(6), "of another session");
  EXPECT_EQ(later.List().front().number, 7);
  EXPECT_THROW(Backups("/dev/null/backups"), Error);
  EXPECT_TRUE(Backups::List(Path("nowhere")).empty());
}

TEST_F(BackupFolder, TwoSessionsNeverReplaceEachOthers)
{
  constexpr int Each = 25;
  std::thread other([this] {
    Backups backups(Path());
    for (int step = 1; step <= Each; ++step)
      backups.Write(Step(1000 + step), "theirs");
  });
  {
    Backups backups(Path());
    for (int step = 1; step <= Each; ++step)
      backups.Write(Step(step), "ours");
  }
  other.join();
  const std::vector<Backup> all = Backups::List(Path());
  EXPECT_EQ(all.size(), 2u * Each);
  for (const Backup& backup : all)
    EXPECT_TRUE(backup.readable) << backup.path;
  const BackupStamp stamp{all.front().number, all.front().time, "taken"};
  EXPECT_FALSE(WriteBackup(all.front().path, Step(5), stamp));
  EXPECT_NE(StepOf(ReadProject(all.front().path)), 5);
}

TEST_F(BackupFolder, OldOnesAreThinnedOut)
{
  // One every ten minutes for three days.
  const std::int64_t now = std::time(nullptr), first = now - 3 * 86400;
  int number = 0;
  for (std::int64_t time = first; time < now; time += 600)
    PutOld(++number, time);
  Backups backups(Path(), {}, 20);
  backups.Write(Step(1000), "new");
  const std::vector<Backup> list = backups.List();
  std::int64_t previous = std::numeric_limits<std::int64_t>::max();
  std::set<std::int64_t> hours, days;
  for (std::size_t i = 0; i < list.size(); ++i) {
    EXPECT_LE(list[i].time, previous);
    previous = list[i].time;
    if (i < 20) {
      EXPECT_EQ(list[i].number, number + 1 - static_cast<int>(i)) << "the last 20 stay";
    } else if (list.front().time - list[i].time < 86400) {
      EXPECT_TRUE(hours.insert(list[i].time / 3600).second) << "one an hour";
    } else {
      EXPECT_TRUE(days.insert(list[i].time / 86400).second) << "one a day";
    }
  }
  EXPECT_GE(hours.size(), 20u);
  EXPECT_LE(hours.size(), 25u);
  EXPECT_GE(days.size(), 2u);
  EXPECT_LE(days.size(), 4u);
}

TEST_F(BackupFolder, DamagedOnesAreListedAndNotOpened)
{
  Backups backups(Path());
  for (int step = 1; step <= 4; ++step)
    backups.Write(Step(step), "step " + std::to_string(step));
  const std::vector<Backup> before = backups.List();
  const std::string whole = Text(before[1].path);
  Put(before[0].path, whole.substr(0, whole.size() / 2));
  std::string flipped = whole;
  flipped[whole.find("\"VolumeToWorld\":[[") + 19] ^= 1;
  Put(before[1].path, flipped);
  Put(before[2].path, "");
  const std::vector<Backup> after = backups.List();
  ASSERT_EQ(after.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(after[i].readable, i == 3) << i;
    if (i < 3) {
      EXPECT_THROW(ReadProject(after[i].path), Error);
    }
  }
  EXPECT_EQ(StepOf(ReadProject(after[3].path)), 1);
}

TEST_F(BackupFolder, AFullDiskCostsTheNewOneAlone)
{
  Backups backups(Path());
  backups.Write(Step(1), "one");
  {
    const FullDisk full;
    EXPECT_THROW(backups.Write(Step(2), "two", true), Error);
  }
  ASSERT_EQ(Numbers(), (std::set<int>{1})) << "also the one whose place it was to take";
  EXPECT_TRUE(backups.Write(Step(2), "two")) << "what was not written is not taken for written";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 3) << "two backups and the lock";

  BackupWriter writer(Path());
  {
    const FullDisk full;
    writer.Post(Step(3), "three", true);
    EXPECT_THROW(writer.Flush(), Error);
    EXPECT_EQ(writer.TakeFailure(), "") << "it was told";
    writer.Post(Step(4), "four", true);
    writer.Wait();
    EXPECT_EQ(writer.TakeFailure(), "") << "nor is the next of the same episode";
  }
  writer.Post(Step(5), "five", true);
  EXPECT_NO_THROW(writer.Flush());
  EXPECT_EQ(StepOf(ReadProject(Backups::List(Path()).front().path)), 5);
}

TEST_F(BackupFolder, EditsAreWrittenBesideTheWork)
{
  {
    BackupWriter writer(Path());
    for (int step = 1; step <= 5; ++step) {
      writer.Post(Step(step), "edit " + std::to_string(step), true);
      writer.Flush();
    }
    EXPECT_EQ(Numbers().size(), 5u);
    for (int step = 6; step <= 30; ++step)
      writer.Post(Step(step), "a key that repeats", true);
    writer.Flush();
    EXPECT_EQ(Numbers().size(), 6u);
    for (int step = 31; step <= 60; ++step)
      writer.Post(Step(step), "drag", false);
    writer.Post(Step(61), "drag", true);
    writer.Flush();
    EXPECT_EQ(Numbers().size(), 7u) << "a drag is one";
    writer.Post(Step(62), "last", true);
  } // nothing that waits is lost
  EXPECT_EQ(StepOf(ReadProject(Backups::List(Path()).front().path)), 62);
}

TEST_F(BackupFolder, ADragIsOnTheDiskWithinASecondOfEachStep)
{
  BackupWriter writer(Path(), {}, 0.2);
  writer.Post(Step(1), "drag", false);
  for (int step = 2; step <= 4; ++step)
    writer.Post(Step(step), "drag", false); // and then the mouse stands still
  bool written = false;
  for (int i = 0; i < 1000 && !written; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::vector<Backup> list = Backups::List(Path());
    written = !list.empty() && list.front().readable && StepOf(ReadProject(list.front().path)) == 4;
  }
  EXPECT_TRUE(written) << "without anybody asking";
}

TEST_F(BackupFolder, ADiskThatHangsHoldsUpNeitherWorkNorBackups)
{
  BackupWriter writer(Path(), {}, 0.02);
  const HangingDisk disk;
  writer.Post(Step(1), "one", true);
  const auto newest = [&] {
    const std::vector<Backup> list = Backups::List(Path());
    return list.empty() ? std::string() : list.front().label;
  };
  for (int i = 0; i < 1000 && !disk.IsWaitedFor(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(disk.IsWaitedFor());
  for (int step = 2; step <= 40; ++step) { // each is there for who comes after a kill
    const std::string label = "drag " + std::to_string(step);
    writer.Post(Step(step), label, false);
    for (int i = 0; i < 1000 && newest() != label; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(newest(), label);
  }
  writer.Post(Step(50), "end of the drag", true);
  writer.Wait();
  EXPECT_EQ(newest(), "end of the drag");
  EXPECT_EQ(writer.TakeFailure(), "");
  EXPECT_EQ(disk.Synced(), 0) << "nothing is on the disk yet";
  EXPECT_EQ(Numbers().size(), 2u) << "the drag is one";
  disk.GoOn();
  writer.Flush();
  EXPECT_GE(disk.Synced(), 3) << "all files are, and their folder";
  EXPECT_EQ(Numbers().size(), 2u);
}

TEST_F(BackupFolder, ADiskThatFailsIsTold)
{
  BackupWriter writer(Path());
  const HangingDisk disk;
  disk.Fail();
  writer.Post(Step(1), "one", true);
  EXPECT_THROW(writer.Flush(), Error);
  writer.Post(Step(2), "two", true);
  EXPECT_THROW(writer.Flush(), Error) << "also when the file itself could be written";
  EXPECT_EQ(writer.TakeFailure(), "") << "it was told";
  EXPECT_EQ(StepOf(ReadProject(Backups::List(Path()).front().path)), 2);
  disk.GoOn();
  writer.Post(Step(3), "three", true);
  EXPECT_NO_THROW(writer.Flush());
  EXPECT_GE(disk.Synced(), 4) << "those that could not be brought there before are, too";
}

TEST_F(BackupFolder, AKillLeavesEveryBackupWhole)
{
  int made = 0;
  for (int round = 0; round < 12 || (made <= 50 && round < 60); ++round) { // more where the disk is slow
    const pid_t child = fork();
    if (child == 0) {
      Backups backups(Path(), {}, 30);
      for (int step = 1;; ++step)
        if (backups.Write(Step(step), "step " + std::to_string(step), step % 3 == 0) && step % 2 == 0)
          backups.Sync();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + 13 * (round % 12)));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    for (const Backup& backup : Backups::List(Path())) {
      ASSERT_TRUE(backup.readable) << backup.path;
      EXPECT_EQ(backup.label, "step " + std::to_string(StepOf(ReadProject(backup.path))));
      ++made;
    }
  }
  EXPECT_GT(made, 50);
  const Backups again(Path());
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_NE(entry.path().filename().string().rfind(".part", 0), 0u) << "what was half-written goes";
}

// Each says in the place of which number it is, and numbers become others.
TEST_F(BackupFolder, WhatIsMovedHidesNoOther)
{
  const auto labels = [](const std::string& in) {
    std::vector<std::string> found;
    for (const Backup& backup : Backups::List(in))
      found.push_back(backup.label);
    return found;
  };
  const std::string target = Path("target");
  Backups(target).Write(Step(9), "there");
  for (const char* name : {"neighbour", "far/away"}) {
    {
      Backups backups(Path(name));
      backups.Write(Step(1), "one");
      backups.Write(Step(2), "two");
      backups.Sync();
      backups.Write(Step(3), "two, going on", true);
      backups.Sync();
    }
    std::vector<std::string> expected{"two, going on", "one"};
    for (const std::string& label : labels(target))
      expected.push_back(label);
    Backups::Move(Path(name), target);
    EXPECT_EQ(labels(target), expected) << name;
  }
  // Also one that was only renamed.
  PutOld(4, 86400);
  WriteBackup(Path(Backups::FileName(5, 86400)), Step(5), {7, 86400, "moved", 4});
  EXPECT_EQ(Numbers(), (std::set<int>{4, 5}));
}

TEST_F(BackupFolder, SessionsWhoseProcessIsGoneAreFound)
{
  setenv("XDG_DATA_HOME", Path("data").c_str(), 1);
  EXPECT_TRUE(Backups::Abandoned().empty());
  const std::string project = Path("liver.json"), beside = Path("liver.backups");
  EXPECT_EQ(Backups::FolderFor(project), beside);

  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    Backups backups(Backups::FolderFor(""));
    backups.Write(Step(8), "the last one");
    if (write(ready[1], "x", 1) != 1)
      _exit(1);
    for (;;)
      pause();
  }
  char byte;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_TRUE(Backups::Abandoned().empty()) << "it is alive";
  {
    const Backups mine(Backups::FolderFor(""));
    EXPECT_TRUE(Backups::Abandoned().empty()) << "nothing is in it";
    EXPECT_THROW(Backups::Discard(mine.Folder()), Error) << "it is used";
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  std::vector<std::string> abandoned = Backups::Abandoned();
  ASSERT_EQ(abandoned.size(), 1u);
  const std::vector<Backup> list = Backups::List(abandoned[0]);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(StepOf(ReadProject(list[0].path)), 8);

  // It is taken over by a project, behind what that has.
  Backups(beside).Write(Step(1), "earlier");
  Backups::Move(abandoned[0], beside);
  EXPECT_TRUE(Backups::Abandoned().empty());
  EXPECT_FALSE(fs::exists(abandoned[0]));
  const std::vector<Backup> moved = Backups::List(beside);
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(StepOf(ReadProject(moved[0].path)), 8);
  Put(Path("liver.backups/notes.txt"), "of somebody else");
  Backups::Discard(beside);
  EXPECT_TRUE(Backups::List(beside).empty());
  EXPECT_TRUE(fs::exists(Path("liver.backups/notes.txt")));
  unsetenv("XDG_DATA_HOME");
}
