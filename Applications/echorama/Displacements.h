// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FileReplacement.h"
#include "Core/Imaging/DisplacementField.h"
#include "Volumes.h"
#include <functional>
#include <optional>

class vtkUltrasoundDeformableAligner;

namespace echorama {

/// Where the displacement of the volume \a number (from 0) belongs that a pose file names: POSES.displacement-NUMBER.vti, from 1.
std::string DisplacementPath(const std::string& poses, std::size_t number);

/// That which the pose of a volume names, or nothing. Throws Error that names the file.
std::optional<DisplacementField> DisplacementOf(Session&, const VolumePose&);

/// Writes a displacement image, straight to that place.
void WriteDisplacement(vtkImageData* image, const std::string& path);

/// Finds what the poses of those volumes leave over that have an \a aligned beside them, and stages it in \a files for the pose
/// file that \a output names, which is called after all that takes long: until they are committed, each pose names the staged
/// one. Tells what was found, as "deformation" in the results of each volume. \param fixed the volume (from 0) that is not bent
void DeformVolumes(Session&, vtkUltrasoundDeformableAligner*, const std::vector<LoadedVolume>&, const std::vector<bool>& aligned,
                   int fixed, const std::function<std::string()>& output, FileReplacement& files, std::vector<VolumePose>& poses);

/// The displacements that the pose file \a path names for volumes that it has placed, as blocks in their order, zero for those
/// without; nothing when it names none. Throws Error that names the file.
vtkSmartPointer<vtkMultiBlockDataSet> DisplacementsOf(Session&, const std::vector<LoadedVolume>&, const std::string& path);

} // namespace echorama
