// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Widgets/Session/ProjectFile.h"
#include <string>

namespace echorama {

/// Copies a project with all that it needs into one folder, which opens on another machine: FOLDER/NAME.json (NAME that of the
/// folder), the files of its volumes as they are in FOLDER/volumes, and FOLDER/truth.json with the poses of those volumes if
/// there is a truth. The folder appears whole or not at all; the project that is open stays where it is.
/// \returns the project file.
/// \throws Error(InvalidParameter) for a volume that is in no file; Error(NotPossible) when \a folder is there and not empty, or
/// lies among a volume's files; Error(BadInput) when the voxels of a volume lie in another folder than its header;
/// Error(FileSystem), Error(Cancelled); and for the truth as ReadPoses.
std::string CopyProject(Project project, const std::string& folder, const Progress& progress = {});

} // namespace echorama
