// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "SessionState.h"
#include <string>
#include <vector>

namespace echorama {

/// What a project file holds.
struct Project {
  SessionState state;
  std::string truth;   ///< pose file of the ground truth, or empty
  std::string comment; ///< for people: who, what
};

/// A project on disk: {"schema": "echorama-project-1", "unit": "mm", "frame": "LPS", "volumes": [{"name", "file", "geometry",
/// "VolumeToWorld", "colour", "opacity", "visible", "group", "strokes": [...]}], "truth", "comment"}. It is a pose file too: the
/// same fields with the same meaning, plus what a session knows. Paths are relative to the project's folder when they lie in or
/// beside it, so that a folder can be moved or opened on another machine; absolute ones are kept as a second place to look
/// ("path"). \throws Error(FileSystem), Error(BadFile) that names file, volume and field.
Project ReadProject(const std::string& path);
/// Atomic, and on the disk when it returns. \throws Error(FileSystem); what was there before then stays.
void WriteProject(const std::string& path, const Project& project);

/// Where a volume of a project is now: where it says, else under the same name in the project's folder or one of \a folders.
/// Empty when nowhere.
std::string FindVolume(const std::string& projectPath, const std::string& file, const std::vector<std::string>& folders = {});

} // namespace echorama
