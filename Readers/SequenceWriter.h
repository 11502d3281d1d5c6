// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FileReplacement.h"
#include "Readers/SequenceFile.h"
#include <memory>
#include <string>

namespace echorama {

/// Writes a tracked sequence as the Plus toolkit does, frame by frame: .mha and .nrrd (pixels after the header), .mhd and
/// .nhdr (pixels in a file beside it). Neither the pixels nor the fields of the frames are held in memory.
///
/// Numbers come back to the last bit, but for geometry in .nrrd, which stores spacing and direction as a product.
class SequenceWriter {
public:
  /// \param content dimensions (0 x 0: poses alone, not in NRRD), type, components, imageType, geometry and fields are used;
  /// frames are written in MF orientation
  /// The files appear when \a files is committed, after Finish(). It must outlive the writer.
  /// \throws Error(InvalidParameter) for another extension, Error(BadInput) for a field that cannot be held (CanHold) or
  /// dimensions that are not possible, Error(FileSystem).
  SequenceWriter(const std::string& path, const SequenceContent& content, bool compress, FileReplacement& files);
  ~SequenceWriter();
  SequenceWriter(const SequenceWriter&) = delete;
  SequenceWriter& operator=(const SequenceWriter&) = delete;

  /// Adds a frame. \a pixels are FrameBytes() bytes in this machine's byte order; nullptr: zeros, with the status INVALID.
  /// \throws Error(BadInput) when the names of its transforms and fields cannot be held or are given twice, when a matrix is not
  /// finite though its status is Valid, or the time is infinite, Error(FileSystem), Error(Cancelled).
  void Append(const SequenceFrame& frame, const void* pixels, const Progress& progress = {});

  /// Completes the files. \throws Error(BadInput) when there are no frames, Error(FileSystem) when the disk is full.
  void Finish(const Progress& progress = {});

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
