// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ProjectFile.h"
#include <cstdint>
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
};

/// A folder of numbered project files: one after each edit and at least one a second during long ones. Each is written under a
/// temporary name, brought to the disk and renamed: a kill at any moment leaves every earlier one and nothing half-made. Old ones
/// are thinned out: the last \a keep stay, of those before ever fewer (some per hour, then per day).
class Backups {
public:
  /// Makes the folder. \throws Error(FileSystem).
  explicit Backups(const std::string& folder, int keep = 100);

  /// Writes the next one, unless the state is that of the last. \throws Error(FileSystem) (full disk): earlier ones stay.
  void Write(const Project& project, const std::string& label);
  /// The newest first. Damaged ones are marked.
  std::vector<Backup> List() const;
  /// \throws as ReadProject.
  static Project Read(const Backup& backup);

  /// Where backups of the project \a path live: NAME.backups beside it; of an unsaved session under the user's data folder
  /// (XDG_DATA_HOME or ~/.local/share, echorama/unsaved/...).
  static std::string FolderFor(const std::string& path);
  /// Sessions that ended without being saved: their folders, the newest first (the process that made them is gone).
  static std::vector<std::string> Abandoned();

private:
  std::string folder_;
  int keep_, next_ = 1;
};

} // namespace echorama
