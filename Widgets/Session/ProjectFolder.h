// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Widgets/Session/ProjectFile.h"
#include <functional>
#include <string>

namespace echorama {

/// Writes the voxels of a volume that is in no file to \a file (.mha), without its strokes.
using VolumeWriter = std::function<void(const SessionVolume&, const std::string& file, const Progress&)>;

/// Copies a project with all that it needs into one folder, which opens on another machine: FOLDER/NAME.json (NAME that of the
/// folder), the files of its volumes as they are in FOLDER/volumes, and FOLDER/truth.json with the poses of those volumes if
/// there is a truth. The folder appears whole or not at all; the project that is open stays where it is.
/// \param write writes a volume that is in no file, a result, into FOLDER/volumes under its name, and nowhere else: in the
/// session it stays in no file. \returns the project file. \throws Error(InvalidParameter) for a volume that is in no file,
/// without \a write; what that throws; Error(NotPossible) when \a folder is there and not empty, or lies among a volume's files;
/// Error(BadInput) when the voxels of a volume lie in another folder than its header; Error(FileSystem), Error(Cancelled); and
/// for the truth as ReadPoses.
std::string CopyProject(Project project, const std::string& folder, const Progress& progress = {},
                        const VolumeWriter& write = {});

} // namespace echorama
