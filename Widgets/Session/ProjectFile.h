// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// The absolute path of a file, with symbolic links followed: two names of one file are one path. Empty stays empty.
std::string ResolvedPath(const std::string& path);

/// Which backup of a project was its last. A clock may be set back; numbers never are. They are compared within one lineage
/// alone: what was made of one project file, until it is saved under another name.
struct LastBackup {
  std::string lineage; ///< empty: none is known
  int number = 0;
  std::set<int> others{}; ///< not beyond that number, but of other windows on the project: their work is not in the file
};

/// What a project file holds.
struct Project {
  SessionState state;                   ///< after reading: ids from 1, in order
  std::string truth;                    ///< pose file of the ground truth, absolute, or empty
  std::string comment;                  ///< for people: who, what
  std::map<std::string, Pose> truths{}; ///< of volumes, by name, that were set by hand: they count more than the file's
  std::string fixed{};                  ///< the name of the volume that was chosen as the fixed one of the score, or empty
  LastBackup lastBackup{};              ///< when the file was written
};

bool operator==(const Project&, const Project&); ///< exact: to the last bit, of all but the last backup
bool SameNotes(const Project&, const Project&);  ///< the same, of all but the state
bool SameTruths(const std::map<std::string, Pose>& a, const std::map<std::string, Pose>& b);

/// What a backup knows beside its project.
struct BackupStamp {
  int number = 0;
  std::int64_t time = 0; ///< of writing, seconds since 1970, UTC
  std::string label;     ///< the edit it was made after
  int inPlaceOf = 0;     ///< the number of an earlier one that goes, or 0
  std::string lineage{};
};

/// A project on disk: {"schema": "echorama-project-1", "unit": "mm", "frame": "LPS", "volumes": [{"name", "file", "path",
/// "geometry", "VolumeToWorld", "colour", "opacity", "visible", "group", "strokes": [{"mode", "radiusMm", "intensity", "opacity",
/// "hardness", "insideValid", "pathMm": [[3], ...]}], "landmarks": [{"label", "position": [3]}], "madeOf", "TrueVolumeToWorld",
/// "fixed"}], "measurements": [{"number", "points": [[3], ...]}], "truth", "comment", "centreOfRotation", "lastBackup":
/// {"lineage", "number", "others"}}. Documentation/session.md tells of each.
///
/// A project is a pose file too (ReadPoses reads it): the same fields with the same meaning, plus what a session knows. And a
/// pose file ("echorama-poses-1") is a project whose volumes have default looks: all keys of a volume but "file" and
/// "VolumeToWorld" may be missing. "file" is relative to the project's folder, so that a folder can be moved or opened on
/// another machine; "path" is absolute, and counts when there is nothing at "file". A volume that came from a pipeline has the
/// file "".
///
/// Relative names count from where the file really is: symbolic links are followed. What is not there is looked for beside the
/// link, too.
///
/// Geometries are told apart from poses, so that nothing is moved twice: who opens the files compares. A volume without
/// "geometry" has dimensions of zero.
/// \param stamp receives what a backup knows; its number is 0 for other projects.
/// \throws Error(FileSystem), Error(BadFile) that names file, volume and field; also for a backup that is not as it was written.
Project ReadProject(const std::string& path, BackupStamp* stamp = nullptr);

/// Atomic, and on the disk when it returns. Numbers come back to the last bit.
/// \throws Error(FileSystem), Error(InvalidParameter) for a name that is not UTF-8; what was there before then stays.
void WriteProject(const std::string& path, const Project& project);

/// The same as a backup, on one line with a checksum. It does not wait for the disk: any process reads it from now on, also when
/// this one is killed; a loss of power may leave it damaged until BringToDisk(). A file that is there already is left alone.
/// \returns whether it was written. \throws as WriteProject.
bool WriteBackup(const std::string& path, const Project& project, const BackupStamp& stamp);

/// Waits until the files are on the disk, and their names. Those that are not there are passed over. \throws Error(FileSystem).
void BringToDisk(const std::vector<std::string>& paths);

/// Where a volume of a project is now: at \a file, else under the same name in the project's folder (for a backup: in the folder
/// of its project), else in one of \a folders. Empty when nowhere.
std::string FindVolume(const std::string& projectPath, const std::string& file, const std::vector<std::string>& folders = {});

} // namespace echorama
