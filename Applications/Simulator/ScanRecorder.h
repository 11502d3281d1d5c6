// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "ScanLog.h"
#include <array>
#include <QDir>
#include <QString>

namespace echorama {

class SequenceRecorder;

/// Records a scan: images and poses as a tracked sequence (NAME.igs.mhd, pixels in NAME.igs.raw), which every reader of such
/// takes, and what they were made from (NAME.scan.jsonl), to be replayed. A crash leaves all but the last half second, and of no
/// frame the line without its image. Join() makes one file of the sequence: its format wants what is said of all frames before
/// the first pixel, so that this can be done only in the end.
class ScanRecorder {
public:
  /// \param size of the images, pixels
  /// \throws Error(FileSystem) that names the file
  ScanRecorder(const QDir& folder, const Subject& subject, const std::array<int, 2>& size);
  ~ScanRecorder();

  /// \throws Error(FileSystem) when the disk is full: what was written stays
  void Append(const ScanFrame& frame, vtkImageData* image);
  /// Makes safe what is due, when no frame comes for a while. \throws as Append
  void FlushWhenDue();
  /// \throws Error(FileSystem), Error(BadInput) when there is no frame: there is no sequence then
  void Finish();
  int Frames() const;
  const QString& Path() const { return path_; } ///< of the sequence

  /// Makes NAME.igs.mha of NAME.igs.mhd and its pixels, which go then. For a Job. \returns the path
  /// \throws Error(FileSystem), Error(Cancelled): what was recorded is as it was
  static QString Join(const QString& path, const Progress& progress);

private:
  QString path_;
  std::unique_ptr<SequenceRecorder> sequence_;
  std::unique_ptr<ScanLogWriter> log_;
};

} // namespace echorama
