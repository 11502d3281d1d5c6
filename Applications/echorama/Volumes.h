// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/PoseFile.h"
#include "Readers/VolumeSource.h"
#include "Session.h"
#include <functional>
#include <string>
#include <vector>
#include <vtkImageData.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkSmartPointer.h>

class vtkImageAlgorithm;

namespace echorama {

/// A volume that came from a file.
struct LoadedVolume {
  std::string file;
  vtkSmartPointer<vtkImageData> image;   ///< where the file says, until it is moved
  ImageGeometry geometry;                ///< of the file as it stands
  VolumeContent content;                 ///< what the file says besides its voxels; of .vti files the format alone
  Pose volumeToWorld = Pose::Identity(); ///< how far the image has been moved from there
};

/// How a volume is read where the file leaves it open.
struct VolumeReading {
  VolumeReadParameters parameters;
  bool beams = false; ///< the samples along beams, not their scan conversion
  int step = 0;       ///< of a time series, from 0
};

/// Reads a volume. Throws Error that names the file.
LoadedVolume LoadVolume(Session&, const std::string& file, const VolumeReading& reading = {});
std::vector<LoadedVolume> LoadVolumes(Session&, const std::vector<std::string>& files, const VolumeReading& reading = {});

/// The volumes among \a files: NAME.ValidRegion.EXT and its like, which a shell's * finds too, belong to NAME.EXT
/// and are left out, with a note, when that is there.
std::vector<std::string> WithoutCompanions(Session&, const std::vector<std::string>& files);

/// Moves a volume on: its image, and the pose that it has been moved by.
void MoveVolume(LoadedVolume&, const Pose&);

/// The pose of a volume in the pose file \a path, whose contents are \a poses. Throws Error that names both files when it has
/// none, or knows the volume with another geometry.
const VolumePose& PoseIn(const std::vector<VolumePose>& poses, const std::string& path, const LoadedVolume&);

/// Puts each volume where the pose file \a path says, painted and carved where that is a project with strokes; throws as PoseIn.
/// An empty path leaves the volumes as their files are.
void ApplyPoses(Session&, std::vector<LoadedVolume>&, const std::string& path);

/// Refuses before the work what the pose file \a path could not hold after it, such as a file's name that is not UTF-8. Writes
/// nothing that stays.
void RehearsePoses(Session&, const std::vector<LoadedVolume>&, const std::string& path);

/// The volumes as the blocks of one data set, named by their files, so that filters name them in what they report.
vtkSmartPointer<vtkMultiBlockDataSet> BlocksOf(const std::vector<LoadedVolume>&);

/// Writes \a image to \a path. Returns what the format could not hold, one sentence each.
std::vector<std::string> SaveVolume(Session&, vtkImageData* image, const std::string& path);

/// Whether files of the format of \a path can be written slab by slab.
bool IsWrittenBySlabs(const std::string& path);

/// Writes the output of \a source in slabs, each made when it is written, and shown to \a take before. Throws Error.
void WriteBySlabs(Session&, vtkImageAlgorithm* source, int slabs, const std::string& path, const std::string& stage,
                  const std::function<void(vtkImageData*)>& take);

/// The lines of a text, as filters give notes and reports.
std::vector<std::string> LinesOf(const std::string& text);

/// JSON of a vector, and of a matrix (a list of rows).
nlohmann::ordered_json JsonOf(const Eigen::Vector3d&);
nlohmann::ordered_json JsonOf(const Pose&);
nlohmann::ordered_json JsonOf(const Eigen::Affine3d&);
nlohmann::ordered_json JsonOf(const ProbeGeometry&);

/// "fan 60.0 degrees, 50.0 mm; sweep ...".
std::string ProbeText(const ProbeGeometry&);

/// "unsigned char", as VTK names it.
const char* TypeText(VoxelType);

/// "12.3 x 4.5 x 6.7", with \a digits after the point.
std::string Triple(const Eigen::Vector3d&, const char* separator, int digits);

} // namespace echorama
