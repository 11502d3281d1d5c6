// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Readers/SequenceFile.h"
#include <cstdint>
#include <memory>
#include <string>

namespace echorama {

/// How a recording is kept.
struct SequenceRecorderOptions {
  bool replace = false;
  double flushSeconds = 0.5;
  bool syncToDisk = true;
};
ParameterList Describe(SequenceRecorderOptions& p);

/// Records a tracked sequence so that a crash, `kill -9` or a full disk leave a file that opens, with all frames that were
/// made safe: in SequenceFile, and in every other reader of MetaImage sequences (Plus, Slicer).
///
/// Poses alone go to one file, NAME.igs.mha; with images the header is NAME.igs.mhd and the pixels, not compressed, are appended
/// to NAME.igs.raw. The cost of a frame does not depend on the length of the recording. Memory holds what is not yet safe.
/// Not safe for use by several threads at a time. For whole sequences at hand SequenceWriter is the way: it compresses, and
/// replaces an old file only by a complete one.
class SequenceRecorder {
public:
  /// \param content dimensions (0 x 0: poses alone), type, components, imageType, geometry and fields are used; transforms may
  /// come and go from frame to frame
  /// \throws Error(InvalidParameter) for another extension or the options, Error(BadInput) for a field that cannot be held or
  /// dimensions that are not possible, Error(FileSystem) when a file is there that must not be replaced, or none can be made.
  explicit SequenceRecorder(const std::string& path, const SequenceContent& content = {},
                            const SequenceRecorderOptions& options = {});
  /// Makes safe what can be made.
  ~SequenceRecorder();
  SequenceRecorder(const SequenceRecorder&) = delete;
  SequenceRecorder& operator=(const SequenceRecorder&) = delete;

  /// Adds a frame, and flushes when it is time. \a pixels are FrameBytes() bytes in this machine's byte order; nullptr: zeros,
  /// with the status INVALID. \throws Error(BadInput) as SequenceWriter::Append, after which the
  /// recording goes on without the frame; Error(FileSystem) when the disk is full: what was safe stays, and every later call
  /// throws the same.
  void Append(const SequenceFrame& frame, const void* pixels = nullptr);

  /// Makes all frames safe. \throws Error(FileSystem) as Append.
  void Flush();
  /// The same when the last time is longer ago than the options say: for when no frame comes for a while.
  void FlushWhenDue();

  /// Flushes and closes; nothing can be appended afterwards. \throws Error(BadInput) when there are no frames; the files are gone
  /// then. Error(FileSystem) as Append.
  void Finish();

  int Frames() const;                 ///< appended
  int SafeFrames() const;             ///< of these, what a kill cannot take away
  std::uint64_t BytesWritten() const; ///< so far, to all files

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
