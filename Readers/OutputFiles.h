// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FileReplacement.h"
#include <filesystem>
#include <string>
#include <vector>

namespace echorama {

/// The files that hold other arrays of the volume \a path, whether or not they are there: NAME.ValidRegion.EXT and its like.
std::vector<std::string> CompanionPaths(const std::string& path);

/// Which of \a files are no volumes of their own, but belong to others of them.
std::vector<bool> AreCompanions(const std::vector<std::string>& files);

/// The files that hold the volume \a path and are there: it, its companions, the voxels beside a header; of a folder of slices
/// all files in it. None: the volume is not there. Each once.
std::vector<std::string> FilesOfVolume(const std::string& path);

/// Refuses, before any work is done, what cannot become the output \a path: a folder, another thing that is not a file, a
/// place in a folder that is missing or cannot be written in, and whatever would replace an input. Links are followed, and
/// the files that belong to a volume (its valid region, its detached voxels) count, on both sides. Throws Error(FileSystem).
void CheckOutput(const std::string& path, const std::vector<std::string>& inputs);

/// As CheckOutput, for a volume: also throws Error(InvalidParameter) when the extension names no format.
void CheckVolumeOutput(const std::string& path, const std::vector<std::string>& inputs);

/// A folder of files that appear all together, or not at all.
///
/// Files are written under their own names into a hidden folder beside their places and moved from there at the end, with
/// the companions that a writer adds. What was not committed is removed again, and so is the folder if it was made for it.
class OutputFolder {
public:
  /// Makes the folder unless it is there. Throws Error(FileSystem).
  OutputFolder(const std::string& path, const std::vector<std::string>& inputs);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Where to write the file \a name for now. Throws as CheckOutput, and when the name was asked for before.
  std::string Stage(const std::string& name);

  /// The hidden folder, which messages may want to name as \a path.
  std::string StageFolder() const { return stage_.string(); }

  /// Where it shall be.
  std::string Final(const std::string& name) const { return (folder_ / name).string(); }

  /// Moves all to their places.
  void Commit();

  /// The same together with the files of \a others: all of them, or none.
  void Commit(FileReplacement& others);

private:
  std::vector<std::string> inputs_, names_;
  FileReplacement place_; ///< what gives stage_ its name, and removes what a killed process left of that name
  std::filesystem::path folder_, stage_;
  std::vector<std::filesystem::path> made_; ///< folders that were not there, outermost first
};

} // namespace echorama
