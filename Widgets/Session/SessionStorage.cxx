// SPDX-License-Identifier: BSD-3-Clause
// Nothing that a person did is lost for want of a save: a backup goes when its work is in the project file, when nobody wants it,
// or when there was none.
#include "Widgets/Session/SessionStorage.h"
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Widgets/Session/ProjectVolumes.h"
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace echorama {
namespace {

// A name that no other session gives: of this process at this nanosecond.
std::string NewLineage()
{
  return std::to_string(getpid()) + "-" + std::to_string(std::chrono::system_clock::now().time_since_epoch().count());
}

int LastOf(const std::set<int>& numbers)
{
  return numbers.empty() ? 0 : *numbers.rbegin();
}

} // namespace

std::size_t SessionStorage::FingerprintOf(const std::string& path)
{
  try {
    return std::hash<std::string>()(ReadTextFile(path, std::size_t{512} << 20)) | 1;
  } catch (const Error&) {
    return 0;
  }
}

void SessionStorage::Opened(const std::string& path, const Project& project, std::size_t fingerprint)
{
  path_ = ResolvedPath(path);
  fingerprint_ = fingerprint;
  saved_ = project;
  offered_ = LastOf(Backups::NumbersFor(path_));
  lineage_ = project.lastBackup.lineage;
  unworked_ = project.state;
  isUnfinished_ = false;
}

void SessionStorage::Recovered(const std::string& path)
{
  const std::vector<std::string> abandoned = Abandoned();
  const std::string folder = fs::absolute(path).parent_path().lexically_normal().string();
  recovered_ = std::count(abandoned.begin(), abandoned.end(), folder) > 0 ? folder : std::string();
  path_.clear();
  fingerprint_ = offered_ = 0;
  saved_ = {};
  lineage_.clear();
  unworked_ = {};
  isUnfinished_ = false;
}

void SessionStorage::SetSavedTruth(const std::string& truth, const std::map<std::string, Pose>& truths)
{
  if (path_.empty())
    return;
  saved_.truth = truth;
  saved_.truths = truths;
}

std::string SessionStorage::Save(const std::string& given, Project project, bool withoutUnsavedResults)
{
  const std::string path = ResolvedPath(given);
  std::vector<SessionVolume>& volumes = project.state.volumes;
  if (withoutUnsavedResults)
    volumes.erase(std::remove_if(volumes.begin(), volumes.end(),
                                 [](const SessionVolume& each) { return each.madeOf && each.file.empty(); }),
                  volumes.end());
  if (path.empty())
    throw Error(Error::Kind::InvalidParameter, "a project needs a file name");
  for (const SessionVolume& volume : project.state.volumes)
    if (volume.file.empty())
      throw Error(Error::Kind::InvalidParameter, path + ": the volume " + volume.name +
                                                     " is in no file; write it to one and add that instead" +
                                                     (volume.madeOf ? ", or leave results that are not saved out" : ""));
  CheckMayBeReplaced(path, project.state, project.truth);
  const std::size_t there = FingerprintOf(path);
  if (path_ == path && there != 0 && there != std::exchange(fingerprint_, there))
    throw Error(Error::Kind::NotPossible, path + ": somebody else has changed it since it was opened or saved here; save again "
                                                 "to replace it, or save under another name");
  if (writer_)
    writer_->Wait(); // what was posted is earlier
  const bool goesOn = path_ == path;
  const std::set<int> all = Backups::NumbersFor(path), ours = writer_ ? writer_->Numbers() : std::set<int>();
  project.lastBackup = {goesOn && !lineage_.empty() ? lineage_ : NewLineage(),
                        std::min(std::max(goesOn ? saved_.lastBackup.number : 0, LastOf(all)), LargestNumber)};
  for (const int number : all)
    if (goesOn && number > offered_ && number <= LargestNumber && ours.count(number) == 0)
      project.lastBackup.others.insert(number);
  WriteProject(path, project);
  saved_ = project;
  lineage_ = project.lastBackup.lineage;
  fingerprint_ = FingerprintOf(path);
  unworked_ = project.state;
  isForgotten_ = false;
  if (writer_)
    writer_->MarkSaved();
  if (goesOn)
    return {};
  // From now on backups lie beside the project. Those that were made before it was a project come along.
  const std::string before = writer_ && path_.empty() ? writer_->Folder() : std::string();
  writer_.reset();
  path_ = path;
  std::string trouble;
  try {
    TakeOver(Backups::FolderFor(path));
    if (!before.empty())
      Backups::Move(before, Backups::FolderFor(path));
  } catch (const std::exception& error) { // the project is saved all the same
    trouble = "the earlier backups stay in " + before + ": " + error.what();
  }
  offered_ = LastOf(Backups::NumbersFor(path)); // those that came along are of here
  return trouble;
}

void SessionStorage::Leave(const SessionState& state, const std::string& comment)
{
  try {
    const bool isWork = state != unworked_ || comment != saved_.comment;
    if (writer_ && isForgotten_)
      writer_->DiscardUnsaved();
    const std::string folder = writer_ ? writer_->Folder() : std::string();
    writer_.reset();
    if (!folder.empty() && path_.empty() && (isForgotten_ || !isWork))
      Backups::Discard(folder);
  } catch (const std::exception&) { // what cannot be removed stays
  }
  recovered_.clear();
  isForgotten_ = false;
}

std::string SessionStorage::BackupFolder() const
{
  return writer_ ? writer_->Folder() : path_.empty() ? std::string() : Backups::FolderFor(path_);
}

// With the backups of the abandoned session that goes on here: so it is offered no more, and nothing is lost.
BackupWriter& SessionStorage::Writer()
{
  if (!writer_) {
    if (lineage_.empty())
      lineage_ = NewLineage();
    const int there = path_.empty() ? 0 : LastOf(Backups::NumbersFor(path_));
    writer_ = std::make_unique<BackupWriter>(Backups::FolderFor(path_),
                                             LastBackup{lineage_, std::max(saved_.lastBackup.number, there)});
    TakeOver(writer_->Folder());
  }
  return *writer_;
}

void SessionStorage::TakeOver(const std::string& folder)
{
  const std::string from = std::exchange(recovered_, {});
  try {
    if (!from.empty())
      Backups::Move(from, folder);
  } catch (const Error&) { // they are offered again
  }
}

std::string SessionStorage::Post(const Project& project, const std::string& label, bool isFinished)
{
  try {
    Writer().Post(project, label, isFinished);
    isUnfinished_ = !isFinished;
    trouble_.clear();
    return writer_->TakeFailure();
  } catch (const std::exception& error) { // once: the folder's name may be another each time
    return std::exchange(trouble_, error.what()).empty() ? trouble_ : std::string();
  }
}

void SessionStorage::BackUp(const Project& project, const std::string& label, bool isFinished)
{
  Writer().Post(project, label, isFinished);
  writer_->Flush();
}

std::vector<Backup> SessionStorage::List(std::string& trouble) const
{
  if (writer_) {
    writer_->Wait();
    trouble = writer_->TakeFailure();
  }
  const std::string folder = BackupFolder();
  return !path_.empty() ? Backups::ListFor(path_) : folder.empty() ? std::vector<Backup>() : Backups::List(folder);
}

std::string SessionStorage::LaterBackup(const Project& now, const std::vector<std::string>& folders) const
{
  struct stat saved {};
  if (path_.empty() || stat(path_.c_str(), &saved) != 0)
    return {};
  if (writer_)
    writer_->Wait();
  try {
    if (const std::optional<Backup> newest = Backups::NewestFor(path_, saved.st_mtim, saved_.lastBackup)) {
      Project other = ReadProject(newest->path);
      const auto find = [&](std::string& file) {
        const std::string found = FindVolume(newest->path, file, folders);
        file = found.empty() ? file : ResolvedPath(found);
      };
      for (SessionVolume& volume : other.state.volumes)
        find(volume.file);
      find(other.truth);
      return SameWork(now.state, other.state) && SameNotes(now, other) ? std::string() : newest->path;
    }
  } catch (const Error&) { // it went meanwhile
  }
  return {};
}

std::vector<std::string> SessionStorage::Abandoned()
{
  try {
    return Backups::Abandoned();
  } catch (const Error&) { // no folder of the user, so nothing in it
    return {};
  }
}

} // namespace echorama
