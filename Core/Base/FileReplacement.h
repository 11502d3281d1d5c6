// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <vector>

namespace echorama {

/// A name beside \a path that nobody else uses, for a folder that is renamed to it when it is whole. What killed processes left
/// under such names goes.
std::string NewFolderBeside(const std::string& path);

/// Files that take their places all together, or not at all.
///
/// Each is written under a temporary name in the folder where it belongs. Commit() renames them; without it (an error, a
/// full disk, a stop on request) the destructor removes the temporary files, and what was there before stays.
class FileReplacement {
public:
  FileReplacement() = default;
  ~FileReplacement();
  FileReplacement(const FileReplacement&) = delete;
  FileReplacement& operator=(const FileReplacement&) = delete;

  /// An empty temporary file to write now, for the file \a path; its name ends in the same one, extension included. A symbolic
  /// link at \a path is followed. The file that is staged last is the one that the others belong to.
  /// \throws Error(FileSystem) when the folder is missing or not writable, or \a path is there and not a plain file.
  std::string Stage(const std::string& path);

  /// Takes back Stage(): the temporary file goes, and what was in its place stays.
  void Unstage(const std::string& temporary);

  /// \a path shall not be there afterwards (it may be missing already): a companion of an earlier version.
  void Remove(const std::string& path);

  /// One file is renamed over its predecessor. With several, all predecessors are put aside first and the last staged
  /// file appears last: others see the old set, none, or the new set, and never a mixed one.
  /// \throws Error(FileSystem) when a temporary file is still empty or cannot be put in place; everything is then as it was.
  void Commit();

private:
  struct Item {
    std::string temporary; ///< empty: to be removed
    std::string target;
    std::string aside; ///< where the predecessor waits during Commit
    bool placed = false;
  };
  void RollBack();
  std::vector<Item> items_;
};

} // namespace echorama
