// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/BackupWriter.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// What of a session is on the disk: its project file, and its backups.
///
/// Backups of a session that was never saved lie in a folder of its own; the first save moves them beside the project. They go at
/// the end when there is no work in them, or nobody wants it.
class SessionStorage {
public:
  const std::string& ProjectPath() const { return path_; } ///< empty: never saved
  /// The project file as it was written or read last; of a session that was never saved: nothing.
  const Project& Saved() const { return saved_; }

  /// \a project was read from \a path. \a fingerprint: FingerprintOf() from before it was read. Leave() first.
  void Opened(const std::string& path, const Project& project, std::size_t fingerprint);
  /// The same for a backup, which goes on as a session that was never saved. When it is of an abandoned session, its backups
  /// become those of this one.
  void Recovered(const std::string& path);
  /// The truth that came of it: its path may be another than the project had.
  void SetSavedTruth(const std::string& truth, const std::map<std::string, Pose>& truths);
  /// Writes the project file; backups lie beside it from then on. \returns why earlier ones stay where they are, or nothing.
  /// \throws Error(InvalidParameter) for a project without name or with volumes that are in no file, and as CheckMayBeReplaced();
  /// Error(NotPossible), once, when somebody else has changed the file; Error(FileSystem).
  /// \param withoutUnsavedResults leaves results that are in no file out of the project; they are not saved then.
  std::string Save(const std::string& path, Project project, bool withoutUnsavedResults = false);
  /// What a project file says, to notice that somebody else has written it. 0: it cannot be read.
  static std::size_t FingerprintOf(const std::string& path);

  ///@{ Work is what is different from volumes that were merely opened.
  bool IsUnworked(const SessionState& state) const { return state == unworked_; }
  void SetUnworked(const SessionState& state) { unworked_ = state; }
  /// A person does not want what is not saved; or has edited on.
  void SetForgotten(bool forgotten) { isForgotten_ = forgotten; }
  ///@}
  /// A session ends, or another project takes its place: its writer stops, and backups without wanted work go. Never throws.
  void Leave(const SessionState& state, const std::string& comment);

  /// The folder of the backups; empty: of a session without project and without backups.
  std::string BackupFolder() const;
  /// Makes a backup beside the work. \a isFinished: not in the middle of an edit. \returns what went wrong, told once.
  std::string Post(const Project& project, const std::string& label, bool isFinished);
  /// The same; returns when it is on the disk. \throws as BackupWriter.
  void BackUp(const Project& project, const std::string& label, bool isFinished);
  /// Whether the last backup is of an edit that went on.
  bool EndsUnfinished() const { return isUnfinished_; }
  /// Whether this is a project that was just opened: it is its own backup; another would be later than the last work that was not
  /// saved.
  bool IsFresh(const Project& now) const { return !writer_ && now == saved_; }
  /// All that were made, the newest first. \a trouble receives why one could not be written, told once.
  std::vector<Backup> List(std::string& trouble) const;
  /// The newest readable one, when it is later than the project file and is other work than \a now. Empty: there is none.
  std::string LaterBackup(const Project& now, const std::vector<std::string>& folders) const;

  /// Folders of sessions that ended without being saved, the newest first.
  static std::vector<std::string> Abandoned();

private:
  BackupWriter& Writer();
  void TakeOver(const std::string& folder);

  std::string path_;
  Project saved_;
  std::size_t fingerprint_ = 0;
  int offered_ = 0; ///< the last backup when it was opened: later ones that were not made here are of another window
  SessionState unworked_;
  std::string lineage_;   ///< of the backups that are made here; empty: not known yet
  std::string recovered_; ///< the folder of the abandoned session that goes on here
  std::unique_ptr<BackupWriter> writer_;
  std::string trouble_; ///< why there is no writer, told once
  bool isForgotten_ = false, isUnfinished_ = false;
};

} // namespace echorama
