// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/PoseFile.h"
#include "Widgets/Session/SessionState.h"
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// The pose of a volume among those of a file; none when the file does not name it. \throws as PoseFor when it was found for
/// another geometry.
std::optional<Pose> PoseAmong(const std::vector<VolumePose>& poses, const SessionVolume& volume);

/// Those of all volumes that the pose file \a path names, by id. \throws as ReadPoses and PoseFor, Error(BadInput) when it names
/// none.
std::map<int, Pose> ReadPosesOf(const SessionState& state, const std::string& path);
/// \throws Error(InvalidParameter) when a volume is in no file, and as CheckMayBeReplaced and WritePoses.
void WritePosesOf(const SessionState& state, const std::string& path, const std::string& truth = {});

/// A name that was mistyped must not cost anything. \throws Error(InvalidParameter) when \a path is the file of a volume or of
/// the \a truth, Error(NotPossible) when it is a pose file that names displacements, which would be lost.
void CheckMayBeReplaced(const std::string& path, const SessionState& state, const std::string& truth);

/// Which poses of a file come with a displacement (align --deformable), which sessions do not know, as a sentence; empty: none.
std::string DisplacementNote(const std::string& path);

/// Whether two states are the same work, whatever the ids; geometries may differ as much as they do after a file.
bool SameWork(const SessionState& a, const SessionState& b);

/// Gives volumes of a backup the ids of those in a session: of \a known (whatever undo could bring back), first \a shown ones.
/// A volume is the one of its full path; one of the same name in another folder only when there is nothing at the path and no
/// other has the name. Those that are not known have the id 0 afterwards.
void Recognize(std::vector<SessionVolume>& volumes, const std::vector<SessionVolume>& known,
               const std::function<bool(int id)>& shown);

/// Leaves out volumes that are not known (id 0) and were in no file. \returns a warning that names them, if there are any.
/// \throws Error(BadInput) when nothing else is in the backup \a path.
std::string LeaveOutFileless(const std::string& path, std::vector<SessionVolume>& volumes);

/// Sets the files of the volumes of the project \a path that are not known (id 0) to where they are now, as FindVolume.
/// \throws Error(FileSystem) that names all that are nowhere, Error(BadInput) when two volumes are one file.
void FindVolumes(const std::string& path, std::vector<SessionVolume>& volumes, const std::vector<std::string>& folders);

/// Takes over the geometry that its file has. \throws Error(BadInput) when the project was saved with that of another volume
/// (another stride is none).
void TakeGeometry(SessionVolume& volume, const ImageGeometry& found);

} // namespace echorama
