// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/Backups.h"
#include <memory>
#include <set>
#include <string>

namespace echorama {

/// Writes backups beside the work: a post costs a copy of the state. One thread writes, another waits for the disk; so neither
/// work nor the next backup is held up by a disk that is slow or hangs.
///
/// What is posted as finished is written at once; what is not (a drag that goes on) once per \a interval, and then it takes the
/// place of what was written of it before. Finished edits of the same label that follow each other within a second are one:
/// keys that repeat. So a kill at any moment loses at most what happened in the last \a interval.
class BackupWriter {
public:
  /// \param interval seconds. \throws as Backups.
  explicit BackupWriter(const std::string& folder, LastBackup after = {}, double interval = 0.5, int keep = 100);
  ~BackupWriter(); ///< after writing what waits
  BackupWriter(const BackupWriter&) = delete;
  BackupWriter& operator=(const BackupWriter&) = delete;

  const std::string& Folder() const;
  void Post(Project project, const std::string& label, bool finished);
  /// Waits until all that was posted is written, or could not be: Backups::List tells of it.
  void Wait();
  /// Waits until it is on the disk. \throws what writing the last threw.
  void Flush();
  /// Why a backup could not be written: told once, until one could be written again; empty: all is well.
  std::string TakeFailure();
  ///@{ As those of Backups, of all that was posted.
  std::set<int> Numbers();
  void MarkSaved();
  void DiscardUnsaved();
  ///@}

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
