// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/ProjectFile.h"
#include <cstdint>
#include <ctime>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// One numbered backup of a session.
struct Backup {
  std::string path;
  int number = 0;
  std::int64_t time = 0; ///< of writing, seconds since 1970, UTC
  std::string label;     ///< the edit it was made after
  bool readable = true;  ///< false: damaged; it is kept, listed and not opened
  int inPlaceOf = 0;     ///< the number of an earlier one that goes: it is not listed, also when a kill has left it
  std::string lineage;
};

/// A folder of numbered project files. Each is written under a temporary name and renamed: a kill at any moment leaves every
/// earlier one and nothing half-made. Sync() brings them to the disk: after a loss of power, the last that it brought there can
/// be read. Old ones are thinned out: the last \a keep stay; of those before, the last of every hour for a day before the newest,
/// and the last of every day before that.
///
/// Who has one of these holds a lock (flock) on the folder's file "lock". The system lets go of it when the process ends, however
/// it ends; so whether a session is alive never depends on a process number that another process may have by now.
class Backups {
public:
  /// Makes the folder, and removes what a killed process left half-written. Backups are of the lineage of \a after, and have
  /// larger numbers. \throws Error(FileSystem).
  explicit Backups(const std::string& folder, LastBackup after = {}, int keep = 100);
  ~Backups();
  Backups(const Backups&) = delete;
  Backups& operator=(const Backups&) = delete;

  const std::string& Folder() const { return folder_; }
  /// Writes the next one, unless it would say what the last said that was written here. Does not wait for the disk.
  /// \a inPlaceOfLast: that one goes once this one is on the disk (a drag that goes on). \returns whether there is a new one.
  /// \throws Error(FileSystem) (full disk): earlier ones stay.
  bool Write(const Project& project, const std::string& label, bool inPlaceOfLast = false);
  /// Waits until what was written is on the disk, and removes what it took the place of. Another thread may call this while
  /// one writes. \throws Error(FileSystem): all stay, and the next call tries again.
  void Sync();
  const std::set<int>& Numbers() const { return numbers_; } ///< of what was written here
  /// What was written here is in the project file now; DiscardUnsaved() leaves it.
  void MarkSaved() { unsaved_.clear(); }
  /// Removes what was written here since the last MarkSaved().
  void DiscardUnsaved();

  /// The newest first; damaged ones are marked. A folder that is not there has none.
  static std::vector<Backup> List(const std::string& folder);
  std::vector<Backup> List() const { return List(folder_); }
  /// Under which name a backup lies in its folder.
  static std::string FileName(int number, std::int64_t time);

  /// Where backups of the project \a path live: NAME.backups beside it; under the user's data folder (XDG_DATA_HOME or
  /// ~/.local/share: echorama/projects/...) when that cannot be written; of an unsaved session ("") a new folder there
  /// (echorama/unsaved/...). \throws Error(FileSystem) when there is no such place.
  static std::string FolderFor(const std::string& path);
  /// All backups of a project, in either folder: the newest first.
  static std::vector<Backup> ListFor(const std::string& path);
  /// The numbers of the backups of a project, in either folder.
  static std::set<int> NumbersFor(const std::string& path);
  /// The newest that can be read, when it was made after the project was last written: its label is not told. It is later when it
  /// is of the lineage of \a last and has a larger number, or one of the others. For a project that does not know its last
  /// backup, the time \a saved of its file decides: names of backups tell seconds; within the same second the times of the files
  /// count.
  static std::optional<Backup> NewestFor(const std::string& path, const timespec& saved, const LastBackup& last);
  /// Sessions that ended without being saved: their folders, the newest first. Those that still run are not among them.
  static std::vector<std::string> Abandoned();
  /// Takes the backups of \a from over, as the next ones of \a to (a session that was saved for the first time, or recovered);
  /// \a from goes when nothing else is in it. They name the same files from their new place. What cannot be moved stays. \throws
  /// Error(FileSystem) when \a to cannot be made.
  static void Move(const std::string& from, const std::string& to);
  /// Removes the backups of a folder, and the folder when nothing else is in it. \throws Error(NotPossible) when a session still
  /// uses it.
  static void Discard(const std::string& folder);

private:
  std::string folder_;
  LastBackup after_;
  int keep_;
  int lock_ = -1;
  std::optional<Project> last_;
  std::string lastPath_;
  BackupStamp lastStamp_;
  std::set<int> numbers_;
  std::vector<std::string> unsaved_;
  std::mutex mutex_; ///< of what follows
  std::vector<std::string> unsynced_, replaced_;
};

} // namespace echorama
