// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include "Readers/ImageHeader.h"
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// Samples along beams, as a scanner acquired them: depth along x (fastest), the fan along y, the sweep along z.
struct BeamContent {
  std::array<int, 3> dimensions{0, 0, 0};
  VoxelType type = VoxelType::UInt8;
  ProbeGeometry probe;
};

/// What a file says of the volume in it, without its voxels.
struct VolumeContent {
  std::string path; ///< that was asked for
  FileFormat format = FileFormat::Unknown;
  ImageGeometry geometry;            ///< of the voxels in memory, mm and LPS; passed ImageGeometry::Check
  VoxelType type = VoxelType::UInt8; ///< one number per voxel
  std::vector<double> times;         ///< seconds, increasing, one per volume of a time series; empty for a single volume
  bool holdsValidRegion = false;     ///< Read() says which voxels are real
  bool lastSliceFirst = false;       ///< the slices lie in the file in reverse
  std::optional<ProbeGeometry> probe;
  std::optional<Pose> probeToWorld;
  std::optional<double> timeStamp;  ///< seconds
  std::optional<BeamContent> beams; ///< the file holds beams; the volume is their scan conversion
  std::vector<HeaderField> fields;  ///< everything else that is worth keeping, for people and for writing again
  std::vector<std::string> notes;   ///< what was missing and assumed, or lost: sentences for people

  std::size_t Volumes() const { return times.empty() ? 1 : times.size(); }
};

/// A file (or a folder of slices) that holds one volume or a time series of one geometry. One subclass per format.
///
/// Opening reads and checks everything but the voxels, and allocates nothing that the file's size does not justify.
class VolumeSource {
public:
  virtual ~VolumeSource() = default;
  VolumeSource(const VolumeSource&) = delete;
  VolumeSource& operator=(const VolumeSource&) = delete;

  const VolumeContent& Content() const { return content_; }

  /// Writes the voxels of volume \a index (0 when there is but one) to \a voxels, in this machine's byte order, and, where
  /// the content holdsValidRegion, 1 or 0 per voxel to \a valid.
  /// \throws Error(BadFile) that names the file when the data end early or are damaged, Error(Cancelled).
  virtual void Read(std::size_t index, void* voxels, unsigned char* valid, const Progress& progress = {}) = 0;

  /// Whether ReadSlices() holds no more than it is asked for.
  virtual bool ReadsSlices() const { return false; }

  /// Writes the slices [first, first + count) of volume \a index to \a voxels, those that Read() would; only where it
  /// ReadsSlices(). Where the file is compressed, slices in its order (descending ones where the content is lastSliceFirst) take
  /// one way through it, and others begin anew. \throws as Read().
  virtual void ReadSlices(std::size_t index, int first, int count, void* voxels, const Progress& progress = {});

  /// Writes the samples of volume \a index to \a samples; only where the content has beams.
  virtual void ReadBeams(std::size_t index, void* samples, const Progress& progress = {});

  /// Leaves out poses that belong to another geometry than that of the file (see FieldsInFile), with a note.
  void LeaveOldPoses();

protected:
  VolumeSource(const std::string& path, FileFormat format)
  {
    content_.path = path;
    content_.format = format;
  }
  /// Error(BadFile): the file, and why it cannot be read.
  [[noreturn]] void Fail(const std::string& reason) const { FailFile(content_.path, reason); }
  void Note(const std::string& sentence) { content_.notes.push_back(sentence); }

  VolumeContent content_;
};

/// How files that leave it open are read.
struct VolumeReadParameters {
  double spacingMm = 0.0;
  Eigen::Vector3d stackSpacingMm = Eigen::Vector3d::Zero();
  int stride = 1;
};
ParameterList Describe(VolumeReadParameters& p);

/// Opens a volume of any format but VTK's own (.vti, which the vtk layer reads); the content decides, not the name.
/// \throws Error(FileSystem) when it is missing or cannot be read, Error(BadFile) that names file and reason,
/// Error(TooLarge) when the voxels do not fit in the free memory.
std::unique_ptr<VolumeSource> OpenVolume(const std::string& path, const VolumeReadParameters& parameters = {});

} // namespace echorama
