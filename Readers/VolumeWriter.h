// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FileReplacement.h"
#include "Core/Base/Progress.h"
#include "Readers/ImageHeader.h"
#include <memory>
#include <string>

namespace echorama {

/// Writes a volume as MetaImage, NRRD or NIfTI, whichever the name asks for, slab by slab: the volume need not be in memory.
/// The bytes in the file do not depend on how it was cut. .mhd and .nhdr get their voxels in a file beside them (.raw;
/// compressed .zraw, .raw.gz).
class VolumeWriter {
public:
  /// Writes the header, from geometry, type and fields of \a header. \a compress: NIfTI goes by its extension instead (.nii,
  /// .nii.gz). The files appear when \a files is committed, after Finish(); the main file is staged last. It must outlive this.
  /// \throws Error(InvalidParameter) when the name has none of these extensions, Error(BadInput) for a field that cannot
  /// be held (CanHold) or a geometry that is none, Error(FileSystem) when the folder cannot be written.
  VolumeWriter(const std::string& path, ImageHeader header, bool compress, FileReplacement& files);
  ~VolumeWriter();
  VolumeWriter(const VolumeWriter&) = delete;
  VolumeWriter& operator=(const VolumeWriter&) = delete;

  /// Adds the next \a bytes bytes of voxels, in this machine's byte order.
  /// \throws Error(FileSystem) when the disk is full, Error(Cancelled).
  void Append(const void* voxels, std::uint64_t bytes, const Progress& progress = {});

  /// Completes the files. \throws Error(BadInput) when there are not as many voxels as the geometry says, Error(FileSystem),
  /// Error(Cancelled).
  void Finish(const Progress& progress = {});

  /// Takes everything back, as if this had never been.
  void Discard();

  /// By how many millimetres other programs see a voxel of a NIfTI file displaced, at most (see NiftiHeaderText); else 0.
  double RoundingMm() const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Writes a whole volume with a VolumeWriter. \returns its RoundingMm() \throws what it throws.
double WriteVolume(const std::string& path, const ImageHeader& header, const void* voxels, bool compress, FileReplacement& files,
                   const Progress& progress = {});

} // namespace echorama
