// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// One line of a pose file: a volume, the geometry it had when the pose was found, and where it belongs.
struct VolumePose {
  std::string file;                      ///< as given; made relative to the JSON's folder when written, resolved when read
  std::optional<ImageGeometry> geometry; ///< of the file as it stands; needed for writing
  Pose volumeToWorld = Pose::Identity(); ///< from the physical space of the file as it stands (identity: where the file says)
  std::string displacement{};            ///< image of what a rigid pose leaves over, a path as \a file; empty: there is none
};

/// Poses on disk: {"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS", "volumes": [{"file": .., "geometry":
/// {"origin": [3], "spacing": [3], "direction": [[3] x 3], "dimensions": [3]}, "VolumeToWorld": [[4 numbers] x 4],
/// "displacement": ..}, ...]}. Matrices are lists of rows. "geometry" and "displacement" may be missing; keys that are not named
/// here are ignored. Files of the schema "echorama-project-1" (the projects of alignment sessions, which hold the same fields and
/// more) are read as well.
/// \throws Error(FileSystem) when the file cannot be opened, Error(BadFile) that names file, volume and field when it is
/// not JSON, of another schema, unit or frame, lacks a field, names a volume twice, or a matrix is not rigid.
std::vector<VolumePose> ReadPoses(const std::string& path);

/// Writes under a temporary name and renames, so that a failure leaves what was there. Numbers come back to the last bit.
/// \throws Error(InvalidParameter) when a volume has no file, no geometry or a pose that is not rigid, Error(FileSystem).
void WritePoses(const std::string& path, const std::vector<VolumePose>& poses);

/// The pose of the volume \a file with \a geometry: matched by resolved path, else, when no path matches, by file name
/// if that is unique.
/// \throws Error(BadInput) when there is none, or when it was found for another volume (so that nothing is moved twice).
const VolumePose& PoseFor(const std::vector<VolumePose>& poses, const std::string& file, const ImageGeometry& geometry);

} // namespace echorama
